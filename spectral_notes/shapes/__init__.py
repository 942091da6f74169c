"""The course's shapes, each made by a formula or a recipe, the same on every machine, and what is known of them.

Formulas in space and in the plane, bodies from signed distances, voxels, points of a surface; closed forms and
one-dimensional solvers for their eigenvalues.
"""

from spectral_notes.shapes.bodies import bracket, doll, doll_correspondence, goat
from spectral_notes.shapes.flat_domains import disk, equilateral_triangle, flat_torus, gww_drums, rectangle
from spectral_notes.shapes.isometries import sheet, spherical_cap
from spectral_notes.shapes.people import (
    PERSON_POSES,
    PERSON_SEGMENTS,
    PERSONS,
    person,
    person_correspondence,
    person_segments,
)
from spectral_notes.shapes.references import (
    DRUM_EIGENVALUES,
    principal_angles,
    sphere_eigenvalues,
    spherical_harmonics,
    weyl_count,
)
from spectral_notes.shapes.revolution import Profile, egg_eigenvalues, revolution_eigenvalues, torus_eigenvalues
from spectral_notes.shapes.sampling import coarse_copy, sample_points, terrain
from spectral_notes.shapes.surfaces import egg, potato, sphere, torus, torus_patch
from spectral_notes.shapes.voxels import (
    VoxelGrid,
    voxel_euler_characteristic,
    voxel_graph,
    voxel_shell,
    voxel_skin,
    voxel_tetrahedra,
    voxelize,
)

__all__ = [
    "sphere",
    "egg",
    "potato",
    "torus",
    "torus_patch",
    "sheet",
    "spherical_cap",
    "rectangle",
    "disk",
    "equilateral_triangle",
    "flat_torus",
    "gww_drums",
    "goat",
    "doll",
    "doll_correspondence",
    "bracket",
    "PERSONS",
    "PERSON_POSES",
    "PERSON_SEGMENTS",
    "person",
    "person_segments",
    "person_correspondence",
    "terrain",
    "sample_points",
    "coarse_copy",
    "VoxelGrid",
    "voxelize",
    "voxel_shell",
    "voxel_skin",
    "voxel_graph",
    "voxel_tetrahedra",
    "voxel_euler_characteristic",
    "DRUM_EIGENVALUES",
    "sphere_eigenvalues",
    "spherical_harmonics",
    "weyl_count",
    "principal_angles",
    "Profile",
    "revolution_eigenvalues",
    "egg_eigenvalues",
    "torus_eigenvalues",
]
