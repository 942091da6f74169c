"""From descriptors of two shapes to a refined map between their points, with a doubt that is said."""

from spectral_notes.matching.map_fitting import fit_functional_map, multiplications, point_descriptors, rotations
from spectral_notes.matching.map_refinement import bijective_zoomout, icp, zoomout
from spectral_notes.matching.map_sets import consistent_maps, cycle_error, shared_embedding, shared_functions
from spectral_notes.matching.partial_maps import PartMatch, match_part
from spectral_notes.matching.point_maps import geodesic_errors, orientation_score, precise_map
from spectral_notes.matching.shape_matching import ShapeMatch, isometry_defect, match_shapes

__all__ = [
    "ShapeMatch", "match_shapes", "isometry_defect", "PartMatch", "match_part",
    "shared_functions", "shared_embedding", "consistent_maps", "cycle_error",
    "point_descriptors", "multiplications", "rotations", "fit_functional_map",
    "icp", "zoomout", "bijective_zoomout", "precise_map", "orientation_score", "geodesic_errors",
]
