"""Eigenbases on many processes or machines: the same problem, solved by SLEPc on PETSc over MPI.

    mpiexec -n 8 python -m spectral_notes.command.distributed shape.obj basis.npz --k 200

takes a mesh, or a pair (L, M) saved by `files.write_problem`, and writes the file that
`files.read_eigenbasis` reads. The rows of L and M are spread over the processes; Krylov-Schur with shift and
invert finds the modes, and MUMPS factors in parallel. The modes are gathered on the first process at the end.

Components: `conda install -c conda-forge slepc4py`, or on Debian and Ubuntu `apt install python3-slepc4py-real
openmpi-bin`. The system's Python then has SLEPc but not this package; it can run this file itself on a saved pair:

    mpiexec -n 8 python3 distributed.py pair.npz basis.npz --k 200

Sources: Hernandez, Roman and Vidal, "SLEPc" (2005); Amestoy, Duff, L'Excellent and Koster, "MUMPS" (2001).
"""

from __future__ import annotations

import argparse
import glob
import sys
from pathlib import Path
from typing import Any

import numpy as np

# Only NumPy may be imported above and only the standard library beside it: see the last paragraph of the docstring.

AGAIN = 8  # modes that are asked for once more, beside those found, to see whether a copy was missed
DEBIAN = "/usr/lib/{}dir/*/*-real/lib/python3/dist-packages"


def main(arguments: list[str] | None = None) -> None:
    """Solve the problem that the command line names, on all processes of the MPI job."""
    parser = argparse.ArgumentParser(
        prog="spectral_notes.command.distributed", description="Eigenbasis of a mesh or of a saved (L, M)."
    )
    parser.add_argument("problem", type=Path, help="a mesh file, or the .npz of a pair (L, M)")
    parser.add_argument("basis", type=Path, help="the .npz to write")
    parser.add_argument("--k", type=int, required=True, help="number of modes")
    parser.add_argument("--tol", type=float, default=1e-10, help="relative residual")
    parser.add_argument("--solver", default="mumps", help="PETSc's name of the parallel factorization")
    options = parser.parse_args(arguments)
    if options.basis.suffix != ".npz":
        parser.error(f"the basis must end in .npz; got {options.basis.name!r}")
    slepc, petsc = _import_slepc(parser)
    rank = petsc.COMM_WORLD.getRank()
    file = _problem_file(options.problem, rank)
    petsc.COMM_WORLD.barrier()
    with np.load(file, allow_pickle=False) as arrays:
        problem = {name: arrays[name] for name in arrays.files}
    n = len(problem["L_indptr"]) - 1
    if not 1 <= options.k <= n:
        parser.error(f"k must be between 1 and {n}; got {options.k}")
    evals, evecs, residuals = solve(slepc, petsc, problem, options.k, options.tol, options.solver)
    if rank == 0:
        closed = min(int(problem["component"].max()) + 1, options.k)
        known = {"n_zero": closed} if closed else {}  # a null vector that is no constant is not counted here
        mass = {name: array for name, array in problem.items() if name.startswith("M_")}
        np.savez(options.basis, evals=evals, evecs=evecs, residuals=residuals, **known, **mass)


def solve(
    slepc: Any, petsc: Any, problem: dict[str, Any], k: int, tol: float, solver: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the k smallest eigenpairs, zero modes included: evals ascending (k,), evecs (n, k) and residuals (k,).

    All processes take part; the first one gets the columns, the others empty ones. `problem` is what
    `files.write_problem` wrote, and `solver` PETSc's name of a parallel factorization.
    """
    n = len(problem["L_indptr"]) - 1
    L, M = _distribute(petsc, problem, "L"), _distribute(petsc, problem, "M")
    known = [_vector(L, column) for column in _zero_modes(problem, k)]
    c = len(known)
    pairs = [(0.0, vector, 0.0) for vector in known]
    eps = _configure(slepc, petsc, L, M, tol, solver, -0.1 * float(problem["spacing"]))
    wanted = k - c
    while wanted:
        new = _solve_beside(eps, L, M, [vector for _, vector, _ in pairs], wanted)
        complete = len(pairs) >= k and min(value for value, _, _ in new) >= pairs[k - 1][0]
        pairs = sorted(pairs + new, key=lambda pair: pair[0])
        wanted = 0 if complete else min(AGAIN, n - len(pairs))
    evals, vectors, residuals = zip(*pairs[:k], strict=True)
    columns = [_gather(petsc, vector) for vector in vectors]
    return np.array(evals), np.array(columns).T, np.array(residuals)


def _zero_modes(problem: dict[str, Any], k: int) -> list[np.ndarray]:
    """The constants of the first k components on which L annihilates them, M-normalised."""
    component = problem["component"]
    masses = np.add.reduceat(problem["M_data"], problem["M_indptr"][:-1])  # of rows, each has its diagonal entry
    parts = [component == i for i in range(min(int(component.max()) + 1, k))]
    return [part / np.sqrt(masses[part].sum()) for part in parts]


def _solve_beside(eps: Any, L: Any, M: Any, known: list[Any], wanted: int) -> list[tuple[float, Any, float]]:
    """The next eigenpairs orthogonal to the known ones: one Krylov space may miss copies of a multiple eigenvalue."""
    eps.setDeflationSpace(known)
    eps.setDimensions(wanted)
    eps.solve()
    if eps.getConverged() < wanted:
        raise ArithmeticError(f"{eps.getConverged()} of {wanted} modes converged: try a larger --tol")
    pairs = []
    for i in range(wanted):
        x = L.createVecRight()
        value = float(np.real(eps.getEigenpair(i, x)))
        pairs.append((value, x, _residual(L, M, x, value)))
    return pairs


def _configure(slepc: Any, petsc: Any, L: Any, M: Any, tol: float, solver: str, shift: float) -> Any:
    """SLEPc's eigensolver for the eigenvalues nearest to a shift."""
    eps = slepc.EPS().create(petsc.COMM_WORLD)
    eps.setOperators(L, M)
    eps.setProblemType(slepc.EPS.ProblemType.GHEP)
    eps.setTolerances(tol)
    eps.setTarget(shift)
    eps.setWhichEigenpairs(slepc.EPS.Which.TARGET_MAGNITUDE)
    transform = eps.getST()
    transform.setType("sinvert")
    transform.getKSP().setType("preonly")
    transform.getKSP().getPC().setType("cholesky")
    transform.getKSP().getPC().setFactorSolverType(solver)
    eps.setFromOptions()
    return eps


def _residual(L: Any, M: Any, x: Any, value: float) -> float:
    """|L x - value M x| in the norm of the inverse of M's diagonal."""
    difference = L * x
    difference.axpy(-value, M * x)
    weights = M.getDiagonal()
    weights.sqrtabs()
    difference.pointwiseDivide(difference, weights)
    return float(difference.norm())


def _distribute(petsc: Any, problem: dict[str, Any], name: str) -> Any:
    """The matrix, each process with its share of the rows."""
    indptr, indices, data = (problem[f"{name}_{part}"] for part in ("indptr", "indices", "data"))
    n = len(indptr) - 1
    layout = petsc.Vec().createMPI(n, comm=petsc.COMM_WORLD)
    first, last = layout.getOwnershipRange()
    start, stop = indptr[first], indptr[last]
    rows = (indptr[first : last + 1] - start).astype(petsc.IntType)
    csr = (rows, indices[start:stop].astype(petsc.IntType), data[start:stop])
    local = last - first
    matrix = petsc.Mat().createAIJ(((local, n), (local, n)), csr=csr, comm=petsc.COMM_WORLD)
    matrix.setOption(petsc.Mat.Option.SYMMETRIC, True)
    return matrix


def _vector(matrix: Any, column: np.ndarray) -> Any:
    """A column as a distributed vector."""
    vector = matrix.createVecRight()
    first, last = vector.getOwnershipRange()
    vector.setArray(np.ascontiguousarray(column[first:last]))
    return vector


def _gather(petsc: Any, vector: Any) -> np.ndarray:
    """The whole vector on the first process, an empty one on the others."""
    scatter, whole = petsc.Scatter.toZero(vector)
    scatter.scatter(vector, whole, False, petsc.Scatter.Mode.FORWARD)
    return np.array(whole.getArray())


def _problem_file(path: Path, rank: int) -> Path:
    """The file of the pair (L, M); of a mesh it is made first, beside it, by the first process."""
    if path.suffix == ".npz":
        return path
    file = path.with_suffix(".problem.npz")
    if rank == 0:
        from spectral_notes.files.eigenbasis_files import write_problem
        from spectral_notes.files.mesh_files import read_mesh
        from spectral_notes.laplacians import cotan_laplacian

        write_problem(file, *cotan_laplacian(read_mesh(path)))
    return file


def _import_slepc(parser: argparse.ArgumentParser) -> tuple[Any, Any]:
    """The modules SLEPc and PETSc, also from where Debian puts them."""
    for package in ("petsc", "slepc"):
        sys.path += [place for place in sorted(glob.glob(DEBIAN.format(package))) if place not in sys.path]
    try:
        import slepc4py  # type: ignore[import-not-found]
    except ImportError:
        parser.error(
            "slepc4py is not installed: conda install -c conda-forge slepc4py, or apt install python3-slepc4py-real"
        )
    slepc4py.init([])
    from petsc4py import PETSc  # type: ignore[import-not-found]
    from slepc4py import SLEPc

    return SLEPc, PETSc


if __name__ == "__main__":
    main()
