"""Every action of a designer's, called as a script would, and what it leaves in the file."""

import json
import re
from unittest.mock import MagicMock

import bpy
import numpy as np

from mu_addon.blender.path import candidates
from mu_addon.blender.sidebar import figures, unit_panel
from mu_addon.blender.unit import base_classes
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.broken import broken
from mu_addon.blender.unit.fields import description, field, shown_value
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.anchors import window
from mu_addon.design.parameters import Chambers, Waveguide, load_preset
from mu_addon.design.quantity import describe
from mu_addon.design.solid import build_solid
from mu_addon.design.surface import bad_edges, stl_surface

from .acting import add, operators, points_of, refused, shown_parts
from .drawing import drawn


def test_add_makes_a_unit():
    bpy.context.scene.cursor.location = (1.0, 2.0, 3.0)
    root = add()
    assert to_unit(root.mu_unit) == load_preset("mu-1.0x")
    # The cursor stays where it is, a metre away, as the scene's unit becomes a millimetre.
    assert root.location[:] == (1000.0, 2000.0, 3000.0)
    assert bpy.context.object == root
    assert bpy.context.selected_objects == [root]
    units = bpy.context.scene.unit_settings
    assert abs(units.scale_length - 0.001) < 1e-9
    assert units.length_unit == "MILLIMETERS"
    bpy.context.view_layer.update()
    assert abs(np.ptp(points_of(root, "actuator")[:, 2]) - 81.0) < 1e-3  # 75 and the inlet's 6
    small = add(preset="mu-0.75x", millimetres=False)
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
        free |= {"drop_toml", "sample", "sensor_ports", "gripper_add", "job_cancel", "job_dismiss"}
        # Called by a drop alone, which says what it was dropped on.
        free |= {"take_asset"}
        free |= {"tree_new", "tree_load"}
        if name in free:
            assert operator.poll()
        elif name.startswith("track"):
            assert "Open a clip of the bench in the Movie Clip Editor" in refused(operator)
        elif name.startswith(("grasp", "gripper")):
            assert "Add > Mesh > Monolithic Gripper" in refused(operator), name
        elif name.startswith(("node_", "tree_")) and name not in ("tree_of_unit", "tree_show"):
            assert "Open a node tree of the kind Monolithic Unit" in refused(operator), name
        elif name == "colours":
            assert "in the header of a 3D view" in refused(operator)
        elif name == "skin":
            assert "Select a curve or a mesh" in refused(operator)
        else:
            assert not operator.poll(), name
            assert "Add > Mesh > Monolithic Unit" in refused(operator), name
        assert cls.__doc__
        assert cls.bl_label


OUTSIDE = re.compile(
    r"(?!import)(.*_)?(cancel|dismiss|open)|simulate|optimize|grasp|picture|probe|colours|preset_(save|remove)|run_remove|"
    r"assets(_remove)?|evidence_diagnose|import_page|node_group_edit|tree_(evaluate|save|show)|export_stl|"
    r"print_(check|check_file|export|specimens)|sensor_(?!port$|channel$|twin$).*"
)
"""Operators whose effects are in files, processes or preferences, which no undo takes back."""


def test_what_changes_the_file_is_one_undo_step():
    for cls in operators():
        assert ("UNDO" in cls.bl_options) != bool(OUTSIDE.fullmatch(cls.bl_idname[3:])), cls
        assert "REGISTER" in cls.bl_options


def test_fields_show_true_lengths_and_tied_ones_change_as_one():
    root = add()
    chambers = root.mu_unit.chambers
    known = {d.name: d for d in describe(Chambers)}
    assert field(chambers, known["wall_mm"]) == "wall_mm"
    root.mu_unit.scale = 2.0
    assert field(chambers, known["bladder_diameter_mm"]) == "bladder_diameter_mm_true"
    assert chambers.bladder_diameter_mm_true == 50.0
    chambers.wall_mm_true = 2.0
    assert to_unit(root.mu_unit).chambers.wall_mm == 1.0
    # What is the same at every scale reads the same at every scale.
    waveguide = root.mu_unit.waveguide
    (pitch,) = (d for d in describe(Waveguide) if d.name == "well_pitch_mm")
    assert field(waveguide, pitch) == "well_pitch_mm"
    for name, value in (("cell_mm", 13.7), ("bladder_diameter_mm", 25.123457), ("cell_mm", 12.345678)):
        setattr(chambers, name, value)
        core = to_unit(root.mu_unit)
        assert root.mu_unit.trouble == ""
        assert core.chambers.bladder_diameter_mm == 2.0 * core.chambers.cell_mm
        assert np.isclose(getattr(core.chambers, name), value, rtol=1e-7)
    assert bpy.ops.mu.profile(bladder_diameter_mm=26.0) == {"FINISHED"}
    assert to_unit(root.mu_unit).chambers.cell_mm == 13.0


def test_the_value_that_fits_is_in_millimetres_as_the_fields_are():
    root = add()
    root.mu_unit.scale = 2.0
    wall, pitch = (
        next(d for d in describe(of) if d.name == name)
        for of, name in ((Chambers, "wall_mm"), (Waveguide, "well_pitch_mm"))
    )
    assert shown_value(root.mu_unit.chambers, wall, 1.874) == "3.748 mm"
    assert shown_value(root.mu_unit.waveguide, pitch, 4.0) == "4 mm", "the same at every scale"


def test_a_broken_rule_stands_in_its_field_with_a_value_that_fits():
    root = add()
    chambers = root.mu_unit.chambers
    assert broken(root) is None
    for scale, shown in ((1.0, "wall of 3 mm"), (2.0, "wall of 6 mm")):
        root.mu_unit.scale = scale
        chambers.wall_mm = 3.0
        found = broken(root)
        assert shown in found.text
        assert "_mm" not in found.text, "the panel's words, not the file's"
        assert found.fits == {("chambers", "wall_mm"): 1.8}
        lines, wrong = figures.lines(root, 38)
        assert wrong
        assert len(lines) == figures.LINES
        assert shown in " ".join(lines)
        assert bpy.ops.mu.fit(section="chambers", name="wall_mm") == {"FINISHED"}
        assert root.mu_unit.trouble == ""
        assert to_unit(root.mu_unit).chambers.wall_mm == 1.8
        chambers.wall_mm = 0.9
    # What was changed is to blame, too, where the rule names another field.
    root.mu_unit.waveguide.well_pitch_mm = 0.5
    assert set(broken(root).fits) == {("waveguide", "well_width_mm"), ("waveguide", "well_pitch_mm")}
    assert bpy.ops.mu.fit(section="waveguide", name="well_pitch_mm") == {"FINISHED"}
    assert to_unit(root.mu_unit).waveguide.well_pitch_mm == 1.001
    assert "breaks no rule" in refused(bpy.ops.mu.fit, section="waveguide", name="well_pitch_mm")


def test_several_faults_have_a_button_each_that_says_what_it_sets_and_one_for_all():
    root = add()
    root.mu_unit.lattice.cells_x = 4
    lines, _ = figures.lines(root, 36)
    assert "odd count: 3 or 5" in " ".join(lines), "the remedy is never cut"
    root.mu_unit.chambers.neck_diameter_mm = 30.0
    words = drawn(unit_panel)
    assert "Neck Ø 24 mm Cells X 3 All 2" in words
    assert broken(root).blames(["lattice"]), "the closed panel's header is marked"
    assert not broken(root).blames(["waveguide"])
    assert broken(root).fits == {("chambers", "neck_diameter_mm"): 24.0, ("lattice", "cells_x"): 3}
    assert bpy.ops.mu.fit(section="chambers", name="neck_diameter_mm") == {"FINISHED"}
    assert root.mu_unit.chambers.neck_diameter_mm == 24.0
    assert root.mu_unit.trouble, "one is left"
    root.mu_unit.chambers.neck_diameter_mm = 30.0
    assert bpy.ops.mu.fit_all() == {"FINISHED"}
    assert root.mu_unit.trouble == ""
    assert (root.mu_unit.chambers.neck_diameter_mm, root.mu_unit.lattice.cells_x) == (24.0, 3)
    assert "no rule is broken" in refused(bpy.ops.mu.fit_all)


def test_three_faults_have_three_buttons_and_what_mends_nothing_is_not_red():
    root = add()
    root.mu_unit.lattice.junction_diameter_mm = 1.6
    root.mu_unit.waveguide.well_pitch_mm = 0.5
    assert ("lattice", "junction_diameter_mm") not in broken(root).fits, "the struts break no rule"
    root.mu_unit.lattice.cells_x = 4
    root.mu_unit.chambers.neck_diameter_mm = 30.0
    words = drawn(unit_panel)
    assert "Neck Ø 24 mm Cells X 3" in words
    for repair in broken(root).repairs:
        d = description(repair.section, repair.name)
        assert shown_value(root.mu_unit.chambers, d, repair.value) in words
    assert f"All {len(broken(root).repairs)}" in words
    assert len(broken(root).repairs) == 3
    assert figures.lines(root, 36)[0][0][0].isupper()


def test_a_closed_fold_with_a_fault_is_red():
    root = add()
    heads = {}

    def panel(name, default_closed):
        heads[name] = MagicMock()
        return heads[name], None

    layout = MagicMock()
    layout.panel.side_effect = panel
    for depth, red in ((0.65, False), (5.0, True)):
        root.mu_unit.waveguide.well_depth_mm = depth
        base_classes.parameters(layout, root, "path")
        base_classes.parameters(layout, root, "simulate")
        assert heads["MU_section and wells"].alert is red
        assert heads["MU_seats"].alert is heads["MU_constants of the resin"].alert is False


def test_the_head_says_what_a_unit_comes_to():
    root = add()
    lines, wrong = figures.lines(root, 38)
    assert not wrong
    assert lines[:3] == [
        "Size 37.5 x 50 x 81 mm",
        "Resin about 19.1 g, 19 ml",
        "Prints upright in about 3 h 40 min",
    ]
    assert "assumed" in lines[3]
    root.mu_unit.scale = 2.0
    assert figures.lines(root, 38)[0][0] == "Size 75 x 100 x 162 mm"
    root.mu_unit.scale = 1.0
    bpy.ops.mu.solid()
    volume = json.loads(root.mu_unit.solid["mu_gates"])["volume_mm3"]
    assert f"{volume / 1000:.3g} ml" in figures.lines(root, 38)[0][1]
    assert "about" not in figures.lines(root, 38)[0][1]


def test_path_select_and_stale_names():
    root = add()
    bpy.ops.mu.solid()
    assert bpy.ops.mu.path(name="alpha4") == {"FINISHED"}
    assert root.mu_unit.show == "preview", "where the waveguide is seen"
    bar = points_of(root, "waveguide")
    assert len(bar) % 8 == 0
    slots = [root.data.materials[face.material_index].name for face in root.data.polygons]
    assert slots.count("MU Waveguide") + slots.count("MU Wells") == len(bar) // 8 * 6
    assert slots.count("MU Wells") > 6
    assert "alpha11" in refused(bpy.ops.mu.path, name="alpha11")
    assert root.mu_unit.path == "alpha4"
    root.mu_unit.candidates = True
    tube = candidates.candidate(root, "alpha7")
    bpy.context.view_layer.objects.active = tube
    assert unit_object.active_root(bpy.context) == root
    assert "Use α7" in drawn([bpy.types.MU_PT_path])
    assert bpy.ops.mu.path() == {"FINISHED"}
    assert root.mu_unit.path == "alpha7"
    assert tube.data.materials[0].name == "MU Waveguide"
    assert bpy.ops.mu.select() == {"FINISHED"}
    assert bpy.context.object == root
    # A unit of fewer chambers has fewer paths: the chosen one is not drawn, and nothing breaks.
    root.mu_unit.chambers.count = 3
    assert root.mu_unit.trouble == ""
    assert "waveguide" not in shown_parts(root)
    assert bpy.ops.mu.path(name="none") == {"FINISHED"}
    assert root.mu_unit.path == ""


def test_solid_is_the_cores_and_knows_when_it_is_old():

    root = add()
    bpy.ops.mu.path(name="alpha4")
    assert bpy.ops.mu.solid() == {"FINISHED"}
    solid = root.mu_unit.solid
    core = load_preset("mu-1.0x")
    made = build_solid(core, window(core, "alpha4"))
    found = np.empty(3 * len(solid.vertices), np.float32)
    solid.vertices.foreach_get("co", found)
    assert np.array_equal(found.reshape(-1, 3), made.vertices.astype(np.float32))
    assert len(solid.polygons) == len(made.triangles)
    assert json.loads(solid["mu_gates"])["genus"] == made.gates.genus
    assert unit_object.solid_is_current(root)
    assert root.mu_unit.show == "solid"
    assert root.data == solid
    root.mu_unit.show = "preview"
    assert root.data == root.mu_unit.preview != solid
    assert shown_parts(root) == {"actuator", "lattice", "anchors", "waveguide"}
    root.mu_unit.chambers.wall_mm = 1.0
    assert not unit_object.solid_is_current(root)
    root.mu_unit.chambers.wall_mm = 0.9
    assert unit_object.solid_is_current(root)
    bpy.ops.mu.path(name="alpha5")
    assert not unit_object.solid_is_current(root)


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
    assert shown_parts(root) == {"actuator", "lattice", "anchors", "waveguide"}
    mesh = root.data
    root.mu_unit.chambers.count = 5
    assert root.data == mesh
    assert abs(points_of(root, "actuator")[:, 2].max() - 62.5) < 1e-4
    assert len(bpy.data.node_groups) == 3  # none was made twice
