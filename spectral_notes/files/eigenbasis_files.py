"""Write and read an eigenproblem (L, M) and an eigenbasis, each as one `.npz` file of plain arrays.

A sparse matrix is stored as the three arrays of its compressed rows. Nothing is pickled, so a file is data and no more,
and any program with an NPZ reader can use it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import FloatArray, as_symmetric
from spectral_notes.eigenbasis import Eigenbasis, fix_signs
from spectral_notes.files.whole import write_whole
from spectral_notes.solver.eigensolver import closed_components, pose


def write_problem(path: str | Path, L: sp.csr_array, M: sp.csr_array) -> None:
    """Write the pair (L, M) to an `.npz` file, with the zero modes of its components, for a solver that runs elsewhere.

    Parameters
    ----------
    path : where to; ends in `.npz`
    L, M : (n, n) sparse, weak Laplacian and mass

    Examples
    --------
    >>> import tempfile
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_problem(Path(folder) / "pair.npz", *interval_laplacian(5))
    ...     L, M = read_problem(Path(folder) / "pair.npz")
    >>> L.shape, float(M.sum())
    ((5, 5), 1.0)
    """
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    problem = pose(L, M, 1)
    arrays = {"component": closed_components(L), "spacing": np.array(problem.spacing)}
    _save(path, arrays | _parts("L", L) | _parts("M", M))


def read_problem(path: str | Path) -> tuple[sp.csr_array, sp.csr_array]:
    """Read the pair (L, M) that `write_problem` wrote.

    Raises
    ------
    ValueError
        If the file does not hold such a pair.
    """
    with np.load(_npz(path), allow_pickle=False) as file:
        _need(path, file, ("L_data", "L_indices", "L_indptr", "M_data", "M_indices", "M_indptr"))
        return _matrix("L", file), _matrix("M", file)


def write_eigenbasis(path: str | Path, basis: Eigenbasis) -> None:
    """Write an eigenbasis to an `.npz` file: eigenvalues, modes, mass and residuals.

    Examples
    --------
    >>> import tempfile
    >>> from spectral_notes.eigenbasis import compute_eigenbasis
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(9), 3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_eigenbasis(Path(folder) / "basis.npz", basis)
    ...     again = read_eigenbasis(Path(folder) / "basis.npz")
    >>> bool((again.evecs == basis.evecs).all())
    True
    """
    arrays = {"evals": basis.evals, "evecs": basis.evecs, "residuals": np.asarray(basis.residuals),
              "n_zero": np.array(basis.n_zero)}
    _save(path, arrays | _parts("M", basis.M))


def read_eigenbasis(path: str | Path) -> Eigenbasis:
    """Read an eigenbasis, from `write_eigenbasis` or from `python -m spectral_notes.command.distributed`.

    The sign of each mode is that of `compute_eigenbasis`.

    Raises
    ------
    ValueError
        If the file does not hold an eigenbasis.
    """
    with np.load(_npz(path), allow_pickle=False) as file:
        _need(path, file, ("evals", "evecs", "residuals", "M_data", "M_indices", "M_indptr"))
        evecs = file["evecs"]
        fix_signs(evecs)
        n_zero = int(file["n_zero"]) if "n_zero" in file else None
        return Eigenbasis(file["evals"], evecs, _matrix("M", file), file["residuals"], n_zero)


def _npz(path: str | Path) -> Path:
    """The path, which must say what the file is."""
    path = Path(path)
    if path.suffix != ".npz":
        raise ValueError(f"path must end in .npz; got {path.name!r}")
    return path


def _save(path: str | Path, arrays: dict[str, FloatArray]) -> None:
    """Write named arrays, whole or not at all."""
    write_whole(_npz(path), lambda place: np.savez(place, **arrays))  # type: ignore[arg-type]


def _need(path: str | Path, file: np.lib.npyio.NpzFile, names: tuple[str, ...]) -> None:
    """A ValueError unless the file has all the arrays."""
    missing = [name for name in names if name not in file.files]
    if missing:
        raise ValueError(f"{Path(path).name} does not hold what is read here; it lacks {', '.join(missing)}")


def _parts(name: str, A: sp.csr_array) -> dict[str, FloatArray]:
    """The three arrays of a matrix, named."""
    return {f"{name}_data": A.data, f"{name}_indices": A.indices, f"{name}_indptr": A.indptr}


def _matrix(name: str, file: np.lib.npyio.NpzFile) -> sp.csr_array:
    """The matrix of three arrays."""
    indptr = file[f"{name}_indptr"]
    n = len(indptr) - 1
    return sp.csr_array((file[f"{name}_data"], file[f"{name}_indices"], indptr), shape=(n, n))
