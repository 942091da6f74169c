"""Checks of curvature."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import as_choice
from spectral_notes.checking.answers import place_of, read_array, slip
from spectral_notes.checking.verdicts import Verdict, judged, right, wrong
from spectral_notes.geometry.curvature import POINTWISE, angle_defects, gaussian_curvature, mean_curvature
from spectral_notes.laplacians import mass_matrix
from spectral_notes.meshes import TriangleMesh

WITHIN = 1e-5  # of the largest entry: single precision passes


@judged
def check_curvature(answer: object, mesh: TriangleMesh, *, kind: str = "defect") -> Verdict:
    """Judge a curvature at the vertices of a closed mesh, one number a vertex.

    Parameters
    ----------
    answer : what the student passes
    mesh : the surface
    kind : {"defect", "gaussian", "mean"}
        The angle defect (integrated), the Gaussian curvature (pointwise), or the mean curvature (pointwise, of either
        sign); pointwise ones by Voronoi areas or by thirds.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> print(check_curvature(np.degrees(angle_defects(sphere(1))), sphere(1)))
    Not right. It sums to 720, where 2 pi chi is 12.57. Everywhere the same slip: degrees taken for radians.
    The law: the angle defects sum to 2 pi chi (Gauss and Bonnet).
    """
    as_choice("kind", kind, ("defect", "gaussian", "mean"))
    defects = angle_defects(mesh)
    pointwise = {"gaussian": gaussian_curvature, "mean": mean_curvature}.get(kind)
    allowed = [pointwise(mesh, mass=mass) for mass in POINTWISE] if pointwise else [defects]
    given = read_array(answer, "the curvature", (mesh.n_vertices,))
    if kind == "mean":
        allowed += [-curvature for curvature in allowed]
    true = min(allowed, key=lambda curvature: float(abs(given - curvature).max()))
    if abs(given - true).max() <= WITHIN * abs(true).max():
        return right("The curvature is right at every vertex.", "curvature sums to 2 pi chi (Gauss and Bonnet)")
    far = given - true
    slip_words = slip(given, true) or f" It differs by {abs(far).max():.3g} at {place_of(far)}."
    if kind == "mean":
        law = "the Laplacian of the position is the normal, stretched by 2 H"
        return wrong(f"Not the mean curvature.{slip_words}", law)
    total = given @ mass_matrix(mesh).diagonal() if kind == "gaussian" else given.sum()
    law = "the angle defects sum to 2 pi chi (Gauss and Bonnet)"
    if kind == "gaussian" and abs(given - defects).max() <= 1e-3 * abs(defects).max():
        law = "curvature is the angle defect per area"
        return wrong("These are angle defects: divide by the area of each vertex.", law)
    if abs(2 * np.pi - given - defects).max() <= 1e-3 * np.pi:
        return wrong("These are the sums of the angles: subtract them from a full turn.", law)
    return wrong(f"It sums to {total:.4g}, where 2 pi chi is {defects.sum():.4g}.{slip_words}", law)
