"""The cortex of chapter 15: read without a network, and its spectrum by LaPy as a second opinion."""

from __future__ import annotations

import socket

import numpy as np
import pytest

from spectral_notes import compute_eigenbasis, cotan_laplacian, meshes
from spectral_notes.files import read_mesh

datasets = pytest.importorskip("nilearn.datasets", reason="nilearn carries the cortex; it is in the extra `book`")


@pytest.fixture
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail whatever looks up a host or connects."""

    def refuse(*_: object) -> None:
        raise AssertionError("something asked for the network")

    for name in ("getaddrinfo", "create_connection"):
        monkeypatch.setattr(socket, name, refuse)
    monkeypatch.setattr(socket.socket, "connect", refuse)


@pytest.mark.parametrize("kind", ["pial", "white", "infl", "sphere"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_surface_is_read_from_the_package_and_is_closed(kind: str, side: str, no_network: None) -> None:
    mesh = read_mesh(datasets.fetch_surf_fsaverage("fsaverage5")[f"{kind}_{side}"])
    assert (mesh.n_vertices, mesh.n_faces) == (10242, 20480)
    assert meshes.is_closed(mesh) and meshes.euler_characteristic(mesh) == 2


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_lapy_finds_the_same_eigenvalues(mass: str) -> None:
    lapy = pytest.importorskip("lapy", reason="LaPy is a peer of the extra `bench`")
    mesh = read_mesh(datasets.fetch_surf_fsaverage("fsaverage5")["pial_left"])
    surface = lapy.TriaMesh(mesh.vertices, mesh.faces)
    theirs = lapy.Solver(surface, lump=mass == "lumped", use_cholmod=False).eigs(50)[0]
    ours = compute_eigenbasis(*cotan_laplacian(mesh, mass=mass), 50).evals
    np.testing.assert_allclose(theirs[1:], ours[1:], rtol=1e-10)
