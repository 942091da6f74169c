"""Checks of gradients and curvature."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_choice
from spectral_notes.checking.answers import largest, place_in, place_of, read_array, read_matrix, slip
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, wrong
from spectral_notes.geometry.curvature import angle_defects, mean_curvature
from spectral_notes.laplacians import mass_matrix
from spectral_notes.mesh_calculus import gradient_matrix
from spectral_notes.meshes import TriangleMesh, face_normals

WITHIN = 1e-5  # of the largest entry: single precision passes


@judged
def check_gradient(answer: object, mesh: TriangleMesh) -> Verdict:
    """Judge the gradient matrix G (3m, n) of a mesh: all x components first, then all y, then all z.

    Parameters
    ----------
    answer : object
        A matrix, dense or sparse.
    mesh : TriangleMesh
        The mesh.

    Returns
    -------
    Verdict
        Right if G f is the gradient of every piecewise-linear f.

    Examples
    --------
    >>> mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> bool(check_gradient(gradient_matrix(mesh).toarray(), mesh))
    True
    """
    true = gradient_matrix(mesh)
    m, n = mesh.n_faces, mesh.n_vertices
    G = read_matrix(answer, "G", (3 * m, n))
    sums = G.sum(axis=1)
    demand(abs(sums).max() <= WITHIN * largest(true), "the gradient of a constant is zero",
           f"G applied to ones gives {abs(sums).max():.3g} at {place_of(sums)}.")
    difference = sp.csr_array(G - true)
    if largest(difference) <= WITHIN * largest(true):
        return right("G is right for every piecewise-linear function.", "G f is the slope of f in each face")
    by_face = sp.csr_array(G[np.arange(3 * m).reshape(m, 3).T.ravel()])
    demand(largest(by_face - true) > 1e-3 * largest(true), "G stacks all x components, then all y, then all z",
           "Its rows go face by face. Is it reshaped in the other order?")
    demand(largest(G + true) > 1e-3 * largest(true), "the gradient points where the function grows",
           "Its sign is turned.")
    heights = (G @ mesh.vertices).reshape(3, m, 3)  # (component, face, coordinate)
    out = np.einsum("cmk,mc->mk", heights, face_normals(mesh))
    demand(abs(out).max() <= 1e-4 * abs(heights).max(), "the gradient lies in the plane of its face",
           f"An arrow leaves its face by {abs(out).max():.3g} at {place_of(out)}.")
    raise Stop(wrong("a linear function has its own gradient, projected into each face",
                     f"It differs by {largest(difference):.3g}, most at {place_in(difference)}."))


@judged
def check_curvature(answer: object, mesh: TriangleMesh, *, kind: str = "defect") -> Verdict:
    """Judge a curvature at the vertices of a closed mesh.

    Parameters
    ----------
    answer : object
        One number a vertex.
    mesh : TriangleMesh
        The mesh.
    kind : {"defect", "gaussian", "mean"}
        The angle defect (integrated), the Gaussian curvature (pointwise), or the mean curvature (pointwise, of either
        sign).

    Returns
    -------
    Verdict
        Right if every value is.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> print(check_curvature(np.degrees(angle_defects(sphere(1))), sphere(1)))
    Not right. It sums to 720, where 2 pi chi is 12.57. Everywhere the same slip: degrees taken for radians.
    The law: the angle defects sum to 2 pi chi (Gauss and Bonnet).
    """
    as_choice("kind", kind, ("defect", "gaussian", "mean"))
    defects, mass = angle_defects(mesh), mass_matrix(mesh).diagonal()
    true = mean_curvature(mesh) if kind == "mean" else defects if kind == "defect" else defects / mass
    given = read_array(answer, "the curvature", (mesh.n_vertices,))
    size = abs(true).max()
    if abs(given - true).max() <= WITHIN * size or (kind == "mean" and abs(given + true).max() <= WITHIN * size):
        return right("The curvature is right at every vertex.", "curvature sums to 2 pi chi (Gauss and Bonnet)")
    far = given - true
    slip_words = slip(given, true) or f" It differs by {abs(far).max():.3g} at {place_of(far)}."
    if kind == "mean":
        law = "the Laplacian of the position is the normal, stretched by 2 H"
        return wrong(law, f"Not the mean curvature.{slip_words}")
    total = given @ mass if kind == "gaussian" else given.sum()
    law = "the angle defects sum to 2 pi chi (Gauss and Bonnet)"
    if kind == "gaussian" and abs(given - defects).max() <= 1e-3 * abs(defects).max():
        law = "curvature is the angle defect per area"
        return wrong(law, "These are angle defects: divide by the area of each vertex.")
    if abs(2 * np.pi - given - defects).max() <= 1e-3 * np.pi:
        return wrong(law, "These are the sums of the angles: subtract them from a full turn.")
    return wrong(law, f"It sums to {total:.4g}, where 2 pi chi is {defects.sum():.4g}.{slip_words}")
