"""Is the set-up working? Each part that the course needs is tried out, and what is missing is said before chapter 3.

A check does what the pages do, on a small case with a known result: it solves an eigenproblem, renders a scene, writes
files. What goes wrong becomes a finding with a remedy, never an exception.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from threadpoolctl import threadpool_info, threadpool_limits  # type: ignore[import-untyped]

from spectral_notes import shapes
from spectral_notes._checks import FloatArray, as_count
from spectral_notes.compression import decode, encode
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.files import arrays
from spectral_notes.files.mesh_files import read_mesh
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.plotting import rendering
from spectral_notes.plotting.pages import SCRIPTS
from spectral_notes.solver import factor_in_use, memory_needed

PACKAGE = "spectral-notes"
INSTALL = "python -m pip install -r requirements.txt"
SLOW = 5.0  # times as long as ARPACK, above which something is in the way; less than as long is usual
OPTIONAL = {
    "jupyterlab": "to run the notebooks: python -m pip install jupyterlab",
    "jupyter_book": "to render the book: python -m pip install -r requirements.txt",
}
SILENT_BACKENDS = {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}  # of matplotlib: files only
SCENE = "import json; from spectral_notes.command.doctor import render_scene; print(json.dumps(render_scene()))"


@dataclass(frozen=True)
class Finding:
    """Hold what one check found.

    Parameters
    ----------
    name : what was looked at
    status : {"ok", "note", "broken"}, whether it works, works with a limit that is worth knowing, or does not
    says : what was found, in a line
    remedy : what to do about it; empty where nothing needs to be done
    """

    name: str
    status: str
    says: str
    remedy: str = ""

    def __str__(self) -> str:
        lines = [f"{self.status:6s} {self.name}: {self.says}"]
        return "\n".join(lines + [f"         {line}" for line in self.remedy.splitlines()])


def examine(n_vertices: int = 100_000, k: int = 100) -> list[Finding]:
    """Try out every part of the set-up and return what was found, in the order in which the course needs it.

    The set-up works when no finding is "broken".

    Parameters
    ----------
    n_vertices, k : the size of mesh and the number of modes for which the free memory is weighed

    Examples
    --------
    >>> findings = examine(10_000, 50)  # doctest: +SKIP
    >>> [finding.name for finding in findings if finding.status == "broken"]  # doctest: +SKIP
    []
    """
    n_vertices, k = as_count("n_vertices", n_vertices, 1), as_count("k", k, 1)
    checks: list[tuple[str, Callable[[], Finding], str]] = [
        ("python", check_python, "install Python 3.11, 3.12, 3.13 or 3.14"),
        ("packages", check_packages, INSTALL),
        ("optional packages", check_optional_packages, ""),
        ("linear algebra", check_linear_algebra, ""),
        ("eigenproblem", check_eigenproblem, f"the numerical packages do not work together: {INSTALL}"),
        ("pictures", check_pictures, rendering.GL_REMEDY),
        ("interactive scenes", check_scenes, f"{INSTALL} --force-reinstall"),
        ("files", check_files, f"a package for mesh files does not work: {INSTALL} --force-reinstall"),
        ("memory", lambda: check_memory(n_vertices, k), "close other programs"),
    ]
    return [_tried(name, check, remedy) for name, check, remedy in checks]


def _tried(name: str, check: Callable[[], Finding], remedy: str) -> Finding:
    """What a check found; an exception is a finding too."""
    try:
        return check()
    except Exception as error:  # whatever breaks here would break a chapter: saying so is the purpose
        return Finding(name, "broken", " ".join(f"{type(error).__name__}: {error}".split())[:300], remedy)


def check_python() -> Finding:
    """Find whether this Python is one that the package supports."""
    wanted = importlib.metadata.metadata(PACKAGE)["Requires-Python"]
    found = platform.python_version()
    if SpecifierSet(wanted).contains(found, prereleases=True):
        return Finding("python", "ok", f"{found} on {platform.system()} {platform.machine()}")
    return Finding("python", "broken", f"{found}, and {wanted} is needed", "install Python 3.11, 3.12, 3.13 or 3.14")


def check_packages() -> Finding:
    """Find whether every package that the library needs is there, in a version that it supports."""
    needed = [Requirement(text) for text in importlib.metadata.requires(PACKAGE) or []]
    versions, wrong = [], []
    for requirement in needed:
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            version = importlib.metadata.version(requirement.name)
        except importlib.metadata.PackageNotFoundError:
            wrong.append(f"{requirement.name} is not installed")
            continue
        versions.append(f"{requirement.name} {version}")
        if not requirement.specifier.contains(version, prereleases=True):
            wrong.append(f"{requirement.name} {version} is installed and {requirement.specifier} is needed")
    if wrong:
        return Finding("packages", "broken", "; ".join(wrong), INSTALL)
    return Finding("packages", "ok", ", ".join([f"{PACKAGE} {importlib.metadata.version(PACKAGE)}", *versions]))


def check_optional_packages() -> Finding:
    """Find which packages are missing that only some pages or large meshes need."""
    missing = [name for name in OPTIONAL if find_spec(name) is None]
    if not missing:
        return Finding("optional packages", "ok", f"all there: {', '.join(OPTIONAL)}")
    remedy = "\n".join(f"{name}: {OPTIONAL[name]}" for name in missing)
    return Finding("optional packages", "note", f"not installed: {', '.join(missing)}", remedy)


def check_linear_algebra() -> Finding:
    """Find which BLAS libraries are loaded, and how many threads each may use."""
    pools = {
        f"{p['internal_api']} {p['version'] or ''}".strip() + f", threads: {p['num_threads']}"
        for p in threadpool_info()
    }
    return Finding("linear algebra", "ok", "; ".join(sorted(pools)) or "no threaded library")


def check_eigenproblem() -> Finding:
    """Solve for 36 modes of the sphere; hold them against l(l+1) and against ARPACK's, which is timed as well."""
    mesh = shapes.sphere(4)
    L, M = cotan_laplacian(mesh)
    compute_eigenbasis(L, M, 2)  # so that nothing is loaded while the clock runs
    started = time.perf_counter()
    basis = compute_eigenbasis(L, M, 36)
    ours = time.perf_counter() - started
    started = time.perf_counter()
    reference = _arpack(L, M, 36)
    ratio = ours / (time.perf_counter() - started)
    exact = np.repeat(np.arange(6) * np.arange(1, 7), 2 * np.arange(6) + 1)
    off = float(abs(basis.evals[1:] / exact[1:] - 1).max())
    gap = float(abs(basis.evals - reference).max())
    error = basis.orthonormality_error()
    remedy = f"the numerical packages do not work together: {INSTALL}"
    if off > 0.02 or gap > 1e-6 or error > 1e-10:
        says = (
            f"eigenvalues of a sphere are off by {off:.1%}, from ARPACK's by {gap:.1g}; orthonormality by {error:.1g}"
        )
        return Finding("eigenproblem", "broken", says, remedy)
    says = (
        f"36 modes of a sphere within {off:.1%} of l(l+1), equal to ARPACK's, in {ratio:.1f} times its time; "
        f"factors by {factor_in_use()}"
    )
    if ratio > SLOW:
        slow = "the machine may have been busy: try again; to see where the time goes: make bench BENCH=--quick"
        return Finding("eigenproblem", "note", says, slow)
    return Finding("eigenproblem", "ok", says)


def _arpack(L: sp.csr_array, M: sp.csr_array, k: int) -> FloatArray:
    """The k smallest eigenvalues by SciPy's ARPACK, ascending, with one thread as ours."""
    with threadpool_limits(limits=1, user_api="blas"):
        start = np.random.default_rng(0).standard_normal(L.shape[0])
        return np.sort(sla.eigsh(L.tocsc(), k=k, M=M.tocsc(), sigma=-0.1, v0=start, return_eigenvectors=False))


def check_pictures() -> Finding:
    """Render one scene in a process of its own, which a broken graphics driver may end, and look at its colours."""
    backend = os.environ.get("MPLBACKEND", "")
    if backend.lower() in SILENT_BACKENDS:
        says = f"MPLBACKEND={backend} in the environment: a notebook draws every figure and shows none"
        remedy = "unset MPLBACKEND (Windows: set MPLBACKEND=), and start the notebook anew"
        return Finding("pictures", "broken", says, remedy)
    if find_spec("pyvista") is None:
        says = "pyvista is not installed: no still pictures or reports, and no .vtk or .vtu files; the rest works"
        return Finding("pictures", "note", says, 'python -m pip install "spectral-notes[pictures]"')
    try:
        run = subprocess.run([sys.executable, "-c", SCENE], capture_output=True, text=True, timeout=300, check=False)
    except subprocess.TimeoutExpired:
        return Finding("pictures", "broken", "no picture after five minutes", rendering.GL_REMEDY)
    if run.returncode:
        last = (run.stderr.strip() or f"the renderer ended with code {run.returncode}").splitlines()[-1]
        return Finding("pictures", "broken", f"no picture: {last}"[:300], rendering.GL_REMEDY)
    scene = json.loads(run.stdout.splitlines()[-1])
    if min(scene["red"], scene["blue"], scene["white"]) < 0.02:
        return Finding("pictures", "broken", f"the picture is wrong: {scene}", rendering.GL_REMEDY)
    return Finding("pictures", "ok", f"an egg in red and blue, drawn by {scene['renderer']} through {scene['window']}")


def render_scene() -> dict[str, Any]:
    """Render mode 1 of an egg, and return what drew it and which share of the picture is red, blue and white."""
    mesh = shapes.egg(subdivisions=3)
    image = rendering.render(rendering.SurfaceView(mesh, mesh.vertices[:, 2]), size=120).astype(np.int64)
    red, blue = image[..., 0], image[..., 2]
    window = rendering.load_pyvista().Plotter(off_screen=True, window_size=[32, 32])
    window.show(auto_close=False)
    facts = window.render_window.ReportCapabilities().splitlines()
    kind = type(window.render_window).__name__
    window.close()
    renderer = [line.split(":", 1)[1].strip() for line in facts if line.startswith("OpenGL renderer")]
    return {
        "renderer": renderer[0] if renderer else "an unnamed renderer",
        "window": kind,
        "red": float((red > blue + 60).mean()),
        "blue": float((blue > red + 60).mean()),
        "white": float((image.min(axis=2) > 250).mean()),
    }


def check_scenes() -> Finding:
    """Find whether the scripts that turn the surfaces lie in the installed package."""
    size = sum(path.stat().st_size for path in SCRIPTS.glob("*.js")) / 1e3
    if not size:
        return Finding("interactive scenes", "broken", "the viewer is missing", f"{INSTALL} --force-reinstall")
    return Finding("interactive scenes", "ok", f"a viewer of {size:.0f} kB comes with the package: no network needed")


def check_files() -> Finding:
    """Write an egg as PLY, VTP and .sgn, read it back, and compare."""
    mesh = shapes.egg(subdivisions=2)
    with tempfile.TemporaryDirectory() as folder:
        for ending in ("ply", "vtp"):
            arrays.write_arrays(Path(folder, f"egg.{ending}"), mesh, {"height": mesh.vertices[:, 2]})
        back = read_mesh(Path(folder, "egg.ply"))
        data = read_mesh(Path(folder, "egg.vtp"))
    small = decode(encode(mesh, error=0.1))
    if back.n_faces == small.n_faces == data.n_faces == mesh.n_faces:
        return Finding("files", "ok", "PLY, VTP and .sgn written and read back")
    raise ValueError(f"{mesh.n_faces} faces became {back.n_faces}, {data.n_faces} and {small.n_faces}")


def check_memory(n_vertices: int, k: int) -> Finding:
    """Weigh the free memory against what k modes of n vertices need."""
    free = float(psutil.virtual_memory().available)
    needed = memory_needed(n_vertices, k)
    most = int(free / 2 / (memory_needed(1_000_000, k) / 1e6))
    says = (
        f"{free / 1e9:.1f} GB free; {k} modes of {n_vertices:,} vertices need {needed / 1e9:.2f} GB and the factor; "
        f"{k} modes in one piece up to {most:,} vertices"
    )
    if 8.0 * n_vertices * k > free:
        fewer = "ask for fewer modes, simplify the mesh, or spread the work: see the page on large meshes"
        return Finding("memory", "broken", says, fewer)
    if needed > free / 2:
        return Finding("memory", "note", says, "the modes will be found a band at a time, which takes longer")
    return Finding("memory", "ok", says)
