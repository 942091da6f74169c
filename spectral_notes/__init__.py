"""Spectral Geometry Notes: the support library of the course."""
