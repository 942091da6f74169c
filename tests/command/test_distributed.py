"""The same eigenbasis from SLEPc on one and two processes; skipped, with the reason, where it is not installed."""

from __future__ import annotations

import functools
import glob
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from spectral_notes.command import distributed
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.files.eigenbasis_files import read_eigenbasis, write_problem
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import sphere, torus

SCRIPT = Path(distributed.__file__)
IMPORTS = """
import glob, sys
for package in ("petsc", "slepc"):
    sys.path += glob.glob("/usr/lib/%sdir/*/*-real/lib/python3/dist-packages" % package)
from slepc4py import SLEPc
"""


@functools.cache
def python_with_slepc() -> str:
    """A Python that can import slepc4py, this one or the system's; skip if there is none, or no mpiexec."""
    if shutil.which("mpiexec") is None:
        pytest.skip("no mpiexec: install Open MPI (Debian: openmpi-bin)")
    for python in dict.fromkeys((sys.executable, "/usr/bin/python3")):
        if Path(python).exists() and run([python, "-c", IMPORTS]).returncode == 0:
            return python
    pytest.skip("no Python with slepc4py: conda install -c conda-forge slepc4py, or apt install python3-slepc4py-real")


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command, with one thread a process and leave to start as the superuser, as containers do."""
    settings = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
    environment = {**os.environ, **settings, "OPENBLAS_NUM_THREADS": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=240)


def mpi(ranks: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the solver on some processes."""
    return run(["mpiexec", "-n", str(ranks), python_with_slepc(), str(SCRIPT), *arguments])


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_equal_to_the_local_engine(tmp_path: Path, ranks: int, mass: str) -> None:
    L, M = cotan_laplacian(sphere(3), mass=mass)
    write_problem(tmp_path / "pair.npz", L, M)
    done = mpi(ranks, str(tmp_path / "pair.npz"), str(tmp_path / "basis.npz"), "--k", "25")
    assert done.returncode == 0, done.stderr
    far, near = read_eigenbasis(tmp_path / "basis.npz"), compute_eigenbasis(L, M, 25)
    assert far.evals == pytest.approx(near.evals, rel=1e-8, abs=1e-8)
    assert far.orthonormality_error() < 1e-8
    assert np.asarray(far.residuals).max() < 1e-6
    gap = (L @ far.evecs - (M @ far.evecs) * far.evals) / np.sqrt(M.diagonal())[:, None]
    assert np.linalg.norm(gap, axis=0).max() < 1e-6
    groups = [slice(0, 1), slice(1, 4), slice(4, 9), slice(9, 16), slice(16, 25)]  # 2 l + 1 at a time
    for group in groups:
        overlap = np.linalg.svd(far.evecs[:, group].T @ M @ near.evecs[:, group], compute_uv=False)
        assert overlap == pytest.approx(np.ones(len(overlap)), abs=1e-8)


def test_two_components_have_two_exact_zeros(tmp_path: Path) -> None:
    one, other = cotan_laplacian(sphere(2)), cotan_laplacian(torus(24, 12))
    L, M = (sp.csr_array(sp.block_diag([a, b])) for a, b in zip(one, other, strict=True))
    write_problem(tmp_path / "pair.npz", L, M)
    done = mpi(2, str(tmp_path / "pair.npz"), str(tmp_path / "basis.npz"), "--k", "12")
    assert done.returncode == 0, done.stderr
    basis = read_eigenbasis(tmp_path / "basis.npz")
    assert (basis.evals == 0).sum() == 2
    assert basis.evals == pytest.approx(compute_eigenbasis(L, M, 12).evals, rel=1e-8, abs=1e-8)


def test_errors_of_the_command_line(tmp_path: Path, tetrahedron: TriangleMesh) -> None:
    write_problem(tmp_path / "pair.npz", *cotan_laplacian(tetrahedron))
    done = mpi(1, str(tmp_path / "pair.npz"), str(tmp_path / "basis.npz"), "--k", "5")
    assert "k must be between 1 and 4; got 5" in done.stderr
    assert done.returncode != 0 and not (tmp_path / "basis.npz").exists()


def test_basis_must_be_npz(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        distributed.main([str(tmp_path / "pair.npz"), str(tmp_path / "basis.txt"), "--k", "3"])
    assert "the basis must end in .npz; got 'basis.txt'" in capsys.readouterr().err


def test_missing_slepc_names_the_next_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "slepc4py", None)
    monkeypatch.setattr(glob, "glob", lambda pattern: [])
    with pytest.raises(SystemExit):
        distributed.main([str(tmp_path / "pair.npz"), str(tmp_path / "basis.npz"), "--k", "3"])
    assert "slepc4py is not installed: conda install -c conda-forge slepc4py" in capsys.readouterr().err
