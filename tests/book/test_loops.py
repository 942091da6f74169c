"""The pictures that move: what they say is so, they are small, and every page that names one finds it."""

from __future__ import annotations

import re

import loop_files
import notebooks
import numpy as np
import pytest
from PIL import Image

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh, edge_lengths
from spectral_notes.shapes import sphere, spherical_cap

NAMED = re.compile(r"```\{figure\} _static/loops/([\w-]+)\.png\n((?::.*\n)+)\n(.+?)```", re.DOTALL)


def test_every_loop_is_a_figure_of_a_chapter_with_words_and_every_such_figure_a_loop():
    found = {}
    for path in notebooks.find_notebooks([]):
        for cell in notebooks.read(path).cells:
            for name, options, caption in NAMED.findall(cell.source):
                assert f":name: {name}\n:figclass: loop\n" in options, name
                assert len(re.search(":alt: (.+)", options)[1]) > 60 and len(caption) > 60, name
                assert path.stem[:2] == name[4:6], name
                found[name] = path.stem
    assert set(found) == set(loop_files.LOOPS)


def test_a_string_whose_end_is_held_more_rises_from_half_tones_to_whole_ones():
    tones = np.array([loop_files.string_modes(1.0, held)[0] / np.pi for held in np.linspace(0, 1, 11)])
    assert np.allclose(tones[0, :3], [0.5, 1.5, 2.5], atol=5e-3) and np.allclose(tones[-1, :3], [1, 2, 3], atol=5e-3)
    assert (np.diff(tones, axis=0) > 0).all()
    assert np.allclose(loop_files.string_modes(0.0, 0.0)[0][:3] / np.pi, [0, 1, 2], atol=1e-3)


@pytest.mark.parametrize("n", [5, 6, 7])
def test_folded_triangles_stay_equilateral_and_close(n):
    fans = [loop_files.fan(n, part) for part in (0, 0.3, 0.7, 1)]
    for mesh in fans:
        assert np.allclose(edge_lengths(mesh), 1, atol=1e-12)
    first, last = fans[-1].vertices[[1, n + 1]]
    assert np.allclose(first, last, atol=1e-9), "it does not close"
    assert np.allclose(fans[0].vertices[:, 2], 0), "it does not begin flat"
    signs = np.sign(np.round(fans[-1].vertices[1:-1, 2], 9))
    assert {5: (signs == -1).all(), 6: (signs == 0).all(), 7: (signs == np.roll(signs, 1)).sum() == n - 4}[n]


def test_no_edge_of_the_cap_changes_its_length_on_the_way_in():
    lengths = [edge_lengths(spherical_cap(rings_pushed_in=k)) for k in range(28)]
    assert np.ptp(lengths, axis=0).max() < 1e-14
    assert max(spherical_cap(rings_pushed_in=k).vertices[:, 2].min() for k in range(28)) >= 0.2  # inside the picture's box


def test_an_arrow_carried_round_three_right_angles_is_turned_by_one():
    places, arrows = map(np.array, zip(*(loop_files.carried(part) for part in np.linspace(0, 1, 61)), strict=True))
    assert np.allclose(np.linalg.norm(places, axis=1), 1) and np.allclose(np.linalg.norm(arrows, axis=1), 1)
    assert np.allclose((places * arrows).sum(axis=1), 0), "the arrow leaves the ball"
    assert np.allclose(places[[0, 20, 40, 60]], [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]])
    assert np.allclose(arrows[[0, 60]], [[0, 0, 1], [0, -1, 0]])
    steps = np.linalg.norm(np.diff(arrows, axis=0), axis=1)
    assert steps.max() < 0.09, "it jumps"
    turn = 3 * np.pi / 2 - np.pi  # the excess of the triangle is its area, an eighth of the ball
    assert np.isclose(turn, 4 * np.pi / 8) and np.isclose(np.arccos(arrows[0] @ arrows[-1]), turn)


@pytest.mark.parametrize(("x", "order"), [(0.75, "yzx"), (0.93, "yxz"), (1.5, "xyz")])
def test_the_longest_axis_has_the_lowest_mode(x, order):
    ball = sphere(4)
    mesh = TriangleMesh(ball.vertices * [x, 1.0, 0.85], ball.faces)
    basis = compute_eigenbasis(*cotan_laplacian(mesh), 4)
    along = np.abs(basis.analyze(mesh.vertices)[1:])
    assert "".join("xyz"[axis] for axis in along.argmax(axis=1)) == order


def test_a_loop_is_written_for_both_themes_with_its_still_and_where_its_surface_lies(tmp_path):
    frames = [np.full((40, 60, 3), 255, dtype=np.uint8) for _ in range(4)]
    for k, frame in enumerate(frames):
        frame[10:30, 8 + 8 * k : 24 + 8 * k] = (200, 30, 30)
    loop_files.write_loop("fig-x", loop_files.Loop(lambda: frames, 2, 50, surface=0.5), tmp_path)
    for ending, ground in (("", 255), ("-dark", 18)):
        with Image.open(tmp_path / f"fig-x{ending}.webp") as moving:
            assert (moving.n_frames, moving.info["loop"], moving.size) == (4, 0, (60, 40))
            assert abs(int(np.asarray(moving.convert("RGB"))[2, 55, 0]) - ground) < 6
    with Image.open(tmp_path / "fig-x.png") as still:
        assert np.array_equal(np.asarray(still), frames[2])
    assert (tmp_path / "fig-x.js").read_text(encoding="utf-8") == '({"pictures": [{"box": [0.0, 0.0, 0.5, 1.0]}]})\n'


def test_a_loop_that_weighs_too_much_loses_detail_and_then_is_refused(tmp_path, monkeypatch):
    noise = np.random.default_rng(0).integers(0, 256, (3, 64, 64, 3), dtype=np.uint8)
    images = [Image.fromarray(frame) for frame in noise]
    loop_files.save(images, tmp_path / "a.webp", 50)
    size = (tmp_path / "a.webp").stat().st_size
    monkeypatch.setattr(loop_files, "MAX_BYTES", size - 1)
    loop_files.save(images, tmp_path / "b.webp", 50)
    assert (tmp_path / "b.webp").stat().st_size < size
    monkeypatch.setattr(loop_files, "MAX_BYTES", 100)
    with pytest.raises(ValueError, match=r"c\.webp must weigh at most 100 bytes; it has \d+: draw fewer frames"):
        loop_files.save(images, tmp_path / "c.webp", 50)
