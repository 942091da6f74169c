"""The traces of a scene: the surface or cloud of a view, and the marks over it, in the axes of its camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.meshes import PointCloud, TriangleMesh, row_norms
from spectral_notes.plotting.rendering import LABEL_COLORS, PLAIN_COLOR, SurfaceView, values_to_draw
from spectral_notes.plotting.scene_meshes import edge_polylines, lift, nodal_polylines

TOP = 32000.0  # of a coordinate in 16 bits
LIFT = 0.004  # of the size: how far lines are lifted off their surface
INK = "#111111"
LIGHTING = {"ambient": 0.45, "diffuse": 0.6, "specular": 0.06, "roughness": 0.6, "fresnel": 0.05}
LAMP = {"x": 3e4, "y": 6e4, "z": -1e5}  # it goes with the eye: to the right, above, and (here negative) in front
PYRAMID = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [1, 3, 2], [1, 4, 3]])  # tip, and four corners

Trace = dict[str, Any]


@dataclass(frozen=True)
class Frame:
    """Hold the map from positions to the coordinates of a scene: turned to the camera, centred, scaled to TOP."""

    axes: FloatArray
    center: FloatArray
    size: float  # of the largest half-extent

    def place(self, points: FloatArray) -> FloatArray:
        """Return points in scene coordinates."""
        return (points - self.center) @ self.axes.T * (TOP / self.size)


def frame_of(view: SurfaceView) -> Frame:
    """Return the frame in which the camera of a view looks along y, with its upward direction along z."""
    eye, up = (np.asarray(direction, dtype=np.float64) for direction in view.view_direction)
    right = np.cross(up, eye)
    if not np.linalg.norm(right):
        raise ValueError(f"camera must look along another direction than up; got {view.view_direction}")
    axes = np.stack([right, np.cross(up, right), up])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    points = all_points(view) @ axes.T
    low, high = points.min(axis=0), points.max(axis=0)
    return Frame(axes, (low + high) / 2 @ axes, float((high - low).max() / 2) or 1.0)


def all_points(view: SurfaceView) -> FloatArray:
    """Return every position that a view shows."""
    parts = [view.positions, *_curves(view)]
    if view.arrows is not None:
        feet, vectors = map(np.asarray, view.arrows)
        parts += [feet, feet + vectors]
    if view.points is not None:
        parts.append(np.asarray(view.points))
    return np.vstack(parts)


def traces_of(view: SurfaceView, frame: Frame, color_bar: dict[str, Any] | None, faceted: bool) -> list[Trace]:
    """Return the traces of a view, the surface first; `color_bar`, where given, stands beside its values."""
    if isinstance(view.surface, PointCloud):
        surface = _cloud_trace(view, view.surface, frame)
        lines = [_line_trace(_curves(view), frame, 4.0)] if view.curves else []
    else:
        surface = _mesh_trace(view, view.surface, frame, faceted)
        lines = _lines_on(view, view.surface, frame)
    if color_bar is not None and view.values is not None:
        colored = surface["marker"] if isinstance(view.surface, PointCloud) else surface
        colored |= {"showscale": True, "colorbar": color_bar}
    return [surface, *lines, *_arrow_traces(view, frame), *_point_traces(view, frame)]


def _coordinates(points: FloatArray, frame: Frame) -> Trace:
    """Positions as integers of 16 bits."""
    placed = np.round(frame.place(points)).astype(np.int16)
    return {name: placed[:, k] for k, name in enumerate("xyz")}


def _corners(faces: IntArray) -> Trace:
    """Faces under the names of Plotly, in 16 bits where that is enough."""
    kind = np.uint16 if faces.max() < 2**16 else np.uint32
    return {name: faces[:, k].astype(kind) for k, name in enumerate("ijk")}


def _colors(view: SurfaceView) -> Trace:
    """The colour map and its ends, under the names that meshes and markers share."""
    if view.kind == "labels":
        ends = np.arange(len(LABEL_COLORS) + 1) / len(LABEL_COLORS)
        steps = zip(ends[:-1], ends[1:], LABEL_COLORS, strict=True)
        scale = [[float(end), color] for low, high, color in steps for end in (low, high)]
        return {"colorscale": scale, "cmin": -0.5, "cmax": len(LABEL_COLORS) - 0.5, "showscale": False}
    shades = mpl.colormaps[str(view.color_map)]
    scale = [[k / 32, to_hex(shades(k / 32))] for k in range(33)]
    low, high = view.color_limits
    return {"colorscale": scale, "cmin": low, "cmax": high, "showscale": False}


def _mesh_trace(view: SurfaceView, mesh: TriangleMesh, frame: Frame, faceted: bool) -> Trace:
    """The surface with its values."""
    trace = {"type": "mesh3d", **_coordinates(mesh.vertices, frame), **_corners(mesh.faces), "hoverinfo": "skip"}
    trace |= {"lighting": LIGHTING, "lightposition": LAMP, "flatshading": faceted}
    if view.values is None:
        return trace | {"color": PLAIN_COLOR}
    values, on_faces = values_to_draw(view)
    shown = values.astype(np.uint8 if view.kind == "labels" else np.float32)
    return trace | _colors(view) | {"intensity": shown, "intensitymode": "cell" if on_faces else "vertex"}


def _cloud_trace(view: SurfaceView, cloud: PointCloud, frame: Frame) -> Trace:
    """The points with their values."""
    marker: Trace = {"size": 5, "color": PLAIN_COLOR, "line": {"width": 0}}
    if view.values is not None:
        marker |= _colors(view) | {"color": values_to_draw(view)[0].astype(np.float32)}
    return {"type": "scatter3d", "mode": "markers", **_coordinates(cloud.points, frame), "marker": marker}


def _lines_on(view: SurfaceView, mesh: TriangleMesh, frame: Frame) -> list[Trace]:
    """Edges, nodal lines and curves, lifted off the surface."""
    step, traces = LIFT * frame.size, []
    if view.edges:
        traces.append(_line_trace(lift(edge_polylines(mesh), mesh, 0.5 * step), frame, 1.0))
    if view.kind == "signed" and view.nodal_lines and view.values is not None:
        values, on_faces = values_to_draw(view)
        if not on_faces:
            traces.append(_line_trace(lift(nodal_polylines(mesh, values), mesh, step), frame, 4.0))
    if view.curves:
        traces.append(_line_trace(lift(_curves(view), mesh, step), frame, 4.0))
    return traces


def _curves(view: SurfaceView) -> list[FloatArray]:
    """The curves of a view."""
    return [np.asarray(curve) for curve in view.curves]


def _line_trace(polylines: Sequence[FloatArray], frame: Frame, width: float) -> Trace:
    """Polylines in one trace, with gaps between them."""
    gap = np.full((1, 3), np.nan)
    pieces = [piece for polyline in polylines for piece in (polyline, gap)] or [gap]
    placed = np.round(frame.place(np.vstack(pieces))).astype(np.float32)
    points = {name: placed[:, k] for k, name in enumerate("xyz")}
    line = {"color": INK, "width": width}
    return {"type": "scatter3d", "mode": "lines", **points, "line": line, "hoverinfo": "skip"}


def _arrow_traces(view: SurfaceView, frame: Frame) -> list[Trace]:
    """Shafts as lines, heads as pyramids of the last quarter, as in the still."""
    if view.arrows is None:
        return []
    feet, vectors = map(np.asarray, view.arrows)
    long = row_norms(vectors) > 0
    feet, vectors = feet[long], vectors[long]
    neck = feet + 0.75 * vectors
    shafts = _line_trace(list(np.stack([feet, neck], axis=1)), frame, 3.0)
    across = np.cross(vectors, np.eye(3)[np.argmin(np.abs(vectors), axis=1)])
    across *= (0.16 * row_norms(vectors) / row_norms(across))[:, None]
    beside = np.cross(vectors, across) / row_norms(vectors)[:, None]
    tips = np.stack([feet + vectors, neck + across, neck + beside, neck - across, neck - beside], axis=1)  # (a, 5, 3)
    faces = (PYRAMID + 5 * np.arange(len(feet))[:, None, None]).reshape(-1, 3)
    heads = {"type": "mesh3d", **_coordinates(tips.reshape(-1, 3), frame), **_corners(faces), "color": INK}
    return [shafts, heads | {"flatshading": True, "hoverinfo": "skip"}] if len(feet) else []


def _point_traces(view: SurfaceView, frame: Frame) -> list[Trace]:
    """Dots."""
    if view.points is None:
        return []
    points = _coordinates(np.asarray(view.points), frame)
    marker = {"size": 7, "color": INK}
    return [{"type": "scatter3d", "mode": "markers", **points, "marker": marker, "hoverinfo": "skip"}]
