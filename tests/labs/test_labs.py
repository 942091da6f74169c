"""The labs: their numbers in Node, what the library exports for them, and both against each other."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import igl
import lab_files
import numpy as np
import pytest
from numpy.polynomial import chebyshev
from sklearn.metrics import adjusted_rand_score
from unpacking import unpack_array

from spectral_notes import labs
from spectral_notes.clustering import spectral_clusters, spectral_embedding
from spectral_notes.diffusion import heat, point_source
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.geometry import geodesic_distances
from spectral_notes.geometry.nodal import nodal_domains
from spectral_notes.labs.data import (
    LabData,
    in_unit_area,
    modes_data,
    quantise,
    surface_data,
)
from spectral_notes.labs.recipes import arrows_data, cap_data, filter_data, map_data, parts_data
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh, corner_angles, euler_characteristic, face_areas
from spectral_notes.shapes import coarse_copy, doll, egg, goat, sphere, spherical_cap
from spectral_notes.vector_fields import connection_laplacian, field_indices, smoothest_field

ROOT = Path(__file__).resolve().parents[2]
NODE = shutil.which("node")
SCRIPTS = [ROOT / "spectral_notes" / name for name in ("plotting/static/arrays.js", "labs/static/numerics.js")]
needs_node = pytest.mark.skipif(NODE is None, reason="node is not installed: the scripts of the labs are not run")


def in_node(tmp_path: Path, data: LabData, expression: str) -> object:
    """Return what an expression over the decoded data (`d`) and the numerics (`N`) is in Node."""
    (tmp_path / "data.js").write_text(data.script("data"), encoding="utf-8")
    (tmp_path / "run.js").write_text(
        f"{' '.join(f'require({json.dumps(str(path))});' for path in SCRIPTS)} const N = spectralNotes.numerics; let given;"
        "spectralNotes.register = (name, value) => (given = value); require('./data.js');"
        "spectralNotes.decodeAll(given.arrays).then((arrays) => { const d = { ...given.facts, ...arrays };"
        f"console.log(JSON.stringify({expression})); }});",
        encoding="utf-8",
    )
    done = subprocess.run([str(NODE), "run.js"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@needs_node
def test_the_numbers_of_the_labs_pass_their_own_tests():
    done = subprocess.run([str(NODE), "--test", "tests/labs"], cwd=ROOT, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert "# fail 0" in done.stdout and "# pass 0" not in done.stdout


# --- arrays -----------------------------------------------------------------------------------------------------------


@needs_node
def test_node_decodes_what_python_packs(tmp_path):
    rng = np.random.default_rng(1)
    arrays = {
        "a": rng.normal(size=(4, 5)).astype(np.float16),
        "b": rng.normal(size=6).astype(np.float32),
        "c": rng.integers(0, 65536, 7).astype(np.uint16),
        "d": rng.integers(-128, 128, 8).astype(np.int8),
    }
    found = in_node(tmp_path, LabData({"x": 1}, arrays), "['a', 'b', 'c', 'd'].map((name) => Array.from(d[name]))")
    for array, values in zip(arrays.values(), found, strict=True):
        assert np.array_equal(np.array(values).astype(array.dtype), array.ravel())


def test_quantised_modes_are_within_half_a_step():
    evecs = np.random.default_rng(2).normal(size=(50, 9))
    packed = quantise(evecs, 4)
    assert np.abs(packed["evecs"].T - evecs[:, :4]).max() <= np.abs(evecs).max() * 2.0**-11
    back = packed["evecs_in_bytes"] * packed["steps"][:, None].astype(np.float64)
    assert np.all(np.abs(back.T - evecs[:, 4:]) <= 0.5001 * packed["steps"])
    assert set(quantise(evecs, 9)) == {"evecs"}


# --- surfaces ---------------------------------------------------------------------------------------------------------


def test_a_coarse_copy_keeps_the_topology_the_area_and_good_triangles():
    mesh = goat()
    coarse, P = coarse_copy(mesh, 3000)
    assert abs(coarse.n_vertices - 3000) <= 1
    assert euler_characteristic(coarse) == 2
    assert np.allclose(P.sum(axis=1), 1.0)
    assert abs(face_areas(coarse).sum() / face_areas(mesh).sum() - 1) < 0.03
    assert np.degrees(corner_angles(coarse).min()) > 10
    posed = TriangleMesh(P @ goat("walk").vertices, coarse.faces)
    assert abs(face_areas(posed).sum() / face_areas(coarse).sum() - 1) < 0.02


def far_apart(one: TriangleMesh, other: TriangleMesh) -> float:
    """Return how far the points of one surface lie from the other at most, as a share of its diagonal."""
    rng = np.random.default_rng(0)
    faces = rng.choice(one.n_faces, 20_000, p=face_areas(one) / face_areas(one).sum())
    weights = rng.dirichlet([1, 1, 1], len(faces))
    points = np.vstack([one.vertices, np.einsum("nk,nkd->nd", weights, one.vertices[one.faces[faces]])])
    squared = igl.point_mesh_squared_distance(points, other.vertices, other.faces)[0]
    return float(np.sqrt(squared.max()) / np.linalg.norm(np.ptp(one.vertices, axis=0)))


@pytest.mark.parametrize(("mesh", "n"), [(goat(), 4500), (goat(), 5000), (doll(), 5000)], ids=["goat 4500", "goat 5000", "doll"])
def test_the_copies_of_the_labs_are_their_shapes(mesh, n):
    """The copies of the reconstruction, of heat, and of the doll's maps and parts; the explorer has whole meshes."""
    coarse, _ = coarse_copy(mesh, n)
    assert far_apart(mesh, coarse) < 0.005 and far_apart(coarse, mesh) < 0.005
    assert abs(face_areas(coarse).sum() / face_areas(mesh).sum() - 1) < 0.02
    assert euler_characteristic(coarse) == euler_characteristic(mesh)
    assert far_apart(mesh, coarse_copy(mesh, 1000)[0]) > 0.005  # the bound can be missed


def test_a_small_mesh_is_its_own_copy():
    mesh = sphere(2)
    coarse, P = coarse_copy(mesh, 1000)
    assert coarse is mesh
    assert abs(P @ mesh.vertices - mesh.vertices).max() == 0


def test_a_mesh_that_cannot_be_simplified_says_so():
    vertices = [[0, 0, 0], [1, 0, 0], *[[0.5, np.cos(a), np.sin(a)] for a in np.linspace(0, 5, 9)]]
    fan = TriangleMesh(vertices, [[0, 1, i] for i in range(2, 11)])
    with pytest.raises(ValueError, match=r"mesh must be manifold to be simplified from 11 to 5 vertices; see health\(mesh\)"):
        coarse_copy(fan, 5)


def test_too_many_vertices_or_too_few_for_the_modes_are_named():
    with pytest.raises(ValueError, match="mesh's number of vertices must be between 200 and 20000; got 162"):
        surface_data(sphere(2), 200)
    with pytest.raises(ValueError, match="n must be at least 4; got 3"):
        coarse_copy(sphere(2), 3)


@pytest.mark.parametrize("in_bytes", [False, True])
@needs_node
def test_a_reconstruction_in_node_errs_as_in_python(tmp_path, in_bytes):
    mesh = in_unit_area(coarse_copy(goat(), 1500)[0])
    basis = compute_eigenbasis(*cotan_laplacian(mesh), 200)
    c = basis.analyze(mesh.vertices)
    mass = basis.M.diagonal()
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    counts = [1, 10, 50, 120, 200]
    lost = [mesh.vertices - basis.truncate(k).synthesize(c[:k]) for k in counts]
    wanted = [np.sqrt((mass @ gap**2).sum() / mass.sum()) / diagonal for gap in lost]
    join = "N.joinBasis(d)"
    parts = "(array, n) => [0, 1, 2].map((i) => array.subarray(i * n, (i + 1) * n))"
    expression = (
        f"((evecs, parts) => {json.dumps(counts)}.map((k) => N.rmsDistance(d.mass, parts(d.vertices, d.n),"
        f" parts(d.coefficients, d.k).map((c) => N.synthesize(evecs, c, d.n, 0, k)))))({join}, {parts})"
    )
    found = np.array(in_node(tmp_path, surface_data(mesh, 200, in_bytes=in_bytes), expression)) / diagonal
    assert np.abs(found - wanted).max() < 1e-4


def test_the_explorer_has_the_shapes_the_values_and_the_nodal_domains_of_the_chapter():
    data = modes_data(egg(), 12)
    basis = compute_eigenbasis(*cotan_laplacian(in_unit_area(egg())), 12)
    assert data.facts["n"] == egg().n_vertices
    assert np.allclose(data.arrays["evals"], basis.evals, rtol=1e-5, atol=1e-4)
    assert data.facts["domains"] == [int(nodal_domains(egg(), f, tol=0.01).max()) + 1 for f in basis.evecs.T]
    assert data.facts["domains"][:3] == [1, 2, 2]


# --- maps and parts ---------------------------------------------------------------------------------------------------


def test_a_map_that_lacks_vertices_is_refused():
    with pytest.raises(ValueError, match=r"p2p_21 must have shape \(162,\); got \(3,\)"):
        map_data(egg(2), egg(2), [0, 1, 2], 4)


def test_a_map_pulls_functions_back_in_the_direction_of_its_name():
    mesh = egg(2)
    rng = np.random.default_rng(3)
    order = rng.permutation(mesh.n_vertices)  # vertex i of the copy is vertex order[i] of the mesh
    inverse = np.argsort(order)
    copy = TriangleMesh(mesh.vertices[order], inverse[mesh.faces], "copy")
    data = map_data(mesh, copy, order, 12)
    evecs_1, evecs_2, C_12 = (data.arrays[name].astype(np.float64) for name in ("evecs_1", "evecs_2", "C_12"))
    c = rng.normal(size=12)
    assert np.abs(evecs_2.T @ (C_12 @ c) - (evecs_1.T @ c)[order]).max() < 0.02


def test_parts_are_those_of_the_library_with_numbers_that_stay():
    poses = lab_files.dolls_in_poses(1500)
    data = parts_data(poses, [6, 7])
    labels = data.arrays["labels"]
    assert labels.shape == (4, 2, poses[0].n_vertices)
    basis = compute_eigenbasis(*cotan_laplacian(poses[2]), 9)
    found = spectral_clusters(spectral_embedding(basis, 8), 7, mass=basis.M.diagonal())
    assert len({(a, b) for a, b in zip(found, labels[2, 1], strict=True)}) == 7  # the same parts under other names
    assert (labels == labels[0]).mean() > 0.9
    assert (labels[0, 0] == labels[0, 1]).mean() > 0.5


def test_what_the_lab_of_clusters_tells_the_reader_to_notice():
    counts = list(range(2, 13))
    labels = parts_data(lab_files.dolls_in_poses(5000), counts).arrays["labels"]
    agreement = np.array([[adjusted_rand_score(labels[0, i], pose[i]) for i in range(len(counts))] for pose in labels[1:]])
    assert agreement[:, 0].max() < 0.5  # two parts: nobody agrees with the pose at rest
    assert agreement[:2, 1:].min() > 0.95 and agreement[2, 1:7].min() > 0.95
    assert agreement[2, [7, 8, 10]].max() < 0.9  # the wave: nine, ten and twelve
    stays = [(labels[0, i] == labels[0, i - 1]).mean() for i in range(counts.index(8), len(counts))]
    assert min(stays) > 0.8


def test_what_the_lab_of_heat_tells_the_reader_to_notice():
    mesh = in_unit_area(coarse_copy(goat(), 5000)[0])
    basis = compute_eigenbasis(*cotan_laplacian(mesh), 300)
    hoof = int(mesh.vertices[:, 1].argmin())
    for t in np.geomspace(6 / basis.evals[-1], 1 / basis.evals[1], 9):
        hottest = int(heat(basis, point_source(basis.M, hoof), t).argmax())
        assert np.linalg.norm(mesh.vertices[hottest] - mesh.vertices[hoof]) < 0.4 * np.ptp(mesh.vertices[:, 1])


@needs_node
def test_the_quotient_of_a_lab_is_that_of_the_library_on_both_caps(tmp_path):
    data = cap_data(6)
    for pushed in (0, 18, 36):
        mesh = spherical_cap(rings_pushed_in=pushed)
        coordinates = json.dumps(mesh.vertices.T.tolist())
        found = in_node(tmp_path, data, f"[3, 5].map((k) => N.rayleighQuotient({coordinates}, d.faces, d.evecs.subarray(k * d.n, (k + 1) * d.n)))")
        evals = compute_eigenbasis(*cotan_laplacian(mesh), 6).evals
        assert np.allclose(found, evals[[3, 5]], rtol=1e-6), pushed


# --- tangent fields, a filter, a cortex -------------------------------------------------------------------------------


@needs_node
@pytest.mark.parametrize("n_fold", [1, 2, 4])
def test_a_field_in_node_is_the_smoothest_of_the_library_with_its_indices(tmp_path, n_fold):
    mesh = in_unit_area(coarse_copy(goat(), 700)[0])
    fixed = [int(mesh.vertices[:, 0].argmax()), int(mesh.vertices[:, 0].argmin()), 300]
    values = np.array([1, 1j, -1])
    expression = (
        f"((n, step, at) => {{ const unit = (v) => Float64Array.from({{ length: 2 * n }}, (_, i) => +(i === v));"
        "const z = N.fieldThrough(at.map((v) => N.conjugateGradients(step, unit(v), unit(v), 1e-10)), n, at, [[1, 0], [0, 1], [-1, 0]]);"
        f"return [...z, ...N.fieldIndices(d, {n_fold}, z)]; }})(d.n, N.heatStep(d, {n_fold}, 1e4), {fixed})"
    )
    found = np.array(in_node(tmp_path, arrows_data(mesh), expression))
    z = found[: mesh.n_vertices] + 1j * found[mesh.n_vertices : 2 * mesh.n_vertices]
    wanted = smoothest_field(mesh, n_fold, fixed=fixed, values=values)
    assert np.allclose(z[fixed], values, atol=1e-8)
    assert np.abs(z - wanted).max() < 1e-3  # weights travel in single precision, and the time of the step is long, not endless
    indices = found[2 * mesh.n_vertices :]
    assert np.array_equal(indices, n_fold * field_indices(mesh, z, n_fold)) and indices.sum() == 2 * n_fold
    assert np.count_nonzero(indices) > 2


@needs_node
def test_a_heat_step_in_node_is_that_of_the_library(tmp_path):
    mesh = in_unit_area(coarse_copy(goat(), 300)[0])
    L, M = connection_laplacian(mesh, 2)
    z = np.random.default_rng(0).normal(size=2 * mesh.n_vertices).round(3)
    found = in_node(tmp_path, arrows_data(mesh), f"Array.from(N.heatStep(d, 2, 0.3)({z.tolist()}))")
    assert np.allclose(found, M @ z + 0.3 * (L @ z), atol=1e-3)


@needs_node
def test_in_a_short_time_the_nearer_arrow_decides_alone_and_in_a_long_one_both_have_a_say(tmp_path):
    mesh = in_unit_area(coarse_copy(goat(), 2500)[0])
    fixed = [int(mesh.vertices[:, 0].argmax()), int(mesh.vertices[:, 0].argmin())]
    expression = (
        "((n, at) => [0.02, 100].map((t) => { const step = N.heatStep(d, 1, t); const unit = (v) => Float64Array.from({ length: 2 * n }, (_, i) => +(i === v));"
        "const columns = at.map((v) => N.conjugateGradients(step, unit(v), unit(v))); const arrows = [[1, 0], [0, 1]];"
        "return [[0, 1], [0], [1]].map((which) => Array.from(N.fieldThrough(which.map((k) => columns[k]), n, which.map((k) => at[k]), which.map((k) => arrows[k]))));"
        f" }}))(d.n, {fixed})"
    )
    n, far = mesh.n_vertices, np.array([geodesic_distances(mesh, [vertex]) for vertex in fixed])
    medians = []
    for x in np.array(in_node(tmp_path, arrows_data(mesh), expression)):
        both, *alone = x[:, :n] + 1j * x[:, n:]
        gaps = np.degrees(np.abs(np.angle(both / np.array(alone))))
        medians.append([np.median(gaps[own][far[own] < 0.7 * far[1 - own]]) for own in (0, 1)])
    short, long = medians
    assert max(short) < 2 and max(long) > 5


def test_an_arrow_costs_least_where_the_field_already_pointed():
    mesh = in_unit_area(coarse_copy(goat(), 700)[0])
    L, _ = connection_laplacian(mesh)
    fixed = [int(mesh.vertices[:, 0].argmax()), int(mesh.vertices[:, 0].argmin())]
    z = smoothest_field(mesh, fixed=fixed, values=[1, 1j])
    for vertex in (100, 350, 600):
        energies = []
        for turn in np.radians([0, 30, -30, 180]):
            there = z[vertex] / abs(z[vertex]) * np.exp(1j * turn)
            field = smoothest_field(mesh, fixed=[*fixed, vertex], values=[1, 1j, there])
            x = np.concatenate([field.real, field.imag])
            energies.append(x @ (L @ x))
        assert energies[0] < min(energies[1:]) and energies[3] == max(energies)


def test_an_open_surface_has_no_euler_characteristic_to_keep_to():
    assert arrows_data(sphere(2)).facts["euler"] == 2
    assert "euler" not in arrows_data(spherical_cap(1.0, 6)).facts
    with pytest.raises(ValueError, match="mesh's number of vertices must be between 1 and 20000; got 40962"):
        arrows_data(sphere(6))


@needs_node
def test_a_polynomial_filter_in_node_is_that_of_the_modes(tmp_path):
    data = filter_data(120)
    evals, evecs, signals = (data.arrays[name].astype(np.float64) for name in ("evals", "evecs", "signals"))
    assert np.abs(evecs @ evecs.T - np.eye(120)).max() < 1e-5 and abs(evals[0]) < 1e-5 < evals[1]
    expression = (
        "((b, f) => { const g = N.polyline([1, 0.2, 0.7, 0], b); return N.chebyshevSum(N.chebyshev(g, 15, b), b,"
        " (u) => N.graphLaplacian(d.edges, d.weights, u), Float64Array.from(f)); })(d.evals[d.n - 1] * 1.001, d.signals.subarray(d.n, 2 * d.n))"
    )
    found = in_node(tmp_path, data, f"Array.from({expression})")
    b = 1.001 * evals[-1]
    g = chebyshev.Chebyshev.interpolate(lambda x: np.interp(x, np.linspace(0, b, 4), [1, 0.2, 0.7, 0]), 15, [0, b])
    assert np.allclose(found, evecs.T @ (g(evals) * (evecs @ signals[1])), atol=1e-5)


def test_the_cortex_of_the_lab_is_the_chapters_and_keeps_what_it_tells_the_reader():
    pytest.importorskip("nilearn", reason="nilearn carries the cortex; it is in the extra `book`")
    data = lab_files.cortex_data()
    waves = 2 * np.pi * data.facts["millimetres"] / np.sqrt(data.arrays["evals"][[1, 10, 50, 100, 200]].astype(float))
    assert waves.round().tolist() == [435, 157, 70, 49, 35]
    mass, c = data.arrays["mass"].astype(float), data.arrays["map_coefficients"].astype(float)
    f = data.arrays["maps"].astype(float)
    assert np.abs(f @ mass).max() < 1e-3
    rest = np.sqrt(1 - np.cumsum(c**2, axis=1) / (f**2 @ mass)[:, None])
    depth, thickness = rest[:, [10, 50, 100, 200]].round(2).tolist()
    print(depth, thickness)
    assert thickness[0] < 0.9 < depth[0]  # thickness falls at once, depth starts late
    assert depth[2] - depth[3] > 1.5 * (thickness[2] - thickness[3])  # and falls on


def test_poses_with_other_faces_are_refused():
    with pytest.raises(ValueError, match="poses must share their faces"):
        parts_data([egg(2), egg(1)], [2])
    with pytest.raises(ValueError, match="counts must be between 1 and 12; got 13"):
        parts_data([egg(2)], [13])


# --- a lab of one's own -----------------------------------------------------------------------------------------------


def registered(page: str) -> list[LabData]:
    """Return the data inside a page, as facts and packed arrays."""
    return [json.loads(text) for text in re.findall(r'<script>spectralNotes\.register\("[^"]+", (.*)\);\n</script>', page)]


@pytest.mark.parametrize(
    ("name", "meshes"),
    [
        ("eigenfunctions", [egg(2), sphere(2)]), ("reconstruction", [egg(3)]), ("heat", [egg(2)]), ("functional-map", [egg(2), egg(2)]),
        ("arrows", [egg(2)]), ("fourier", []), ("ends", []), ("bump-dent", []), ("filter", []),
    ],
)
def test_a_lab_of_ones_own_is_a_page_that_asks_nobody(name, meshes):
    page = labs.lab(name, *meshes, k=12 if meshes else None).page
    count = {"eigenfunctions": len(meshes), "bump-dent": 1, "filter": 1}.get(name, bool(meshes))
    assert len(registered(page)) == count
    assert f'<spectral-lab name="{name}"' in page
    assert not re.search(r'<(script|link|img)[^>]+(src|href)=', page)


def test_a_lab_is_stored_once_and_says_what_an_untrusted_notebook_must_do():
    made = labs.lab("heat", egg(2), k=12)
    assert len(repr(made)) < 100  # a notebook stores the representation beside the page
    shown = made._repr_html_()
    assert "choose File &gt; Trust Notebook" in shown.split("<iframe")[0]
    assert shown.count("<iframe") == 1


def test_a_lab_of_ones_own_takes_a_large_mesh_and_two_poses():
    page = labs.lab("functional-map", goat(), goat("walk"), k=20).page
    facts = registered(page)[0]["facts"]
    assert abs(facts["n_1"] - 4500) <= 1 and abs(facts["n_2"] - 4500) <= 1
    C = unpack_array(registered(page)[0]["arrays"]["C_12"])
    assert np.abs(C.T @ C - np.eye(20)).max() < 0.2
    parts = registered(labs.lab("clusters", goat(), goat("walk")).page)[0]
    assert parts["facts"]["poses"] == ["goat", "goat_walk"]


def test_a_lab_says_what_it_needs():
    with pytest.raises(ValueError, match="name must be one of 'eigenfunctions'"):
        labs.lab("drum", egg(2))
    with pytest.raises(ValueError, match="the number of meshes must be between 1 and 1; got 2"):
        labs.lab("heat", egg(2), egg(2))
    with pytest.raises(TypeError, match="meshes must be TriangleMesh; got ndarray"):
        labs.lab("heat", egg(2).vertices)
    with pytest.raises(ValueError, match="k must be at least 1; got 0"):
        labs.lab("heat", egg(1), k=0)
    with pytest.raises(ValueError, match="p2p_21 must be given"):
        labs.lab("functional-map", egg(2), egg(1))
    with pytest.raises(ValueError, match="meshes must share their faces"):
        labs.lab("clusters", egg(2), egg(1))
