"""A mesh as few bytes: the `.sgn` codec, which transmits coefficients in a basis that the faces alone determine."""

from spectral_notes.compression.codec import FileSummary, decode, describe, encode, renumbered

__all__ = [
    "FileSummary",
    "encode",
    "decode",
    "renumbered",
    "describe",
]
