"""The stack of steps in a unit: run alone, muted, shown, and never made again for nothing."""

import tempfile
from collections import Counter
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from mu_addon.blender.preview import nodes
from mu_addon.blender.steps import operators as steps_operators
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import stack
from mu_addon.blender.unit.drawing import DRAWN, PARTS
from mu_addon.blender.unit.fields import description, field
from mu_addon.design.parameters import load_preset
from mu_addon.design.steps import STEPS

from .acting import add, attribute, points_of, refused, shown_parts


def made(action):
    before = Counter(stack.STACK.counts)
    action()
    return {name for name in STEPS if stack.STACK.counts[name] > before[name]}


def shape(root, name):
    return len(points_of(root, name))


def test_a_slider_makes_only_what_depends_on_it():
    root = add()
    bpy.ops.mu.path(name="alpha4")
    props = root.mu_unit

    def change(section, name, value):
        return made(lambda: setattr(getattr(props, section), name, value))

    assert [entry.name for entry in props.stack] == list(STEPS)
    assert change("chambers", "wall_mm", 1.0) == {"chambers", "membranes", "wells"}
    assert change("chambers", "wall_mm", 0.9) == set()
    assert change("waveguide", "well_pitch_mm", 4.0) == {"wells"}
    assert made(lambda: bpy.ops.mu.rebuild()) == set()
    # Another unit of the same shape costs nothing.
    assert made(lambda: add()) == set()


def test_each_step_runs_alone_with_its_own_parameters():
    root = add()
    bpy.ops.mu.path(name="alpha4")
    props = root.mu_unit
    for step in STEPS.values():
        if step.name in ("path", "solid"):
            continue
        operator = getattr(bpy.ops.mu, step.name)
        own = {name for _, name in stack.own_parameters(step)}
        fields = {p.identifier for p in operator.get_rna_type().properties} - {"rna_type"}
        shown = {name.removesuffix("_true") for name in fields}
        assert shown == own | ({"muted"} if step.muting else set()), (step.name, shown)
        assert made(operator) == {step.name}
        assert props.step == list(STEPS).index(step.name)
    assert made(lambda: bpy.ops.mu.again(step="cells")) == {"cells"}
    assert "no step 'polish'" in refused(bpy.ops.mu.again, step="polish")

    assert made(lambda: bpy.ops.mu.chambers(wall_mm=1.1)) == {"chambers", "membranes", "wells"}
    assert round(props.chambers.wall_mm, 4) == 1.1
    assert round(props.chambers.tip_cap_mm, 4) == 5.0
    assert "too thick" in refused(bpy.ops.mu.chambers, wall_mm=3.0)
    assert round(props.chambers.wall_mm, 4) == 1.1
    assert props.trouble == ""
    bpy.ops.mu.wells(well_depth_mm=0.3)
    assert round(props.waveguide.well_depth_mm, 4) == 0.3


CHAMBERS = next(c for c in steps_operators.CLASSES if c.__name__ == "MU_OT_chambers")


def redo_fields(operator):
    """Names of the lengths in a step's redo panel."""
    shown = []
    layout = SimpleNamespace(prop=lambda data, name: shown.append(name))
    members = dict.fromkeys(operator.__annotations__)
    operator.draw(SimpleNamespace(layout=layout, step=operator.step, **members), bpy.context)
    return [name for name in shown if "_mm" in name]


def test_the_step_that_is_asked_for_is_of_hundredths_of_a_millimetre_in_any_scene():
    """Fields are in millimetres, whatever the scene's unit is: a drag of ten pixels is a tenth of one."""
    root = add(preset="mu-0.75x")
    units = bpy.context.scene.unit_settings
    for system, scale_length in (("METRIC", 1.0), ("METRIC", 0.001), ("IMPERIAL", 1.0), ("NONE", 1.0)):
        units.system, units.scale_length = system, scale_length
        for section, name, step_mm in (("chambers", "wall_mm", 0.01), ("chambers", "cell_mm", 0.1)):
            group = getattr(root.mu_unit, section)
            shown = group.bl_rna.properties[field(group, description(section, name))]
            assert shown.step / 100.0 == pytest.approx(step_mm, rel=1e-5), (system, scale_length, name)
            assert shown.unit == "CAMERA", "a length that Blender shows in mm in any scene"


def test_a_steps_redo_panel_shows_true_lengths():
    props = add(preset="mu-0.75x").mu_unit
    assert redo_fields(CHAMBERS) == ["wall_mm_true", "base_cap_mm_true", "tip_cap_mm_true"]
    assert bpy.ops.mu.chambers(wall_mm_true=0.75) == {"FINISHED"}
    assert round(props.chambers.wall_mm, 4) == 1.0
    assert bpy.ops.mu.chambers(wall_mm=0.9) == {"FINISHED"}
    assert round(props.chambers.wall_mm, 4) == 0.9


def test_a_length_dragged_beyond_its_bound_ends_there():
    root = add()
    assert bpy.ops.mu.chambers(wall_mm_true=-9.1) == {"FINISHED"}
    assert root.mu_unit.chambers.wall_mm == pytest.approx(description("chambers", "wall_mm").low)
    # What breaks a rule of units is refused in words that name it, and the unit stays.
    assert "neck" in refused(bpy.ops.mu.profile, neck_diameter_mm_true=1.0).lower()
    assert root.mu_unit.chambers.neck_diameter_mm == pytest.approx(12.5)
    assert bpy.ops.mu.chambers(wall_mm_true=0.9) == {"FINISHED"}
    assert root.mu_unit.trouble == ""


def test_muted_steps_are_left_out_and_not_printed(tmp_path):
    root = add()
    bpy.ops.mu.path(name="alpha4")
    props = root.mu_unit
    props.cut = True
    with_wells = shape(root, "waveguide")
    whole = shape(root, "actuator")
    assert bpy.ops.mu.mute(step="wells") == {"FINISHED"}
    assert 0 < shape(root, "waveguide") < with_wells
    assert "without wells is not the unit" in refused(bpy.ops.mu.solid)
    never = {"filepath": str(tmp_path / "never.stl"), "quality": "interactive"}
    assert "unmute wells" in refused(bpy.ops.mu.export_stl, **never)
    assert props.solid is None
    bpy.ops.mu.mute(step="wells", muted=False)
    assert shape(root, "waveguide") == with_wells

    bpy.ops.mu.chambers(muted=True)
    assert shape(root, "actuator") < whole
    bpy.ops.mu.chambers(muted=False)
    assert shape(root, "actuator") == whole

    def skins():
        struts = attribute(root, "mu_part") == PARTS.index("lattice")
        return set(attribute(root, "mu_skin")[struts])

    def length():
        of = attribute(root, "mu_part") == PARTS.index("lattice")
        points = [v.co[:] for v in root.data.vertices]
        ends = np.array([[points[v] for v in e.vertices] for e in root.data.edges if of[e.vertices[0]]])
        return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()

    assert skins() == {nodes.unit.TUBE, nodes.unit.NODE}
    trimmed = length()
    bpy.ops.mu.mute(step="trim")
    assert length() > 1.1 * trimmed
    bpy.ops.mu.mute(step="struts")
    assert skins() == {nodes.unit.PLAIN}, "struts without thickness stay lines"
    bpy.ops.mu.mute(step="struts", muted=False)
    assert skins() == {nodes.unit.TUBE, nodes.unit.NODE}
    bpy.ops.mu.mute(step="trim", muted=False)
    bpy.ops.mu.mute(step="cells")
    assert "lattice" not in shown_parts(root)
    assert "waveguide" in shown_parts(root)
    bpy.ops.mu.mute(step="cells", muted=False)

    bpy.ops.mu.mute(step="path")
    assert "waveguide" not in shown_parts(root)
    assert props.path == "alpha4"


def test_every_step_can_be_shown():
    root = add()
    bpy.ops.mu.path(name="alpha4")
    props = root.mu_unit
    assert {e.name for e in props.stack if e.shown} == {"membranes", "struts", "anchors", "wells"}
    for entry in props.stack:
        entry.shown = True
    assert shown_parts(root) == {name for name, _ in DRAWN.values()}
    d = load_preset("mu-1.0x").dimensions
    of = attribute(root, "mu_part") == PARTS.index("cells")
    edges = [e for e in root.data.edges if of[e.vertices[0]]]
    nx, ny, nz = d.cells_x, d.cells_y_minus + d.cells_y_plus + 1, d.count
    assert of.sum() == (nx + 1) * (ny + 1) * (nz + 1)
    assert len(edges) == sum(a * (b + 1) * (c + 1) for a, b, c in ((nx, ny, nz), (ny, nx, nz), (nz, nx, ny)))
    for entry in props.stack:
        entry.shown = False
    assert len(root.data.vertices) == 0


def test_the_stack_is_saved_and_an_older_file_gets_one():
    root = add()
    bpy.ops.mu.mute(step="trim")
    root.mu_unit.stack["profile"].shown = True
    path = tempfile.mkdtemp() + "/steps.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    (root,) = unit_object.roots()
    assert stack.muted(root.mu_unit) == {"trim"}
    assert root.mu_unit.stack["profile"].shown
    root.mu_unit.stack.clear()  # as a file of an earlier version has it
    assert bpy.ops.mu.rebuild() == {"FINISHED"}
    assert [e.name for e in root.mu_unit.stack] == list(STEPS)
    assert "lattice" in shown_parts(root)
