"""Sections of a part along its build: areas in closed form, another reader's outlines, what is enclosed."""

import numpy as np
import pytest
import trimesh

from mu_addon.design import shapes
from mu_addon.design.printing.slices import Layers, even_heights, signed_area, slices
from mu_addon.design.solid import chamber, printable

from .parts import small_solid, small_unit

UP = (0.0, 0.0, 1.0)


def bottle():
    """A box of 14 mm with a chamber of 10 mm in its middle, which a bore opens to the bottom."""
    body = shapes.box([-7, -7, 0], [7, 7, 14]) - shapes.box([-5, -5, 2], [5, 5, 12])
    return printable(body - shapes.cylinder(2.0, -1.0, 3.0, 64))


@pytest.mark.parametrize(
    ("height", "area", "enclosed"),
    [(1.0, 196 - 4 * np.pi, 4 * np.pi), (7.0, 96.0, 100.0), (13.0, 196.0, 0.0)],
)
def test_areas_of_a_bottle(height, area, enclosed):
    (found,) = slices(*bottle(), UP, [height])
    assert found.area_mm2 == pytest.approx(area, rel=1e-3)
    assert found.enclosed_mm2 == pytest.approx(enclosed, rel=3e-3, abs=1e-9)


def test_the_build_direction_is_the_way_up():
    vertices, triangles = bottle()
    found = slices(vertices, triangles, (1.0, 0.0, 0.0), [1.0, 7.0])
    assert [s.area_mm2 for s in found] == pytest.approx([196.0, 196 - 100 - 2 * 4], rel=1e-3)
    assert even_heights(vertices, (1.0, 0.0, 0.0), 4) == pytest.approx([1.75, 5.25, 8.75, 12.25])


def test_a_chamber_is_seen_where_its_inlet_opens_it():
    """Along the bore's axis the bottle's chamber is not a hole of the section, as it is beside the bore."""
    room = printable(shapes.box([-5, -5, 2], [5, 5, 12]))
    opened, enclosed = slices(*bottle(), (1.0, 0.0, 0.0), [7.0, 3.0], room)
    assert (opened.enclosed_mm2, opened.open_mm2) == pytest.approx((0.0, 100.0), abs=1e-6)
    assert (enclosed.enclosed_mm2, enclosed.open_mm2) == pytest.approx((100.0, 0.0), abs=1e-6)
    layers = Layers(*bottle(), (1.0, 0.0, 0.0), room)
    assert [layers.filled(z).enclosed_mm2 for z in (7.0, 3.0)] == pytest.approx([100.0, 100.0])
    assert Layers(*bottle(), (1.0, 0.0, 0.0)).filled(7.0).enclosed_mm2 == 0.0


@pytest.mark.parametrize("tilt", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.3), (0.0, 0.0, -1.0)])
def test_a_units_chamber_is_the_room_in_its_solid(tilt):
    solid = small_solid()
    within = chamber(small_unit())
    heights = even_heights(solid.vertices, tilt, 9)
    for found in slices(solid.vertices, solid.triangles, tilt, heights, within):
        # None of it where there is material, which is grey: its own area, and outlines that do not cross it.
        (alone,) = slices(solid.vertices, solid.triangles, tilt, [found.height_mm])
        assert found.area_mm2 == alone.area_mm2
        assert sum(map(signed_area, found.open_chamber)) == pytest.approx(found.open_mm2, abs=0.05)
    exact = trimesh.Trimesh(*within).volume
    step = heights[1] - heights[0]
    fine = slices(solid.vertices, solid.triangles, tilt, even_heights(solid.vertices, tilt, 90), within)
    room = sum(s.enclosed_mm2 + s.open_mm2 for s in fine) * step / 10
    assert room == pytest.approx(exact, rel=0.03)


def test_layers_add_up_to_the_part():
    solid = small_solid()
    heights = even_heights(solid.vertices, UP, 200)
    found = slices(solid.vertices, solid.triangles, UP, heights)
    volume = sum(s.area_mm2 for s in found) * (heights[1] - heights[0])
    exact = trimesh.Trimesh(solid.vertices, solid.triangles).volume
    assert volume == pytest.approx(exact, rel=0.01)


def test_outlines_are_those_of_another_program():
    solid, unit = small_solid(), small_unit()
    part = trimesh.Trimesh(solid.vertices, solid.triangles)
    low = part.bounds[0, 2]
    # Through a bladder's widest place, and through a neck.
    for z in (0.5 * unit.dimensions.cell, unit.dimensions.cell):
        (found,) = slices(solid.vertices, solid.triangles, UP, [z + 0.013 - low])
        section = part.section(plane_origin=[0, 0, z + 0.013], plane_normal=[0, 0, 1])
        around = sum(np.linalg.norm(r - np.roll(r, 1, axis=0), axis=1).sum() for r in found.outlines)
        assert around == pytest.approx(section.length, rel=5e-3)
        assert found.enclosed_mm2 > 10.0


def test_a_surface_without_volume_has_no_sections():
    vertices, triangles = bottle()
    assert slices(vertices, triangles[:-1], UP, [1.0]) == []
