"""Time the eigenbasis engine beside its peers, from vertices and faces to k eigenpairs, in one interleaved run.

    python benchmarks/eigenbasis.py --quick        under a minute, prints
    python benchmarks/eigenbasis.py                hours of one core; writes benchmarks/eigenbasis.json after every run
    python benchmarks/eigenbasis.py --cells 2:4    some cells of the table only, in place of those that the file holds

Each run is a process of its own, so that its peak of memory is its own; methods take turns, so that whatever else the
machine does meets them all alike. CPU seconds are recorded beside wall-clock ones: on a shared machine compare those.
Peers that are not installed are left out and named: pip install lapy pyfmaps pyamg cholespy; SLEPc is for the Python of
the system (apt install python3-slepc4py-real openmpi-bin), and its seconds include the start of that Python.
"SciPy only" is what runs in an environment without cholespy.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import importlib.metadata
import importlib.util
import json
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull, Delaunay

from spectral_notes.command import distributed
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.files import read_eigenbasis, write_problem
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, goat, person, rectangle, sphere, torus

SYSTEM_PYTHON = "/usr/bin/python3"
OUT = Path(__file__).with_suffix(".json")
Result = tuple[sp.csr_array, sp.csr_array, np.ndarray, np.ndarray]  # L, M, evals, evecs

# --- shapes ----------------------------------------------------------------------------------------------------------


def blob(n: int) -> TriangleMesh:
    """A closed surface of irregular triangles with slivers: jittered points on a sphere, joined and deformed."""
    rng, i = np.random.default_rng(0), np.arange(n) + 0.5
    z, turn = 1 - 2 * i / n, np.pi * (1 + 5**0.5) * i
    points = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    points += 0.45 * np.sqrt(4 * np.pi / n) * rng.standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices
    faces = np.where(np.linalg.det(points[faces])[:, None] < 0, faces[:, ::-1], faces)
    x, y, z = points.T
    radius = 1 + 0.25 * np.sin(3 * x) * np.cos(2 * y) + 0.15 * np.sin(4 * z + 1) + 0.1 * np.cos(5 * x * y)
    return TriangleMesh(points * radius[:, None] * [1.3, 1.0, 0.8], faces, name="blob")


def patch(n: int) -> TriangleMesh:
    """An open, wavy square of irregular triangles."""
    side = round(n**0.5)
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, side)] * 2), axis=-1).reshape(-1, 2)
    inside = ((grid > 0) & (grid < 1)).all(axis=1)
    grid[inside] += 0.25 / side * np.random.default_rng(1).uniform(-1, 1, (inside.sum(), 2))
    faces = Delaunay(grid).simplices
    a, b, c = grid[faces[:, 0]], grid[faces[:, 1]], grid[faces[:, 2]]
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = np.where(area[:, None] < 0, faces[:, ::-1], faces)[abs(area) > 1e-3 * np.median(abs(area))]
    height = 0.2 * np.sin(4 * grid[:, 0]) * np.cos(5 * grid[:, 1])
    return TriangleMesh(np.column_stack([grid, height]), faces, name="patch")


def subdivisions(n: int) -> int:
    """How often an icosahedron is divided for about n vertices."""
    return round(np.log(n / 10) / np.log(4))


SHAPES: dict[str, Callable[[int], TriangleMesh]] = {
    "blob": blob,
    "patch": patch,
    "goat": lambda n: goat(),
    "person": lambda n: person("average"),
    "icosphere": lambda n: sphere(subdivisions(n)),
    "egg": lambda n: egg(subdivisions(n)),
    "torus grid": lambda n: torus(2 * round((n / 2) ** 0.5), round((n / 2) ** 0.5)),
    "plane grid": lambda n: rectangle(1.0, 1.0, round(n**0.5), round(n**0.5)),
}

# --- methods ---------------------------------------------------------------------------------------------------------


def engine(mesh: TriangleMesh, k: int, factor: str = "cholespy") -> Result:
    """This library."""
    L, M = cotan_laplacian(mesh)
    basis = compute_eigenbasis(L, M, k, factor=factor)
    return L, M, basis.evals, basis.evecs


def classic(mesh: TriangleMesh, k: int, sigma: float = 1e-8) -> Result:
    """The listing that most courses print: ARPACK in shift-invert mode, as SciPy offers it."""
    L, M = cotan_laplacian(mesh)
    return (L, M, *eigsh(L, k, M=M, sigma=sigma))


def lobpcg(mesh: TriangleMesh, k: int) -> Result:
    """LOBPCG with algebraic multigrid as its preconditioner: no factor at all; stopped after 60 iterations."""
    import pyamg
    from scipy.sparse.linalg import lobpcg as iterate

    L, M = cotan_laplacian(mesh)
    near = pyamg.smoothed_aggregation_solver(sp.csr_matrix(L + 1e-2 * abs(L).sum() / M.sum() / L.shape[0] * M))
    X = np.random.default_rng(0).standard_normal((L.shape[0], k + k // 4))
    X[:, 0] = 1.0
    evals, evecs = iterate(L, X, B=M, M=near.aspreconditioner(), largest=False, tol=1e-6, maxiter=60)
    order = np.argsort(evals)[:k]
    return L, M, evals[order], evecs[:, order]


def slepc(mesh: TriangleMesh, k: int) -> Result:
    """SLEPc on one rank."""
    L, M = cotan_laplacian(mesh)
    with tempfile.TemporaryDirectory() as folder:
        problem, basis = Path(folder) / "problem.npz", Path(folder) / "basis.npz"
        write_problem(problem, L, M)
        command = [SYSTEM_PYTHON, distributed.__file__, str(problem), str(basis), "--k", str(k)]
        subprocess.run(["mpiexec", "--allow-run-as-root", "-n", "1", *command], check=True, stdout=sys.stderr)
        found = read_eigenbasis(basis)
    return L, M, found.evals, found.evecs


def robust(mesh: TriangleMesh, k: int) -> Result:
    """The same listing on the robust Laplacian."""
    import robust_laplacian

    L, M = robust_laplacian.mesh_laplacian(mesh.vertices, mesh.faces)
    return (sp.csr_array(L), sp.csr_array(M), *eigsh(L, k, M, sigma=1e-8))


def lapy(mesh: TriangleMesh, k: int, cholmod: bool = True, lump: bool = True) -> Result:
    """LaPy."""
    from lapy import Solver, TriaMesh

    solver = Solver(TriaMesh(np.array(mesh.vertices), np.array(mesh.faces)), lump=lump, use_cholmod=cholmod)
    return (sp.csr_array(solver.stiffness), sp.csr_array(solver.mass), *solver.eigs(k))


def pyfm(mesh: TriangleMesh, k: int) -> Result:
    """pyFM."""
    from pyFM.mesh import TriMesh

    other = TriMesh(np.array(mesh.vertices), np.array(mesh.faces))
    other.process(k, verbose=False)
    return sp.csr_array(other.W), sp.csr_array(other.A), other.eigenvalues, other.eigenvectors


METHODS: dict[
    str, tuple[str, Callable[..., Result], dict[str, object]]
] = {  # name: (package needed, function, options)
    "engine": ("cholespy", engine, {}),
    "engine, SciPy only": ("scipy", engine, {"factor": "superlu"}),
    "classic listing": ("scipy", classic, {}),
    "LaPy, cholespy, lumped": ("lapy", lapy, {}),
    "LaPy, cholespy": ("lapy", lapy, {"lump": False}),
    "LaPy, SciPy only": ("lapy", lapy, {"cholmod": False}),
    "pyFM": ("pyFM", pyfm, {}),
    "robust + listing": ("robust_laplacian", robust, {}),
    "listing, sigma < 0": ("scipy", classic, {"sigma": -1e-2}),
    "LOBPCG, PyAMG": ("pyamg", lobpcg, {}),
    "SLEPc, one rank": ("slepc4py", slepc, {}),
}
ALL, MAIN = list(METHODS), ["engine", "engine, SciPy only", "classic listing", "LaPy, cholespy, lumped", "pyFM"]
EIGHT = ["engine", "engine, SciPy only", "classic listing", "LaPy, cholespy, lumped"]
CELLS: list[tuple[str, int, int, list[str], int, int]] = [  # shape, n, k, methods, threads, repeats
    ("blob", 10_000, 200, ALL, 1, 3),
    ("blob", 10_000, 200, MAIN, 2, 3),
    ("blob", 30_000, 100, ["engine"], 1, 3),
    ("blob", 100_000, 100, MAIN, 1, 3),
    ("blob", 100_000, 200, ["engine", "classic listing", "LaPy, cholespy, lumped"], 1, 3),
    ("blob", 300_000, 100, ["engine"], 1, 3),
    ("blob", 100_000, 50, ["engine"], 1, 3),
    ("blob", 100_000, 500, ["engine", "LaPy, cholespy, lumped"], 1, 3),
    ("blob", 1_000_000, 100, ["engine"], 1, 3),
    ("blob", 1_000_000, 50, ["engine", "classic listing"], 1, 3),
    *((shape, 10_000, 100, EIGHT, 1, 3) for shape in SHAPES),
    ("blob", 2_562, 20, ALL, 1, 3),
    ("icosphere", 2_562, 20, ALL, 1, 3),
    ("icosphere", 40_962, 100, EIGHT, 1, 3),
    ("icosphere", 40_962, 20, EIGHT, 1, 3),
]
QUICK = [("blob", 3_000, 60, MAIN, 1, 3), ("patch", 3_000, 60, ["engine", "classic listing"], 2, 3)]

# --- measuring -------------------------------------------------------------------------------------------------------


def measure(file: str, k: int, method: str) -> dict[str, object]:
    """Run one method in this process."""
    with np.load(file) as arrays:
        mesh = TriangleMesh(arrays["vertices"], arrays["faces"])
    _, function, options = METHODS[method]
    with contextlib.redirect_stdout(sys.stderr):
        function(blob(600), 5, **options)  # whatever is imported or compiled on first use is not what is measured
    before = peak_bytes()
    wall, cpu = time.perf_counter(), cpu_seconds()
    with contextlib.redirect_stdout(sys.stderr):
        L, M, evals, evecs = function(mesh, k, **options)
    wall, cpu = time.perf_counter() - wall, cpu_seconds() - cpu
    peak = peak_bytes()
    gap = (L @ evecs - (M @ evecs) * evals) / np.sqrt(M.diagonal())[:, None]
    residual = np.linalg.norm(gap, axis=0).max() / evals.max()
    order = np.argsort(evals)
    return {
        "wall": wall, "cpu": cpu, "residual": float(residual), "peak_bytes": peak, "bytes_before": before,
        "first": float(evals[order[1]]), "last": float(evals[order[-1]]),
    }


def cpu_seconds() -> float:
    """Processor time of this process and of those it has waited for."""
    times = os.times()
    return sum(times[:4])


def peak_bytes() -> int:
    """The most memory that this process has held."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def assembly(n: int) -> dict[str, object]:
    """CPU seconds to assemble L and M: here in NumPy, and in libigl; the best of five."""
    mesh = blob(n)
    V, F = np.array(mesh.vertices), np.array(mesh.faces)
    ways = {
        "engine": lambda: cotan_laplacian(mesh),
        "libigl": lambda: (-igl.cotmatrix(V, F), igl.massmatrix(V, F, igl.MASSMATRIX_TYPE_BARYCENTRIC)),
    }
    best = dict.fromkeys(ways, np.inf)
    for _ in range(5):
        for name, way in ways.items():
            start = time.process_time()
            way()
            best[name] = min(best[name], time.process_time() - start)
    return {"n": n, **best}


def description() -> dict[str, object]:
    """What a reader needs to judge the numbers, without naming the machine."""
    names = ["numpy", "scipy", "cholespy", "lapy", "pyfmaps", "pyamg", "robust_laplacian", "libigl"]
    versions = {}
    for name in names:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    machine = {"processor": platform.machine(), "cores": os.cpu_count(), "memory_bytes": memory}
    return {
        "date": datetime.date.today().isoformat(), "python": platform.python_version(), "system": platform.system(),
        "machine": machine, "versions": versions,
    }


def run_cells(
    cells: list[tuple[str, int, int, list[str], int, int]], report: dict[str, object], out: Path | None
) -> None:
    """Run every cell, the methods of a cell by turns, and print the ratios."""
    runs: list[dict[str, object]] = report.setdefault("runs", [])  # type: ignore[assignment]
    with tempfile.TemporaryDirectory() as folder:
        for shape, n, k, methods, threads, repeats in cells:
            file = Path(folder) / f"{shape}-{n}.npz"
            if not file.exists():
                mesh = SHAPES[shape](n)
                np.savez(file, vertices=mesh.vertices, faces=mesh.faces)
            with np.load(file) as arrays:
                vertices = len(arrays["vertices"])
            cell = []
            present = [method for method in methods if installed(METHODS[method][0])]
            for method in set(methods) - set(present):
                print(f"  {method} left out: {METHODS[method][0]} is not installed")
            same = {"shape": shape, "n": n, "k": k, "threads": threads}
            runs[:] = [run for run in runs if any(run[name] != same[name] for name in same)]
            for _ in range(repeats):
                for method in present:
                    row = same | {"method": method, "vertices": vertices, "date": report["date"]}
                    row |= run_one(file, k, method, threads)
                    row["load"] = os.getloadavg()[0]
                    cell.append(row)
                    runs.append(row)
                    if out is not None:
                        out.write_text(json.dumps(report, indent=1) + "\n")
            print_cell(cell)


def installed(package: str) -> bool:
    """Whether a package can be imported; SLEPc by the system's Python."""
    if package != "slepc4py":
        return importlib.util.find_spec(package) is not None
    home = any(Path("/usr/lib/slepcdir").glob("*/*-real/lib/python3/dist-packages"))
    return home and shutil.which("mpiexec") is not None


def run_one(file: Path, k: int, method: str, threads: int) -> dict[str, object]:
    """One method in a process of its own."""
    cap = {name: str(threads) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
    command = [sys.executable, __file__, "--one", str(file), str(k), method]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **cap}, check=False)
    if done.returncode:
        raise RuntimeError(f"{method} failed:\n{done.stderr}")
    return json.loads(done.stdout)


def print_cell(cell: list[dict[str, object]]) -> None:
    """Medians of each method and their ratios to the engine's."""
    first = cell[0]
    print(f"\n{first['shape']}  n = {first['n']:,}  k = {first['k']}  threads = {first['threads']}  (medians)")
    print(f"{'':26}{'CPU s':>9}{'ratio':>7}{'wall s':>9}{'ratio':>7}{'residual':>10}{'peak GB':>9}{'runs':>6}")
    base: dict[str, float] = {}
    for method in dict.fromkeys(str(row["method"]) for row in cell):
        rows = [row for row in cell if row["method"] == method]
        cpu, wall = (float(np.median([row[name] for row in rows])) for name in ("cpu", "wall"))
        base = base or {"cpu": cpu, "wall": wall}
        worst, peak = (max(float(row[name]) for row in rows) for name in ("residual", "peak_bytes"))  # type: ignore[arg-type]
        ratios = f"{cpu:9.2f}{cpu / base['cpu']:7.2f}{wall:9.2f}{wall / base['wall']:7.2f}"
        print(f"{method:26}{ratios}{worst:10.1e}{peak / 1e9:9.2f}{len(rows):6d}", flush=True)


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="under a minute; writes nothing")
    parser.add_argument("--cells", default=":", help="a slice of the table, such as 2:4")
    parser.add_argument("--repeats", type=int, help="runs of each method, instead of three")
    parser.add_argument("--one", nargs=3, metavar=("FILE", "K", "METHOD"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        json.dump(measure(options.one[0], int(options.one[1]), options.one[2]), sys.stdout)
        return
    report = json.loads(OUT.read_text()) if OUT.exists() and options.cells != ":" else {}
    report |= description()
    begin, end = (int(part) if part else None for part in options.cells.split(":"))
    cells = QUICK if options.quick else CELLS[begin:end]
    if options.repeats:
        cells = [(*cell[:-1], options.repeats) for cell in cells]
    report["assembly"] = [assembly(n) for n in ((10_000,) if options.quick else (10_000, 100_000))]
    for row in report["assembly"]:
        print(f"assembly of L and M, n = {row['n']:,}: libigl / engine = {row['libigl'] / row['engine']:.2f}")
    run_cells(cells, report, None if options.quick else OUT)


if __name__ == "__main__":
    main()
