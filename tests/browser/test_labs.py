"""The labs in a browser: every slider moves its number, the numbers are Python's, and all of it without a pointer."""

from __future__ import annotations

import io
import json
import re

import lab_files
import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from PIL import Image

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.functional_maps import functional_map, nearest_rows
from spectral_notes.labs.data import in_unit_area
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh, edge_lengths
from spectral_notes.shapes import coarse_copy, goat, spherical_cap

PAGE = "book/labs.html"
LABS = ("fourier", "ends", "bump-dent", "eigenfunctions", "heat", "reconstruction", "functional-map", "clusters", "arrows", "filter", "cortex")
FLAT = ("fourier", "ends", "filter")  # no scene
WINDOWS = {"upright": (390, 844), "sideways": (844, 390), "desktop": (1280, 800)}
STEP_MILLISECONDS = 20.0


class Lab:
    """One lab of the page, as a reader meets it: named controls, named numbers."""

    def __init__(self, page, name):
        self.page, self.name = page, name
        self.root = page.locator(f"spectral-lab[name={name}]").first

    def start(self):
        """Start by keyboard and wait for the first numbers."""
        self.root.locator(".lab-start").focus()
        self.page.keyboard.press("Enter")
        self.root.locator(".lab-numbers dd").first.wait_for(timeout=60_000)
        return self.settle()

    def settle(self):
        """Wait until the newest step has been painted."""
        self.page.wait_for_function(
            "(lab) => !lab.hasAttribute('aria-busy') && (lab.querySelector('dd')?.textContent ?? '–') !== '–'",
            arg=self.root.element_handle(),
            timeout=60_000,
        )
        return self

    def slide(self, label, value):
        """Set a slider as a drag would, and wait."""
        self.root.get_by_label(label, exact=True).evaluate(
            "(input, value) => { input.value = value; input.dispatchEvent(new Event('input')); }", str(value)
        )
        return self.settle()

    def choose(self, label, option):
        """Choose from a list, and wait."""
        self.root.get_by_label(label, exact=True).select_option(label=option)
        return self.settle()

    def press(self, text):
        """Press a button, and wait."""
        self.root.get_by_role("button", name=text, exact=True).click()
        return self.settle()

    def text(self, name):
        """Return what stands beside a name."""
        return self.root.locator(f'dd[data-name^="{name}"]').inner_text()

    def number(self, name):
        """Return the first number beside a name."""
        return float(re.search(r"-?\d+(\.\d+)?(e-?\d+)?", self.text(name).replace("−", "-"))[0])


@pytest.fixture(scope="module")
def goat_errors():
    """Return Python's RMS error of the goat from k modes, in percent of the diagonal, as a function of k."""
    mesh = in_unit_area(coarse_copy(goat(), 4500)[0])
    basis = compute_eigenbasis(*cotan_laplacian(mesh), 500)
    c, mass = basis.analyze(mesh.vertices), basis.M.diagonal()
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))

    def error(first, last):
        kept = np.zeros_like(c)
        kept[first:last] = c[first:last]
        gap = mesh.vertices - basis.synthesize(kept)
        return 100 * float(np.sqrt((mass @ gap**2).sum() / mass.sum())) / diagonal

    return error


@pytest.fixture(scope="module")
def map_misses():
    """Return Python's mean miss of the forty points, in percent of the size, as a function of a change of C and of k."""
    one, two, p2p_21 = lab_files.two_dolls(5000)
    basis_1, basis_2 = (compute_eigenbasis(*cotan_laplacian(in_unit_area(mesh)), 60) for mesh in (one, two))
    C_12 = functional_map(basis_1, basis_2, p2p_21)
    samples = ((np.arange(40) + 0.5) * one.n_vertices / 40).astype(int)

    def miss(change, k):
        coefficients = basis_1.evecs[samples, :k] @ change(C_12)[:k, :k].T
        images = p2p_21[nearest_rows(basis_2.evecs[:, :k], coefficients)]
        gaps = np.linalg.norm(one.vertices[images] - one.vertices[samples], axis=1)
        return 100 * float(gaps.mean() / np.linalg.norm(np.ptp(one.vertices, axis=0)))

    return miss


@pytest.fixture(scope="module", params=LABS)
def lab(request, visit):
    """Return each lab in turn, started once for all tests that take it, on a page whose complaints it keeps."""
    with visit(PAGE) as (page, watch):
        started = Lab(page, request.param).start()
        started.watch = watch
        yield started


def draw(page, chart, start, end):
    """Draw a stroke over a chart with the pointer, between two places in shares of its size."""
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    places = [(box["x"] + box["width"] * x, box["y"] + box["height"] * y) for x, y in (start, end)]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=5)
    page.mouse.up()


def numbers(lab):
    """Return all numbers that a lab shows, as text."""
    return lab.root.locator(".lab-numbers").inner_text()


# --- all of them ------------------------------------------------------------------------------------------------------


def test_a_lab_says_what_to_try_and_names_its_controls(lab):
    assert lab.root.locator("ol > li").count() == 3
    assert lab.root.locator("details").count() == 3
    for control in lab.root.locator("input, select, [tabindex='0']").all():
        assert control.get_attribute("aria-label"), control.evaluate("(c) => c.outerHTML.slice(0, 80)")


def test_a_canvas_is_not_one_colour_and_turns_by_the_keyboard(lab):
    scene = lab.root.locator(".lab-scene")
    if lab.name in FLAT:
        assert scene.count() == 0
        return
    scene.scroll_into_view_if_needed()
    lab.page.wait_for_timeout(300)
    seen = scene.screenshot()
    assert len(Image.open(io.BytesIO(seen)).convert("RGB").getcolors(1_000_000)) > 50
    scene.focus()
    lab.page.keyboard.press("ArrowLeft")
    lab.page.wait_for_timeout(500)
    assert scene.screenshot() != seen


def test_every_slider_moves_a_number_by_the_keyboard(lab):
    if lab.name == "functional-map":
        lab.choose("Matrix", "The identity")
    for slider in lab.root.locator("input[type=range]").all():
        label = slider.get_attribute("aria-label")
        before = numbers(lab), slider.get_attribute("aria-valuetext")
        slider.focus()
        lab.page.keyboard.press("Home" if slider.evaluate("(s) => s.value === s.max") else "End")
        lab.settle()
        assert slider.get_attribute("aria-valuetext") != before[1], label
        if label not in ("Wave k", "Knob"):  # chooses what the next slider changes, and is a number itself
            assert numbers(lab) != before[0], label


def test_a_step_costs_little(lab):
    slider = lab.root.locator("input[type=range]").first
    label, low, high = slider.evaluate("(s) => [s.ariaLabel, +s.min, +s.max]")
    times = []
    for part in np.linspace(0.1, 0.9, 12):
        lab.slide(label, round(low + part * (high - low)))
        times.append(lab.root.evaluate("(element) => element.stepMilliseconds"))
    print(f"{lab.name}: {min(times):.1f} to {max(times):.1f} ms")
    assert min(times) < STEP_MILLISECONDS  # the least of many: what the code costs when nobody else is at work


def test_a_lab_stops_and_starts_again_without_a_complaint(lab):
    lab.root.locator(".lab-stop").click()
    assert lab.page.evaluate("document.activeElement.className") == "lab-start"
    lab.root.locator("img").wait_for()
    lab.start()
    assert lab.watch.faults() == []


def test_axe_finds_nothing_serious_in_a_running_lab(lab):
    for theme in ("dark", "light"):
        lab.page.evaluate("(theme) => (document.documentElement.dataset.theme = theme)", theme)
        found = Axe().run(lab.page, context="spectral-lab", options={"resultTypes": ["violations"]}).response["violations"]
        assert [(one["id"], one["nodes"][0]["html"][:200]) for one in found if one["impact"] in ("serious", "critical")] == []


def test_the_labs_work_from_a_folder(visit):
    with visit(PAGE, "file") as (page, watch):
        for name in LABS:
            assert Lab(page, name).start().root.locator(".lab-numbers dd").count() > 0
        assert watch.faults() == []


def test_without_scripts_a_still_picture_remains(browser, http):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(f"{http}/{PAGE}")
    assert page.locator("spectral-lab img").count() == len(LABS)
    assert page.locator(".lab-start").count() == 0
    assert all(len(image.get_attribute("alt")) > 60 for image in page.locator("spectral-lab img").all())
    context.close()


def test_without_webgl_the_picture_stays_and_a_sentence_says_why(visit):
    with visit(PAGE) as (page, watch):
        page.evaluate("HTMLCanvasElement.prototype.getContext = () => null")
        page.locator("spectral-lab[name=heat] .lab-start").click()
        alert = page.locator("spectral-lab[name=heat] [role=alert]")
        alert.wait_for()
        assert "WebGL 2 is missing" in alert.inner_text()
        assert page.locator("spectral-lab[name=heat] img").is_visible()
        assert watch.faults() == []


def test_a_fifth_scene_stops_the_oldest(visit):
    with visit(PAGE) as (page, _):
        started = [Lab(page, name).start() for name in LABS if name not in FLAT]
        assert started[0].root.locator(".lab-start").count() == 1
        assert all(lab.root.locator(".lab-scene").count() == 1 for lab in started[-4:])


def test_a_lab_whose_scene_is_lost_goes_back_to_its_picture(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "eigenfunctions").start()
        lab.root.locator("canvas").evaluate("(canvas) => canvas.getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()")
        lab.root.locator("img").first.wait_for()
        lab.start()


def test_where_the_reader_wants_less_motion_nothing_plays(visit):
    with visit(PAGE, reduced_motion="reduce") as (page, _):
        lab = Lab(page, "heat").start()
        assert lab.root.get_by_role("button", name="Play", exact=True).count() == 0
        before = lab.number("Highest value")
        lab.press("Step")
        assert lab.number("Highest value") < before
        still = lab.number("Highest value")
        page.wait_for_timeout(400)
        assert lab.number("Highest value") == still


def test_the_newest_position_wins_and_nothing_piles_up(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "reconstruction").start()
        painted = page.evaluate(
            """async () => {
                const lab = document.querySelector("spectral-lab[name=reconstruction]");
                const input = lab.querySelector("input");
                let painted = 0;
                const { change } = spectralNotes.Viewer.prototype;
                spectralNotes.Viewer.prototype.change = function (...all) { painted += 1; return change.apply(this, all); };
                for (let k = 100; k < 300; k++) { input.value = k; input.dispatchEvent(new Event("input")); }
                while (lab.hasAttribute("aria-busy")) await new Promise(requestAnimationFrame);
                return painted;
            }"""
        )
        assert painted <= 3
        assert lab.text("Numbers kept").startswith("897 of")  # 3 * 299


# --- each of them -----------------------------------------------------------------------------------------------------


def test_the_error_of_a_reconstruction_is_that_of_python(visit, goat_errors):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "reconstruction").start()
        for k in (1, 7, 50, 123, 500):
            lab.slide("Modes k", k)
            assert abs(lab.number("RMS error") - goat_errors(0, k)) < 1e-3 + 1e-3 * goat_errors(0, k)
        lab.slide("Leave out the first", 5)
        assert abs(lab.number("RMS error") - goat_errors(5, 500)) < 0.01
        lab.slide("Modes k", 3)  # the band stays a band
        assert lab.text("Numbers kept").startswith("3 of")


def test_heat_conserves_its_integral_and_evens_out(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "heat").start()
        highest = []
        for position in (0, 100, 200, 300, 400):
            lab.slide("Time", position)
            assert abs(lab.number("Kept for ever") - 1) < 2e-3
            highest.append(lab.number("Highest value"))
        assert highest == sorted(highest, reverse=True) and highest[0] > 10 * highest[-1]
        lab.choose("Where", "its −y end").press("Drop it there")
        assert abs(lab.number("Kept for ever") - 2) < 4e-3


def test_waves_keep_their_energy_and_a_particle_its_probability(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "heat").start()
        lab.choose("Equation", "Wave")
        energy = lab.number("Kept for ever")
        for position in (37, 200, 400):
            lab.slide("Time", position)
            assert abs(lab.number("Kept for ever") / energy - 1) < 1e-3
        lab.choose("Equation", "Schrödinger")
        for position in (0, 37, 400):
            lab.slide("Time", position)
            assert abs(lab.number("Kept for ever") - 1) < 5e-3


def test_heat_drops_where_the_reader_clicks(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "heat").start()
        scene = lab.root.locator(".lab-scene")
        scene.scroll_into_view_if_needed()
        box = scene.bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        assert abs(lab.settle().number("Kept for ever") - 2) < 0.01
        page.mouse.click(box["x"] + 3, box["y"] + 3)  # beside the goat
        assert abs(lab.settle().number("Kept for ever") - 2) < 0.01


def test_the_explorer_shows_eigenvalues_of_python_and_keeps_to_courant(visit):
    mesh = in_unit_area(goat())
    evals = compute_eigenbasis(*cotan_laplacian(mesh), 101).evals
    with visit(PAGE) as (page, _):
        lab = Lab(page, "eigenfunctions").start()
        for k in (1, 10, 57, 100):
            lab.slide("Mode", k)
            assert abs(lab.number("Eigenvalue") - evals[k]) < 0.06
            pieces, allowed = map(int, re.findall(r"\d+", lab.text("Nodal domains")))
            assert allowed == k + 1 and 2 <= pieces <= allowed
            assert k != 1 or pieces == allowed
            assert k < 57 or pieces < 0.7 * allowed
        lab.choose("Shape", "egg")
        lab.root.locator('.lab-scene[aria-label*="egg"] canvas').wait_for()
        page.wait_for_timeout(1000)  # the browser tells of the goat's freed context late
        assert lab.root.locator(".lab-scene").count() == 1
        assert lab.slide("Mode", 57).text("Nodal domains").endswith("58)")


def test_the_square_wave_from_its_largest_coefficients(visit):
    with visit(PAGE) as (page, watch):
        lab = Lab(page, "fourier").start().choose("Signal", "Square wave")
        f = np.where(np.arange(128) < 64, 0.8, -0.8)
        F = np.fft.rfft(f)
        for K in (1, 4, 20):
            kept = np.where(np.argsort(np.argsort(-np.abs(F))) < K, F, 0)
            wanted = np.sqrt(np.mean((f - np.fft.irfft(kept, 128)) ** 2))
            lab.slide("Keep the largest", K)
            assert abs(lab.number("RMS error") - wanted) < 1e-4
        lab.slide("Keep the largest", 65).slide("Wave k", 1).press("Mute or unmute it")
        assert lab.number("Waves heard") == 31
        lab.press("Hear it").press("Silence")
        assert watch.faults() == []


def test_a_signal_is_drawn_by_pointer_and_by_keys(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "fourier").start().choose("Signal", "Flat, to draw on")
        chart = lab.root.locator(".lab-chart").first
        chart.focus()
        for _ in range(5):
            page.keyboard.press("ArrowUp")
        lab.settle()
        assert lab.number("Waves heard") == 65  # an impulse holds every frequency
        draw(page, chart, (0.4, 0.3), (0.7, 0.2))
        curve = lab.settle().root.locator("path.given").get_attribute("d")
        heights = [float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", curve)]
        assert sum(height < 90 for height in heights) > 30  # a long stroke lies high


def test_a_map_breaks_when_its_matrix_does(visit, map_misses):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "functional-map").start()
        lab.slide("Modes k", 60)
        whole = lab.number("Their mean miss")
        assert lab.number("Of 40 points") == 40 and lab.number("|CᵀC") < 0.02
        diagonal = lab.choose("Matrix", "Only its diagonal").number("Their mean miss")
        identity = lab.choose("Matrix", "The identity").number("Their mean miss")
        python = [map_misses(change, 60) for change in (np.array, lambda C: np.diag(np.diag(C)), lambda C: np.eye(len(C)))]
        assert np.allclose([whole, diagonal, identity], python, atol=0.02)
        assert whole < diagonal and 2 * diagonal < identity
        turned = lab.choose("Matrix", "One sign turned").number("Their mean miss")
        assert turned < 1.2 * whole  # fifty-nine outvote one
        few_turned = lab.slide("Modes k", 10).number("Their mean miss")
        few_whole = lab.choose("Matrix", "The map as it is").number("Their mean miss")
        assert few_turned > 4 / 3 * few_whole
        lab.root.locator("canvas.lab-matrix").focus()
        page.keyboard.press("0")
        assert lab.settle().number("Their mean miss") > few_whole


def test_parts_stay_when_the_pose_changes(visit):
    with visit(PAGE) as (page, _):
        lab = Lab(page, "clusters").start()
        for _ in range(3):
            assert lab.press("Next pose").number("Agreement") > 0.95
        assert lab.slide("Parts", 12).number("Parts") == 12


def test_the_ground_and_the_spectrum_know_no_bump_from_a_dent_and_the_air_does(visit):
    n_rings, rim = 36, 3781  # the first vertex of the last ring
    with visit(PAGE) as (page, _):
        lab = Lab(page, "bump-dent").start()
        for pushed, stretch, mode in ((0, 100, 1), (18, 100, 5), (27, 100, 20), (36, 100, 5), (18, 130, 5)):
            lab.slide("Rings pushed in", pushed).slide("Height, %", stretch).slide("Mode", mode)
            cap = spherical_cap(rings_pushed_in=pushed)
            stretched = TriangleMesh(cap.vertices * [1, 1, stretch / 100], cap.faces)
            f = compute_eigenbasis(*cotan_laplacian(spherical_cap()), 21).evecs[:, mode]
            L, M = cotan_laplacian(stretched)
            assert abs(lab.number("Eigenvalue") - (f @ (L @ f)) / (f @ (M @ f))) < 2e-3
            assert abs(lab.number("Through the air") - np.linalg.norm(stretched.vertices[0] - stretched.vertices[rim])) < 1e-3
            change = np.abs(edge_lengths(stretched) / edge_lengths(spherical_cap()) - 1).max()
            if stretch == 100:
                assert abs(lab.number("On the ground") - 1.2) < 2e-3  # the angle of the rim, on a ball of radius one
                assert lab.text("Largest change") == "none" and change < 1e-12
            else:
                assert abs(lab.number("Largest change") - 100 * change) < 0.06
                assert lab.number("On the ground") > 1.25
        lab.choose("Measure", "rim to rim")
        assert abs(lab.number("Through the air") - 2 * np.sin(1.2)) < 1e-3
        lab.slide("Height, %", 100).choose("Measure", "pole to half way")
        assert abs(lab.number("On the ground") - 1.2 * 18 / n_rings) < 1e-3


@pytest.mark.parametrize(("window", "theme"), [("upright", "dark"), ("sideways", "light"), ("desktop", "dark")])
@pytest.mark.parametrize("which", ["arrows", "filter", "cortex"])
def test_every_control_of_part_four_is_pressed_by_pointer_and_by_keys(visit, which, window, theme):
    width, height = WINDOWS[window]
    with visit(PAGE, "file", theme, viewport={"width": width, "height": height}, has_touch=window != "desktop") as (page, watch):
        lab = Lab(page, which)
        lab.root.locator(".lab-start").tap() if window != "desktop" else lab.root.locator(".lab-start").click()
        lab.root.locator(".lab-numbers dd").first.wait_for()
        lab.settle()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        for slider in lab.root.locator("input[type=range]").all():
            said = [slider.get_attribute("aria-valuetext")]
            slider.scroll_into_view_if_needed()
            box = slider.bounding_box()
            at = {"x": box["width"] * 0.3, "y": box["height"] / 2}
            slider.tap(position=at) if window != "desktop" else slider.click(position=at)
            said.append(lab.settle() and slider.get_attribute("aria-valuetext"))
            slider.press("ArrowRight")
            said.append(lab.settle() and slider.get_attribute("aria-valuetext"))
            assert len(set(said)) == 3, said
        for select in lab.root.locator("select").all():
            select.focus()
            page.keyboard.press("ArrowDown")
            lab.settle()
            assert select.evaluate("(s) => s.selectedIndex") == 1
            page.keyboard.press("ArrowUp")
            lab.settle()
        for button in lab.root.locator(".lab-controls button").all():
            for press in (button.tap if window != "desktop" else button.click, lambda button=button: button.press("Enter")):
                press()
                lab.settle()
        lab.root.locator("summary").first.click()
        assert lab.root.locator("details").first.get_attribute("open") is not None
        assert watch.faults() == []
        lab.root.locator(".lab-stop").press("Enter")
        assert lab.root.locator("img").is_visible()


def test_arrows_follow_and_their_indices_sum_to_two(visit):
    with visit(PAGE) as (page, watch):
        lab = Lab(page, "arrows").start()
        two = lab.number("Energy")
        energies = [lab.slide("Turn the newest", degrees).number("Energy") for degrees in (-90, -30, 30, 180)]
        assert two < min(energies) and energies[-1] == max(energies)
        assert lab.number("Sum of their indices") == 2
        assert lab.slide("Turn the newest", 0).slide("Time", 0).number("Energy") > two
        for kind, unit in (("lines", "1/2"), ("crosses", "1/4")):
            lab.choose("Field of", kind)
            assert lab.number("Sum of their indices") == 2
            assert f"of index {unit}," in lab.text("Singular faces")
        assert lab.choose("Field of", "arrows").slide("Time", 40).press("Take the newest away").number("Energy") < two
        assert lab.press("Place it there").number("Energy") == two  # the middle again
        scene = lab.root.locator(".lab-scene")
        scene.scroll_into_view_if_needed()
        box = scene.bounding_box()
        page.mouse.click(box["x"] + box["width"] * 0.44, box["y"] + box["height"] / 2)  # the flank, beside the middle
        assert lab.settle().number("Energy") > two
        assert lab.press("Start again").number("Energy") == two
        assert watch.faults() == []


def test_a_filter_is_drawn_and_its_polynomial_sees_as_far_as_its_degree(visit):
    data = lab_files.filter_data()
    evals, evecs, (spark, *_) = (data.arrays[name].astype(float) for name in ("evals", "evecs", "signals"))
    W = np.zeros((300, 300), dtype=bool)
    W[tuple(data.arrays["edges"].T)] = True
    with visit(PAGE) as (page, _):
        lab = Lab(page, "filter").start()
        near = spark > 0
        for degree in range(4):
            assert lab.slide("Degree", degree).number("Nodes that") == near.sum()
            near = near | (W | W.T)[near].any(axis=0)
        for response, degree, gains in (("low-pass", 20, np.exp(-6 * np.arange(9) / 8)), ("ideal low-pass", 20, 1.0 * (np.arange(9) / 8 < 0.3))):
            b = evals[-1] * (1 + 1e-6)
            asked = lambda x, gains=gains, b=b: np.interp(x, np.linspace(0, b, 9), gains)  # noqa: E731
            got = np.polynomial.chebyshev.Chebyshev.interpolate(asked, degree, [0, b])
            wanted = np.abs(evecs.T @ ((asked(evals) - got(evals)) * (evecs @ spark))).max()
            lab.choose("Response", response).slide("Degree", degree)
            assert abs(lab.number("Largest difference") / wanted - 1) < 0.1
        assert lab.number("Largest difference") > 3 * lab.choose("Response", "low-pass").number("Largest difference")
        lab.choose("Response", "all pass")
        for knob in range(1, 9):
            assert lab.slide("Knob", knob).slide("Its gain", 0.3).number("Sum over the nodes") == 1
        assert lab.slide("Knob", 0).slide("Its gain", 0.3).number("Sum over the nodes") == 0.3
        chart = lab.root.locator(".lab-chart").first
        chart.focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowUp")
        lab.settle()
        assert lab.root.get_by_label("Its gain", exact=True).input_value() == "0.35"
        draw(page, chart, (0.55, 0.4), (0.55, 0.1))
        lab.settle()
        assert lab.root.get_by_label("Knob", exact=True).input_value() == "4"
        assert float(lab.root.get_by_label("Its gain", exact=True).input_value()) == 1


def test_the_cortex_has_the_wavelengths_and_the_errors_of_its_chapter(visit):
    pial, _, maps = lab_files.cortex()
    basis = compute_eigenbasis(*cotan_laplacian(pial), 201)
    mass = basis.M.diagonal()
    with visit(PAGE) as (page, _):
        lab = Lab(page, "cortex").start()
        for name, f in maps.items():
            f = f - mass @ f / mass.sum()
            left = np.sqrt(1 - np.cumsum(basis.analyze(f) ** 2) / (mass @ f**2))
            lab.choose("Map", name)
            for k in (1, 10, 100, 200):
                lab.slide("Mode", k).slide("Modes k", k)
                assert abs(lab.number("Relative error") - left[k]) < 3e-3
                assert lab.number("Wavelength") == lab.number("Shortest") == round(2 * np.pi / np.sqrt(basis.evals[k]))
        lab.choose("Beside it", "the whole map").choose("Surface", "inflated")
        assert lab.root.locator(".viewer-title").all_inner_texts() == ["the whole map", "from 200 modes"]


# --- budgets ----------------------------------------------------------------------------------------------------------


def test_the_data_of_a_lab_is_at_most_three_megabytes(html):
    sizes = {path.stem: path.stat().st_size for path in (html / "_static" / "labs" / "data").glob("*.js")}
    print(json.dumps(sizes, indent=1))
    assert len(sizes) == 12
    assert max(sizes.values()) <= lab_files.MAX_BYTES  # a lab of several shapes loads them one by one


def test_the_pages_that_embed_labs_name_files_that_exist(html):
    for path in html.glob("book/*.html"):
        for files in re.findall(r'<spectral-lab name="[a-z-]+" data="([^"]+)"', path.read_text(encoding="utf-8")):
            for name in files.split():
                assert (html / "_static" / "labs" / "data" / f"{name}.js").exists(), (path.name, name)
