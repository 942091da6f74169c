"""Decoding does not depend on the machine, and hostile bytes give errors: the parts of the codec one by one."""

from __future__ import annotations

import os
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.compression import bases, coefficients, decode, encode
from spectral_notes.compression.connectivity import NONE, Mends, decode_connectivity, encode_connectivity
from spectral_notes.compression.file_format import Place, front, pack
from spectral_notes.compression.positions import Head, code_of, step_of
from spectral_notes.compression.range_coder import Coder, CorruptStreamError
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, rectangle, sphere, torus

DATA = Path(__file__).parents[1] / "data"


def noisy_torus() -> TriangleMesh:
    mesh = torus(40, 30)
    rng = np.random.default_rng(1)
    return TriangleMesh(mesh.vertices + 0.01 * rng.normal(size=mesh.vertices.shape), mesh.faces)


SHAPES = {"torus": noisy_torus, "egg": lambda: egg(subdivisions=4), "sphere": lambda: sphere(subdivisions=3)}


@pytest.fixture(scope="module", params=SHAPES)
def coded(request) -> tuple[bytes, TriangleMesh]:
    """A file and its mesh; egg and sphere are subdivided icosahedra, with eigenvalues repeated exactly."""
    data = encode(SHAPES[request.param](), error=0.01, codec="spectral")
    return data, decode(data)


def assert_same(one: TriangleMesh, two: TriangleMesh) -> None:
    size = np.linalg.norm(np.ptp(one.vertices, axis=0))
    assert np.array_equal(one.faces, two.faces)
    assert np.linalg.norm(one.vertices - two.vertices, axis=1).max() < 1e-6 * size


def test_eigenvectors_off_by_1e_13_change_nothing(coded, monkeypatch):
    data, mesh = coded
    exact, rng = bases.patch_basis, np.random.default_rng(0)
    monkeypatch.setattr(
        bases, "patch_basis", lambda W, i: exact(W, i) + 1e-13 * rng.normal(size=(len(i), len(i)))
    )
    assert_same(decode(data), mesh)


@pytest.mark.parametrize("driver", ["ev", "evr", "evx"])
def test_another_eigensolver_changes_nothing(coded, monkeypatch, driver):
    data, mesh = coded
    eigh = scipy.linalg.eigh
    monkeypatch.setattr(scipy.linalg, "eigh", lambda Q, **options: eigh(Q, **{**options, "driver": driver}))
    assert_same(decode(data), mesh)


def test_without_the_seeded_diagonal_another_eigensolver_gives_another_mesh(monkeypatch):
    """The control of the two tests above: it is the perturbation that makes decoding exact."""
    monkeypatch.setattr(bases, "EPSILON", 0.0)
    data = encode(sphere(subdivisions=3), error=0.01, codec="spectral")
    mesh, eigh = decode(data), scipy.linalg.eigh
    monkeypatch.setattr(scipy.linalg, "eigh", lambda Q, **options: eigh(Q, **{**options, "driver": "evr"}))
    assert np.abs(decode(data).vertices - mesh.vertices).max() > 1e-6


@pytest.mark.parametrize("threads", ["1", "2"])
def test_the_number_of_threads_changes_nothing(coded, tmp_path, threads):
    data, mesh = coded
    (tmp_path / "mesh.sgn").write_bytes(data)
    code = (
        "import sys, numpy as np; from spectral_notes.compression import decode;"
        "m = decode(open(sys.argv[1], 'rb').read()); np.savez(sys.argv[2], V=m.vertices, F=m.faces)"
    )
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "MKL_NUM_THREADS": threads}
    subprocess.run([sys.executable, "-c", code, tmp_path / "mesh.sgn", tmp_path / "out.npz"], check=True, env=environment)
    with np.load(tmp_path / "out.npz") as out:
        assert_same(TriangleMesh(out["V"], out["F"]), mesh)


def test_the_integers_of_a_file_are_the_same_when_rounding_differs(monkeypatch):
    """The predictions of the entropy coder see integers only: another basis cannot move them."""
    data = encode(sphere(subdivisions=3), error=0.01, codec="spectral")
    seen: list[list[np.ndarray]] = [[], []]
    classes, exact = coefficients.Contexts.classes, bases.patch_basis
    for run in (0, 1):

        def spy(self, run=run):
            seen[run].append(classes(self))
            return seen[run][-1]

        monkeypatch.setattr(coefficients.Contexts, "classes", spy)
        if run:
            monkeypatch.setattr(bases, "patch_basis", lambda W, i: exact(W, i) * (1 + 1e-9))
        decode(data)
    assert len(seen[0]) == len(seen[1]) > 100
    assert all(np.array_equal(a, b) for a, b in zip(*seen, strict=True))


def test_the_rounded_constants_are_far_from_a_tie():
    """Machines may differ in the last bit of a power; no constant of the format may hang on it."""
    bounds = 2.0 ** (2.75 + np.arange(80) / 2)
    small = bounds[bounds < 2**40]
    assert np.abs(small - np.floor(small) - 0.5).min() > 1e-3
    mean = 2.0 ** ((np.arange(20) - 12.5) / 2)
    x = mean / (1 + np.sqrt(1 + mean * mean))
    p = np.stack([[[(2 if k else 1) * t ** max(2 * k - q, 0) for k in range(16)] for q in (0, 1)] for t in x])
    wanted = 1000 * p / p.sum(axis=2, keepdims=True)
    assert np.abs(wanted - np.floor(wanted) - 0.5).min() > 1e-6
    assert np.array_equal(coefficients.COUNTS, 1 + np.rint(wanted))


@pytest.mark.parametrize("size", [7, 50, 10_000])
def test_patches_cover_every_vertex_once_and_stay_small(size):
    mesh = noisy_torus()
    parts = bases.partition(graph_of(mesh), size)
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(mesh.n_vertices))
    assert max(map(len, parts)) < 2 * size and min(map(len, parts)) >= min(size, mesh.n_vertices)


def test_patches_of_pieces_are_equal_in_size():
    one, n = noisy_torus(), 1200
    two = TriangleMesh(np.r_[one.vertices, one.vertices + 3], np.r_[one.faces, one.faces + n])
    sizes = [len(i) for i in bases.partition(graph_of(two), 500)]
    assert sum(sizes) == 2400 and max(sizes) - min(sizes) <= 1


def test_cells_cover_everything_and_average():
    domain = bases.Domain(noisy_torus().faces, 1200)
    means = domain.means(np.ones((1200, 3)))
    assert np.array_equal(np.unique(domain.label), np.arange(len(means)))
    assert domain.coarse.n == len(means) < 1200 / 8
    assert np.abs(means - 1).max() < 1e-12


def test_a_lift_of_a_plane_is_the_plane():
    """Away from the rim; the mean of every cell is kept where the lift is stiff."""
    square = rectangle(1.0, 1.0, 20)
    domain = bases.Domain(square.faces, square.n_vertices)
    X = np.c_[square.vertices, np.zeros(square.n_vertices)][:, :3]
    lifted = domain.lift(domain.means(X), 0)
    assert np.abs(domain.means(lifted) - domain.means(X)).max() < 0.02
    assert np.abs(lifted[:, 2]).max() < 1e-12


def test_a_transform_is_orthonormal_and_frames_are_rotations():
    mesh = noisy_torus()
    domain = bases.Domain(mesh.faces, 1200)
    h = np.random.default_rng(2).normal(size=(1200, 3))
    c = domain.fine.forward(h)
    assert abs((c**2).sum() - (h**2).sum()) < 1e-9
    assert np.abs(domain.fine.inverse(c) - h).max() < 1e-12
    R = domain.frames(mesh.vertices)
    assert np.abs(np.einsum("nij,nkj->nik", R, R) - np.eye(3)).max() < 1e-12


@pytest.mark.parametrize("flat", [True, False])
def test_frames_exist_where_normals_vanish(flat):
    """Two faces on the same vertices with opposite orientation: every normal cancels."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) * (1 if flat else 0)
    R = bases.Domain(np.array([[0, 1, 2], [0, 2, 1]]), 3).frames(vertices)
    assert np.abs(np.einsum("nij,nkj->nik", R, R) - np.eye(3)).max() < 1e-9


def path(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The indices and multiples of columns (rows, columns), as patches of one axis."""
    c = np.stack([x, x, x], axis=1)
    k, value = coefficients.best_path(c, np.full(c.shape, 30))
    return k[:, 0], value[:, 0]


def test_the_trellis_gains_a_decibel_over_a_uniform_quantiser(monkeypatch):
    monkeypatch.setattr(coefficients, "TRADE", 0.0)
    x = 30 * np.random.default_rng(0).normal(size=(300, 50))
    error = ((x - path(x)[1]) ** 2).mean()
    assert 1.0 < 10 * np.log10((2**2 / 12) / error) < 1.53  # 1.53 dB is the most any quantiser can gain


def test_the_decoder_follows_the_encoders_path():
    """The multiple of each step is what the state's quantiser makes of the index, and the state moves by parity."""
    x = 3 * np.random.default_rng(0).normal(size=(40, 5))
    x[::3] = 0  # where a zero is given a sign, or none, the parity must still be the path's
    k, value = path(x)
    for column in range(5):
        state = 0
        for row in range(40):
            quantiser, index = coefficients.QUANTISER[state], k[row, column]
            assert value[row, column] == 2 * index - quantiser * np.sign(index)
            state = coefficients.NEXT[state][index & 1]


@settings(max_examples=50)
@given(st.lists(st.tuples(st.integers(0, 80), st.integers(0, 1), st.integers(-(2**43), 2**43)), max_size=60))
def test_symbols_come_back_from_the_range_coder(symbols):
    coder, tables = Coder(), coefficients.Tables()
    assert [tables.code(coder, *symbol) for symbol in symbols] == [k for _, _, k in symbols]
    coder, tables = Coder(coder.finish()), coefficients.Tables()
    assert [tables.code(coder, level, quantiser) for level, quantiser, _ in symbols] == [k for _, _, k in symbols]


@settings(max_examples=50)
@given(st.lists(st.integers(-(2**55), 2**55), max_size=30), st.lists(st.integers(0, 4), max_size=300))
def test_integers_and_tables_come_back(integers, symbols):
    coder, table = Coder(), [1, 1, 1, 1, 1, 5]
    for value in integers:
        coder.signed(value)
        coder.bits(57, value & (2**57 - 1))
    for symbol in symbols:
        coder.symbol(table, symbol)
    coder, table = Coder(coder.finish()), [1, 1, 1, 1, 1, 5]
    for value in integers:
        assert (coder.signed(), coder.bits(57)) == (value, value & (2**57 - 1))
    assert [coder.symbol(table) for _ in symbols] == symbols


def test_a_skewed_source_costs_its_entropy():
    coder, table = Coder(), [*[1] * 8, 8]
    rng = np.random.default_rng(0)
    symbols = (rng.random(20_000) < 0.05).astype(int) * 3
    for symbol in symbols.tolist():
        coder.symbol(table, symbol)
    p = (symbols > 0).mean()
    entropy = -p * np.log2(p) - (1 - p) * np.log2(1 - p)
    assert entropy < 8 * len(coder.finish()) / 20_000 < 1.06 * entropy


def test_data_that_end_too_early_are_noticed():
    coder = Coder()
    for _ in range(50):
        coder.bits(16, 12345)
    coder = Coder(coder.finish()[:20])
    with pytest.raises(CorruptStreamError, match="the data end too early"):
        [coder.bits(16) for _ in range(50)]


@settings(max_examples=50)
@given(st.floats(2.0**-59, 15.0))
def test_steps_are_rounded_down_by_less_than_a_thousandth(step):
    assert 0.9993 * step < step_of(code_of(step)) <= step * (1 + 1e-9)


@settings(max_examples=50)
@given(st.integers(-332, 332), st.lists(st.integers(-(2**52), 2**52), min_size=3, max_size=3))
def test_heads_and_places_come_back(exponent, corner):
    place, head, coder = Place(exponent, tuple(corner)), Head(12345, 67, 8, 2), Coder()
    mends = Mends(np.array([3, 7, 8]), np.array([1, 0, 2]), 4)
    assert front(coder, place, mends, True, 100)[0] == place
    assert head.code(coder) == head
    coder = Coder(coder.finish())
    back, again, spectral = front(coder, Place(), NONE, False, 100)
    assert (back, spectral, again.lone, Head().code(coder)) == (place, True, 4, head)
    assert again.again.tolist() == [3, 7, 8] and again.twin.tolist() == [1, 0, 2]


def resealed(data: bytes, at: int, value: bytes) -> bytes:
    """The file with bytes replaced and the checksum made right again: what an attacker can do."""
    body = data[8:at] + value + data[at + len(value) :]
    return data[:4] + zlib.crc32(body).to_bytes(4, "little") + body


def graph_of(mesh: TriangleMesh) -> sp.csr_array:
    return bases.graph(mesh.faces.ravel(), mesh.faces[:, [1, 2, 0]].ravel(), mesh.n_vertices)


@pytest.fixture(scope="module")
def small() -> bytes:
    return encode(egg(subdivisions=2), error=0.1, codec="spectral")


def test_every_flipped_bit_is_noticed(small):
    for bit in range(0, 8 * len(small), 7):
        changed = bytearray(small)
        changed[bit // 8] ^= 1 << bit % 8
        with pytest.raises(CorruptStreamError):
            decode(bytes(changed))


def test_every_missing_end_is_noticed_and_opened_on_request_only_after_the_base(small):
    opened = 0
    for length in range(0, len(small), 4):
        with pytest.raises(CorruptStreamError):
            decode(small[:length])
        try:
            mesh = decode(small[:length], progressive=True)
        except CorruptStreamError:
            assert not opened, "once it opens, more bytes must not close it"
        else:
            opened += 1
            assert mesh.n_vertices == 162 and np.isfinite(mesh.vertices).all()
    assert opened > 5


@settings(max_examples=100)
@given(st.data())
def test_resealed_changes_give_a_mesh_or_a_clear_error(small, data):
    at = data.draw(st.integers(8, len(small) - 1))
    value = data.draw(st.binary(min_size=1, max_size=8))
    changed = resealed(small, at, value[: len(small) - at])
    try:
        mesh = decode(changed, max_vertices=10_000)
    except ValueError:
        return  # a clear error; anything else would fail this test
    else:
        assert np.isfinite(mesh.vertices).all()


@settings(max_examples=200)
@given(st.binary(max_size=200))
def test_random_bytes_are_refused(junk):
    for data in (junk, b"SGN\x04" + junk, b"SGN\x04" + zlib.crc32(junk).to_bytes(4, "little") + junk):
        with pytest.raises(CorruptStreamError, match=r"^(a|data|the) "):
            decode(data)


def test_a_small_file_cannot_announce_a_large_mesh(small):
    stream = bytearray(encode_connectivity(egg(subdivisions=2).faces, 162).stream)
    huge = bytes([stream[0]]) + b"\x80\x80\x80\x80\x08" + bytes(stream[3:])
    with pytest.raises(CorruptStreamError, match="data announces 2147483648 vertices and"):
        decode_connectivity(huge, NONE, 2**24)
    with pytest.raises(CorruptStreamError, match="data announces 162 vertices and 320 faces: more than"):
        decode(small, max_vertices=20)


def spectral(stream: bytes | None = None, mends: Mends = NONE, write=lambda coder: None, softness: int = 2) -> bytes:
    """A file of an egg whose payload goes on as `write` says."""
    coder = Coder()
    front(coder, Place(), mends, True, 2**24)
    Head(10000, 50, softness, 0).code(coder)
    write(coder)
    return pack(stream or encode_connectivity(egg(subdivisions=1).faces, 42).stream, coder.finish())


def escapes(coder: Coder) -> None:
    for _ in range(70):
        coder.bits(1, 1)


def no_coefficients(*after: int):
    def write(coder: Coder) -> None:
        for value in (0, 0, *after):
            coder.unsigned(value)
    return write


def far_correction(coder: Coder) -> None:
    no_coefficients(1)(coder)
    coder.bits(16, 10000)
    coder.unsigned(500)


def huge_coefficient(coder: Coder) -> None:
    coder.unsigned(1)
    level = int(coefficients.Contexts(1).classes()[0, 0])
    coder.symbol(coefficients.Tables()._tables[level][0], coefficients.TOKENS - 1)
    coder.unsigned(2**50)


def mends(*values: int) -> bytes:
    """A file whose mends are these integers: vertices without a face, how many are joined, then gap after gap."""
    coder = Coder()
    coder.bits(10, 512)  # a place of size one at the origin
    for _ in range(3):
        coder.signed(0)
    for i, value in enumerate(values):
        if i == 2:
            coder.bits(5, 0)
        coder.unsigned(value)
    return pack(encode_connectivity(egg(subdivisions=1).faces, 42).stream, coder.finish() + bytes(20))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"PLY", "data does not start with 'SGN'"),
        (b"SGN\x02", "data ends after 4 bytes, inside the header"),
        (b"SGN\x05" + bytes(20), "data is of version 5; this library reads version 4: decode it with the release that"),
        (b"SGN\x11" + bytes(20), "data is of version 1; this library reads version 4: decode it with the release that"),
        (b"SGN\x04" + bytes(20), "data does not match its checksum: bytes were changed or are missing"),
        (resealed(spectral(), 8, b"\xff"), "data ends inside the connectivity"),
        (spectral(softness=55), "the base is softer than any encoder makes it"),
        (spectral(write=escapes), "a coded integer is longer than any encoder writes"),
        (spectral(write=lambda coder: coder.unsigned(10**6)), "a block has more rows than its patches have modes"),
        (spectral(write=huge_coefficient), "a coefficient is larger than any encoder writes"),
        (spectral(write=no_coefficients(500)), "the corrections are more than there are vertices"),
        (spectral(write=far_correction), "the corrections name a vertex that is not there"),
        (spectral(stream=b"\1\2\3\4"), "the connectivity is not a Draco stream"),
        (spectral(stream=b"\1\x80"), "the connectivity ends inside a number"),
        (mends(2**25, 0), "the list of joined vertices is longer than the mesh allows"),
        (mends(0, 1, 2**41), "the list of joined vertices does not fit the mesh"),
        (spectral(mends=Mends(np.array([90]), np.array([0]), 0)), "the connectivity names vertices it does not have"),
        (spectral(mends=Mends(np.array([5]), np.array([41]), 0)), "the connectivity joins vertices it does not have"),
        (spectral(mends=Mends(np.array([1]), np.array([0]), 0)), "the connectivity names a vertex twice in a face"),
    ],
)
def test_decode_says_what_is_wrong(data, message):
    with pytest.raises(CorruptStreamError, match=message):
        decode(data)


def test_a_file_of_no_coefficients_is_a_mesh():
    """The control of the cases above."""
    assert decode(spectral(write=no_coefficients(0))).n_faces == 80


@pytest.mark.parametrize(("version", "start"), [(1, b"SGN\x10"), (2, b"SGN\x02"), (3, b"SGN\x03")])
def test_files_of_older_versions_are_refused_by_name(version, start):
    with pytest.raises(CorruptStreamError, match=f"data is of version {version}; this library reads version 4"):
        decode(start + bytes(100))


def test_decode_wants_bytes_and_a_sensible_limit(small):
    with pytest.raises(TypeError, match="data must be bytes; got str"):
        decode("mesh.sgn")
    with pytest.raises(ValueError, match="max_vertices must be between 1 and"):
        decode(small, max_vertices=0)


@pytest.mark.parametrize("name", ["sphere", "potato", "drum"])
def test_files_written_elsewhere_decode_to_the_vertices_they_had_there(name):
    """Files of one machine and one release of SciPy, kept: every other machine and release must read the same mesh."""
    kept = np.load(DATA / f"{name}.npz")
    mesh = decode((DATA / f"{name}.sgn").read_bytes())
    np.testing.assert_array_equal(mesh.faces, kept["faces"])
    diagonal = np.linalg.norm(np.ptp(kept["vertices"], axis=0))
    assert np.abs(mesh.vertices - kept["vertices"]).max() < 1e-6 * diagonal
