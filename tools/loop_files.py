"""Write the pictures of the book that move: a still, and a short loop that a reader plays, for both themes.

A page names the still in a figure of the class `loop`; `book/_static/loops.js` puts a button on it. The files are
loops/FIGURE.png, .webp and -dark.webp, and FIGURE.js, which says where a surface lies in the picture, for the still's
twin.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import figure_twins
import lab_files
import matplotlib.pyplot as plt
import notebooks
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image
from scipy.linalg import eigh_tridiagonal
from scipy.optimize import brentq

from spectral_notes import plotting
from spectral_notes.diffusion import heat, point_source, wave
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching import zoomout
from spectral_notes.meshes import TriangleMesh
from spectral_notes.plotting import SurfaceView
from spectral_notes.shapes import goat, sphere, spherical_cap

MAX_BYTES = 400_000  # of one loop
SIZE = 640  # pixels of a square picture of a surface, before it is cut
QUALITIES = (85, 60, 40)
CAP_CAMERA = ((0.3, -1.0, 0.9), (0.0, 0.0, 1.0))
FAN_CAMERA = ((0.35, -1.0, 0.75), (0.0, 0.0, 1.0))
BALL_CAMERA = ((1.2, 0.65, 0.95), (0.0, 0.0, 1.0))
EGG_CAMERA = ((0.6, -1.2, 0.7), (0.0, 0.0, 1.0))

Frame = NDArray[np.uint8]


@dataclass(frozen=True)
class Loop:
    """Hold what draws the frames of one loop, which of them is the still, and how long each is seen."""

    draw: Callable[[], list[Frame]]
    still: int
    milliseconds: int
    surface: float = 1.0  # the share of the width in which white is the ground behind a surface


# --- frames ---------------------------------------------------------------------------------------------------------


def rendered(views: Sequence[SurfaceView], size: int = SIZE) -> list[Frame]:
    """Return the pictures of views, cut to what any of them shows."""
    images = [plotting.render(view, size=size) for view in views]
    inked = np.any([(image < 250).any(axis=2) for image in images], axis=0)
    rows, columns = (np.flatnonzero(inked.any(axis=axis)) for axis in (1, 0))
    return [image[max(rows[0] - 8, 0) : rows[-1] + 9, max(columns[0] - 8, 0) : columns[-1] + 9] for image in images]


def room(low: Sequence[float], high: Sequence[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return arrows of no length at the ends of a box: pictures with the same box have the same scale."""
    return np.array([low, high]), np.zeros((2, 3))


def drawn(figure: Figure) -> Frame:
    """Return the pixels of a figure, and close it."""
    file = io.BytesIO()
    figure.savefig(file, dpi=100)
    plt.close(figure)
    return np.asarray(Image.open(file).convert("RGB"))


def to_and_fro(n: int) -> NDArray[np.float64]:
    """Return n numbers that go from 0 to 1 and back, slowly at the ends."""
    return (1 - np.cos(2 * np.pi * np.arange(n) / n)) / 2


# --- chapter 4 ------------------------------------------------------------------------------------------------------


def fan(n: int, part: float) -> TriangleMesh:
    """Return n equilateral triangles round a point, folded a part of the way from flat on the table to closed.

    Five rise to a tip; more than six wave up and down twice. Spokes of length one that keep 60 degrees to the next turn
    by the angle d about the axis, with cos 60 = sin e sin f + cos e cos f cos d for their elevations e and f.
    """

    def turns(wave: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        elevation = np.full(n + 1, -wave) if n < 6 else wave * np.cos(4 * np.pi * np.arange(n + 1) / n)
        e, f = elevation[:-1], elevation[1:]
        d = np.arccos(np.clip((0.5 - np.sin(e) * np.sin(f)) / (np.cos(e) * np.cos(f)), -1, 1))
        return elevation, np.concatenate([[0.0], np.cumsum(d)])

    closed = 0.0 if n == 6 else brentq(lambda wave: turns(wave)[1][-1] - 2 * np.pi, 0.0, 0.75)
    elevation, around = turns(part * closed)
    out = np.cos(elevation)
    spokes = np.column_stack([out * np.cos(around), out * np.sin(around), np.sin(elevation)])
    return TriangleMesh(np.vstack([np.zeros(3), spokes]), [[0, k, k + 1] for k in range(1, n + 1)])


def folding() -> list[Frame]:
    """Draw five, six and seven triangles round a point while they are folded until they close."""
    box = room([-1.0, -1.0, -0.6], [1.0, 1.0, 0.5])
    parts = to_and_fro(16)
    columns = [
        rendered([SurfaceView(fan(n, part), edges=True, arrows=box, camera=FAN_CAMERA) for part in parts], 420)
        for n in (5, 6, 7)
    ]
    high = max(len(frames[0]) for frames in columns)
    return [np.hstack([np.pad(f, ((0, high - len(f)), (0, 0), (0, 0)), constant_values=255) for f in row])
            for row in zip(*columns, strict=True)]


def pushed_in() -> list[Frame]:
    """Draw a cap whose inner rings are mirrored, one after the other; no edge becomes longer or shorter."""
    counts = np.rint(27 * to_and_fro(28)).astype(int)
    rim = spherical_cap().vertices
    box = room([*rim.min(axis=0)[:2], 0.2], rim.max(axis=0))
    views = {k: SurfaceView(spherical_cap(rings_pushed_in=int(k)), arrows=box, camera=CAP_CAMERA) for k in {*counts}}
    images = dict(zip(views, rendered(list(views.values())), strict=True))
    return [images[k] for k in counts]


def carried(part: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where an arrow is, and where it points, after a part of the way round a triangle with three right angles.

    Along a great circle an arrow keeps its angle to the way.
    """
    corners = np.eye(3)
    leg = min(int(3 * part), 2)
    turn = (3 * part - leg) * np.pi / 2
    arrow = np.array([0.0, 0.0, 1.0])
    for k in range(leg + 1):
        start, end = corners[k], corners[(k + 1) % 3]
        angle = np.pi / 2 if k < leg else turn
        place, ahead = np.cos(angle) * start + np.sin(angle) * end, np.cos(angle) * end - np.sin(angle) * start
        arrow = (arrow @ end) * ahead + (arrow @ np.cross(start, end)) * np.cross(start, end)
    return place, arrow


def transported() -> list[Frame]:
    """Draw an arrow on its way round a triangle of a sphere; what it left behind stays."""
    ball, n = sphere(4), 24
    angle = np.linspace(0, np.pi / 2, 40)[:, None]
    corners = zip(np.eye(3), np.roll(np.eye(3), -1, axis=0), strict=True)
    lines = [1.004 * (np.cos(angle) * a + np.sin(angle) * b) for a, b in corners]
    states = [carried(k / n) for k in range(n + 1)]
    views = []
    for k in [*range(n + 1), *[n] * 5]:
        feet, vectors = map(np.array, zip(*states[:k:4], states[k], strict=True))
        ends, nothing = room([-1.1] * 3, [1.1] * 3)
        arrows = np.vstack([1.02 * feet, ends]), np.vstack([0.3 * vectors, nothing])
        views.append(SurfaceView(ball, curves=tuple(lines), arrows=arrows, camera=BALL_CAMERA))
    return rendered(views)


# --- chapter 8 ------------------------------------------------------------------------------------------------------


def string_modes(left: float, right: float, n: int = 400) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return frequencies and modes of a string of length one whose ends are held by springs, 0 (free) to 1 (fixed)."""
    h = 1 / n
    springs = [np.tan(np.pi / 2 * min(held, 1 - 1e-4)) for held in (left, right)]
    diagonal, mass = np.full(n + 1, 2 / h), np.full(n + 1, h)
    diagonal[[0, -1]] = 1 / h + np.array(springs)
    mass[[0, -1]] = h / 2
    root = np.sqrt(mass)
    evals, modes = eigh_tridiagonal(diagonal / mass, -1 / h / (root[:-1] * root[1:]), select="i", select_range=(0, 3))
    modes /= root[:, None]
    return np.sqrt(np.maximum(evals, 0)), modes * np.sign(modes[1])


def string() -> list[Frame]:
    """Draw modes of a string while its right end goes from free to fixed and back; the left end is fixed."""
    frames = []
    for held in to_and_fro(22):
        frequencies, modes = string_modes(1.0, held)
        modes /= np.abs(modes).max(axis=0)
        figure, panels = plt.subplots(1, 3, figsize=(7.0, 2.1), sharey=True)
        for k, axes in enumerate(panels):
            axes.plot(np.linspace(0, 1, len(modes)), modes[:, k])
            axes.plot([0], [0], "ko", ms=5)
            axes.plot([1], [modes[-1, k]], "ko", ms=5, mfc="k" if held > 0.98 else "w")
            axes.set(title=f"mode {k}: {frequencies[k] / np.pi:.2f} π", ylim=(-1.2, 1.2), xticks=[0, 1], yticks=[0])
        frames.append(drawn(figure))
    return frames


def stretched() -> list[Frame]:
    """Draw the first three modes of a ball while it is stretched along x; each is followed by its direction."""
    ball = sphere(4)
    box = room([-1.5, -1.0, -0.85], [1.5, 1.0, 0.85])
    columns: list[list[SurfaceView]] = [[], [], []]
    for part in to_and_fro(16):
        mesh = TriangleMesh(ball.vertices * [0.75 + 0.75 * part, 1.0, 0.85], ball.faces)
        basis = compute_eigenbasis(*cotan_laplacian(mesh), 4)
        along = basis.analyze(mesh.vertices)  # of x, y and z: each mode is nearly one of them
        for axis, views in enumerate(columns):
            k = int(np.abs(along[1:, axis]).argmax()) + 1
            f = basis.evecs[:, k] * np.sign(along[k, axis])
            views.append(SurfaceView(mesh, f / np.abs(f).max(), limits=(-1, 1), arrows=box, camera=EGG_CAMERA))
    return [np.hstack(row) for row in zip(*(rendered(views, SIZE // 2) for views in columns), strict=True)]


# --- chapter 9 ------------------------------------------------------------------------------------------------------


def drop() -> list[Frame]:
    """Draw heat that spreads from the muzzle of the goat; in each frame the hottest point has the last colour."""
    mesh, basis = lab_files.basis_of(goat(), 4000, 250)
    start = point_source(basis.M, int(mesh.vertices[:, 0].argmax()))
    fields = [heat(basis, start, t) for t in np.geomspace(0.001, 0.6, 24)]
    views = [SurfaceView(mesh, f / f.max(), kind="positive", limits=(0.0, 1.0)) for f in fields]
    return rendered([*views, *[views[-1]] * 3])


def front() -> list[Frame]:
    """Draw a wave that starts at the muzzle of the goat."""
    mesh, basis = lab_files.basis_of(goat(), 4000, 250)
    start = heat(basis, point_source(basis.M, int(mesh.vertices[:, 0].argmax())), 0.002)
    fields = [wave(basis, start, t) for t in np.linspace(0.0, 1.6, 28)]
    top = 0.25 * float(np.abs(fields[0]).max())
    return rendered([SurfaceView(mesh, f, limits=(-top, top), nodal_lines=False) for f in fields])


# --- chapter 12 -----------------------------------------------------------------------------------------------------


def growing() -> list[Frame]:
    """Draw ZoomOut from 4 to 60 modes: the matrix, and the coordinate of one doll as the map brings it to the other."""
    one, two, p2p_21 = lab_files.two_dolls(3000)
    basis_1, basis_2 = (compute_eigenbasis(*cotan_laplacian(lab_files.in_unit_area(mesh)), 60) for mesh in (one, two))
    C = functional_map(basis_1.truncate(4), basis_2.truncate(4), p2p_21)
    height = one.vertices[:, 1] - one.vertices[:, 1].min()
    signal = np.sin(7 * np.pi * height / height.max())
    views, matrices = [SurfaceView(one, signal, limits=(-1.2, 1.2), nodal_lines=False)], []
    for k in range(4, 61, 4):
        C = zoomout(basis_1.truncate(k), basis_2.truncate(k), C, k=k, step=2)
        brought = signal[point_map(basis_1.truncate(k), basis_2.truncate(k), C)]
        views.append(SurfaceView(two, brought, limits=(-1.2, 1.2), nodal_lines=False))
        matrices.append(C)
    left, *right = rendered(views)
    frames = []
    for image, C in zip(right, matrices, strict=True):
        surfaces = np.hstack([left, image])
        high, wide = surfaces.shape[:2]
        figure = plt.figure(figsize=(wide / 100, high / 100), layout="none")
        whole = np.zeros((60, 60))
        whole[: len(C), : len(C)] = C
        axes = figure.add_axes((0.06, 0.04, 0.88, 0.86))
        axes.imshow(whole, cmap="RdBu_r", vmin=-1, vmax=1)
        axes.set(title=f"{len(C)} modes", xticks=[], yticks=[])
        frames.append(np.hstack([surfaces, drawn(figure)]))
    return frames


LOOPS = {
    "fig-03-held": Loop(string, 4, 110, surface=0.0),
    "fig-04-folding": Loop(folding, 8, 120),
    "fig-04-pushed-in": Loop(pushed_in, 8, 100),
    "fig-13-triangle": Loop(transported, 24, 120),
    "fig-08-stretched": Loop(stretched, 8, 140),
    "fig-09-drop": Loop(drop, 14, 120),
    "fig-09-wave": Loop(front, 12, 120),
    "fig-12-growing": Loop(growing, 6, 400, surface=0.5),
}


# --- files ----------------------------------------------------------------------------------------------------------


def save(frames: Sequence[Image.Image], path: Path, milliseconds: int) -> None:
    """Write a loop, with less detail where it would weigh too much."""
    for quality in QUALITIES:
        form = {"duration": milliseconds, "loop": 0, "quality": quality, "method": 4}
        frames[0].save(path, save_all=True, append_images=frames[1:], **form)
        if path.stat().st_size <= MAX_BYTES:
            return
    size = path.stat().st_size
    raise ValueError(f"{path.name} must weigh at most {MAX_BYTES} bytes; it has {size}: draw fewer frames")


def write_loop(name: str, loop: Loop, folder: Path) -> None:
    """Write the files of one loop."""
    frames = [Image.fromarray(frame) for frame in loop.draw()]
    boxes = [[0.0, 0.0, loop.surface, 1.0]] if loop.surface else []
    frames[loop.still].save(folder / f"{name}.png")
    save(frames, folder / f"{name}.webp", loop.milliseconds)
    save([figure_twins.dark(frame, boxes) for frame in frames], folder / f"{name}-dark.webp", loop.milliseconds)
    notebooks.write(folder / f"{name}.js", f"({json.dumps({'pictures': [{'box': box} for box in boxes]})})\n")


def write_loops(target: Path, root: Path = notebooks.ROOT) -> None:
    """Write all loops below `target`, unless they are those of the library as it is."""
    sources = [Path(__file__), Path(lab_files.__file__), Path(figure_twins.__file__)]
    notebooks.once(target.parent / "loops.digest", sources, root, lambda: make_loops(target / "loops"))


def make_loops(folder: Path) -> None:
    """Write all loops into a folder."""
    sys.stderr.write("loops: drawing the pictures that move\n")
    plotting.use_house_style()
    folder.mkdir(parents=True, exist_ok=True)
    for name, loop in LOOPS.items():
        write_loop(name, loop, folder)
