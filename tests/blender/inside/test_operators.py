"""Every action of a designer's, called as a script would, and what it leaves in the file."""

import json

import bpy
import numpy as np

from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.anchors import window
from mu_addon.design.parameters import load_preset
from mu_addon.design.solid import build_solid
from mu_addon.design.surface import bad_edges, stl_surface

from .acting import add, operators, refused


def test_add_makes_a_unit_in_millimetres():

    bpy.context.scene.cursor.location = (1.0, 2.0, 3.0)
    root = add()
    assert to_unit(root.mu_unit) == load_preset("mu-1.0x")
    assert root.location[:] == (1.0, 2.0, 3.0)
    assert bpy.context.object == root
    assert bpy.context.selected_objects == [root]
    units = bpy.context.scene.unit_settings
    assert abs(units.scale_length - 0.001) < 1e-9
    assert units.length_unit == "MILLIMETERS"
    bpy.context.view_layer.update()
    assert abs(unit_object.part(root, "actuator").dimensions.z - 81.0) < 1e-3  # 75 and the inlet's 6
    small = add(preset="mu-0.75x")
    assert small.mu_unit.scale == 0.75
    assert small.mu_unit.uuid != root.mu_unit.uuid
    other = add(preset="mu-1.0x", scale=1.2)
    assert to_unit(other.mu_unit).scale == 1.2
    # As the redo panel does when another preset is chosen there: it brings its own scale.
    redone = add(preset="mu-0.75x", scale=1.0, scaled="mu-1.0x")
    assert redone.mu_unit.scale == 0.75
    units.system = "IMPERIAL"
    assert bpy.ops.mu.millimetres() == {"FINISHED"}
    assert units.system == "METRIC"


def test_operators_without_a_unit_say_what_is_missing():

    for cls in operators():
        name = cls.bl_idname.split(".")[1]
        operator = getattr(bpy.ops.mu, name)
        free = {"add", "millimetres", "preset_remove", "assets", "assets_remove"}
        free |= {"sample", "sensor_ports", "gripper_add"}
        if name in free:
            assert operator.poll()
        elif name.startswith("track"):
            assert "Open a clip of the bench in the Movie Clip Editor" in refused(operator)
        elif name.startswith(("grasp", "gripper")):
            assert "Add > Mesh > Monolithic Gripper" in refused(operator), name
        elif name == "skin":
            assert "Select a curve or a mesh" in refused(operator)
        else:
            assert not operator.poll(), name
            assert "Add > Mesh > Monolithic Unit" in refused(operator), name
        assert cls.__doc__
        assert cls.bl_label


def test_what_changes_the_file_is_one_undo_step():

    # What these do is in files, processes or preferences, and no undo takes it back.
    outside = {"simulate", "cancel", "dismiss", "open", "export_stl", "preset_save", "preset_remove"}
    outside |= {"assets", "assets_remove", "picture"}
    outside |= {"evidence_diagnose", "evidence_cancel", "evidence_dismiss", "evidence_open"}
    outside |= {"print_check", "print_export", "print_specimens"}
    outside |= {"print_cancel", "print_dismiss", "print_open"}
    outside |= {"sensor_ports", "sensor_connect", "sensor_disconnect", "sensor_pause"}
    outside |= {"sensor_mark", "sensor_freeze", "sensor_sweep", "sensor_hold"}
    outside |= {"sensor_calibrate", "sensor_cancel", "sensor_dismiss", "sensor_zero"}
    outside |= {"sensor_open", "grasp", "grasp_cancel", "grasp_dismiss", "grasp_open"}
    for cls in operators():
        assert ("UNDO" in cls.bl_options) == (cls.bl_idname.split(".")[1] not in outside), cls
        assert "REGISTER" in cls.bl_options


def test_path_select_and_stale_names():
    root = add()
    assert bpy.ops.mu.path(name="alpha4") == {"FINISHED"}
    bar = unit_object.part(root, "waveguide")
    assert bar is not None
    assert [m.name for m in bar.data.materials] == ["MU Waveguide", "MU Wells"]
    assert abs(bar.dimensions.z) >= 0
    assert len(bar.data.polygons) % 6 == 0
    assert "alpha11" in refused(bpy.ops.mu.path, name="alpha11")
    assert root.mu_unit.path == "alpha4"
    root.mu_unit.candidates = True
    tube = unit_object.part(root, "candidate:alpha7")
    bpy.context.view_layer.objects.active = tube
    assert unit_object.active_root(bpy.context) == root
    assert bpy.ops.mu.path() == {"FINISHED"}
    assert root.mu_unit.path == "alpha7"
    assert tube.data.materials[0].name == "MU Waveguide"
    assert bpy.ops.mu.select() == {"FINISHED"}
    assert bpy.context.object == root
    # A unit of fewer chambers has fewer paths: the chosen one is not drawn, and nothing breaks.
    root.mu_unit.chambers.count = 3
    assert root.mu_unit.trouble == ""
    assert unit_object.part(root, "waveguide") is None
    assert bpy.ops.mu.path(name="none") == {"FINISHED"}
    assert root.mu_unit.path == ""


def test_solid_is_the_cores_and_knows_when_it_is_old():

    root = add()
    bpy.ops.mu.path(name="alpha4")
    assert bpy.ops.mu.solid() == {"FINISHED"}
    solid = unit_object.part(root, "solid")
    core = load_preset("mu-1.0x")
    made = build_solid(core, window(core, "alpha4"))
    found = np.empty(3 * len(solid.data.vertices), np.float32)
    solid.data.vertices.foreach_get("co", found)
    assert np.array_equal(found.reshape(-1, 3), made.vertices.astype(np.float32))
    assert len(solid.data.polygons) == len(made.triangles)
    assert json.loads(solid["mu_gates"])["genus"] == made.gates.genus
    assert unit_object.solid_is_current(root, solid)
    assert root.mu_unit.show == "solid"
    assert not solid.hide_viewport
    assert unit_object.part(root, "lattice").hide_viewport
    root.mu_unit.show = "preview"
    assert solid.hide_viewport
    assert not unit_object.part(root, "lattice").hide_viewport
    root.mu_unit.chambers.wall_mm = 1.0
    assert not unit_object.solid_is_current(root, solid)
    root.mu_unit.chambers.wall_mm = 0.9
    assert unit_object.solid_is_current(root, solid)
    bpy.ops.mu.path(name="alpha5")
    assert not unit_object.solid_is_current(root, solid)


def test_stl_comes_out_in_millimetres(tmp_path):
    add(preset="mu-0.75x")
    target = str(tmp_path / "unit.stl")
    assert bpy.ops.mu.export_stl(filepath=target, quality="interactive", nodes=True) == {"FINISHED"}
    nowhere = {"filepath": "/proc/no/unit.stl", "quality": "interactive"}
    assert "what to do" in refused(bpy.ops.mu.export_stl, **nowhere)
    vertices, triangles = stl_surface((tmp_path / "unit.stl").read_bytes())
    assert bad_edges(triangles) == 0
    assert np.ptp(vertices[:, 2]) == np.float32(0.75 * (75.0 + 6.0))
    assert "# id kind x_mm y_mm z_mm" in (tmp_path / "unit.txt").read_text()


def test_save_and_reload(tmp_path):

    root = add()
    root.mu_unit.chambers.wall_mm = 0.95
    root.mu_unit.lattice.cells_y_plus = 3
    bpy.ops.mu.path(name="alpha6")
    kept, uuid = to_unit(root.mu_unit), root.mu_unit.uuid
    path = str(tmp_path / "seat.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert unit_object.roots() == []
    bpy.ops.wm.open_mainfile(filepath=path)
    (root,) = unit_object.roots()
    assert to_unit(root.mu_unit) == kept
    assert root.mu_unit.uuid == uuid
    assert root.mu_unit.path == "alpha6"
    assert not unit_object.behind(root)
    parts = {c["mu_part"]: c for c in root.children}
    assert set(parts) == {"actuator", "lattice", "anchors", "waveguide"}
    root.mu_unit.chambers.count = 5
    assert unit_object.part(root, "actuator") == parts["actuator"]
    assert abs(max(v.co.z for v in parts["actuator"].data.vertices) - 62.5) < 1e-4
    assert len(bpy.data.node_groups) == 2  # none was made twice
