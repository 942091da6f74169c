"""Decoding does not depend on the machine, and hostile bytes give errors: the parts of the codec one by one."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.compression import basis, contexts, decode, describe, encode, patches, sgn_format, tables, trellis
from spectral_notes.compression.coefficients import Head
from spectral_notes.compression.connectivity import decode_connectivity, encode_connectivity, pack_varint, unpack_varint
from spectral_notes.compression.range_coder import CorruptStreamError, RangeDecoder, RangeEncoder, Table
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, sphere, torus

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
    exact, rng = basis.patch_basis, np.random.default_rng(0)
    monkeypatch.setattr(
        basis, "patch_basis", lambda W, i: exact(W, i) + 1e-13 * rng.normal(size=(len(i), len(i)))
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
    monkeypatch.setattr(basis, "EPSILON", 0.0)
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
    predict, exact = contexts.predict, basis.patch_basis
    for run in (0, 1):

        def spy(logs, row, axis, run=run):
            seen[run].append(predict(logs, row, axis))
            return seen[run][-1]

        monkeypatch.setattr(contexts, "predict", spy)
        if run:
            monkeypatch.setattr(basis, "patch_basis", lambda W, i: exact(W, i) * (1 + 1e-9))
        decode(data)
    assert len(seen[0]) == len(seen[1]) > 100
    assert all(np.array_equal(a, b) for a, b in zip(*seen, strict=True))


def test_the_rounded_logarithms_are_far_from_a_tie():
    exact = contexts.OCTAVE * np.log2(1 + np.arange(128) / 128)
    assert np.abs(exact - np.floor(exact) - 0.5).min() > 1e-6
    x = np.array([1, 2, 3, 255, 256, 257, 10**6, 2**40 + 12345])
    assert np.abs(contexts.log2_fixed(x) / 64 - np.log2(x)).max() < 0.02


@pytest.mark.parametrize("size", [7, 50, 10_000])
def test_patches_cover_every_vertex_once_and_stay_small(size):
    mesh = noisy_torus()
    parts = patches.partition(patches.adjacency(mesh.faces, mesh.n_vertices), size)
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(mesh.n_vertices))
    assert max(map(len, parts)) <= size


def test_cells_touch_their_seed_and_cover_everything():
    W = patches.adjacency(noisy_torus().faces, 1200)
    cells = patches.cells(W, 3)
    assert cells.label.min() == 0 and cells.label.max() + 1 == cells.graph.shape[0] < 1200 / 8
    assert np.array_equal(cells.means(np.ones((1200, 3))), np.ones((cells.graph.shape[0], 3)))


def test_a_transform_is_orthonormal_and_frames_are_rotations():
    mesh = noisy_torus()
    transform = basis.make_transform(patches.adjacency(mesh.faces, 1200), 500)
    h = np.random.default_rng(2).normal(size=(1200, 3))
    c = transform.forward(h)
    assert abs((c**2).sum() - (h**2).sum()) < 1e-9
    assert np.abs(transform.inverse(c) - h).max() < 1e-12
    R = basis.frames(mesh.vertices, mesh.faces, transform.patches)
    assert np.abs(np.einsum("nij,nkj->nik", R, R) - np.eye(3)).max() < 1e-12


@pytest.mark.parametrize("flat", [True, False])
def test_frames_exist_where_normals_vanish(flat):
    """Two faces on the same vertices with opposite orientation: every normal cancels."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) * (1 if flat else 0)
    R = basis.frames(vertices, np.array([[0, 1, 2], [0, 2, 1]]), [np.arange(3)])
    assert np.abs(np.einsum("nij,nkj->nik", R, R) - np.eye(3)).max() < 1e-9


def test_the_trellis_gains_a_decibel_over_a_uniform_quantiser():
    x = 30 * np.random.default_rng(0).normal(size=(300, 50))
    k, quantiser = trellis.best_path(x, np.zeros(x.shape, dtype=np.int64), np.zeros((1, 2, 500)), 0.0)
    error = ((x - trellis.multiple(k, quantiser)) ** 2).mean()
    assert 1.0 < 10 * np.log10((2**2 / 12) / error) < 1.53  # 1.53 dB is the most any quantiser can gain


def test_the_decoder_follows_the_encoders_path():
    """The quantiser of each step is the state's, and the state moves by parity."""
    x = 3 * np.random.default_rng(0).normal(size=(40, 5))
    x[10, 2] = np.nan
    x[::3] = 0  # where a zero is given a sign, or none, the parity must still be the path's
    k, quantiser = trellis.best_path(x, np.zeros(x.shape, dtype=np.int64), np.zeros((1, 2, 500)), 0.05)
    for column in range(5):
        state = 0
        for row in range(40):
            if not np.isnan(x[row, column]):
                assert quantiser[row, column] == trellis.QUANTISER[state]
                state = trellis.NEXT[state][k[row, column] & 1]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 43), st.integers(0, 1), st.integers(-(10**6), 10**6)), max_size=60))
def test_symbols_come_back_from_the_range_coder(symbols):
    coder, tables = RangeEncoder(), contexts.Tables()
    for symbol in symbols:
        tables.encode(coder, *symbol)
    decoder, tables = RangeDecoder(coder.finish()), contexts.Tables()
    assert [tables.decode(decoder, level, quantiser) for level, quantiser, _ in symbols] == [k for _, _, k in symbols]
    assert not decoder.overrun


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 2**39), max_size=30), st.lists(st.integers(0, 4), max_size=300))
def test_integers_and_tables_come_back(integers, symbols):
    coder, table = RangeEncoder(), Table([1, 1, 1, 1, 1])
    for value in integers:
        coder.put_unsigned(value)
    for symbol in symbols:
        table.encode(coder, symbol)
    decoder, table = RangeDecoder(coder.finish()), Table([1, 1, 1, 1, 1])
    assert [decoder.get_unsigned() for _ in integers] == integers
    assert [table.decode(decoder) for _ in symbols] == symbols


def test_a_skewed_source_costs_its_entropy():
    coder, table = RangeEncoder(), Table([1] * 8)
    rng = np.random.default_rng(0)
    symbols = (rng.random(20_000) < 0.05).astype(int) * 3
    for symbol in symbols.tolist():
        table.encode(coder, symbol)
    p = (symbols > 0).mean()
    entropy = -p * np.log2(p) - (1 - p) * np.log2(1 - p)
    assert entropy < 8 * len(coder.finish()) / 20_000 < 1.06 * entropy


def test_varints_come_back():
    for value in (0, 127, 128, 300, 2**31):
        assert unpack_varint(pack_varint(value), 0) == (value, len(pack_varint(value)))
    with pytest.raises(CorruptStreamError, match="the file ends inside a number"):
        unpack_varint(b"\x80", 0)


def resealed(data: bytes, at: int, value: bytes) -> bytes:
    """The file with bytes replaced and the outer checksum made right again: what an attacker can do."""
    body = data[8:at] + value + data[at + len(value) :]
    return data[:4] + zlib.crc32(body).to_bytes(4, "little") + body


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


@settings(max_examples=100, deadline=None)
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


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200))
def test_random_bytes_are_refused(junk):
    for data in (junk, b"SGN\x11" + junk, b"SGN\x10" + zlib.crc32(junk).to_bytes(4, "little") + junk):
        with pytest.raises(CorruptStreamError, match=r"^(data|the) "):
            decode(data)


def test_a_small_file_cannot_announce_a_large_mesh(small):
    stream = bytearray(encode_connectivity(egg(subdivisions=2).faces, 162).stream)
    huge = bytes([stream[0]]) + pack_varint(2**31) + bytes(stream[3:])
    with pytest.raises(CorruptStreamError, match="data announces 2147483648 vertices and"):
        decode_connectivity(huge, b"", 2**24)
    with pytest.raises(CorruptStreamError, match="data announces 162 vertices and 320 faces; 60 fit its size and limit"):
        decode(small, max_vertices=20)


def spectral(**changes: bytes) -> bytes:
    sections, _ = sgn_format.unpack(encode(egg(subdivisions=1), error=1, codec="spectral"), progressive=False)
    return sgn_format.pack(sgn_format.Sections(**{**vars(sections), **changes}))


ESCAPES = RangeEncoder()
for _ in range(50):
    ESCAPES.put_bits(1, 1)
MANY_ROWS = RangeEncoder()
MANY_ROWS.put_unsigned(10**6)
FAR = RangeEncoder()
for value in (0, 500):
    FAR.put_unsigned(value)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"PLY", "data does not start with 'SGN'"),
        (b"SGN\x11", "data ends after 4 bytes, inside the header"),
        (b"SGN\x21" + bytes(20), "data is of version 2; this library reads version 1"),
        (b"SGN\x13" + bytes(20), "data holds a mesh of unknown kind 3"),
        (b"SGN\x11" + bytes(20), "data does not match its checksum: bytes were changed or are missing"),
        (spectral(head=struct.pack("<ffBB", np.nan, 1, 0, 1)), "the head of the file holds numbers that no encoder writes"),
        (spectral(base=ESCAPES.finish()), "a coded integer is longer than any encoder writes"),
        (spectral(base=MANY_ROWS.finish()), "a block has more rows than its patches have modes"),
        (spectral(corrections=b"\0\0\x80\x3f" + FAR.finish()), "the corrections name a vertex that is not there"),
        (spectral(corrections=b"\0\0\0\0" + FAR.finish()), "the corrections are more than there are vertices"),
        (spectral(stream=b"\1\2\3"), "the connectivity is not a Draco stream"),
        (spectral(mends=pack_varint(3)), "the file ends inside a number"),
        (spectral(mends=pack_varint(99) + pack_varint(0)), "the list of joined vertices is longer than the file allows"),
        (spectral(mends=b"\1\0\x50\1"), "the list of joined vertices does not fit the connectivity"),
        (spectral(mends=b"\1\0\1\x50"), "the connectivity joins a vertex to one that is not there"),
    ],
)
def test_decode_says_what_is_wrong(data, message):
    with pytest.raises(CorruptStreamError, match=message):
        decode(data)


def test_lengths_that_do_not_add_up_are_refused(small):
    with pytest.raises(CorruptStreamError, match=r"data has \d+ bytes where its lengths say"):
        decode(resealed(small, 8, b"\x05"))


def test_a_changed_base_is_noticed_even_with_the_outer_checksum_right(small):
    sections, _ = sgn_format.unpack(small, progressive=False)
    at = small.index(sections.base) + 1
    with pytest.raises(CorruptStreamError, match="data does not match the checksum of its base"):
        decode(resealed(small, at, bytes([small[at] ^ 1])))


def test_decode_wants_bytes_and_a_sensible_limit(small):
    with pytest.raises(TypeError, match="data must be bytes; got str"):
        decode("mesh.sgn")
    with pytest.raises(ValueError, match="max_vertices must be between 1 and"):
        decode(small, max_vertices=0)


def test_the_constants_have_the_form_the_coder_needs():
    assert [w.shape for w in tables.WEIGHTS] == [(12,), (12,)]
    assert all(len(t) == 16 and min(t) >= 1 for pair in tables.COUNTS for t in pair)
    assert describe(encode(egg(subdivisions=1), error=1)).n_faces == 80
    assert Head.unpack(Head(1.0, 1.0, 0, 1).pack()) == Head(1.0, 1.0, 0, 1)


@pytest.mark.parametrize("name", ["sphere", "potato", "drum"])
def test_files_written_elsewhere_decode_to_the_vertices_they_had_there(name):
    """Files of one machine and one release of SciPy, kept: every other machine and release must read the same mesh."""
    kept = np.load(DATA / f"{name}.npz")
    mesh = decode((DATA / f"{name}.sgn").read_bytes())
    np.testing.assert_array_equal(mesh.faces, kept["faces"])
    diagonal = np.linalg.norm(np.ptp(kept["vertices"], axis=0))
    assert np.abs(mesh.vertices - kept["vertices"]).max() < 1e-6 * diagonal
