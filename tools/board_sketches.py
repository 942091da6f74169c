"""Draw the board sketches of the teacher's page, one for each chapter: `book/_static/board/NN.svg`.

python tools/board_sketches.py
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Wedge

TARGET = Path(__file__).resolve().parents[1] / "book" / "_static" / "board"
INK, CHALK, PALE = "#1f3044", "#b5342a", "#c9d3df"
STYLE = {"svg.hashsalt": "board", "svg.fonttype": "path", "lines.linewidth": 1.8, "font.size": 11, "text.color": INK}


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], color: str = INK) -> None:
    """Draw an arrow."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": color, "lw": 1.8})


def write(ax: Axes, x: float, y: float, words: str, color: str = INK) -> None:
    """Write centred words, and make room for them."""
    ax.text(x, y, words, ha="center", va="center", color=color)
    ax.update_datalim([(x, y)])


def line(ax: Axes, x: object, y: object, color: str = INK, style: str = "-") -> None:
    """Draw a line."""
    ax.plot(x, y, style, color=color)


def shape(ax: Axes, corners: object, face: str = "none") -> None:
    """Draw a closed polygon."""
    ax.add_patch(Polygon(np.asarray(corners), closed=True, facecolor=face, edgecolor=INK, lw=1.8))


def function_spaces(ax: Axes) -> None:
    """Samples with bars of weight h, and of h/2 at the two ends."""
    x = np.linspace(0, 8, 9)
    f = 1.6 + np.sin(0.8 * x)
    widths = np.array([0.5, *[1.0] * 7, 0.5])
    ax.bar(x + np.array([0.25, *[0.0] * 7, -0.25]), f, widths, color=PALE, edgecolor="white")
    line(ax, x, f, style="o-")
    write(ax, 0.1, -0.45, "h/2", CHALK)
    write(ax, 4, -0.45, "h", CHALK)
    write(ax, 7.9, -0.45, "h/2", CHALK)
    write(ax, 11.2, 1.5, r"$\langle f, g\rangle = f^{\,T} M\, g$")


def fourier_basis(ax: Axes) -> None:
    """Two waves, of frequency 2 and of 8 - 2, that meet in every sample."""
    t, n = np.linspace(0, 8, 400), np.arange(9)
    line(ax, t, np.cos(2 * np.pi * 2 * t / 8), INK)
    line(ax, t, np.cos(2 * np.pi * 6 * t / 8), CHALK)
    line(ax, n, np.cos(2 * np.pi * 2 * n / 8), INK, "o")
    write(ax, 10.2, 0.5, "k = 2")
    write(ax, 10.2, -0.3, "N - k = 6", CHALK)
    write(ax, 4, -1.6, "N = 8 samples cannot tell them apart")


def differentiation(ax: Axes) -> None:
    """The rows of the central difference; the first and the last lack a neighbour."""
    for i in range(6):
        for j in range(6):
            entry = {-1: "-1", 1: "+1"}.get(j - i, "·")
            write(ax, j, 5 - i, entry, CHALK if i in (0, 5) and entry != "·" else INK)
    line(ax, [-0.6, -0.8, -0.8, -0.6], [-0.5, -0.5, 5.5, 5.5])
    line(ax, [5.6, 5.8, 5.8, 5.6], [-0.5, -0.5, 5.5, 5.5])
    write(ax, 7.3, 5, "no left\nneighbour", CHALK)
    write(ax, 7.3, 0, "no right\nneighbour", CHALK)
    write(ax, 7.3, 2.5, "/ 2h")


def manifolds(ax: Axes) -> None:
    """Six triangles round a vertex, cut open and laid flat: the gap is the defect."""
    turns = np.radians([25, 80, 135, 190, 245, 300, 340])
    for a, b in itertools.pairwise(turns):
        shape(ax, [(0, 0), (np.cos(a), np.sin(a)), (np.cos(b), np.sin(b))], PALE)
    ax.add_patch(Wedge((0, 0), 0.55, -20, 25, facecolor=CHALK, alpha=0.8))
    write(ax, 1.75, 0.05, r"defect $= 2\pi - \sum$ angles", CHALK)
    write(ax, 1.75, -0.75, r"sum of all defects $= 2\pi\chi$")


def discrete_geometries(ax: Axes) -> None:
    """One disk as a mesh, as points, as voxels and as a graph."""
    ring = np.array([(np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3])
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        shape(ax, [(0, 0), a, b], PALE)
    points = np.random.default_rng(4).uniform(-1, 1, (120, 2))
    points = points[np.hypot(*points.T) < 1] + [3, 0]
    ax.plot(*points.T, "o", color=INK, ms=3)
    for i, j in np.ndindex(6, 6):
        x, y = (i - 2.5) / 3, (j - 2.5) / 3
        if np.hypot(x, y) < 1:
            shape(ax, [(6 + x + s / 6, y + t / 6) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))], PALE)
    nodes = np.vstack([ring, ring * 0.45, [(0, 0)]])
    nodes[:, 0] += 9
    for i, a in enumerate(nodes):
        for b in nodes[i + 1 :]:
            if np.hypot(*(a - b)) < 0.72:
                line(ax, *zip(a, b, strict=True))
    ax.plot(*nodes.T, "o", color=CHALK, ms=6)
    for x, words in ((0, "mesh"), (3, "points"), (6, "voxels"), (9, "graph")):
        write(ax, x, -1.45, words)


def signals_on_surfaces(ax: Axes) -> None:
    """The gradient of a hat function: from the opposite edge to the corner, one over the height long."""
    shape(ax, [(0, 0), (4, 0), (2.6, 2.2)], PALE)
    arrow(ax, (2.6, 0.05), (2.6, 2.1), CHALK)
    write(ax, 2.6, 2.5, "1")
    write(ax, -0.25, -0.2, "0")
    write(ax, 4.25, -0.2, "0")
    write(ax, 7.1, 1.6, r"$|\nabla\varphi| = 1/\mathrm{height}$", CHALK)
    write(ax, 7.1, 0.6, "at a right angle to the edge where it is 0")


def laplacian(ax: Axes) -> None:
    """Two triangles on an edge, and the two angles opposite to it."""
    shape(ax, [(0, 1), (2, 0), (2, 2.2)], PALE)
    shape(ax, [(4.2, 1.3), (2, 0), (2, 2.2)], PALE)
    line(ax, [2, 2], [0, 2.2], CHALK)
    write(ax, 0.5, 1.02, r"$\alpha$")
    write(ax, 3.75, 1.25, r"$\beta$")
    write(ax, 2.05, -0.3, "i")
    write(ax, 2.05, 2.5, "j")
    write(ax, 7.6, 1.5, r"$w_{ij} = (\cot\alpha + \cot\beta)/2$", CHALK)
    write(ax, 7.6, 0.6, r"$(Lf)_i = \sum_j w_{ij}\,(f_i - f_j)$")


def eigenfunctions(ax: Axes) -> None:
    """The ladder of the sphere: 1, 3, 5, 7 modes at l (l + 1)."""
    for degree in range(4):
        height = degree * (degree + 1) / 4
        for m in range(-degree, degree + 1):
            line(ax, [0.8 * m - 0.3, 0.8 * m + 0.3], [height, height], CHALK if m else INK)
        write(ax, 4.0, height, rf"$\lambda = {degree * (degree + 1)}$")
        write(ax, 5.6, height, f"{2 * degree + 1} times")


def heat(ax: Axes) -> None:
    """A drop that spreads, and what happens to one coefficient."""
    x = np.linspace(-3, 3, 200)
    for t, color in ((0.05, INK), (0.25, "#5d7590"), (1.0, "#9db0c4")):
        line(ax, x, np.exp(-(x**2) / (4 * t)) / np.sqrt(4 * np.pi * t), color)
    write(ax, 6, 1.0, r"$c_k \;\to\; e^{-\lambda_k t}\, c_k$", CHALK)
    write(ax, 6, 0.5, "high modes go first;\nthe constant stays")


def compression(ax: Axes) -> None:
    """Five steps on both sides of a wire, and the question what the other side knows."""
    steps = {0.0: "faces\n→ L, basis", 2.6: "analyze\nX, Y, Z", 5.2: "keep k,\nround", 9.2: "synthesize"}
    for x, words in steps.items():
        shape(ax, [(x - 1.1, -0.6), (x + 1.1, -0.6), (x + 1.1, 0.6), (x - 1.1, 0.6)])
        write(ax, x, 0, words)
    for a, b in ((1.1, 1.5), (3.7, 4.1), (6.3, 8.1)):
        arrow(ax, (a, 0), (b, 0))
    write(ax, 7.2, 0.35, "bits", CHALK)
    write(ax, 9.2, 1.1, "which basis?", CHALK)


def clustering(ax: Axes) -> None:
    """In space two hands may touch; in the embedding they are the ends of different arms."""
    rng = np.random.default_rng(1)
    colors = {20: INK, 100: CHALK, 165: "#5d7590", 240: "#c98a2b", 310: "#6a8f5a"}
    for turn, color in colors.items():
        along, across = np.sqrt(rng.uniform(0.1, 2.2, 35)), 0.08 * rng.normal(size=(2, 35))
        x, y = along * np.cos(np.radians(turn)), along * np.sin(np.radians(turn))
        ax.plot(x + across[0], y + across[1], "o", color=color, ms=3)
    write(ax, 4.4, 0.5, r"row of $x$:  $\varphi_j(x)/\sqrt{\lambda_j},\ j \geq 1$")
    write(ax, 4.4, -0.4, "limbs become arms;\nposes fall on each other", CHALK)


def functional_maps(ax: Axes) -> None:
    """Points go one way, functions the other."""
    for x, words in ((0, "shape 1"), (6, "shape 2")):
        ax.add_patch(Circle((x, 1), 0.8, facecolor=PALE, edgecolor=INK, lw=1.8))
        write(ax, x, 1, words)
    arrow(ax, (5.0, 1.5), (1.0, 1.5), CHALK)
    write(ax, 3, 1.9, r"points:  p2p_21", CHALK)
    arrow(ax, (1.0, 0.5), (5.0, 0.5))
    write(ax, 3, 0.1, r"functions:  $C_{12}$")
    write(ax, 9.7, 1, r"$f_2(x) = f_1(p(x))$")


def vectors(ax: Axes) -> None:
    """Two arrows in two planes, and what has to happen before one is taken from the other."""
    ax.plot([0, 4], [0, 0], "o-", color=INK, ms=6)
    arrow(ax, (0, 0), (0.7, 1.2))
    arrow(ax, (4, 0), (3.7, 1.4), CHALK)
    for x, words in ((0, "$i$"), (4, "$j$")):
        write(ax, x, -0.4, words)
    write(ax, 2, 0.5, r"$z_j \;\leftrightarrow\; r_{ij}\, z_i$", CHALK)
    write(ax, 8.2, 0.5, r"$E(z) = \sum w_{ij}\, |z_j - r_{ij} z_i|^2$")


def graphs(ax: Axes) -> None:
    """A response, the polynomial that follows it up to b, and what happens beyond."""
    x = np.linspace(0, 4, 200)
    line(ax, x, 2 * np.exp(-1.2 * x), INK)
    inside = np.linspace(0, 3, 9)
    line(ax, x, np.polynomial.Chebyshev.fit(inside, 2 * np.exp(-1.2 * inside), 3)(x), CHALK)
    ax.plot([3, 3], [-0.3, 2], "--", color="0.5", lw=1)
    ax.plot([0, 4.2], [0, 0], color="0.5", lw=1)
    write(ax, 3, -0.55, "$b$")
    write(ax, 0, -0.55, "0")
    write(ax, 8.4, 1.4, r"$g(L) f \;\approx\; \sum a_k\, T_k(X)\, f$")
    write(ax, 8.4, 0.5, "$r$ products see $r$ edges far", CHALK)


def brain(ax: Axes) -> None:
    """Two smooth curves, what their correlation is worth, and how to shuffle fairly."""
    x = np.linspace(0, 4.4, 200)
    rng = np.random.default_rng(4)
    for level, color, words in ((0.9, INK, "$f$"), (-0.9, CHALK, "$g$")):
        waves = sum(rng.normal() * np.cos(k * np.pi * x / 4.4 + rng.normal()) / k for k in (1, 2, 3))
        line(ax, x, level + 0.5 * waves, color)
        write(ax, -0.4, level, words, color)
    write(ax, 8.2, 0.7, r"$\sigma(r) = 1/\sqrt{\nu}$,  not  $1/\sqrt{N}$")
    write(ax, 8.2, -0.7, r"$c_g \;\to\; Q_g\, c_g$ in each group", CHALK)


def outlook(ax: Axes) -> None:
    """One equation, and the roads that lead out of it."""
    write(ax, 0, 0, r"$L\varphi = \lambda M\varphi$", CHALK)
    roads = {"finite elements": (-3.4, 1), "solids": (3.2, 1)}
    roads |= {"millions of\nvertices": (-3.4, -1), "other operators": (3.4, -1)}
    for words, (x, y) in roads.items():
        arrow(ax, (0.32 * x, 0.32 * y), (0.62 * x, 0.66 * y))
        write(ax, x, y, words)


SKETCHES: dict[int, Callable[[Axes], None]] = {  # by chapter
    1: function_spaces,
    2: fourier_basis,
    3: differentiation,
    4: manifolds,
    5: discrete_geometries,
    6: signals_on_surfaces,
    7: laplacian,
    8: eigenfunctions,
    9: heat,
    10: compression,
    11: clustering,
    12: functional_maps,
    13: vectors,
    14: graphs,
    15: brain,
    16: outlook,
}


def main() -> int:
    """Draw and store all sketches."""
    TARGET.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for number, sketch in SKETCHES.items():
            figure = Figure(figsize=(5.6, 2.1), facecolor="white")
            ax = figure.add_axes((0.03, 0.03, 0.94, 0.94))
            sketch(ax)
            ax.set_axis_off()
            ax.margins(0.08)
            ax.autoscale_view()
            if sketch not in (function_spaces, fourier_basis, differentiation, heat, eigenfunctions):
                ax.set_aspect("equal")
            figure.savefig(TARGET / f"{number:02d}.svg", bbox_inches="tight", pad_inches=0.1, metadata={"Date": None})
    return 0


if __name__ == "__main__":
    sys.exit(main())
