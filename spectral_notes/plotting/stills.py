"""Pictures in one house style: curves and matrices by matplotlib, surfaces rendered by PyVista and laid out in rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse as sp
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from spectral_notes._checks import as_count, as_floats, as_instance
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.meshes import PointCloud, Shape, TriangleMesh
from spectral_notes.plotting import scenes
from spectral_notes.plotting.rendering import Image, SurfaceView, render

STYLE_FILE = Path(__file__).with_name("house.mplstyle")
DPI = 160


def use_house_style() -> None:
    """Set matplotlib to the house style, for the rest of the session.

    Examples
    --------
    >>> use_house_style()
    >>> plt.rcParams["axes.spines.top"]
    False
    """
    plt.style.use(STYLE_FILE)


def plot_matrix(A: Any, *, ax: Axes | None = None, title: str = "") -> Axes:
    """Draw a matrix as a picture, one square an entry: red positive, blue negative, white zero, with a colour bar.

    Parameters
    ----------
    A : (m, n), dense or sparse, of finite real numbers, one at least
    ax : where to draw; by default a new figure
    title : text above

    Examples
    --------
    >>> plot_matrix(np.eye(3), title="identity").get_title()
    'identity'
    """
    entries = as_floats("A", A.toarray() if sp.issparse(A) else A, ("m", "n"))
    if not entries.size:
        raise ValueError(f"A must hold at least one number; got shape {entries.shape}")
    axes = ax or plt.figure(figsize=(4.2, 3.6)).add_subplot()
    top = float(np.abs(entries).max(initial=0.0)) or 1.0
    picture = axes.imshow(entries, cmap="RdBu_r", vmin=-top, vmax=top)
    axes.figure.colorbar(picture, ax=axes, shrink=0.8)
    axes.grid(False)
    axes.set_title(title)
    return axes


def plot_surfaces(
    surfaces: Shape | Sequence[Shape], values: Any = None, *,
    titles: Sequence[str] | None = None, n_columns: int | None = None, color_bar: str = "", **view: Any,
) -> Figure:
    """Draw surfaces, or one surface under several functions, in rows of still pictures.

    Parameters
    ----------
    surfaces : what to draw: a mesh, a cloud, or several
    values : for one surface (n,) or (n, p), one column a picture; for several one array, or None, for each
    titles : text above each picture
    n_columns : pictures in a row; by default all of them
    color_bar : label of one colour bar for all pictures, which then share their limits; none where empty
    **view : for all pictures, anything else that a `SurfaceView` takes

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> figure = plot_surfaces(triangle, [1.0, 0.0, -1.0], titles=["a ramp"])
    >>> len(figure.axes)
    1
    """
    pairs = _pair_up(surfaces, values)
    if titles is not None and len(titles) != len(pairs):
        raise ValueError(f"titles must hold one text for each of the {len(pairs)} pictures; got {len(titles)}")
    names = [""] * len(pairs) if titles is None else titles
    views = [SurfaceView(surface, f, title=t, **view) for (surface, f), t in zip(pairs, names, strict=True)]
    return plot_views(views, n_columns=n_columns, color_bar=color_bar)


def plot_modes(mesh: Shape, basis: Eigenbasis, modes: Sequence[int], *, n_columns: int | None = None) -> Figure:
    """Draw eigenfunctions in rows, each with its nodal lines and the number of its mode.

    Parameters
    ----------
    mesh : the surface that the basis belongs to
    basis : its eigenbasis
    modes : numbers of the modes, 0 .. basis.k - 1
    n_columns : pictures in a row; by default all of them

    Examples
    --------
    >>> from spectral_notes.eigenbasis import compute_eigenbasis
    >>> from spectral_notes.laplacians import cotan_laplacian
    >>> tetrahedron = TriangleMesh(np.eye(4)[:, :3], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> figure = plot_modes(tetrahedron, compute_eigenbasis(*cotan_laplacian(tetrahedron), k=3), [1, 2])
    >>> [axes.get_title() for axes in figure.axes]
    ['mode 1', 'mode 2']
    """
    basis = as_instance("basis", basis, Eigenbasis, "compute_eigenbasis(L, M, k) returns one")
    modes = [as_count("modes", mode, 0, basis.k - 1) for mode in modes]
    titles = [f"mode {mode}" for mode in modes]
    return plot_surfaces(mesh, basis.evecs[:, modes], titles=titles, n_columns=n_columns)


def plot_views(views: Sequence[SurfaceView], *, n_columns: int | None = None, color_bar: str = "") -> Figure:
    """Draw views in rows of still pictures, all cut to the same frame; in the book each can be turned (`scenes`).

    Parameters
    ----------
    views : what to draw, one at least
    n_columns, color_bar : as for `plot_surfaces`

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> figure = plot_views([SurfaceView(triangle), SurfaceView(triangle, edges=True)])
    >>> len(figure.axes)
    2
    """
    views = [as_instance("views", view, SurfaceView, "SurfaceView(mesh, values) makes one") for view in views]
    if not views:
        raise ValueError("views must hold at least one view")
    columns = as_count("n_columns", len(views) if n_columns is None else n_columns, 1)
    if color_bar:
        lows, highs = zip(*(view.color_limits for view in views), strict=True)
        views = [replace(view, limits=(min(lows), max(highs))) for view in views]
    width = {1: 4.5, 2: 7.0, 3: 8.0}.get(columns, 9.0)  # inches
    images = _cut_alike([render(view, size=int(1.5 * DPI * width / columns)) for view in views])
    panel = (width / columns, width / columns * images[0].shape[0] / images[0].shape[1])
    return scenes.attach(_lay_out(views, images, columns, panel, color_bar), views, color_bar=color_bar)


def _pair_up(surfaces: Any, values: Any) -> list[tuple[Any, Any]]:
    """One (surface, values) pair a picture."""
    if not isinstance(surfaces, TriangleMesh | PointCloud):
        if not isinstance(surfaces, Sequence):
            raise TypeError(f"surfaces must be a TriangleMesh, a PointCloud or several; got {type(surfaces).__name__}")
        surfaces = list(surfaces)
        values = [None] * len(surfaces) if values is None else list(values)
        if len(values) != len(surfaces):
            raise ValueError(f"values must hold one array for each of the {len(surfaces)} surfaces; got {len(values)}")
        return list(zip(surfaces, values, strict=True))
    if values is None:
        return [(surfaces, None)]
    array = np.asarray(values)
    return [(surfaces, column) for column in (array.T if array.ndim == 2 else [array])]


def _cut_alike(images: Sequence[Image]) -> list[Image]:
    """Cut the white margin that all images share, but for a narrow rim."""
    inked = np.any([(image < 250).any(axis=2) for image in images], axis=0)
    if not inked.any():
        return list(images)
    rim = max(2, len(inked) // 60)
    rows, columns = (np.flatnonzero(inked.any(axis=axis)) for axis in (1, 0))
    top, left = max(rows[0] - rim, 0), max(columns[0] - rim, 0)
    return [image[top : rows[-1] + rim + 1, left : columns[-1] + rim + 1] for image in images]


def _lay_out(
    views: Sequence[SurfaceView], images: Sequence[Image], columns: int, panel: tuple[float, float], color_bar: str
) -> Figure:
    """Place the images on a figure, pixel for pixel, each under its title."""
    rows = -(-len(images) // columns)
    head = 0.28 if any(view.title for view in views) else 0.0
    foot = 0.7 if color_bar else 0.0
    width, height = columns * panel[0], rows * (panel[1] + head) + foot
    figure = plt.figure(figsize=(width, height), dpi=DPI, layout="none")
    for number, (view, image) in enumerate(zip(views, images, strict=True)):
        row, column = divmod(number, columns)
        bottom = height - (row + 1) * (panel[1] + head)
        axes = figure.add_axes((column * panel[0] / width, bottom / height, panel[0] / width, panel[1] / height))
        axes.imshow(image, interpolation="antialiased")
        axes.set_axis_off()
        axes.set_title(view.title, fontsize=9, pad=3)
    if color_bar:
        colors = ScalarMappable(Normalize(*views[0].color_limits), str(views[0].color_map))
        bar = figure.add_axes((0.3, 0.5 / height, 0.4, 0.1 / height))
        figure.colorbar(colors, cax=bar, orientation="horizontal", label=color_bar)
    return figure
