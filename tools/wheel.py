"""Build the wheel and the source archive, look into them, install each in an empty environment, and use it there.

    python tools/wheel.py

The wheel holds the library alone. What is used is what the README shows, from a folder that is not the repository.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
USE = """
import importlib, pkgutil
from pathlib import Path
import spectral_notes
from spectral_notes import compression, files, labs, plotting, shapes
assert Path(spectral_notes.__file__).is_relative_to({environment!r}), spectral_notes.__file__
rooms = [name for _, name, is_room in pkgutil.iter_modules(spectral_notes.__path__) if is_room]
doors = [spectral_notes, *(importlib.import_module("spectral_notes." + name) for name in rooms)]
public = [getattr(door, name) for door in doors for name in door.__all__]
{readme}
files.write_mesh("egg.obj", mesh)
again = files.read_mesh("egg.obj")
data = compression.encode(again, error=0.1)
scene = plotting.show(plotting.SurfaceView(mesh, basis.evecs[:, 1])).page
lab = labs.lab("heat", mesh, k=10).page
person = shapes.person("tall", "walk")
print(len(public), "public names in", len(rooms), "rooms")
print("a scene of", len(scene) // 1000, "kB, a lab of", len(lab) // 1000, "kB, a person:", person.n_vertices)
print(smooth_egg.shape, basis.evals.round(2).tolist()[:3], compression.describe(data).codec)
"""


def readme_example(readme: Path = ROOT / "README.md") -> str:
    """Return the first Python block of the README."""
    block = re.search(r"```python\n(.*?)```", readme.read_text(encoding="utf-8"), re.DOTALL)
    if block is None:
        raise ValueError(f"{readme.name} must show how the library is used, in a block of python")
    return block[1]


def strangers(wheel: Path) -> list[str]:
    """Return the files of a wheel that are neither the library nor its metadata."""
    with zipfile.ZipFile(wheel) as archive:
        return [name for name in archive.namelist() if not re.match(r"spectral_notes(/|-[^/]*\.dist-info/)", name)]


def build(target: Path) -> list[Path]:
    """Build the source archive, and the wheel from it, into an empty folder."""
    shutil.rmtree(target, ignore_errors=True)
    uv = shutil.which("uv")
    command = [uv, "build", "--quiet", "--out-dir"] if uv else [sys.executable, "-m", "build", "--outdir"]
    subprocess.run([*command, str(target)], check=True, cwd=ROOT)
    return [*target.glob("*.whl"), *target.glob("*.tar.gz")]


def use(archive: Path, scratch: Path) -> None:
    """Install an archive in an empty environment and run the example of the README there."""
    environment = scratch / archive.name
    python = environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    make, install = [sys.executable, "-m", "venv"], [str(python), "-m", "pip", "install"]
    if uv := shutil.which("uv"):
        make = [uv, "venv", "--quiet", "--python", sys.executable]
        install = [uv, "pip", "install", "--python", str(python)]
    subprocess.run([*make, str(environment)], check=True)
    subprocess.run([*install, "--quiet", f"{archive}[pictures]"], check=True)
    code = USE.format(environment=str(environment.resolve()), readme=readme_example())
    subprocess.run([str(python), "-I", "-c", code], check=True, cwd=scratch)
    for script in sorted(python.parent.glob("spectral-notes*")):
        subprocess.run([str(script), "--help"], check=True, cwd=scratch, stdout=subprocess.DEVNULL)


def main() -> int:
    """Run the command line and return its exit status."""
    archives = build(ROOT / "dist")
    for archive in archives:
        sys.stderr.write(f"{archive.name}: {archive.stat().st_size / 1e6:.2f} MB\n")
    if foreign := strangers(archives[0]):
        sys.stderr.write(f"{archives[0].name} holds more than the library: {foreign}\n")
        return 1
    with tempfile.TemporaryDirectory(prefix="wheel-") as scratch:
        for archive in archives:
            use(archive, Path(scratch))
            sys.stderr.write(f"{archive.name}: installed in an empty environment, and used\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
