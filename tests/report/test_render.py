"""Pictures show what they should, where they should, and the same every time."""

import io

import numpy as np
import pytest
from PIL import Image

from mu_addon.report.render import Camera, Cut, Part, fit, png, render
from mu_addon.report.shapes import ball, tube

RED, GREEN, BLUE = (0.9, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.9)
FRONT = Camera((0, 0, 0), (1, 0, 0), (0, 0, 1), 4.0)


def box(low, high, color=RED, inside_out=False, **more):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    if inside_out:
        faces = faces[:, ::-1]
    return Part(np.asarray(low) + corners * (np.asarray(high) - np.asarray(low)), faces, color, **more)


def picture(parts, camera=FRONT, size=64, **more):
    return render(parts, camera, size, size, **more)


def hue(pixel):
    return int(np.argmax(pixel[:3]))


def test_a_disc_of_the_right_size_without_a_hole():
    image = picture([Part(*ball((0, 0, 0), 1.5, 96))], size=200)
    alpha = image[..., 3] / 255.0
    assert alpha.sum() * (4.0 / 200) ** 2 == pytest.approx(np.pi * 1.5**2, rel=2e-3)
    y, x = np.mgrid[:200, :200]
    distance = np.hypot((x + 0.5 - 100) / 50, (y + 0.5 - 100) / 50)
    assert (alpha[distance < 1.46] == 1.0).all()
    assert (alpha[distance > 1.53] == 0.0).all()


def test_a_point_falls_where_the_extent_says():
    camera = Camera((5.0, 7.0, 9.0), (1, 0, 0), (0, 0, 1), 4.0)
    image = render([Part(*ball((5.0, 7.5, 10.0), 0.05))], camera, 160, 80)
    left, right, bottom, top = camera.extent(2.0)
    rows, columns = np.nonzero(image[..., 3] > 128)
    assert left + (columns.mean() + 0.5) * (right - left) / 160 == pytest.approx(7.5, abs=0.03)
    assert top - (rows.mean() + 0.5) * (top - bottom) / 80 == pytest.approx(10.0, abs=0.03)


def test_the_nearer_part_hides_the_farther():
    near, far = box((1, -1, -1), (1.5, 0, 1), RED), box((-1, -1, -1), (-0.5, 1, 1), BLUE)
    for parts in ([near, far], [far, near]):
        image = picture(parts)
        assert hue(image[32, 24]) == 0
        assert hue(image[32, 40]) == 2


def test_a_translucent_part_lets_through_what_is_behind():
    veil = box((1, -2, -2), (1.2, 2, 2), (0.5, 0.5, 0.5), opacity=0.3)
    inside = box((-1, -1, -1), (0, 1, 1), RED)
    image = picture([veil, inside], layers=1)
    bare = picture([inside])
    assert hue(image[32, 32]) == 0
    assert int(image[32, 32, 0]) - int(image[32, 32, 1]) < int(bare[32, 32, 0]) - int(bare[32, 32, 1])
    assert image[4, 4, 3] == pytest.approx(255 * 0.3, abs=3)
    two = picture([veil, inside], layers=2)
    assert two[4, 4, 3] == pytest.approx(255 * (1 - 0.7**2), abs=3)


def test_a_cut_fills_the_section_and_shows_the_cavity():
    shell = box((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), GREEN)
    cavity = box((-1, -1, -1), (1, 1, 1), GREEN, inside_out=True)
    marker = Part(*ball((0, 1.25, 1.25), 0.2), BLUE, whole=True)
    image = picture([shell, cavity, marker], cut=Cut((0, 0, 0), (1, 0, 0), color=RED), size=128)
    assert hue(image[64, 20]) == 0  # the wall's section
    assert hue(image[64, 64]) == 1  # the cavity's back wall
    assert hue(image[24, 104]) == 2  # left whole in front of the section
    assert hue(picture([shell, cavity], size=128)[64, 20]) == 1
    own = picture([shell, cavity], cut=Cut((0, 0, 0), (1, 0, 0)), size=128)
    assert hue(own[64, 20]) == 1


def test_where_cut_parts_touch_each_shows_its_own_section():
    left, right = box((-1, -1, -1), (1, 0, 1), RED), box((-1, 0, -1), (1, 1, 1), BLUE)
    core = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), GREEN)
    hole = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), RED, inside_out=True)
    camera = Camera((0, 0, 0), (1, -0.3, 0.2), (0, 0, 1), 4.0)
    for parts in ([left, right], [right, left]):
        image = picture(parts, camera, cut=Cut((0, 0, 0), (1, 0, 0)))
        assert hue(image[32, 24]) == 0
        assert hue(image[32, 40]) == 2
    ahead = Cut((0.75, 0, 0), (1, 0, 0))
    for parts in ([left, hole, core], [core, hole, left]):
        assert hue(picture(parts, camera, cut=ahead)[32, 28]) == 0


@pytest.mark.parametrize("distance", [None, 6.0])
def test_a_veil_is_seen_before_a_section_and_not_behind_it(distance):
    camera = Camera((0, 0, 0), (1, 0, 0), (0, 0, 1), 4.0, distance=distance)
    solid, cut = box((-1.5, -1, -1), (1.5, 1, 1), RED), Cut((0.5, 0, 0), (1, 0, 0))
    for x, seen in ((0.8, True), (0.2, False)):
        veil = box((x, -0.5, -0.5), (x + 0.01, 0.5, 0.5), BLUE, opacity=0.6, whole=True)
        pixel = picture([solid, veil], camera, cut=cut)[32, 32]
        assert (pixel[2] > 100) == seen


def test_an_oblique_cut_in_perspective_stays_in_its_plane():
    solid = box((-1, -1, -1), (1, 1, 1), GREEN)
    camera = Camera((0, 0, 0), (1, 0.4, 0.3), (0, 0, 1), 5.0, distance=9.0)
    image = render([solid], camera, 128, 128, cut=Cut((0.2, 0, 0), (1, 0, 0), color=RED))
    right, up, towards = camera.axes
    eye = 9.0 * towards
    for y, z in ((0, 0), (0.9, 0.9), (-0.9, -0.9), (0.9, -0.9)):
        away = np.array([0.2, y, z]) - eye
        seen = 9.0 * away / -(away @ towards)
        column, row = 64 + seen @ right * 128 / 5.0, 64 - seen @ up * 128 / 5.0
        assert hue(image[int(row), int(column)]) == 0


def test_perspective_makes_the_nearer_larger():
    parts = [box((1, -1.1, -0.25), (1.1, -0.6, 0.25), RED), box((-3, 0.6, -0.25), (-2.9, 1.1, 0.25), BLUE)]
    image = picture(parts, Camera((0, 0, 0), (1, 0, 0), (0, 0, 1), 4.0, distance=5.0), size=128)
    red = (image[..., 0] > image[..., 2]) & (image[..., 3] > 128)
    blue = (image[..., 2] > image[..., 0]) & (image[..., 3] > 128)
    # Sides as 5 / 3.9 to 5 / 7.9 of the target's plane.
    assert red.sum() / blue.sum() == pytest.approx((7.9 / 3.9) ** 2, rel=0.1)


def test_parts_shade_each_other():
    floor, post = box((-0.2, -2, -2), (0, 2, 2), (0.8, 0.8, 0.8)), box((0, -0.2, -2), (1.5, 0.2, 2), RED)
    shaded = picture([floor, post], size=96)[48].astype(int)
    open_ = picture([floor, post], size=96, ambient=False)[48].astype(int)
    beside, away = 48 + 8, 48 + 44
    assert open_[beside, 0] - shaded[beside, 0] > 25
    assert open_[beside, 0] - shaded[beside, 0] > 2 * (open_[away, 0] - shaded[away, 0])


def test_colours_a_vertex_are_interpolated():
    part = box((-1, -1, -1), (0, 1, 1))
    t = (part.vertices[:, 1:2] + 1) / 2
    part = Part(part.vertices, part.faces, t * np.array([BLUE]) + (1 - t) * np.array([RED]))
    row = picture([part], ambient=False)[32, 17:47].astype(int)
    assert (np.diff(row[:, 0]) <= 0).all()
    assert row[0, 0] > row[-1, 0] + 100
    assert (np.diff(row[:, 2]) >= 0).all()


def test_the_same_every_time_and_a_png():
    parts = [
        Part(*tube([(0, -1, -1), (0, 0, 1), (0, 1, 0)], 0.3)),
        box((-1, -2, -2), (-0.5, 2, 2), opacity=0.5),
    ]
    first = png(picture(parts, background=(1, 1, 1)))
    assert first == png(picture(parts, background=(1, 1, 1)))
    with Image.open(io.BytesIO(first)) as image:
        assert image.size == (64, 64)
        assert image.getpixel((0, 0))[3] == 255


def test_fit_leaves_its_margin_and_no_more():
    parts = [box((-3, 2, 1), (4, 9, 6)), Part(*ball((0, 0, 12), 1.0))]
    camera = fit(parts, (1, 0.6, 0.3), aspect=1.5, margin=0.05)
    image = render(parts, camera, 300, 200)
    rows, columns = np.nonzero(image[..., 3] > 0)
    edges = [rows.min() / 200, 1 - (rows.max() + 1) / 200, columns.min() / 300, 1 - (columns.max() + 1) / 300]
    assert min(edges) == pytest.approx(0.05, abs=0.01)
