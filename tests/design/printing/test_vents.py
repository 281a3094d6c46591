"""Vents let trapped resin out, and the plugs close them again: by the same check, and by trimesh."""

import numpy as np
import pytest
import trimesh

from mu_addon.design import shapes
from mu_addon.design.gates import GateError
from mu_addon.design.printing.check import check
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.printing.vents import CLEARANCE_MM, DIAMETER_MM, vented

from .parts import arrays, manifold, small_solid, small_unit


@pytest.fixture(scope="module")
def printer():
    return load_printer()


def bottle(floor=2.0):
    """A box with a chamber of 1 ml and a bore of 4 mm at the top, z = 14."""
    low = -floor
    return (
        shapes.box([-7, -7, low], [7, 7, 14])
        - shapes.box([-5, -5, 0], [5, 5, 10])
        - shapes.cylinder(2, 9, 15, 32)
    )


def largest_cup(vertices, triangles, printer, up):
    return check(vertices, triangles, printer, direction=up, stages=("chambers", "layers")).figures[
        "largest_cup_ml"
    ]


def test_a_cup_gets_a_hole_where_it_begins_and_is_gone(printer):
    body = bottle()
    part = arrays(body)
    trapped = 1.0 + 0.016 * np.pi
    assert largest_cup(*part, printer, (0, 0, 1)) == pytest.approx(trapped, rel=0.01)
    found = vented(*part, (0, 0, 1), printer)
    (vent,) = found.vents
    assert vent.length == pytest.approx(2.0, abs=1e-3)
    assert [vent.inner[2], vent.outer[2]] == pytest.approx([0.0, -2.0], abs=1e-3)
    assert np.hypot(*vent.inner[:2]) < 0.3
    assert found.before_ml == pytest.approx(trapped, rel=0.01)
    assert found.after_ml < printer["cup_ml"]
    assert largest_cup(found.vertices, found.triangles, printer, (0, 0, 1)) == found.after_ml
    read = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert read.is_watertight
    assert read.body_count == 1
    assert body.volume() - read.volume == pytest.approx(np.pi * (0.5 * DIAMETER_MM) ** 2 * 2.0, rel=0.01)


def test_the_plug_fits_the_hole_and_its_head_does_not(printer):
    found = vented(*arrays(bottle()), (0, 0, 1), printer)
    (vent,) = found.vents
    drilled = manifold(found.vertices, found.triangles)
    assert (vent.plug ^ drilled).volume() < 1e-6
    assert vent.head
    plug = trimesh.Trimesh(*arrays(vent.plug), process=False)
    assert plug.is_watertight
    assert plug.body_count == 1
    assert np.ptp(plug.vertices, axis=0) == pytest.approx([DIAMETER_MM + 2.0] * 2 + [3.0], abs=0.02)
    standing = vent.plug_surface()[0]
    assert standing.min(axis=0) == pytest.approx([-2.0, -2.0, 0.0], abs=0.02)
    assert np.hypot(*standing[standing[:, 2] > 1.01][:, :2].T).max() == pytest.approx(0.95, abs=0.01)
    # Moved inward it stays outside by its head; a thicker stem would not go in.
    assert (vent.plug.translate([0, 0, 1.0]) ^ drilled).volume() > 1.0
    assert CLEARANCE_MM < 0.1 * DIAMETER_MM


def test_a_part_without_a_cup_stays_as_it_is(printer):
    part = arrays(bottle())
    found = vented(*part, (0, 0, -1), printer)
    assert found.vents == []
    assert found.triangles is part[1]


def test_a_sealed_void_gets_a_hole_at_either_end(printer):
    part = arrays(shapes.box([-6, -6, -6], [6, 6, 6]) - shapes.box([-4, -4, -4], [4, 4, 4]))
    found = vented(*part, (0, 0, 1), printer)
    assert sorted(round(float(v.outer[2])) for v in found.vents) == [-6, 6]
    shells = manifold(found.vertices, found.triangles).decompose()
    assert len(shells) == 1


@pytest.mark.parametrize(("floor", "words"), [(0.6, "walls of 0.6"), (20.0, "1.2 to 12 mm")])
def test_a_wall_that_is_too_thin_or_too_thick_is_refused(printer, floor, words):
    body = bottle(floor) if floor > 1 else bottle(floor) ^ shapes.box([-5.6, -5.6, -9], [5.6, 5.6, 20])
    if floor > 1:
        body += shapes.box([-25, -25, -20], [25, 25, 8]) - shapes.box([-6, -6, -1], [6, 6, 9])
    with pytest.raises(GateError, match=words):
        vented(*arrays(body), (0, 0, 1), printer)


@pytest.mark.nightly(
    "tests/studies/test_export.py::test_vents_for_a_build_direction_are_cut_and_their_plugs_written"
)
def test_the_units_tip_takes_the_vent_and_its_membrane_none(printer):
    """With the inlet away from the platform the whole chamber is a cup, which begins at the tip's cap."""
    solid = small_solid()
    found = vented(solid.vertices, solid.triangles, (0, 0, -1), printer)
    (vent,) = found.vents
    d = small_unit().dimensions
    assert vent.length == pytest.approx(d.tip_cap, abs=0.01)
    assert vent.outer == pytest.approx([0, 0, d.height], abs=0.3)
    assert found.before_ml > 5.0
    assert found.after_ml < printer["cup_ml"]
    # With the plug the chamber holds pressure again, as the leak test of the unit says.
    plugged = arrays(
        manifold(found.vertices, found.triangles)
        + shapes.cylinder(1.2, -2.0, 2.0, 48).translate(((vent.inner + vent.outer) / 2.0).tolist())
    )
    by_name = {f.check: f for f in check(*plugged, printer, small_unit(), stages=("chambers",)).findings}
    assert by_name["leak test"].severity == "pass"
    with pytest.raises(GateError, match="can have no vent"):
        vented(solid.vertices, solid.triangles, (1, 0, 0), printer)
