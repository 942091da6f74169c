"""Write what the labs load on request, and the still picture that each of them shows before it is started.

Data go to labs/data/NAME.js and pictures to labs/stills/NAME.png below the folder of generated files.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import notebooks
import numpy as np
from matplotlib.figure import Figure
from numpy.polynomial import chebyshev
from scipy.spatial import cKDTree

from spectral_notes import plotting
from spectral_notes.diffusion import heat, point_source
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.files import read_mesh
from spectral_notes.fourier import dft_by_fft, fourier_matrices, half_coefficients
from spectral_notes.functional_maps import functional_map
from spectral_notes.labs.data import LabData, in_unit_area, modes_data, quantise, surface_data
from spectral_notes.labs.recipes import arrows_data, cap_data, filter_data, map_data, parts_data
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import spread_faces
from spectral_notes.meshes import TriangleMesh, face_areas, vertex_normals
from spectral_notes.shapes import bracket, coarse_copy, doll, doll_correspondence, egg, goat, spherical_cap
from spectral_notes.vector_fields import arrows_of_field, field_indices, smoothest_field

ROOT = Path(__file__).resolve().parents[1]
MAX_BYTES = 3_000_000  # of one lab's data
STILL_DPI = 90
CORTEX_EYE = [-1.0, 0.0, 0.15]  # a left hemisphere, seen from the left


def basis_of(mesh: TriangleMesh, n: int, k: int) -> tuple[TriangleMesh, Eigenbasis]:
    """Return a lighter copy of a shape in unit area, and its modes."""
    coarse = in_unit_area(coarse_copy(mesh, n)[0])
    return coarse, compute_eigenbasis(*cotan_laplacian(coarse), k)


def two_dolls(n: int) -> tuple[TriangleMesh, TriangleMesh, np.ndarray]:
    """Return two poses with different triangles, and the true map from the second to the first: nearest at rest."""
    coarse, P = coarse_copy(doll(), n)
    other, Q = coarse_copy(doll("rest", "remeshed"), n)
    p2p_21 = cKDTree(coarse.vertices).query(other.vertices)[1]
    arms_down = TriangleMesh(P @ doll("arms_down").vertices, coarse.faces, "doll_arms_down")
    walking = TriangleMesh(Q @ (doll_correspondence() @ doll("walk").vertices), other.faces, "doll_walk")
    return arms_down, walking, p2p_21


def dolls_in_poses(n: int) -> list[TriangleMesh]:
    """Return the doll in every pose with the same few triangles."""
    coarse, P = coarse_copy(doll(), n)
    poses = ("rest", "arms_down", "walk", "wave")
    return [TriangleMesh(P @ doll(pose).vertices, coarse.faces, f"doll_{pose}") for pose in poses]


def cortex() -> tuple[TriangleMesh, TriangleMesh, dict[str, np.ndarray]]:
    """Return the left pial and inflated surface of nilearn's package, and its maps; the mean fills the medial wall.

    The book reads them where nilearn is installed. The library has no part in it: the surfaces are not its to give.
    """
    from nilearn.datasets import fetch_surf_fsaverage
    from nilearn.surface import load_surf_data

    names = fetch_surf_fsaverage("fsaverage5")
    depth, thickness = (np.asarray(load_surf_data(names[f"{kind}_left"]), dtype=float) for kind in ("sulc", "thick"))
    pial, inflated = (read_mesh(names[f"{kind}_left"]) for kind in ("pial", "infl"))
    wall = thickness < 0.5
    M = cotan_laplacian(pial)[1].diagonal()
    thickness[wall] = np.average(thickness[~wall], weights=M[~wall])
    return pial, inflated, {"depth": depth, "thickness": thickness}


# --- data -----------------------------------------------------------------------------------------------------------


def lab_data() -> Iterator[tuple[str, LabData]]:
    """Yield the name and the data of every file."""
    for shape in (egg(), goat(), bracket(), doll()):
        yield f"eigenfunctions-{shape.name}", modes_data(shape, 101)
    yield "reconstruction-goat", surface_data(coarse_copy(goat(), 4500)[0], 500, in_bytes=True)
    yield "heat-goat", surface_data(coarse_copy(goat(), 5000)[0], 300, in_bytes=True)
    yield "functional-map-doll", map_data(*two_dolls(5000), 60)
    yield "bump-dent-cap", cap_data()
    yield "clusters-doll", parts_data(dolls_in_poses(5000), range(2, 13))
    yield "arrows-goat", arrows_data(coarse_copy(goat(), 2500)[0])
    yield "filter-graph", filter_data()
    yield "cortex-left", cortex_data()


def cortex_data(k: int = 201) -> LabData:
    """Return the left hemisphere with its modes, inflated too, and two maps without their means, analyzed."""
    pial, inflated, maps = cortex()
    data = surface_data(pial, k, in_bytes=True)
    basis = compute_eigenbasis(*cotan_laplacian(in_unit_area(pial)), k)
    mass = basis.M.diagonal()
    values = np.array([f - mass @ f / mass.sum() for f in maps.values()])
    facts = {"name": "left hemisphere", "eye": CORTEX_EYE, "maps_of": list(maps)}
    facts["millimetres"] = float(np.sqrt(face_areas(pial).sum()))  # in one unit of length of the lab
    arrays = {"maps": values.astype(np.float16), "map_coefficients": basis.analyze(values.T).T.astype(np.float32)}
    arrays["inflated"] = in_unit_area(inflated).vertices.T.astype(np.float16)
    return LabData({**data.facts, **facts}, {**data.arrays, **quantise(basis.evecs, 16), **arrays})  # 3 MB hold no more


# --- stills ---------------------------------------------------------------------------------------------------------


def still_of_eigenfunctions() -> Figure:
    """Draw three modes of the goat."""
    mesh, basis = basis_of(goat(), 5000, 51)
    return plotting.plot_modes(mesh, basis, [1, 10, 50])


def still_of_reconstruction() -> Figure:
    """Draw the goat from few and from many modes."""
    mesh, basis = basis_of(goat(), 5000, 500)
    c = basis.analyze(mesh.vertices)
    counts = (5, 50, 500)
    partial = [TriangleMesh(basis.truncate(k).synthesize(c[:k]), mesh.faces, "goat") for k in counts]
    return plotting.plot_surfaces(partial, titles=[f"{k} modes" for k in counts])


def still_of_heat() -> Figure:
    """Draw a drop of heat on the goat at three times."""
    mesh, basis = basis_of(goat(), 5000, 300)
    drop = point_source(basis.M, int(mesh.vertices[:, 0].argmax()))
    later = np.column_stack([heat(basis, drop, t) for t in (0.003, 0.03, 0.3)])
    later /= later.max(axis=0)
    titles = ["soon", "later", "much later"]
    return plotting.plot_surfaces(mesh, later, titles=titles, kind="positive", limits=(0.0, 1.0))


def still_of_fourier() -> Figure:
    """Draw a square wave from few waves, and its amplitudes."""
    f = np.where(np.arange(128) < 64, 0.8, -0.8)
    a, b = dft_by_fft(f)
    low = np.minimum(np.arange(128), 128 - np.arange(128)) <= 9
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 2.6))
    left.plot(f, color="0.7")
    psi, chi = fourier_matrices(128)
    left.plot(psi.T @ (a * low) + chi.T @ (b * low))
    left.set(xlabel="sample n", ylabel="f")
    right.bar(np.arange(65), np.hypot(*half_coefficients(a, b)))
    right.set(xlabel="frequency k", ylabel="amplitude")
    return figure


def still_of_ends() -> Figure:
    """Draw the second mode of a string with fixed, mixed and free ends."""
    x = np.linspace(0, 1, 201)
    modes = {"both fixed": np.sin(2 * np.pi * x), "one free": np.sin(1.5 * np.pi * x), "both free": np.cos(np.pi * x)}
    figure, panels = plt.subplots(1, 3, figsize=(8.0, 2.2), sharey=True)
    for axes, (name, u) in zip(panels, modes.items(), strict=True):
        axes.plot(x, u)
        axes.set(title=name, xlabel="place along the string")
    panels[0].set_ylabel("mode 1")
    return figure


def still_of_functional_map() -> Figure:
    """Draw a bump on one pose and its image on the other, carried by 30 modes."""
    one, two, p2p_21 = two_dolls(5000)
    basis_1, basis_2 = (compute_eigenbasis(*cotan_laplacian(in_unit_area(mesh)), 30) for mesh in (one, two))
    c = basis_1.evecs[int(one.vertices[:, 0].argmax())]
    C_12 = functional_map(basis_1, basis_2, p2p_21)
    return plotting.plot_surfaces([one, two], [basis_1.synthesize(c), basis_2.synthesize(C_12 @ c)], nodal_lines=False)


def still_of_clusters() -> Figure:
    """Draw the same seven parts in three poses."""
    poses = dolls_in_poses(5000)[1:]
    labels = parts_data(poses, [7]).arrays["labels"][:, 0]
    return plotting.plot_surfaces(poses, list(labels.astype(float)), kind="labels")


def still_of_bump_dent() -> Figure:
    """Draw mode 1 of a cap and of the cap pushed in, both from the same coefficients."""
    f = cap_data(2).arrays["evecs"][1].astype(float)
    caps = [spherical_cap(rings_pushed_in=count) for count in (0, 18, 27)]
    titles = ["a bump", "half pushed in", "pushed in further"]
    return plotting.plot_surfaces(caps, [f] * 3, titles=titles, camera=((0.3, -1.0, 0.5), (0.0, 0.0, 1.0)))


def still_of_arrows() -> Figure:
    """Draw the goat combed through three arrows, in lines and in crosses, and its singular places in red and blue."""
    mesh = in_unit_area(coarse_copy(goat(), 2500)[0])
    x, y, _ = mesh.vertices.T
    fixed = [int(x.argmax()), int(x.argmin()), int((y - 9 * abs(x)).argmax())]
    views = []
    for n_fold, title in ((1, "arrows"), (2, "lines"), (4, "crosses")):
        z = smoothest_field(mesh, n_fold, fixed=fixed, values=[1, -1, 1j])
        found = field_indices(mesh, z, n_fold)
        spots = np.zeros(mesh.n_vertices)
        np.put(spots, mesh.faces[found != 0], np.repeat(np.sign(found[found != 0]), 3))
        at = mesh.faces[spread_faces(mesh, 400 // (n_fold + 1)), 0]
        turns = np.exp(2j * np.pi * np.arange(n_fold) / n_fold)
        hairs = [0.045 * arrows_of_field(mesh, turn * np.exp(1j * np.angle(z) / n_fold))[at] for turn in turns]
        feet = np.tile(mesh.vertices[at] + 0.006 * vertex_normals(mesh)[at], (n_fold, 1))
        look = {"limits": (-1.6, 1.6), "nodal_lines": False, "title": title}
        views.append(plotting.SurfaceView(mesh, spots, arrows=(feet, np.vstack(hairs)), **look))
    return plotting.plot_views(views, n_columns=3)


def still_of_filter() -> Figure:
    """Draw a steep low-pass with a polynomial for it, and a noisy signal before and after."""
    data = filter_data()
    x, y = data.arrays["points"]
    evals, evecs, noisy = (data.arrays[name].astype(float) for name in ("evals", "evecs", "signals"))
    knobs = np.linspace(0, evals[-1], 9)
    gains = 1.0 * (knobs < 0.3 * knobs[-1])
    f = noisy[1]
    cleaned = evecs.T @ (np.interp(evals, knobs, gains) * (evecs @ f))
    figure, panels = plt.subplots(1, 3, figsize=(9.6, 3.2))
    low = chebyshev.Chebyshev.interpolate(lambda at: np.interp(at, knobs, gains), 20, [0, evals[-1]])
    panels[0].plot(knobs, gains, "o--", color="C1")
    panels[0].plot(*low.linspace(200), color="C0")
    panels[0].set(xlabel="eigenvalue", ylabel="gain")
    edges = data.arrays["edges"].T
    for axes, values, title in ((panels[1], f, "before"), (panels[2], cleaned, "after")):
        axes.plot(x[edges], y[edges], color="0.85", lw=0.5, zorder=0)
        axes.scatter(x, y, c=values, s=16, cmap="RdBu_r", vmin=-1.5, vmax=1.5)
        axes.set(title=title, xticks=[], yticks=[], aspect="equal")
    return figure


def still_of_cortex() -> Figure:
    """Draw a mode of the left hemisphere, and its depth from two hundred modes."""
    pial, _, maps = cortex()
    basis = compute_eigenbasis(*cotan_laplacian(pial), 201)
    depth = maps["depth"] - np.average(maps["depth"], weights=basis.M.diagonal())
    c = basis.analyze(depth)
    shown = {"mode 10": basis.evecs[:, 10], "depth from 50 modes": basis.evecs[:, :51] @ c[:51]}
    shown["from 200"] = basis.evecs @ c
    camera = (tuple(CORTEX_EYE), (0.0, 0.0, 1.0))
    views = [plotting.SurfaceView(pial, f, title=title, camera=camera, nodal_lines=False) for title, f in shown.items()]
    return plotting.plot_views(views, n_columns=3)


STILLS: dict[str, Callable[[], Figure]] = {
    "eigenfunctions": still_of_eigenfunctions,
    "reconstruction": still_of_reconstruction,
    "heat": still_of_heat,
    "fourier": still_of_fourier,
    "ends": still_of_ends,
    "functional-map": still_of_functional_map,
    "clusters": still_of_clusters,
    "bump-dent": still_of_bump_dent,
    "arrows": still_of_arrows,
    "filter": still_of_filter,
    "cortex": still_of_cortex,
}


# --- files ----------------------------------------------------------------------------------------------------------


def write_labs(target: Path, root: Path = ROOT) -> None:
    """Write data and stills below `target`, unless they are those of the library as it is."""
    notebooks.once(target.parent / "labs.digest", [Path(__file__)], root, lambda: make_labs(target / "labs"))


def make_labs(folder: Path) -> None:
    """Write data and stills into a folder."""
    sys.stderr.write("labs: computing their data and pictures\n")
    for name, data in lab_data():
        notebooks.write(folder / "data" / f"{name}.js", data.script(f"labs/data/{name}"))
    plotting.use_house_style()
    (folder / "stills").mkdir(parents=True, exist_ok=True)
    for name, draw in STILLS.items():
        figure = draw()
        figure.savefig(folder / "stills" / f"{name}.png", dpi=STILL_DPI, metadata={"Software": None})
        plt.close(figure)
