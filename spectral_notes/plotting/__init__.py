"""Pictures of signals on shapes, in the house style: stills, and scenes that a reader turns."""

from spectral_notes.plotting.pages import Page
from spectral_notes.plotting.rendering import SurfaceView, render
from spectral_notes.plotting.scenes import show
from spectral_notes.plotting.stills import plot_matrix, plot_modes, plot_surfaces, plot_views, use_house_style

__all__ = [
    "use_house_style",
    "plot_matrix",
    "plot_surfaces",
    "plot_modes",
    "plot_views",
    "SurfaceView",
    "render",
    "show",
    "Page",
]
