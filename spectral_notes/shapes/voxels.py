"""Solids made of equal cubes: which voxels of a grid lie inside a mesh, the skin of their faces, and their graph.

A voxel grid is a picture in three dimensions, as scanners make them. Two eigenproblems live on it: that of the solid,
by the graph or the tetrahedra of its voxels, and that of a surface, by its skin or by a shell of voxels around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray, as_floats, as_number
from spectral_notes.meshes import TriangleMesh, is_closed

MAX_VOXELS = 30_000_000


@dataclass(frozen=True, eq=False, repr=False)
class VoxelGrid:
    """Hold which cubes of a regular grid belong to a solid; checked when made, and read-only.

    Parameters
    ----------
    inside : (n_x, n_y, n_z) of booleans, whether each cube belongs to the solid; at least one does
    corner : (3,), corner of the cube (0, 0, 0) with the smallest coordinates
    step : edge length of the cubes, positive, in the unit of the corner
    name : what the solid is called, for titles

    Examples
    --------
    >>> VoxelGrid(np.ones((2, 1, 1), dtype=bool), (0, 0, 0), 0.5)
    VoxelGrid('', 2 voxels of edge 0.5)
    """

    inside: NDArray[np.bool_]
    corner: FloatArray
    step: float
    name: str = ""

    def __post_init__(self) -> None:
        inside = np.array(self.inside)
        if inside.dtype != np.bool_ or inside.ndim != 3:
            raise TypeError(
                f"inside must be a three-dimensional array of booleans; got {inside.dtype}, {inside.ndim} axes"
            )
        if not inside.any():
            raise ValueError("inside must mark at least one voxel; a smaller step may find some")
        corner = as_floats("corner", self.corner, (3,))
        for array in (inside, corner):
            array.flags.writeable = False
        object.__setattr__(self, "inside", inside)
        object.__setattr__(self, "corner", corner)
        object.__setattr__(self, "step", as_number("step", self.step, above=0.0))

    def __repr__(self) -> str:
        return f"VoxelGrid({self.name!r}, {self.n_voxels} voxels of edge {self.step:g})"

    @property
    def n_voxels(self) -> int:
        """Number of cubes that belong to the solid."""
        return int(self.inside.sum())

    @property
    def volume(self) -> float:
        """Volume of these cubes."""
        return self.n_voxels * self.step**3

    @property
    def centers(self) -> FloatArray:
        """Centres of these cubes, shape (n_voxels, 3), in the order of ``np.argwhere(inside)``."""
        return np.asarray(self.corner + self.step * (np.argwhere(self.inside) + 0.5))


def voxelize(mesh: TriangleMesh, step: float) -> VoxelGrid:
    """Return the cubes whose centres lie inside a closed mesh: those that the surface winds around.

    The winding number of a point is the solid angle under which it sees the surface over 4 pi: 1 inside, 0 outside, and
    -1 inside a mesh whose normals point in (Barill et al., "Fast winding numbers for soups and clouds", 2018). A rim of
    empty cubes stays around the mesh.

    Parameters
    ----------
    mesh : a closed mesh whose faces agree which side is out
    step : edge length of the cubes, in units of the vertices
        Not so small that the grid is enormous, nor so large that no centre lies inside.

    Examples
    --------
    >>> from spectral_notes.shapes.surfaces import sphere
    >>> ball = voxelize(sphere(4), 0.05)
    >>> round(ball.volume / (4 * np.pi / 3), 2)
    1.0
    """
    if not is_closed(mesh):
        raise ValueError("mesh must be closed to have an inside; it has boundary edges")
    corner, shape, centers = _grid_around(mesh, step, 1)
    winding = np.asarray(igl.fast_winding_number(mesh.vertices, mesh.faces, centers))
    return VoxelGrid((np.abs(winding) > 0.5).reshape(shape), corner, step, f"{mesh.name}_voxels".removeprefix("_"))


def voxel_shell(mesh: TriangleMesh, step: float, half_width: float = 2.0) -> VoxelGrid:
    """Return the cubes whose centres are at most `half_width` steps from a mesh: a thick skin, inside and outside.

    A thin shell remembers distances along the surface, whatever its slope to the grid; the faces of cubes do not. The
    eigenvalues of `voxel_graph` over step^2 tend to those of the surface as the steps shrink and many make the width.
    Where the surface lies askew to the grid they are too low by about 1 / (4 half_width): the outermost cubes are dead
    ends.

    Parameters
    ----------
    mesh : the surface, closed or with a boundary
    step : edge length of the cubes, in units of the vertices, as for `voxelize`
    half_width : largest distance of a centre from the surface, in steps, positive

    Examples
    --------
    >>> from spectral_notes.shapes.surfaces import sphere
    >>> ball = sphere(4)
    >>> shell = voxel_shell(ball, 0.05, 2.0)
    >>> round(shell.volume / (4 * 0.05 * ball.area), 1)
    1.0
    """
    half_width = as_number("half_width", half_width, above=0.0)
    corner, shape, centers = _grid_around(mesh, step, int(np.ceil(half_width)) + 1)
    squared = np.asarray(igl.point_mesh_squared_distance(centers, mesh.vertices, mesh.faces)[0])
    inside = (squared <= (half_width * step) ** 2).reshape(shape)
    return VoxelGrid(inside, corner, step, f"{mesh.name}_shell".removeprefix("_"))


def voxel_skin(grid: VoxelGrid) -> TriangleMesh:
    """Return the faces between cubes of the solid and empty ones, each square cut in two triangles, normals out.

    The skin is closed. Where cubes touch along an edge or in a corner only, it is not a manifold there. Its area does
    not tend to that of the surface it stands for: a sphere's skin keeps 3/2 of the sphere's area at every step.

    Examples
    --------
    >>> skin = voxel_skin(VoxelGrid(np.ones((3, 2, 1), dtype=bool), (0, 0, 0), 1.0))
    >>> skin.area
    22.0
    """
    padded = np.pad(grid.inside, 1)
    squares = []
    for axis in range(3):
        across, up = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3]]
        for side in (0, 1):
            neighbor = np.roll(padded, 1 - 2 * side, axis=axis)
            base = np.argwhere(padded & ~neighbor) - 1
            base[:, axis] += side
            square = np.stack([base, base + across, base + across + up, base + up], axis=1)  # counter-clockwise: axis
            squares.append(square if side else square[:, ::-1])
    corners = np.concatenate(squares).reshape(-1, 3)
    used, place = np.unique(corners, axis=0, return_inverse=True)
    a, b, c, d = place.reshape(-1, 4).T
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return TriangleMesh(grid.corner + grid.step * used, faces, grid.name)


def voxel_graph(grid: VoxelGrid) -> sp.csr_array:
    """Return the weights of the graph that joins cubes of the solid with a common face, each with weight 1.

    The eigenvalues of its Laplacian over step^2 tend to those of the solid with free boundary (Neumann). Rows and
    columns of the sparse matrix are in the order of ``grid.centers``.

    Examples
    --------
    >>> row = VoxelGrid(np.ones((3, 1, 1), dtype=bool), (0, 0, 0), 1.0)
    >>> voxel_graph(row).toarray().tolist()
    [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    """
    number = np.full(grid.inside.shape, -1)
    number[grid.inside] = np.arange(grid.n_voxels)
    pairs = []
    for axis in range(3):
        along = np.moveaxis(number, axis, 0)
        pairs.append(np.column_stack([along[:-1].ravel(), along[1:].ravel()]))
    joined = np.concatenate(pairs)
    i, j = joined[(joined >= 0).all(axis=1)].T
    n = grid.n_voxels
    return sp.csr_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), (n, n))


def voxel_tetrahedra(grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """Return the solid cut into tetrahedra, six to a cube, round the diagonal that points away from the middle.

    Each tetrahedron walks along three edges from the cube's corner next to the middle to the one opposite. So none of
    them crosses a plane of symmetry of the grid, and a full cube of an even number of steps can be pushed to a ball
    (Kuhn, "Some combinatorial lemmas in topology", 1960). The vertices (n, 3) are the corners of the cubes, the
    tetrahedra (6 n_voxels, 4) name four of them each.

    Examples
    --------
    >>> vertices, tets = voxel_tetrahedra(VoxelGrid(np.ones((2, 1, 1), dtype=bool), (0, 0, 0), 1.0))
    >>> len(vertices), len(tets)
    (12, 12)
    """
    cubes = np.argwhere(grid.inside)  # (n_voxels, 3)
    outward = np.where(2 * cubes + 1 < grid.inside.shape, -1, 1)
    corner = cubes + (outward < 0)
    steps = np.eye(3, dtype=int)[list(permutations(range(3)))]  # (6, 3, 3): six ways to take one step along each axis
    walks = np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0), (0, 0)))
    places = corner[:, None, None] + outward[:, None, None] * walks  # (n_voxels, 6, 4, 3)
    used, tets = np.unique(places.reshape(-1, 3), axis=0, return_inverse=True)
    return np.asarray(grid.corner + grid.step * used), tets.reshape(-1, 4)


def voxel_euler_characteristic(grid: VoxelGrid) -> int:
    """Return corners - edges + faces - cubes of the solid, each shared one counted once: pieces - tunnels + cavities.

    1 for a ball, 0 for a ring. Cubes that touch anywhere count as joined.

    Examples
    --------
    >>> ring = np.ones((3, 3, 1), dtype=bool)
    >>> ring[1, 1, 0] = False
    >>> voxel_euler_characteristic(VoxelGrid(ring, (0, 0, 0), 1.0))
    0
    """
    padded = np.pad(grid.inside, 1)
    total = 0
    for spread in np.ndindex(2, 2, 2):  # a cell is thin along the axes where it touches cubes on both sides
        cells = padded
        for axis, both in enumerate(spread):
            if both:
                cells = cells | np.roll(cells, 1, axis=axis)
        total += (-1) ** (3 - sum(spread)) * int(cells.sum())
    return total


def _grid_around(mesh: TriangleMesh, step: float, rim: int) -> tuple[FloatArray, tuple[int, ...], FloatArray]:
    """The corner, shape and centres of a grid of cubes around a mesh with `rim` empty cubes on each side."""
    step = as_number("step", step, above=0.0)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    counts: IntArray = (np.ceil((high - low) / step) + 2 * rim).astype(np.int64)
    if counts.astype(float).prod() > MAX_VOXELS:
        raise ValueError(f"step must leave at most {MAX_VOXELS} voxels around the mesh; {step:g} needs more")
    corner = 0.5 * (low + high) - 0.5 * step * counts
    shape = tuple(int(count) for count in counts)
    return corner, shape, corner + step * (np.indices(shape).reshape(3, -1).T + 0.5)
