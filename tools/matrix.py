"""Run the tests and notebooks with the oldest and newest NumPy and SciPy, and with one and two BLAS threads.

    python tools/matrix.py [NOTEBOOK ...] [--only oldest-1]

Each release of the pair gets an environment of its own in `_build/matrix`: the pins, then the two packages in the
versions that pyproject.toml names as its lowest, or in the newest that the registry has. What is stored in the
notebooks must come out of all of them.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("numpy", "scipy")
RELEASES = ("oldest", "newest")
THREADS = (1, 2)
TESTS = (
    "test_fourier", "test_finite_differences", "test_laplacians", "solver/test_lanczos", "test_eigenbasis",
    "test_mesh_calculus", "test_diffusion", "test_descriptors", "test_clustering", "geometry/test_geodesics",
    "compression/test_compression_exact",
)
NOTEBOOKS = ("02_fourier_basis", "03_differentiation", "06_signals_on_surfaces", "07_laplacian", "conventions")
THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def requirements(release: str, pyproject: Path = ROOT / "pyproject.toml") -> list[str]:
    """Return NumPy and SciPy as pyproject.toml has them, at their lowest for the oldest release."""
    wanted = tomllib.loads(pyproject.read_text(encoding="utf-8"))["project"]["dependencies"]
    ranges = [line for line in wanted if re.split(r"[<>=]", line)[0] in PACKAGES]
    if release == "newest":
        return ranges
    return [re.sub(r">=([0-9.]+).*", r"==\1", line) for line in ranges]


def environment(release: str) -> Path:
    """Make an environment with the pins and one release of the two packages, and return its interpreter."""
    folder = ROOT / "_build" / "matrix" / release
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if uv := shutil.which("uv"):
        make = [uv, "venv", "--quiet", "--allow-existing", "--python", sys.executable, str(folder)]
        install = [uv, "pip", "install", "--quiet", "--python", str(python)]
    else:
        make = [sys.executable, "-m", "venv", str(folder)]
        install = [str(python), "-m", "pip", "install", "--quiet"]
    upgrade = ["--upgrade"] if release == "newest" else []
    for command in (make, [*install, "-r", "requirements.txt"], [*install, *upgrade, *requirements(release)]):
        subprocess.run(command, check=True, cwd=ROOT)
    return python


def prove(python: Path, threads: int, notebooks: list[str]) -> int:
    """Run the chosen tests and notebooks and return the exit status."""
    tests = [f"tests/{name}.py" for name in TESTS]
    options = ["--nbval", "--nbval-current-env", "--nbval-cell-timeout=600"]
    options += ["--nbval-sanitize-with", "tests/nbval_sanitize.cfg", "-q", "-p", "no:cacheprovider"]
    command = [str(python), "-m", "pytest", *options, *tests, *notebooks]
    variables = {**os.environ, **dict.fromkeys(THREAD_VARIABLES, str(threads))}
    return subprocess.run(command, check=False, cwd=ROOT, env=variables).returncode


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    names = [f"{release}-{threads}" for release in RELEASES for threads in THREADS]
    parser.add_argument("notebooks", nargs="*", help=f"notebooks to compare (default: {', '.join(NOTEBOOKS)})")
    parser.add_argument("--only", choices=names, action="append", help="one release and number of threads")
    options = parser.parse_args(arguments)
    notebooks = options.notebooks or [f"book/{name}.ipynb" for name in NOTEBOOKS]
    failed = []
    for name in options.only or names:
        release, threads = name.split("-")
        python = environment(release)
        sys.stderr.write(f"matrix {name}: {' '.join(requirements(release))}, BLAS threads: {threads}\n")
        if prove(python, int(threads), notebooks):
            failed.append(name)
    sys.stderr.write(f"matrix: {', '.join(failed) + ' FAILED' if failed else 'all passed'}\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
