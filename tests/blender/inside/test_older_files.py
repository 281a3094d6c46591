"""A file of an extension whose units were Empties with a child a part: it opens with units of today."""

from pathlib import Path

import bpy
import numpy as np

import mu_addon
from mu_addon.blender.body import state as bodies
from mu_addon.blender.shared import displays
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit

from .acting import points_of, shown_parts

FILE = Path(__file__).resolve().parents[1] / "files" / "unit-as-empty.blend"
"""Saved by the extension as it was before, with bpy 5.0: two units, one of them in a body of its own."""


def opened():
    bpy.ops.wm.open_mainfile(filepath=str(FILE))
    return (unit_object.root_of(bpy.data.objects[name]) for name in ("Left", "Bodied"))


def test_units_are_one_object_each_with_all_that_they_were():
    left, bodied = opened()
    assert {root.type for root in unit_object.roots()} == {"MESH"}
    core = to_unit(left.mu_unit)
    assert core.name == "Left"
    assert core.chambers.wall_mm == 0.95
    assert core.scale == 0.75
    assert left.mu_unit.path == "alpha4"
    assert left.mu_unit.study.folder == "//kept"
    assert round(left.mu_motion.apart, 3) == 1.7
    assert np.allclose(left.location, (10.0, 20.0, 30.0))
    assert round(left.rotation_euler.z, 3) == 0.5
    assert shown_parts(left) == {"actuator", "lattice", "anchors", "waveguide"}
    assert round(points_of(left, "actuator")[:, 2].max(), 3) == 0.75 * 75.0
    assert not unit_object.behind(left)
    assert not unit_object.behind(bodied)
    # The solid that was there is kept, with what it was built from; its hash is of another time: it is old.
    assert len(left.mu_unit.solid.vertices) == 4
    assert not unit_object.solid_is_current(left)
    assert bodies.envelope_in(bodied, to_unit(bodied.mu_unit)) is not None
    assert points_of(bodied, "lattice")[:, 1].max() < 38.1, "it still fills its body"
    # Candidates, and nothing else of the unit, stand beside it.
    tubes = [o for o in bpy.data.objects if o.get(displays.OWNER) == left.mu_unit.uuid]
    assert len(tubes) == 10
    assert all(o.parent == left for o in tubes)


def test_what_was_tied_to_them_still_is():
    left, bodied = opened()
    stranger = bpy.data.objects["stranger"]
    assert stranger.parent == left
    assert stranger.constraints[0].target == left
    assert bodied.parent == stranger
    assert {o.name for o in bpy.data.objects if o.get(displays.OWNER) is None} == {
        "Left",
        "Bodied",
        "stranger",
    }


def test_saved_anew_it_is_a_file_of_today(tmp_path):
    left, _ = opened()
    before = points_of(left, "lattice")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "new.blend"))
    mu_addon.unregister()  # a reader without the extension
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert len(bpy.data.objects["Left"].data.vertices) > len(before)
    mu_addon.register()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    left = bpy.data.objects["Left"]
    assert np.array_equal(points_of(left, "lattice"), before)
    assert to_unit(left.mu_unit).chambers.wall_mm == 0.95
