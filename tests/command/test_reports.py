"""Reports: one page with everything in it, that asks nothing of any host, and scenes that turn in a real browser."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pytest

from spectral_notes import plotting
from spectral_notes.command.cli import main
from spectral_notes.command.reports import lighter, report_page
from spectral_notes.files.mesh_files import write_mesh
from spectral_notes.meshes import PointCloud, TriangleMesh
from spectral_notes.plotting.rendering import SurfaceView
from spectral_notes.shapes import egg, torus

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
SWITCHES = ["--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def page_of(**facts):
    """A report about a small cloud."""
    view = SurfaceView(PointCloud(np.eye(3)), [1.0, 0.0, -1.0], title="$\\phi$ <&>")
    return report_page("A <b> & 'c'", facts, [view], plotting.plot_views([view]))


def test_what_people_wrote_is_shown_and_not_obeyed():
    page = page_of(
        name="</script><script>alert(1)</script>", nothing="", values=[0.5] * 20, inner={"a": True, "b": None}
    )
    assert "<title>A &lt;b&gt; &amp; &#x27;c&#x27;</title>" in page
    assert "alert(1)</script>" not in page
    assert 'alt="Still pictures of φ &lt;&amp;&gt;."' in page
    assert "<th>inner a</th><td>yes</td>" in page
    assert "<th>inner b</th><td>–</td>" in page
    assert "(20 in all)" in page
    assert "<th>nothing</th>" not in page


def test_the_page_holds_its_viewer_and_names_nothing_outside():
    page = page_of(faces=80)
    assert "class Viewer" in page
    assert len(page) < 300_000
    assert not re.search(r"(src|href)\s*=\s*[\"'](?!data:)", page)
    assert "://" not in page
    assert "default-src 'none'" in page
    scene = re.search(r'spectralNotes.register\("scene", (.*)\);\n', page)
    assert scene
    assert set(json.loads(scene[1].replace("<\\/", "</"))) == {"pictures", "bar"}


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this system")
@pytest.mark.parametrize(("width", "scheme"), [(1200, "light"), (390, "dark")])
def test_a_report_turns_in_a_browser_without_a_request(tmp_path, width, scheme):
    from playwright.sync_api import sync_playwright

    write_mesh(tmp_path / "egg.obj", egg(subdivisions=2))
    assert main(["modes", str(tmp_path / "egg.obj"), "-k", "12", "-o", str(tmp_path / "egg.html")]) == 0
    with sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=CHROMIUM, args=SWITCHES)
        page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
        asked, faults = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto((tmp_path / "egg.html").as_uri())
        page.click("#start")
        page.wait_for_selector("#stage canvas")
        page.get_by_role("combobox").select_option(index=1)
        page.wait_for_timeout(500)
        canvas, stage = page.locator("#stage canvas").bounding_box(), page.locator(".scene-view").bounding_box()
        wide = page.evaluate("document.documentElement.scrollWidth")
        browser.close()
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert faults == []
    assert wide <= width
    assert canvas["width"] == pytest.approx(stage["width"], abs=4)
    assert canvas["height"] == pytest.approx(stage["height"], abs=4)


def test_a_report_about_a_large_shape_has_at_most_two_megabytes_and_keeps_its_scenes(tmp_path):
    orderly = torus(300, 200)
    number = np.random.default_rng(0).permutation(orderly.n_vertices)  # in order, it would pack into little as it is
    mesh = TriangleMesh(orderly.vertices[np.argsort(number)], number[orderly.faces], "torus")
    views = [SurfaceView(mesh, np.sin(k * mesh.vertices[:, 0]), title=f"mode {k}") for k in range(1, 7)]
    small = [SurfaceView(coarse, np.sin(k * coarse.vertices[:, 0])) for coarse in [torus(60, 30)] for k in range(1, 7)]
    page = report_page("A large torus", {}, views, plotting.plot_views(small, n_columns=3))
    assert len(page.encode()) < 2e6
    light = lighter(views[0], 20_000)
    assert 10_000 < light.surface.n_vertices <= 20_000
    assert light.surface.area == pytest.approx(mesh.area, rel=0.01)
    np.testing.assert_array_equal(light.values, np.sin(light.surface.vertices[:, 0]))
    assert light.color_limits == views[0].color_limits
    labels = lighter(SurfaceView(mesh, np.arange(mesh.n_faces) % 5, kind="labels"), 20_000)
    assert len(labels.values) == labels.surface.n_faces
    cloud = lighter(SurfaceView(PointCloud(mesh.vertices), mesh.vertices[:, 2]), 5_000)
    np.testing.assert_array_equal(cloud.values, cloud.positions[:, 2])
