"""Compare what `import spectral_notes` costs with what `import numpy` costs: CPU seconds, medians, and modules loaded.

    python benchmarks/imports.py
"""

from __future__ import annotations

import subprocess
import sys
from statistics import median

RUNS = 7
STATEMENTS = ("pass", "import numpy", "import spectral_notes", "import spectral_notes.plotting")


def cost(statement: str) -> tuple[float, int]:
    """Return the CPU seconds and the modules of a fresh interpreter that runs a statement."""
    code = f"import sys, time; {statement}; print(time.process_time(), len(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    seconds, modules = done.stdout.split()
    return float(seconds), int(modules)


def main() -> int:
    """Print one line a statement."""
    runs = {statement: [cost(statement) for _ in range(RUNS)] for statement in STATEMENTS}
    start = median(seconds for seconds, _ in runs["pass"])
    unit = median(seconds for seconds, _ in runs["import numpy"]) - start
    for statement, measured in runs.items():
        share = (median(seconds for seconds, _ in measured) - start) / unit
        print(f"{statement:32s} {share:6.2f} times numpy's import, {measured[0][1]:5d} modules")
    return 0


if __name__ == "__main__":
    sys.exit(main())
