"""What a scene draws, light enough to load on a click: fewer vertices with their values kept, and lines lifted off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import igl
import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.meshes import PointCloud, TriangleMesh, face_normals, is_closed
from spectral_notes.plotting.pyvista_loading import load_pyvista
from spectral_notes.plotting.rendering import SurfaceView, values_to_draw

VALUE_WEIGHT = 0.3  # of the values beside the positions, both scaled to one, in the quadric that decides what to keep


def is_faceted(mesh: TriangleMesh) -> bool:
    """Say whether every face has three corners of its own, the form of a mesh that is to look faceted."""
    return mesh.n_vertices == 3 * mesh.n_faces


def lighten(view: SurfaceView, n_max: int) -> SurfaceView:
    """Return the view on a surface of about `n_max` vertices or points at most, values carried over.

    A cloud keeps an even sample of its points. A mesh loses the edges whose collapse changes the positions and the
    values least (quadric error metric, Garland and Heckbert 1998); its new vertices take the values of the closest
    points of the old surface, interpolated, and its new faces those of the closest old faces. Labels of vertices
    become labels of faces, as they are drawn. Drawn edges are left away when they are no longer those of the mesh.
    """
    if isinstance(view.surface, PointCloud):
        n = view.surface.n_points
        kept = np.sort(np.random.default_rng(0).permutation(n)[:n_max])
        values = None if view.values is None else np.asarray(view.values)[kept]
        return replace(view, surface=PointCloud(view.surface.points[kept], view.surface.name), values=values)
    limits, mesh = view.color_limits, view.surface
    values, on_faces = (None, False) if view.values is None else values_to_draw(view)
    if is_faceted(mesh):
        mesh, first = _welded(mesh)
        values = values if values is None or on_faces else values[first]
    if mesh.n_vertices <= n_max:
        return replace(view, surface=mesh, values=values, limits=limits)
    guide = np.zeros(mesh.n_vertices) if values is None else _on_vertices(mesh, values, on_faces)
    light = _collapsed(mesh, (guide - limits[0]) / (limits[1] - limits[0] or 1.0), n_max)
    if values is not None:
        values = _carried(mesh, values, light, on_faces)
    return replace(view, surface=light, values=values, limits=limits, edges=False)


def _welded(mesh: TriangleMesh) -> tuple[TriangleMesh, IntArray]:
    """Join the vertices that coincide; also the first old vertex of each new one."""
    vertices, first, names = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
    faces = names.reshape(-1)[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return (TriangleMesh(vertices, faces, mesh.name), first) if whole.all() else (mesh, np.arange(mesh.n_vertices))


def _on_vertices(mesh: TriangleMesh, values: FloatArray, on_faces: bool) -> FloatArray:
    """Values of vertices, or the means of the faces around each."""
    if not on_faces:
        return values
    corners = mesh.faces.ravel()
    count = np.bincount(corners, minlength=mesh.n_vertices)
    return np.bincount(corners, np.repeat(values, 3), mesh.n_vertices) / np.maximum(count, 1)


def _collapsed(mesh: TriangleMesh, guide: FloatArray, n_max: int) -> TriangleMesh:
    """Collapse edges until about `n_max` vertices are left; `guide`, of size one, counts beside the positions."""
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    pv = load_pyvista()
    data = pv.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    data.point_data.set_array(guide, "guide")
    data.point_data.active_scalars_name = "guide"
    collapse = vtkQuadricDecimation()
    collapse.SetInputData(data)
    collapse.SetTargetReduction(1 - n_max / mesh.n_vertices)
    collapse.AttributeErrorMetricOn()
    collapse.SetScalarsWeight(VALUE_WEIGHT)
    loud = vtkObject.GetGlobalWarningDisplay()
    vtkObject.SetGlobalWarningDisplay(0)  # where the best place of a collapsed edge is not unique, its middle is taken
    try:
        collapse.Update()
    finally:
        vtkObject.SetGlobalWarningDisplay(loud)
    light = pv.wrap(collapse.GetOutput()).clean(point_merging=False)
    return TriangleMesh(np.asarray(light.points, dtype=np.float64), light.regular_faces, mesh.name)


def _carried(mesh: TriangleMesh, values: FloatArray, light: TriangleMesh, on_faces: bool) -> FloatArray:
    """Values on the light mesh: of the closest face, or interpolated at the closest point."""
    if on_faces:
        middles = light.vertices[light.faces].mean(axis=1)
        return values[igl.point_mesh_squared_distance(middles, mesh.vertices, mesh.faces)[1]]
    _, face, foot = igl.point_mesh_squared_distance(light.vertices, mesh.vertices, mesh.faces)
    corners = mesh.faces[face]
    weights = igl.barycentric_coordinates(foot, *(mesh.vertices[corners[:, k]] for k in range(3)))
    weights = np.where(np.isfinite(weights), weights, 1 / 3)  # a face without area has no better point
    return np.einsum("nk,nk->n", weights, values[corners])


def nodal_polylines(mesh: TriangleMesh, values: FloatArray) -> list[FloatArray]:
    """Return the zero set of vertex values as polylines, each of shape (c, 3)."""
    data = load_pyvista().PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    data.point_data["values"] = values
    return _polylines(data.contour([0.0], scalars="values"))


def edge_polylines(mesh: TriangleMesh) -> list[FloatArray]:
    """Return all edges of a mesh, each once, joined to polylines, each of shape (c, 3)."""
    return _polylines(load_pyvista().PolyData.from_regular_faces(mesh.vertices, mesh.faces).extract_all_edges())


def _polylines(segments: Any) -> list[FloatArray]:
    """Join PyVista's segments to polylines."""
    lines = segments.strip(max_length=10**6)
    points, packed, polylines, start = np.asarray(lines.points, dtype=np.float64), lines.lines, [], 0
    while start < len(packed):
        polylines.append(points[packed[start + 1 : start + 1 + packed[start]]])
        start += packed[start] + 1
    return polylines


def lift(curves: Sequence[FloatArray], mesh: TriangleMesh, step: float) -> list[FloatArray]:
    """Move curves off the surface they lie on: outward from a closed surface, to both sides of an open one."""
    if not curves:
        return []
    points = np.vstack(curves)
    face = igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)[1]
    away = step * face_normals(mesh)[face]
    sides = [_outward(mesh)] if is_closed(mesh) else [1.0, -1.0]
    ends = np.cumsum([len(curve) for curve in curves])[:-1]
    return [piece for side in sides for piece in np.split(points + side * away, ends)]


def _outward(mesh: TriangleMesh) -> float:
    """1 where the normals of a closed surface point outward, -1 where inward: the sign of the enclosed volume."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.sign(np.einsum("fd,fd->", a, np.cross(b, c)))) or 1.0
