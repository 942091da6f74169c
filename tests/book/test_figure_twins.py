"""Twins of figures: dark ones keep hues and shapes, narrow ones keep every panel and what stands below."""

from __future__ import annotations

import figure_twins
import numpy as np
from PIL import Image, ImageDraw


def test_greys_are_turned_and_hues_stay():
    colours = np.array([[1, 1, 1], [0, 0, 0], [0, 0.447, 0.698], [0.835, 0.369, 0]])
    ground, ink, blue, orange = figure_twins.turned_greys(colours)
    assert np.allclose(ground, figure_twins.GROUND)
    assert np.allclose(ink, figure_twins.INK)
    for before, after in ((colours[2], blue), (colours[3], orange)):
        assert np.array_equal(np.argsort(before), np.argsort(after))
        assert after.min() < 0.35 and after.max() > 0.6


def drawing(n: int) -> tuple[Image.Image, list[list[float]]]:
    """A row of n panels of 200 pixels under titles: a disk with a white middle seen through, and a bar below."""
    picture = Image.new("RGB", (200 * n, 300), "white")
    draw = ImageDraw.Draw(picture)
    for k in range(n):
        draw.ellipse((200 * k + 20, 50, 200 * k + 180, 210), fill=(180, 20 + 10 * k, 40))
        draw.ellipse((200 * k + 80, 110, 200 * k + 120, 150), fill="white")
        draw.rectangle((200 * k + 90, 8, 200 * k + 110, 20), fill="black")  # a title
    draw.rectangle((200 * n // 2 - 60, 260, 200 * n // 2 + 60, 270), fill=(20, 60, 200))
    return picture, [[k / n, 0.1, 1 / n, 0.7] for k in range(n)]


def test_a_surface_keeps_its_colours_on_a_dark_ground_and_its_holes_are_ground():
    picture, boxes = drawing(2)
    pixels = np.asarray(figure_twins.dark(picture, boxes))
    assert tuple(pixels[80, 100]) == (180, 20, 40)
    assert pixels[35, 5].max() < 30 and pixels[130, 100].max() < 30
    assert pixels[14, 100].min() > 200  # the title
    rim = pixels[40:220, 10:190].reshape(-1, 3).astype(int)
    assert (rim.min(axis=1) > 100).sum() == 0, "a white rim is left"


def test_black_on_the_ground_is_turned_black_on_a_surface_stays_and_a_slit_is_ground():
    picture, boxes = drawing(1)
    draw = ImageDraw.Draw(picture)
    draw.line((10, 225, 190, 225), fill="black", width=3)  # the floor
    draw.line((60, 100, 140, 100), fill="black", width=3)  # a nodal line
    draw.line((100, 160, 100, 180), fill=(250, 250, 250), width=2)  # two legs nearly touch
    draw.line((100, 60, 100, 90), fill=(235, 235, 235), width=2)  # a pale surface is none
    pixels = np.asarray(figure_twins.dark(picture, boxes))
    assert pixels[225, 20:180].min() > 200, "the floor is lost"
    assert pixels[100, 70:130].max() < 30, "a line on the surface changed"
    assert pixels[162:178, 95:106].min(axis=-1).max() < 80, "white is left in the slit"
    assert pixels[62:88, 100].min() > 200, "a pale strip was taken for ground"


def test_a_colour_bar_keeps_the_colours_of_its_surfaces_and_its_label_is_turned():
    picture, boxes = drawing(2)
    draw = ImageDraw.Draw(picture)
    draw.rectangle((140, 260, 260, 270), fill="white", outline="black")
    draw.rectangle((141, 261, 180, 269), fill=(103, 0, 31))
    draw.rectangle((220, 261, 259, 269), fill=(5, 48, 97))
    draw.line((200, 270, 200, 274), fill="black")  # a tick
    draw.rectangle((190, 280, 210, 290), fill="black")  # its label
    pixels = np.asarray(figure_twins.dark(picture, boxes))
    assert [tuple(pixels[265, x]) for x in (150, 200, 240)] == [(103, 0, 31), (255, 255, 255), (5, 48, 97)]
    assert pixels[285, 200].min() > 200 and pixels[250, 200].max() < 30
    assert np.asarray(figure_twins.dark(picture, []))[265, 200].max() < 30, "a figure of curves is turned whole"


def test_narrow_windows_stack_the_panels():
    picture, boxes = drawing(7)
    assert figure_twins.columns_when_narrow(picture.width, boxes) == 3
    assert figure_twins.columns_when_narrow(400, drawing(2)[1]) is None
    assert figure_twins.columns_when_narrow(1400, []) is None
    made = np.asarray(figure_twins.stacked(picture, boxes))
    assert made.shape[1] == 600
    reds = [made[240 * row + 80, 200 * column + 100] for row in range(3) for column in range(3)]
    assert [tuple(map(int, red)) for red in reds[:7]] == [(180, 20 + 10 * k, 40) for k in range(7)]
    assert tuple(reds[7]) == (255, 255, 255)
    assert (made[720:] == (20, 60, 200)).all(axis=2).any(), "the bar below is lost"
    assert (made[:30] == 0).all(axis=2).any(), "the titles are lost"
