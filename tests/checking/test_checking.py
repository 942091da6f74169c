"""The checks: a bank of right answers that pass, a bank of wrong ones with the law each must name, and strange things."""

from __future__ import annotations

import decimal
import fractions
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spectral_notes import checking as ck
from spectral_notes import shapes
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.finite_differences import central_difference, second_difference
from spectral_notes.geometry.curvature import angle_defects, gaussian_curvature, mean_curvature
from spectral_notes.graphs import mesh_graph
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, interval_laplacian, mass_matrix
from spectral_notes.mesh_calculus import gradient_matrix
from spectral_notes.meshes import TriangleMesh

Case = tuple[str, Callable[[], ck.Verdict], str]

BALL = shapes.sphere(2)
L, M = cotan_laplacian(BALL)
EGG = shapes.egg(2)
X = np.linspace(0, 2, 21)
H = X[1] - X[0]
ANGLES = 2 * np.pi * np.arange(24) / 24
F = 3 * np.cos(5 * ANGLES) + 2 * np.sin(7 * ANGLES) + 0.3
DFT = np.fft.fft(F)
D1 = central_difference(21, H, ends="one-sided").toarray()
NAIVE = (np.diag(np.ones(20), 1) - np.diag(np.ones(20), -1)) / (2 * H)
RING = second_difference(24, 2 * np.pi / 24, ends="periodic").toarray()


@lru_cache
def ball_basis(k: int) -> Eigenbasis:
    return compute_eigenbasis(L, M, k)


@lru_cache
def egg_basis(k: int) -> Eigenbasis:
    return compute_eigenbasis(*cotan_laplacian(EGG), k)


B = ball_basis(9)
TURN = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
P2P_21 = np.random.default_rng(2).permutation(BALL.n_vertices)
BALL_2 = TriangleMesh(BALL.vertices[P2P_21], np.argsort(P2P_21)[BALL.faces])  # vertex i of 2 is vertex P2P_21[i] of 1
B2 = compute_eigenbasis(*cotan_laplacian(BALL_2), 9)
C_12 = B2.analyze(B.evecs[P2P_21])
INVERSE = np.argsort(P2P_21)
DISTANCES = np.linalg.norm(BALL.vertices[:, None] - BALL.vertices[None, :], axis=2)
SIGNAL = np.exp(BALL.vertices[:, 2])
G = gradient_matrix(BALL)
W = mesh_graph(BALL)
HAT = mass_matrix(BALL, kind="full")


def rotated() -> np.ndarray:
    """The basis of the ball with its threefold eigenspace turned."""
    evecs = B.evecs.copy()
    evecs[:, 1:4] = evecs[:, 1:4] @ TURN
    return evecs


def embedded(weights: np.ndarray, first: int = 1) -> np.ndarray:
    """Three modes as coordinates."""
    return B.evecs[:, first : first + 3] * weights


def unscaled() -> np.ndarray:
    """Modes that are orthonormal without M."""
    return np.linalg.qr(B.evecs)[0]


def raises(*_: object) -> float:
    raise ZeroDivisionError("by h")


GPS = B.evals[1:4] ** -0.5

RIGHT: list[tuple[str, Callable[[], ck.Verdict]]] = [
    ("number: a phase and a turn", lambda: ck.check_number(0.5 - 2 * np.pi, 0.5, modulo=2 * np.pi)),
    ("choice: yes for True", lambda: ck.check_choice("yes", True)),
    ("choice: 0 for False", lambda: ck.check_choice(0, ck.seal(False))),
    ("choice: a formula without blanks", lambda: ck.check_choice(["a^2+b^2", "|F|"], ["|F|", "a^2 + b^2"])),
    ("function: against sealed values", lambda: ck.check_function(lambda x: x * x, ck.seal([4, 9]), [(2,), (3,)])),
    ("values: the image is known", lambda: ck.check_values([3, 0, 5], [3, 0], through=[[1, 0, 0], [0, 1, 0]])),
    ("number: fraction", lambda: ck.check_number(fractions.Fraction(1, 3), 1 / 3)),
    ("number: decimal", lambda: ck.check_number(decimal.Decimal("2.0"), 2.0)),
    ("number: array of one", lambda: ck.check_number(np.array([[2.0]]), 2)),
    ("number: real complex", lambda: ck.check_number(2 + 0j, ck.seal(2))),
    ("number: boolean of numpy", lambda: ck.check_number(np.int8(2), 2)),
    ("values: column", lambda: ck.check_values([[1], [2]], [1, 2])),
    ("values: tuple in single precision", lambda: ck.check_values(np.float32([0.1, 0.2]), ck.seal([0.1, 0.2]))),
    ("values: other sign", lambda: ck.check_values([-1, -2], [1, 2], either_sign=True)),
    ("values: any scale", lambda: ck.check_values([-3, -6], [1, 2], free_scale=True)),
    ("values: a null vector", lambda: ck.check_values([1, -1, 0], np.zeros(3), through=[[1, 1, 1]])),
    ("values: same image", lambda: ck.check_values([3, 0], [1, 2], through=np.ones((1, 2)))),
    ("values: truth", lambda: ck.check_values([True, False], ck.seal([True, False]))),
    ("function: lambda", lambda: ck.check_function(lambda x: x * x, np.square, [(np.arange(3.0),)])),
    ("function: list", lambda: ck.check_function(lambda x: [v * v for v in x], np.square, [(np.arange(3.0),)])),
    ("labels: words", lambda: ck.check_labels(list("bbac"), [0, 0, 1, 2])),
    ("choice: case and order", lambda: ck.check_choice(("B", " a"), ck.seal(["a", "b"]))),
    ("choice: truth", lambda: ck.check_choice(np.bool_(True), ck.seal(True))),
    ("dft: numpy", lambda: ck.check_dft(DFT, F)),
    ("dft: mean", lambda: ck.check_dft(DFT / 24, F)),
    ("dft: unitary", lambda: ck.check_dft(DFT / np.sqrt(24), F, scaling="unitary")),
    ("dft: rfft", lambda: ck.check_dft(np.fft.rfft(F), F)),
    ("dft: pair", lambda: ck.check_dft((DFT.real / 24, -DFT.imag / 24), F)),
    ("dft: matrix", lambda: ck.check_dft(scipy.linalg.dft(24), F)),
    ("dft: function", lambda: ck.check_dft(np.fft.fft, F, scaling="numpy")),
    ("dft: single precision", lambda: ck.check_dft(DFT.astype(np.complex64), F)),
    ("difference: sparse", lambda: ck.check_difference_matrix(sp.coo_array(D1), X)),
    ("difference: fourth order", lambda: ck.check_difference_matrix(fourth_order(), X)),
    ("difference: rows of fractions", lambda: ck.check_difference_matrix([[fractions.Fraction(v) for v in row] for row in D1], X)),
    ("difference: circle", lambda: ck.check_difference_matrix(-RING, ANGLES, derivative=2, length=2 * np.pi)),
    ("difference: spectral on a circle", lambda: ck.check_difference_matrix(spectral(), ANGLES, length=2 * np.pi)),
    ("laplacian: dense, other sign", lambda: ck.check_laplacian(-L.toarray(), BALL)),
    ("laplacian: single precision", lambda: ck.check_laplacian(L.astype(np.float32), BALL)),
    ("laplacian: the pair", lambda: ck.check_laplacian((L, M), BALL)),
    ("laplacian: old sparse matrix", lambda: ck.check_laplacian(sp.csc_matrix(L), L)),
    ("laplacian: graph", lambda: ck.check_laplacian(np.diag(W.sum(axis=0)) - W.toarray(), graph_laplacian(W)[0])),
    ("laplacian: duplicates in coo", lambda: ck.check_laplacian(doubled(L), L)),
    ("mass: diagonal", lambda: ck.check_mass_matrix(M.diagonal(), BALL)),
    ("mass: full", lambda: ck.check_mass_matrix(HAT, BALL)),
    ("mass: voronoi", lambda: ck.check_mass_matrix(mass_matrix(EGG, kind="voronoi"), EGG)),
    ("mass: any scale", lambda: ck.check_mass_matrix(7 * M, BALL, free_scale=True)),
    ("curvature: defects", lambda: ck.check_curvature(angle_defects(BALL)[:, None], BALL)),
    ("curvature: by thirds", lambda: ck.check_curvature(gaussian_curvature(BALL, mass="lumped"), BALL, kind="gaussian")),
    ("curvature: mean by thirds", lambda: ck.check_curvature(-mean_curvature(EGG, mass="lumped"), EGG, kind="mean")),
    ("curvature: by Voronoi areas", lambda: ck.check_curvature(gaussian_curvature(BALL), BALL, kind="gaussian")),
    ("curvature: mean of the other sign", lambda: ck.check_curvature(-mean_curvature(BALL), BALL, kind="mean")),
    ("eigenbasis: the library's", lambda: ck.check_eigenbasis(ball_basis(6), L, M, 6)),
    ("eigenbasis: signs", lambda: ck.check_eigenbasis((B.evals, -B.evecs), L, M, 9)),
    ("eigenbasis: turned", lambda: ck.check_eigenbasis((B.evals, rotated()), L, M, 9)),
    ("eigenbasis: cut eigenspace", lambda: ck.check_eigenbasis((B.evals[:3], rotated()[:, :3]), L, M, 3)),
    ("eigenbasis: single precision", lambda: ck.check_eigenbasis([np.float32(B.evals), np.float32(B.evecs)], L, M, 9)),
    ("eigenbasis: scipy", lambda: ck.check_eigenbasis(by_scipy(5), L, M, 5)),
    ("eigenbasis: all modes", lambda: ck.check_eigenbasis(scipy.linalg.eigh(*small()), *map(sp.csr_array, small()), 12)),
    ("coefficients: list", lambda: ck.check_coefficients(B.analyze(SIGNAL).tolist(), B, SIGNAL)),
    ("coefficients: a function", lambda: ck.check_coefficients(B.analyze, B, SIGNAL)),
    ("coefficients: three at once", lambda: ck.check_coefficients(B.evecs.T @ (M @ BALL.vertices), B, BALL.vertices)),
    ("embedding: signs", lambda: ck.check_embedding(-embedded(GPS), B, 3)),
    ("embedding: turned", lambda: ck.check_embedding(embedded(GPS) @ TURN, B, 3)),
    ("embedding: no weights", lambda: ck.check_embedding(embedded(np.ones(3)), B, 3, weights="none")),
    ("functional map", lambda: ck.check_functional_map(C_12.astype(np.float32), B, B2, P2P_21)),
    ("point map: floats", lambda: ck.check_point_map(P2P_21.astype(float), P2P_21, 162)),
    ("point map: one 1 a row", lambda: ck.check_point_map(np.eye(162)[P2P_21], P2P_21, 162)),
    ("point map: near", lambda: ck.check_point_map(P2P_21, P2P_21, 162, distances=DISTANCES, within=0.1)),
]


def fourth_order() -> np.ndarray:
    """A matrix of fourth order, from polynomials through five samples."""
    D = np.zeros((21, 21))
    for i in range(21):
        near = np.arange(5) + min(max(i - 2, 0), 16)
        powers = (X[near] - X[i]) ** np.arange(5)[:, None]
        D[i, near] = np.linalg.solve(powers, [0, 1, 0, 0, 0])
    return D


def first_order_ends() -> np.ndarray:
    """Central differences with one-sided first differences at the ends."""
    D = NAIVE.copy()
    D[0, :2], D[-1, -2:] = np.array([-1, 1]) / H, np.array([-1, 1]) / H
    return D


def spectral() -> np.ndarray:
    """The full matrix that multiplies coefficients by i k."""
    k = np.fft.fftfreq(24, 1 / 24)
    k[12] = 0
    return np.fft.ifft(1j * k[:, None] * np.fft.fft(np.eye(24), axis=0), axis=0).real


def doubled(A: sp.csr_array) -> sp.coo_array:
    """The same matrix, each entry stored in two halves."""
    a = sp.coo_array(A)
    return sp.coo_array((np.tile(a.data / 2, 2), (np.tile(a.row, 2), np.tile(a.col, 2))), a.shape)


def by_scipy(k: int) -> tuple[np.ndarray, np.ndarray]:
    """Modes from a dense solver."""
    return scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[0, k - 1])


@lru_cache
def small() -> tuple[np.ndarray, np.ndarray]:
    """The pair of an icosahedron."""
    pair = cotan_laplacian(shapes.sphere(0))
    return pair[0].toarray(), pair[1].toarray()


def small_modes() -> tuple[np.ndarray, np.ndarray]:
    """All modes of the icosahedron."""
    return scipy.linalg.eigh(*small())


def without(A: np.ndarray, row: int) -> np.ndarray:
    """A matrix with one empty row."""
    B = np.array(A)
    B[row] = 0
    return B


def swapped() -> np.ndarray:
    """Modes 0 and 5 swapped, eigenvalues not."""
    return B.evecs[:, [5, 1, 2, 3, 4, 0, 6, 7, 8]]


WRONG: list[Case] = [
    ("number: half a turn off", lambda: ck.check_number(0.5 + np.pi, 0.5, modulo=2 * np.pi), "Your number is"),
    ("number: infinity is no phase", lambda: ck.check_number(np.inf, 0.5, modulo=2 * np.pi), "finite"),
    ("choice: 1 for a word", lambda: ck.check_choice(1, "true north"), "not what the numbers say"),
    ("choice: no for True", lambda: ck.check_choice("no", True), "not what the numbers say"),
    ("function: misses sealed values", lambda: ck.check_function(lambda x: x, ck.seal([4, 9]), [(2,), (3,)]), "test input 1"),
    ("values: the image is another", lambda: ck.check_values([3, 1, 5], [3, 0], through=[[1, 0, 0], [0, 1, 0]]), "What the matrix makes"),
    ("number: sign", lambda: ck.check_number(-2, 2, law="order 2"), "order 2"),
    ("number: factor", lambda: ck.check_number(4 * np.pi, 2.0), "a factor of 2 pi"),
    ("number: degrees", lambda: ck.check_number(180.0, np.pi), "degrees"),
    ("number: text", lambda: ck.check_number("2", 2), "text came"),
    ("number: two of them", lambda: ck.check_number([2, 2], 2), "shape (2,)"),
    ("number: known slip", lambda: ck.check_number(3, 2, slips={3: "Was the zero mode counted?"}), "zero mode counted"),
    ("number: not a number", lambda: ck.check_number(float("nan"), 2), "finite"),
    ("values: shifted", lambda: ck.check_values([3, 1, 2.5], [1, 2.5, 3]), "shifted by one"),
    ("values: reversed", lambda: ck.check_values([4, 2, 1, 1], [1, 1, 2, 4]), "reverse order"),
    ("values: unsorted", lambda: ck.check_values([9, 1, 4, 16], [1, 4, 9, 16]), "another order"),
    ("values: roots", lambda: ck.check_values([1, 2, 3, 4], [1, 4, 9, 16]), "a square missing"),
    ("values: squares", lambda: ck.check_values([1, 4, 9, 16], [1, 2, 3, 4]), "a square root missing"),
    ("values: too many", lambda: ck.check_values([1, 2, 3], [1, 2]), "shape (2,)"),
    ("values: factor", lambda: ck.check_values([2, 4], [1, 2]), "the same slip: a factor of 2"),
    ("values: zero for a null vector", lambda: ck.check_values(np.zeros(3), np.zeros(3), through=[[1, 1, 1]]), "every matrix maps to zero"),
    ("values: other image", lambda: ck.check_values([3, 1], [1, 2], through=np.ones((1, 2))), "differs by 1"),
    ("function: raises", lambda: ck.check_function(raises, np.square, [(1.0,)]), "ZeroDivisionError: by h"),
    ("function: called", lambda: ck.check_function(4.0, np.square, [(2.0,)]), "uncalled"),
    ("function: wrong at one input", lambda: ck.check_function(abs, lambda x: x, [(1.0,), (-2.0,)]), "input 2 of 2"),
    ("labels: merged", lambda: ck.check_labels([0, 0, 0, 0], [0, 0, 1, 2]), "1 parts where 3"),
    ("labels: too few", lambda: ck.check_labels([0, 0], [0, 0, 1]), "2 labels came for 3"),
    ("choice: other", lambda: ck.check_choice("egg", "potato", law="lambda A is free of scale"), "free of scale"),
    ("choice: known slip", lambda: ck.check_choice("egg", "potato", slips={"egg": "Raw, size counts."}), "size counts"),
    ("dft: sign", lambda: ck.check_dft(DFT.conj(), F), "exp(-i) belongs"),
    ("dft: off by one", lambda: ck.check_dft(np.roll(DFT, 1), F), "off by one"),
    ("dft: shifted", lambda: ck.check_dft(np.fft.fftshift(DFT), F), "fftshift"),
    ("dft: cosines only", lambda: ck.check_dft(DFT.real, F), "Only the cosines"),
    ("dft: scale", lambda: ck.check_dft(DFT / 24, F, scaling="numpy"), "that of 'mean'"),
    ("dft: twice", lambda: ck.check_dft(2 * DFT / 24, F), "a factor of 2"),
    ("dft: pair with the sign of numpy", lambda: ck.check_dft((DFT.real / 24, DFT.imag / 24), F), "wrong sign"),
    ("dft: one frequency lost", lambda: ck.check_dft(DFT * (np.arange(24) != 7), F), "index 7"),
    ("difference: empty end rows", lambda: ck.check_difference_matrix(without(without(D1, 0), -1), X), "end rows are empty"),
    ("difference: naive ends", lambda: ck.check_difference_matrix(NAIVE, X), "one-sided stencils"),
    ("difference: h for 2h", lambda: ck.check_difference_matrix(2 * D1, X), "2h belongs"),
    ("difference: 2h for h", lambda: ck.check_difference_matrix(D1 / 2, X), "where h belongs"),
    ("difference: sign", lambda: ck.check_difference_matrix(-D1, X), "sign turned"),
    ("difference: no h", lambda: ck.check_difference_matrix(D1 * H, X), "not divided by h"),
    ("difference: ends of order one", lambda: ck.check_difference_matrix(first_order_ends(), X), "x^2"),
    ("difference: second, h once", lambda: ck.check_difference_matrix(-RING * ANGLES[1], ANGLES, derivative=2, length=2 * np.pi), "h once"),
    ("difference: second, sign", lambda: ck.check_difference_matrix(RING, ANGLES, derivative=2, length=2 * np.pi), "sign turned"),
    ("difference: circle not closed", lambda: ck.check_difference_matrix(np.triu(np.tril(-RING, 1), -1), ANGLES, derivative=2, length=2 * np.pi), "corners"),
    ("difference: shape", lambda: ck.check_difference_matrix(D1[1:], X), "shape (20, 21)"),
    ("laplacian: no diagonal", lambda: ck.check_laplacian(L - sp.diags_array(L.diagonal()), BALL), "diagonal missing"),
    ("laplacian: D + W", lambda: ck.check_laplacian(abs(L), BALL), "same sign"),
    ("laplacian: pointwise", lambda: ck.check_laplacian(sp.diags_array(1 / M.diagonal()) @ L, BALL), "divided by the mass"),
    ("laplacian: sign", lambda: ck.check_laplacian(-L, BALL, either_sign=False), "positive semidefinite"),
    ("laplacian: twice", lambda: ck.check_laplacian(2 * L, BALL), "a factor of 2"),
    ("laplacian: one side of each edge", lambda: ck.check_laplacian(sp.triu(L) + sp.diags_array(L.sum(axis=1) - sp.triu(L).sum(axis=1)), BALL), "symmetric"),
    ("laplacian: graph for cotan", lambda: ck.check_laplacian(graph_laplacian(W)[0], cotan_laplacian(EGG)[0]), "opposite the edge"),
    ("laplacian: squared", lambda: ck.check_laplacian(L @ L, BALL), "no edge joins"),
    ("laplacian: other mesh", lambda: ck.check_laplacian(cotan_laplacian(shapes.sphere(1))[0], BALL), "shape (162, 162)"),
    ("laplacian: a patch lost", lambda: ck.check_laplacian(of_part(), BALL), "entries are missing"),
    ("laplacian: zeros", lambda: ck.check_laplacian(np.zeros((162, 162)), BALL), "Every entry is zero"),
    ("mass: full area for each corner", lambda: ck.check_mass_matrix(3 * M, BALL), "3 times the right total"),
    ("mass: identity scaled", lambda: ck.check_mass_matrix(np.full(162, M.sum() / 162), BALL), "shares are not"),
    ("mass: inverse", lambda: ck.check_mass_matrix(1 / M.diagonal(), BALL), "sum to the area"),
    ("mass: negative", lambda: ck.check_mass_matrix(-M, BALL), "M is positive"),
    ("mass: lumped for voronoi", lambda: ck.check_mass_matrix(mass_matrix(EGG), EGG, kind="voronoi"), "share of each vertex"),
    ("mass: lumped for full", lambda: ck.check_mass_matrix(M, BALL, kind="full"), "share of each vertex"),
    ("mass: no spacing", lambda: ck.check_mass_matrix(np.ones(21), np.diag(np.full(21, H))), "is the spacing in it"),
    ("curvature: degrees", lambda: ck.check_curvature(np.degrees(angle_defects(BALL)), BALL), "degrees"),
    ("curvature: angles", lambda: ck.check_curvature(2 * np.pi - angle_defects(BALL), BALL), "full turn"),
    ("curvature: not per area", lambda: ck.check_curvature(angle_defects(BALL), BALL, kind="gaussian"), "divide by the area"),
    ("curvature: per area", lambda: ck.check_curvature(gaussian_curvature(BALL), BALL), "2 pi chi"),
    ("curvature: mean twice", lambda: ck.check_curvature(2 * mean_curvature(EGG), EGG, kind="mean"), "stretched by 2 H"),
    ("eigenbasis: orthonormal without M", lambda: ck.check_eigenbasis((B.evals, unscaled()), L, M, 9), "evecs.T @ M @ evecs"),
    ("eigenbasis: no zero mode", lambda: ck.check_eigenbasis((B.evals[1:], B.evecs[:, 1:]), L, M, 8), "zero mode is missing"),
    ("eigenbasis: largest", lambda: ck.check_eigenbasis(largest_modes(), L, M, 4), "the largest ones"),
    ("eigenbasis: roots", lambda: ck.check_eigenbasis((np.sqrt(B.evals), B.evecs), L, M, 9), "frequencies"),
    ("eigenbasis: negative", lambda: ck.check_eigenbasis((-B.evals[::-1], B.evecs[:, ::-1]), L, M, 9), "other sign"),
    ("eigenbasis: descending", lambda: ck.check_eigenbasis((B.evals[::-1], B.evecs[:, ::-1]), L, M, 9), "ascend"),
    ("eigenbasis: out of step at the top", lambda: ck.check_eigenbasis((small_modes()[0], small_modes()[1][:, [*range(3), 11, *range(4, 11), 3]]), *map(sp.csr_array, small()), 12), "same order"),
    ("eigenbasis: three percent off", lambda: ck.check_eigenbasis((B.evals * [1, 1.03, 1.03, 1.03, 1, 1, 1, 1, 1], B.evecs), L, M, 9), "smallest of"),
    ("eigenbasis: out of step", lambda: ck.check_eigenbasis((B.evals, swapped()), L, M, 9), "same order"),
    ("eigenbasis: of L alone", lambda: ck.check_eigenbasis(np.linalg.eigh(L.toarray()), L, M, 162), "smallest of"),
    ("eigenbasis: transposed", lambda: ck.check_eigenbasis((B.evals, B.evecs.T), L, M, 9), "transposed"),
    ("eigenbasis: too few", lambda: ck.check_eigenbasis(ball_basis(4), L, M, 9), "9 modes are asked for"),
    ("eigenbasis: vectors only", lambda: ck.check_eigenbasis(B.evecs, L, M, 9), "pair (evals, evecs)"),
    ("coefficients: no mass", lambda: ck.check_coefficients(B.evecs.T @ SIGNAL, B, SIGNAL), "without M"),
    ("coefficients: signs", lambda: ck.check_coefficients(-B.analyze(SIGNAL), B, SIGNAL), "signs are turned"),
    ("coefficients: too many", lambda: ck.check_coefficients(SIGNAL, B, SIGNAL), "shape (9,)"),
    ("embedding: zero mode", lambda: ck.check_embedding(embedded(np.ones(3), 0), B, 3), "leave the zero mode out"),
    ("embedding: not weighted", lambda: ck.check_embedding(embedded(np.ones(3)), B, 3), "not weighted"),
    ("embedding: wrong weights", lambda: ck.check_embedding(embedded(1 / GPS), B, 3), "sqrt(lambda)"),
    ("embedding: wrong modes", lambda: ck.check_embedding(embedded(GPS, 4), B, 3), "in order"),
    ("embedding: one mode twice", lambda: ck.check_embedding(embedded(GPS)[:, [0, 0, 1]], B, 3), "orthogonal in M"),
    ("embedding: division by zero", lambda: ck.check_embedding(embedded(np.array([np.inf, 1, 1])), B, 3), "division by zero"),
    ("functional map: transposed", lambda: ck.check_functional_map(C_12.T, B, B2, P2P_21), "from 2 to 1"),
    ("functional map: shape of the other way", lambda: ck.check_functional_map(C_12[:, :5], B.truncate(9), B2.truncate(5), P2P_21), "from 2 to 1"),
    ("functional map: no mass", lambda: ck.check_functional_map(B2.evecs.T @ B.evecs[P2P_21], B, B2, P2P_21), "without the mass"),
    ("functional map: signs", lambda: ck.check_functional_map(-C_12, B, B2, P2P_21), "signs"),
    ("functional map: noise", lambda: ck.check_functional_map(C_12 + 0.3, B, B2, P2P_21), "constant function"),
    ("point map: inverse", lambda: ck.check_point_map(INVERSE, P2P_21, 162), "from 1 to 2"),
    ("point map: counts from 1", lambda: ck.check_point_map(P2P_21 + 1, P2P_21, 162), "count from 1"),
    ("point map: all to one", lambda: ck.check_point_map(np.zeros(162), P2P_21, 162), "one vertex"),
    ("point map: halves", lambda: ck.check_point_map(P2P_21 / 2, P2P_21, 162), "whole numbers"),
    ("point map: far", lambda: ck.check_point_map(P2P_21[::-1], P2P_21, 162, distances=DISTANCES, within=0.1), "mean distance"),
    ("point map: length of the other way", lambda: ck.check_point_map(np.arange(162), P2P_21[:50], 162), "from 1 to 2"),
]


def of_part() -> np.ndarray:
    """A Laplacian that missed some triangles."""
    part = TriangleMesh(BALL.vertices, BALL.faces[5:])
    return cotan_laplacian(part)[0].toarray()


def largest_modes() -> tuple[np.ndarray, np.ndarray]:
    """The four modes at the wrong end of the list."""
    return scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[158, 161])


@pytest.mark.parametrize("judge", [case[1] for case in RIGHT], ids=[case[0] for case in RIGHT])
def test_a_right_answer_passes(judge: Callable[[], ck.Verdict]) -> None:
    verdict = judge()
    assert verdict, str(verdict)


@pytest.mark.parametrize(("judge", "named"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG])
def test_a_wrong_answer_is_told_its_law(judge: Callable[[], ck.Verdict], named: str) -> None:
    verdict = judge()
    assert verdict.status == "wrong"
    assert named in str(verdict)
    assert verdict.law, "no law is named"


def test_the_banks_are_as_large_as_promised_and_cover_every_check() -> None:
    assert len(WRONG) >= 40 and len(RIGHT) >= 20
    checks = {"_".join(name.split("_")[1:]) for name in ck.__all__ if name.startswith("check_")} - {"result"}
    for bank in (RIGHT, WRONG):
        covered = {case[0].split(":")[0].replace(" ", "_") for case in bank}
        assert covered == {name.removesuffix("_matrix") for name in checks}


def test_a_wrong_shape_is_the_message_and_the_wanted_one_the_law() -> None:
    verdict = ck.check_values([1.0, 2.0], [1.0, 2.0, 3.0])
    assert (verdict.message, verdict.law) == ("The shape (2,) came.", "the answer has shape (3,)")


# --- placeholders and strange things --------------------------------------------------------------------------------

CHECKS: dict[str, Callable[[object], ck.Verdict]] = {
    "number": lambda a: ck.check_number(a, 2.0),
    "values": lambda a: ck.check_values(a, [1.0, 2.0, 3.0]),
    "function": lambda a: ck.check_function(a, np.square, [(2.0,)]),
    "labels": lambda a: ck.check_labels(a, [0, 0, 1]),
    "choice": lambda a: ck.check_choice(a, "egg"),
    "dft": lambda a: ck.check_dft(a, F),
    "difference": lambda a: ck.check_difference_matrix(a, X),
    "laplacian": lambda a: ck.check_laplacian(a, BALL),
    "mass": lambda a: ck.check_mass_matrix(a, BALL),
    "curvature": lambda a: ck.check_curvature(a, BALL),
    "eigenbasis": lambda a: ck.check_eigenbasis(a, *map(sp.csr_array, small()), 3),
    "coefficients": lambda a: ck.check_coefficients(a, B, SIGNAL),
    "embedding": lambda a: ck.check_embedding(a, B, 3),
    "functional map": lambda a: ck.check_functional_map(a, B, B2, P2P_21),
    "point map": lambda a: ck.check_point_map(a, P2P_21, 162),
}
each_check = pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS.keys())


def unwritten(*_: object) -> None:
    raise NotImplementedError


@each_check
@pytest.mark.parametrize("placeholder", [None, ..., NotImplemented, "...", "", (None, None), [..., 1.0], (..., ...)])
def test_a_placeholder_is_told_kindly(check: Callable[[object], ck.Verdict], placeholder: object) -> None:
    verdict = check(placeholder)
    assert verdict.status == "unattempted" and not verdict
    assert str(verdict).startswith("Not attempted yet.")


@pytest.mark.parametrize("placeholder", [unwritten, lambda *_: None, lambda *_: ...])
@pytest.mark.parametrize("check", ["function", "dft"])
def test_a_function_without_a_body_is_told_kindly(check: str, placeholder: object) -> None:
    assert CHECKS[check](placeholder).status == "unattempted"


class Hostile:
    """An object whose every way of being read fails."""

    shape = property(lambda self: 1 / 0)

    def __array__(self, *_: object, **__: object) -> np.ndarray:
        raise RuntimeError("no")

    def __len__(self) -> int:
        raise RuntimeError("no")

    def __str__(self) -> str:
        raise RuntimeError("no")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("no")

    __hash__ = None


def quits(*_: object) -> None:
    raise SystemExit("bye")


STRANGE = [
    "text", b"bytes", {}, {"a": 1}, set(), object(), Hostile(), Hostile, raises, quits, print, lambda: 1, float("nan"), np.nan, np.inf,
    -1, 0, 10**400, 1e308, 1j, True, [], [[]], [1, [2, 3]], ["a", "b", "c"], [1, None, 2], (1,), (1, 2), (1, 2, 3), [Hostile()] * 3, (Hostile(), Hostile()),
    np.zeros(0), np.zeros((0, 0)), np.zeros((3, 0)), np.full(3, np.nan), np.full((162, 162), np.inf), np.full((162, 162), 1e300),
    np.full((162, 162), 1j), np.zeros((162, 162)), np.array(["a"] * 3), np.array([None] * 3), np.array([object()] * 3), np.zeros(3, dtype="M8[s]"),
    np.zeros(3, dtype=[("a", float)]), np.ma.masked_all(3), sp.csr_array((162, 162)), sp.csr_array((1, 1)), sp.coo_array(([np.nan], ([0], [0])), (162, 162)),
    sp.csr_array(np.eye(162) * 1j), sp.dok_array((162, 162)), sp.coo_array(np.ones(3)), BALL, B, ck.check_dft, iter([1, 2, 3]), range(162), np.float16(3), memoryview(b"abc"),
    (L, "M"), ("L", M), np.random.default_rng(0), Exception("x"), type, np,
]


@each_check
@pytest.mark.parametrize("strange", STRANGE, ids=[f"{n}-{type(x).__name__}" for n, x in enumerate(STRANGE)])
def test_no_answer_makes_a_check_raise(check: Callable[[object], ck.Verdict], strange: object) -> None:
    verdict = check(strange)
    assert isinstance(verdict, ck.Verdict)
    assert verdict.message and str(verdict)


SHAPES = st.sampled_from([(), (1,), (3,), (24,), (24, 24), (21, 21), (162,), (162, 3), (9,), (9, 9), (12, 3), (60, 12), (162, 162), (0,)])
NUMBERS = SHAPES.flatmap(
    lambda shape: hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.int64, np.int8, np.bool_, np.complex128]), shape, fill=st.nothing() if not shape else None
    )
)
SCRAPS = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.complex_numbers(), st.text(max_size=3), st.binary(max_size=3))
ANYTHING = st.one_of(
    NUMBERS,
    st.recursive(SCRAPS, lambda inner: st.one_of(st.lists(inner, max_size=4), st.tuples(inner, inner), st.dictionaries(st.text(max_size=2), inner, max_size=2)), max_leaves=6),
    st.tuples(NUMBERS, NUMBERS),
    NUMBERS.filter(lambda a: a.ndim == 2).map(sp.csr_array),
)


@each_check
@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(answer=ANYTHING)
def test_whatever_is_passed_a_verdict_comes_back(check: Callable[[object], ck.Verdict], answer: object) -> None:
    verdict = check(answer)
    assert verdict.status in ("right", "wrong", "unattempted")
    assert verdict.message and str(verdict)


@settings(max_examples=25)
@given(angles=st.lists(st.floats(-3, 3), min_size=3, max_size=3), signs=st.lists(st.sampled_from([-1.0, 1.0]), min_size=9, max_size=9))
def test_every_basis_of_a_repeated_eigenspace_passes(angles: list[float], signs: list[float]) -> None:
    a, b, c = angles
    turn = scipy.linalg.expm(np.array([[0, a, b], [-a, 0, c], [-b, -c, 0]]))
    evecs = B.evecs.copy()
    evecs[:, 1:4] = evecs[:, 1:4] @ turn
    assert ck.check_eigenbasis((B.evals, evecs * signs), L, M, 9)


# --- verdicts ------------------------------------------------------------------------------------------------------


def test_a_verdict_reads_well_and_is_frozen() -> None:
    verdict = ck.check_number(3, 2, law="the order is 2")
    assert repr(verdict) == str(verdict) == "Not right. Your number is 3.\nThe law: the order is 2."
    assert verdict._repr_markdown_() == "**Not right.** Your number is 3.\n\nThe law: the order is 2."
    assert not verdict and ck.check_number(2, 2)
    with pytest.raises(AttributeError):
        verdict.status = "right"  # type: ignore[misc]


def test_a_wrong_number_does_not_say_the_right_one() -> None:
    assert "7.25" not in str(ck.check_number(3, 7.25)) + str(ck.check_values([3, 4], [7.25, 1]))


def test_sealed_answers_are_not_read_at_a_glance() -> None:
    assert "42" not in ck.seal(42) and "egg" not in ck.seal("egg")
    assert ck.check_number(42, ck.seal(42)) and not ck.check_number(41, ck.seal(42))


def test_a_mistake_in_the_question_is_no_verdict() -> None:
    with pytest.raises(ValueError, match="scaling"):
        ck.check_dft(DFT, F, scaling="other")
    with pytest.raises(ValueError, match="symmetric"):
        ck.check_laplacian(L, sp.triu(L))
    with pytest.raises(ValueError, match="kind"):
        ck.check_mass_matrix(M, BALL, kind="other")


def test_an_interval_is_judged_like_a_surface() -> None:
    pair = interval_laplacian(41)
    assert ck.check_eigenbasis(compute_eigenbasis(*pair, 5), *pair, 5)
    assert ck.check_mass_matrix(pair[1].diagonal(), pair[1])
    assert ck.check_laplacian(pair[0].toarray(), pair[0])
