"""Small named meshes with facts that are known without computing them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings

from spectral_notes.meshes import TriangleMesh

settings.register_profile("on any machine", deadline=None)  # no example fails for the time it takes
settings.load_profile("on any machine")


@pytest.fixture
def tetrahedron() -> TriangleMesh:
    """Regular, edges of length sqrt(8), closed, outward: 4 vertices, 6 edges, 4 faces, chi = 2."""
    vertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    return TriangleMesh(vertices, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], name="tetrahedron")


@pytest.fixture
def unit_square() -> TriangleMesh:
    """Unit square cut along the diagonal 0-2: area 1, one boundary loop, chi = 1."""
    return TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], name="square")


@pytest.fixture
def mobius() -> TriangleMesh:
    """Möbius strip of 12 vertices and 12 faces: no consistent orientation, one boundary loop of 12 edges, chi = 0."""
    turn = np.pi * np.arange(6) / 3
    across = 0.3 * np.stack([np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2)], axis=1)
    middle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    vertices = np.stack([middle - across, middle + across], axis=1).reshape(-1, 3)
    faces = []
    for i in range(6):
        a, b, c, d = (2 * i, 2 * i + 1, (2 * i + 2) % 12, (2 * i + 3) % 12)
        if i == 5:  # the ends meet with the sides exchanged
            c, d = d, c
        faces += [[a, b, c], [b, d, c]]
    return TriangleMesh(vertices, faces, name="mobius")


@pytest.fixture
def book_of_three() -> TriangleMesh:
    """Three triangles on one edge, like pages of a book: a non-manifold edge 0-1 with three faces on it."""
    vertices = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]]
    return TriangleMesh(vertices, [[0, 1, 2], [0, 1, 3], [0, 1, 4]], name="book")
