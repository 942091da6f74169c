"""Draw the picture of the front page: eigenfunctions of an egg and a goat, `book/_static/eggenvectors.png`.

    python tools/front_picture.py

The one picture that is stored, because a README cannot run code; every other picture is drawn when the book is built.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

from PIL import Image

from spectral_notes import plotting
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.shapes import egg, goat

TARGET = Path(__file__).resolve().parents[1] / "book" / "_static" / "eggenvectors.png"
MODES = [1, 2, 5, 10, 50]
WIDTH = 1120  # pixels


def main() -> int:
    """Draw, shrink and store the picture."""
    plotting.use_house_style()
    surfaces, values = [], []
    for mesh in (egg(), goat()):
        basis = compute_eigenbasis(*cotan_laplacian(mesh), max(MODES) + 1)
        surfaces += [mesh] * len(MODES)
        values += [basis.evecs[:, mode] for mode in MODES]
    titles = [f"mode {mode}" for mode in MODES] + [""] * len(MODES)
    figure = plotting.plot_surfaces(surfaces, values, titles=titles, n_columns=len(MODES))
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=200)
    picture = Image.open(drawn).convert("RGB")
    picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.save(TARGET, optimize=True)
    sys.stderr.write(f"{TARGET.name}: {TARGET.stat().st_size // 1024} kB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
