"""Compile requirements.txt from pyproject.toml: exact versions, one file for every system and Python version.

python tools/pins.py [--upgrade]
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = ("run", "book", "test", "classroom", "dev")
OLDEST_PYTHON = "3.11.0"
HEADER = """\
# Exact versions of everything the course needs, for readers and for continuous integration alike:
#     python -m pip install -r requirements.txt
# Compiled from pyproject.toml by `make pins`; do not edit by hand.
"""


def main(arguments: list[str]) -> int:
    """Write requirements.txt and return the exit status of the resolver."""
    python = [sys.executable, "-m"]
    subprocess.run([*python, "pip", "install", "--quiet", "uv"], check=True)
    target = ROOT / "requirements.txt"
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    plain = ["--universal", "--no-header", "--no-emit-index-url", "--no-emit-find-links", "--annotation-style=line"]
    compiled = [*python, "uv", "pip", "compile", "--quiet", "pyproject.toml", "--python-version", OLDEST_PYTHON]
    status = subprocess.run(
        [*compiled, *plain, *extras, "-o", target.name, *arguments], cwd=ROOT, check=False, stdout=subprocess.DEVNULL
    ).returncode
    if status == 0:
        pins = [line for line in target.read_text(encoding="utf-8").splitlines() if not line.startswith(("#", "-e"))]
        target.write_text(HEADER + "\n".join(pins) + "\n-e .\n", encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
