"""What a surface measures: coordinates and curvature, distances on it and between two, conformal maps, its health."""

from spectral_notes.geometry.conformal import conformal_distortion, conformal_map
from spectral_notes.geometry.curvature import angle_defects, gaussian_curvature, mean_curvature
from spectral_notes.geometry.geodesics import faces_under_arcs, geodesic_distances, parallel_transport
from spectral_notes.geometry.heat_geodesics import HeatMethod, heat_distances
from spectral_notes.geometry.mending import cut_mesh, keep_pieces, orient_faces, weld_vertices
from spectral_notes.geometry.mesh_distances import hausdorff_error, normal_deviation, surface_error, vertex_error
from spectral_notes.geometry.mesh_health import MeshHealth, health
from spectral_notes.geometry.nodal import nodal_domains
from spectral_notes.geometry.parametric import (
    coordinate_lines,
    first_fundamental_form,
    patch_area,
    patch_mesh,
    second_fundamental_form,
    surface_curvatures,
    tangent_vectors,
    torus_curvatures,
    torus_surface,
    unit_normals,
)

__all__ = [
    "torus_surface",
    "torus_curvatures",
    "tangent_vectors",
    "unit_normals",
    "first_fundamental_form",
    "second_fundamental_form",
    "surface_curvatures",
    "patch_area",
    "patch_mesh",
    "coordinate_lines",
    "angle_defects",
    "gaussian_curvature",
    "mean_curvature",
    "geodesic_distances",
    "parallel_transport",
    "faces_under_arcs",
    "HeatMethod",
    "heat_distances",
    "conformal_map",
    "conformal_distortion",
    "nodal_domains",
    "MeshHealth",
    "health",
    "weld_vertices",
    "keep_pieces",
    "cut_mesh",
    "orient_faces",
    "vertex_error",
    "surface_error",
    "hausdorff_error",
    "normal_deviation",
]
