"""Arrows in the view: where they stand, what a drag of the mouse sets, and that Esc puts it back."""

from types import MethodType, SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from mu_addon.blender.scene import handles
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit

from .acting import add, points_of, with_runs

SIZES = ("wall", "bladder", "cell")


def seen(root):
    """A view from +x, upright, of 10 pixels a millimetre, and a header that remembers what it says."""
    mm = root.matrix_world.median_scale
    turn = Matrix(((0, 1, 0, 0), (0, 0, 1, 0), (-1, 0, 0, 0), (0, 0, 0, 1)))
    flat = Matrix.Diagonal((10 / 500 / mm, 10 / 500 / mm, 1e-6, 1.0))
    view = SimpleNamespace(perspective_matrix=flat @ turn)
    return SimpleNamespace(
        region=SimpleNamespace(width=1000, height=1000),
        region_data=view,
        area=MagicMock(),
        scene=bpy.context.scene,
        object=root,
        window_manager=MagicMock(),
    )


def event(kind, at=(0, 0), shift=False, ctrl=False):
    return SimpleNamespace(
        type=kind, value="PRESS", mouse_region_x=at[0], mouse_region_y=at[1], shift=shift, ctrl=ctrl
    )


def held(root, what):
    """The drag operator as a mouse holds it."""
    hand = SimpleNamespace(what=what, report=MagicMock())
    for name, function in vars(handles.MU_OT_drag).items():
        if callable(function) and not name.startswith("__"):
            setattr(hand, name, MethodType(function, hand))
    context = seen(root)
    assert hand.invoke(context, event("LEFTMOUSE")) == {"RUNNING_MODAL"}, hand.report.mock_calls
    return hand, context


def test_an_arrow_stands_on_what_it_changes():
    root = add()
    d = to_unit(root.mu_unit).dimensions
    wall = points_of(root, "actuator")
    mm = root.matrix_world.median_scale
    for name in SIZES[:2]:
        at, toward = handles._place(root, name, d)
        near = np.linalg.norm(wall - np.array(at) / mm, axis=1).min()
        assert near < 0.02 * d.cell
        assert toward.length / mm == pytest.approx(1.0, abs=1e-5)
    assert handles._place(root, "cell", d)[0].z / mm == pytest.approx(d.height)


@pytest.mark.parametrize(
    ("what", "moved", "section_name", "gained"),
    [
        ("bladder", (-20, 0), "bladder_diameter_mm", 4.0),
        ("cell", (0, 30), "cell_mm", 0.5),
        ("wall", (20, 5), "wall_mm", 0.2),
    ],
)
def test_a_drag_sets_true_millimetres_and_esc_puts_them_back(what, moved, section_name, gained):
    root = add(preset="mu-0.75x")
    group = root.mu_unit.chambers
    before = getattr(group, section_name)
    hand, context = held(root, what)
    hand.modal(context, event("MOUSEMOVE", moved))
    now = getattr(group, section_name)
    assert 0.75 * (now - before) == pytest.approx(gained, abs=0.051)
    assert f"{0.75 * now:.2f} mm" in context.area.header_text_set.call_args.args[0]
    assert not unit_object.behind(root)
    hand.modal(context, event("MOUSEMOVE", moved, shift=True))
    assert 0.75 * (getattr(group, section_name) - before) == pytest.approx(0.1 * gained, abs=0.051)
    assert hand.modal(context, event("ESC")) == {"CANCELLED"}
    assert getattr(group, section_name) == pytest.approx(before)
    assert context.area.header_text_set.call_args.args == (None,)
    hand.modal(context, event("MOUSEMOVE", moved))
    assert hand.modal(context, event("LEFTMOUSE")) == {"FINISHED"}, "one step to undo"


def test_the_pressure_goes_to_its_frame(home):
    root = with_runs(home)
    assert not handles.usable(root, "pressure")
    assert all(handles.usable(root, name) for name in SIZES)
    assert bpy.ops.mu.field_show(field="displacement_mm") == {"FINISHED"}
    assert handles.usable(root, "pressure")
    assert not any(handles.usable(root, name) for name in SIZES)
    scene = bpy.context.scene
    handles.to_pressure(root, scene, 25.0)
    assert handles.pressure_of(root, scene) == pytest.approx(25.0, abs=0.5)
    hand, context = held(root, "pressure")
    hand.modal(context, event("MOUSEMOVE", (0, -100)))
    assert handles.pressure_of(root, scene) == pytest.approx(5.0, abs=0.6)
    assert hand.modal(context, event("RET")) == {"CANCELLED"}, "a frame is no step to undo"


def test_what_is_not_seen_is_not_dragged():
    root = add()
    hand, context = held(root, "wall")
    hand.what = "pressure"
    assert hand.invoke(context, event("LEFTMOUSE")) == {"CANCELLED"}
    assert "simulate" in hand.report.call_args.args[1]
    context.region_data = None
    assert hand.invoke(context, event("LEFTMOUSE")) == {"CANCELLED"}
    assert hand.report.call_args.args[1] == "Drag in a 3D view"


def test_a_broken_rule_leaves_the_arrows_where_they_were():
    root = add()
    arrows = {name: SimpleNamespace(hide=False, matrix_basis=None) for name in handles.HANDLES}
    group = SimpleNamespace(arrows=arrows)
    handles.MU_GGT_handles.draw_prepare(group, seen(root))
    before = arrows["wall"].matrix_basis
    assert arrows["pressure"].hide
    assert handles.MU_GGT_handles.poll(SimpleNamespace(mode="OBJECT", object=root))
    assert not handles.MU_GGT_handles.poll(SimpleNamespace(mode="PAINT_WEIGHT", object=root))
    root.mu_unit.chambers.wall_mm = 3.0
    handles.MU_GGT_handles.draw_prepare(group, seen(root))
    assert arrows["wall"].matrix_basis == before
    root.mu_unit.chambers.wall_mm = 0.9
    hand, context = held(root, "wall")
    root.mu_unit.chambers.wall_mm = 3.0
    assert hand.invoke(context, event("LEFTMOUSE")) == {"CANCELLED"}
    assert "wall" in hand.report.call_args.args[1]


def test_the_tools_header_shows_the_value_that_it_drags():
    root = add(preset="mu-1.0x")
    chosen = SimpleNamespace(what="")
    for name in (*SIZES, handles.PRESSURE):
        chosen.what = name
        layout = MagicMock()
        handles.MU_WT_size.draw_settings(
            seen(root), layout, SimpleNamespace(operator_properties=lambda operator: chosen)
        )
        values = [getattr(*call.args) for call in layout.prop.call_args_list]
        expected = {"wall": 0.9, "bladder": 25.0, "cell": 12.5}
        assert values == pytest.approx([expected[name]] if name in expected else [])
