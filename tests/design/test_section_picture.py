"""The small picture of a half section: areas as the design's own figures have them."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import cavity_polygon
from mu_addon.design.section_picture import CAVITY, ENVELOPE, STRUT, WALL, section_pixels


def area(polygon):
    x, y = polygon.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


@pytest.mark.parametrize("preset", ["mu-0.75x", "mu-1.5x"])
def test_the_cavity_fills_its_share_and_all_parts_are_seen(preset):
    d = load_preset(preset).dimensions
    pixels = section_pixels(load_preset(preset), 200)
    parts = {tuple(color) for color in np.unique(pixels.reshape(-1, 4), axis=0)}
    assert parts == {(0.0, 0.0, 0.0, 0.0), ENVELOPE, STRUT, WALL, CAVITY}
    (_, _), (y0, y1), (z0, z1) = d.bounds
    size = 1.06 * max(y1 - y0, z1 - z0) / 200
    shown = (pixels == CAVITY).all(axis=2).sum() * size**2
    assert shown == pytest.approx(2 * area(cavity_polygon(d, 64)), rel=0.02)


def test_a_thicker_wall_has_more_of_the_picture():
    unit = load_preset("mu-1.0x")
    thick = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, wall_mm=1.8))
    thin, wide = ((section_pixels(u) == WALL).all(axis=2).sum() for u in (unit, thick))
    assert wide > 1.4 * thin
