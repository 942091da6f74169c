"""Twins of the book's figures: for the dark theme, and for a narrow window.

A figure of curves is dark ink on white: its greys are turned, and its colours stay (`turned_greys`). A surface would
look lit from below; there the white ground is taken away and the shape stays as it is. Where the surfaces lie is known
from their scenes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

GROUND = np.array([18, 18, 18]) / 255  # of the dark theme's page
INK = 0.9  # what black becomes
READABLE = 716  # pixels of a picture that a window of 358 may shrink to one half and still be read

Pixels = NDArray[np.float64]


def turned_greys(pixels: Pixels) -> Pixels:
    """Return colours (..., 3) with their grey parts turned from white ground to dark and their hues kept."""
    low = pixels.min(axis=-1, keepdims=True)
    chroma = pixels.max(axis=-1, keepdims=True) - low
    grey = np.minimum(low / np.maximum(1 - chroma, 1e-6), 1) ** 1.6  # so that pale colours keep some light
    return np.clip(pixels - low + (1 - chroma) * (INK + (GROUND - INK) * grey), 0, 1)


def on_dark(pixels: Pixels) -> Pixels:
    """Return a surface on white (h, w, 3) on the dark ground; its rim, mixed with white, is mixed with dark instead."""
    white = pixels.min(axis=-1) > 0.985
    pieces, _ = ndimage.label(white)
    outer = np.unique(np.concatenate([pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1]]))
    ground = white & np.isin(pieces, outer)
    holes = [k for k, size in enumerate(np.bincount(pieces.ravel())) if k and size > 6 and k not in set(outer)]
    ground |= np.isin(pieces, holes)  # the ground seen through a shape
    low = pixels.min(axis=-1)
    ground |= (low > 0.97) & (low - ndimage.grey_opening(low, size=(7, 7)) > 0.15)  # and through a slit in it
    drawn = strokes(pixels, ground)
    inside = (ndimage.distance_transform_edt(~ground) > 2.5) & ~drawn
    if not inside.any():
        return turned_greys(pixels)
    at = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
    shape = pixels[at[0], at[1]]
    away, full = 1 - pixels, 1 - shape
    share = np.clip((away * full).sum(axis=-1) / np.maximum((full**2).sum(axis=-1), 1e-3), 0, 1)
    share = np.where(inside, 1.0, np.where(ground, 0.0, share))[..., None]
    made = np.where(inside[..., None], pixels, share * shape + (1 - share) * GROUND)
    return np.where(drawn[..., None], turned_greys(pixels), made)


def strokes(pixels: Pixels, ground: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where black is drawn on the ground (h, w), rims and all; black that lies on a surface is none of it."""
    low, high = pixels.min(axis=-1), pixels.max(axis=-1)
    black = (high < 0.3) & (high - low < 0.08)
    if not black.any():
        return black
    pieces, count = ndimage.label(black, np.ones((3, 3)))
    away, (row, column) = ndimage.distance_transform_edt(~black, return_indices=True)
    nearest, beside = pieces[row, column], (away > 2.5) & (away < 5)
    around = np.bincount(nearest[beside], minlength=count + 1)
    free = np.bincount(nearest[beside & ground], minlength=count + 1) > 0.65 * around
    neutral = high - low < 0.08
    return free[nearest] & (away < 2.5) & neutral


def dark(picture: Image.Image, boxes: Sequence[Sequence[float]]) -> Image.Image:
    """Return the twin of a figure for the dark theme; `boxes` are the shares of the picture that show surfaces."""
    pixels = np.asarray(picture.convert("RGB")) / 255
    made, rest = turned_greys(pixels), pixels.copy()
    for box in boxes:
        left, top, right, bottom = _corners(picture, box)
        made[top:bottom, left:right] = on_dark(pixels[top:bottom, left:right])
        rest[top:bottom, left:right] = 1.0
    for bar in color_bars(rest) if boxes else ():
        made[bar] = pixels[bar]  # the colours of the surfaces, which stay
    return Image.fromarray(np.rint(255 * made).astype(np.uint8))


def color_bars(pixels: Pixels) -> list[tuple[slice, slice]]:
    """Return where the lying colour bars of a picture are: many colours in full rows, long and low."""
    pieces, _ = ndimage.label(pixels.min(axis=-1) < 0.985)
    found = []
    for k, (rows, columns) in enumerate(ndimage.find_objects(pieces), 1):
        if columns.stop - columns.start > 0.2 * pixels.shape[1]:
            inked = ndimage.binary_fill_holes(pieces[rows, columns] == k)
            full = rows.start + np.flatnonzero(inked.mean(axis=1) > 0.95)
            bar = slice(full.min(initial=rows.stop), full.max(initial=rows.start - 1) + 1), columns
            high, wide = pixels[bar].shape[:2]
            if 4 <= high <= wide / 8 and np.ptp(pixels[bar], axis=-1).max() > 0.3:
                found.append(bar)
    return found


def _corners(picture: Image.Image, box: Sequence[float]) -> tuple[int, int, int, int]:
    """The pixels of a box: left, top, right, bottom."""
    left, top, width, height = box
    w, h = picture.size
    corner = max(round(left * w), 0), max(round(top * h), 0)
    return *corner, min(round((left + width) * w), w), min(round((top + height) * h), h)


def columns_when_narrow(width: int, boxes: Sequence[Sequence[float]]) -> int | None:
    """Return how many panels of a picture stand side by side in a narrow window; None where it is shown as it is."""
    columns = len({box[0] for box in boxes})
    fitting = max(1, int(READABLE * columns / width)) if columns else 1
    return fitting if columns > fitting else None


def stacked(picture: Image.Image, boxes: Sequence[Sequence[float]]) -> Image.Image:
    """Return a figure with fewer panels in a row under their titles; what stands below all of them stays below."""
    columns = columns_when_narrow(picture.width, boxes) or len(boxes)
    corners = [_corners(picture, box) for box in boxes]
    floors = sorted({0, *(bottom for *_, bottom in corners)})
    panels = []
    for left, top, right, bottom in corners:
        above = max(floor for floor in floors if floor <= top)  # the title is between the row above and the panel
        panels.append(picture.crop((left, above, right, bottom)))
    wide, high = max(p.width for p in panels), max(p.height for p in panels)
    rest = picture.crop((0, floors[-1], picture.width, picture.height))
    ground = picture.getpixel((1, 1))
    bar = rest if np.ptp(np.asarray(rest), axis=(0, 1)).max() > 40 else None
    rows = -(-len(panels) // columns)
    width = columns * wide
    if bar is not None:
        box = bar.convert("L").point([255 * (abs(k - ground[0]) > 8) for k in range(256)]).getbbox()
        bar = bar.crop((box[0], 0, box[2], bar.height))
        if bar.width > width:
            bar = bar.resize((width, round(bar.height * width / bar.width)))
    made = Image.new("RGB", (width, rows * high + (bar.height if bar else 0)), ground)
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        made.paste(panel, (column * wide + (wide - panel.width) // 2, row * high + high - panel.height))
    if bar is not None:
        made.paste(bar, ((width - bar.width) // 2, rows * high))
    return made
