"""The encoder's estimate of what each index costs; the decoder never needs it, so floating point may take part."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray
from spectral_notes.compression.contexts import CLASSES, TOKENS, table_of
from spectral_notes.compression.tables import COUNTS

LONGEST = 2048


def _prices() -> FloatArray:
    """Bits (classes, quantisers, indices) of a table that has not adapted yet, with sign and plain bits."""
    out = np.empty((CLASSES, 2, LONGEST))
    k = np.arange(LONGEST)
    for level in range(CLASSES):
        which, shift = table_of(level)
        token = np.minimum(k >> shift, TOKENS - 1)
        beyond = np.where(token == TOKENS - 1, 1 + 2 * np.log2((k >> shift) - token + 1), 0.0)
        for quantiser in (0, 1):
            counts = np.array(COUNTS[which][quantiser], dtype=np.float64)
            out[level, quantiser] = -np.log2(counts / counts.sum())[token] + beyond + shift + (k > 0)
    return out


PRICES = _prices()
