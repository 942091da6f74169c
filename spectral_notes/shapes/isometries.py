"""Surfaces that change their form in space and keep every length: a sheet of paper, and a cap that is pushed in."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import as_count, as_number
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.triangulations import grid_faces, ring_coordinates, ring_faces


def sheet(bend: float = 0.0, n_long: int = 61, n_wide: int = 37) -> TriangleMesh:
    """Return a sheet of paper, 1 by 0.6, bent without stretching: every edge keeps its length to rounding.

    Its cross-section is a chain of equal chords that follows a logarithmic spiral whose radius doubles with each turn,
    so that a rolled sheet does not meet itself. The rulings run along y. The faces do not depend on `bend`: vertex
    ``i * n_wide + j`` is always the same point of paper.

    Parameters
    ----------
    bend : the angle in radians by which the sheet turns from its first chord to its last
        0 is flat, 2.4 an arch, 4 pi a roll of two turns; negative values bend the other way.
    n_long, n_wide : vertices along the length and across, at least 2

    Examples
    --------
    >>> from spectral_notes.meshes import edge_lengths
    >>> flat, rolled = sheet(), sheet(bend=4 * np.pi)
    >>> bool(np.abs(edge_lengths(flat) - edge_lengths(rolled)).max() < 1e-15)
    True
    """
    bend = as_number("bend", bend)
    n_long, n_wide = as_count("n_long", n_long, 2), as_count("n_wide", n_wide, 2)
    growth = np.log(2.0) / (2.0 * np.pi)
    s = np.linspace(0.0, 1.0, n_long - 1)
    turn = np.sign(bend) * np.log1p(s * np.expm1(growth * abs(bend))) / growth
    angle = bend / 2.0 - turn
    step = 1.0 / (n_long - 1)
    x = np.concatenate([[0.0], np.cumsum(step * np.cos(angle))])
    z = np.concatenate([[0.0], np.cumsum(step * np.sin(angle))])
    y = np.linspace(0.0, 0.6, n_wide)
    vertices = np.column_stack([np.repeat(x, n_wide), np.tile(y, n_long), np.repeat(z, n_wide)])
    return TriangleMesh(vertices, grid_faces(n_long, n_wide), "sheet")


def spherical_cap(half_angle: float = 1.2, n_rings: int = 36, rings_pushed_in: int = 0) -> TriangleMesh:
    """Return a cap of the unit sphere about the z axis; its innermost rings may be pushed in without stretching.

    Ring k of the mesh is the circle at the angle ``half_angle * k / n_rings`` from the pole. Pushing in mirrors the
    part inside a ring in the plane of that ring: all edges keep their lengths, yet no motion carries one cap to the
    other. The faces do not depend on it.

    Parameters
    ----------
    half_angle : angle from the pole to the boundary in radians, between 0 and pi
    n_rings : rings of triangles; the mesh has ``1 + 3 * n_rings * (n_rings + 1)`` vertices
    rings_pushed_in : how many of the rings lie inside the mirror, 0 to n_rings

    Examples
    --------
    >>> from spectral_notes.meshes import edge_lengths
    >>> bump, dent = spherical_cap(), spherical_cap(rings_pushed_in=18)
    >>> bool(np.abs(edge_lengths(bump) - edge_lengths(dent)).max() < 1e-15)
    True
    """
    half_angle = as_number("half_angle", half_angle, above=0.0)
    if half_angle >= np.pi:
        raise ValueError(f"half_angle must be less than pi; got {half_angle:g}")
    n_rings = as_count("n_rings", n_rings, 1)
    rings_pushed_in = as_count("rings_pushed_in", rings_pushed_in, 0, n_rings)
    ring, around = ring_coordinates(n_rings)
    polar = half_angle * ring / n_rings
    height = np.cos(polar)
    mirror = np.cos(half_angle * rings_pushed_in / n_rings)
    height = np.where(ring < rings_pushed_in, 2.0 * mirror - height, height)
    vertices = np.column_stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), height])
    return TriangleMesh(vertices, ring_faces(n_rings), "cap_pushed_in" if rings_pushed_in else "cap")
