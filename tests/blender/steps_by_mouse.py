"""Runs inside a Blender with a window: a step's redo panel (F9) by mouse, undo, redo, a step muted."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from simulated import called, dragged_in_redo_panel, key, module, over_view, run

unit_object, stack = module("blender.unit.object"), module("blender.unit.stack")
drawing = module("blender.unit.drawing")


def unit():
    return unit_object.roots()[0].mu_unit


def shown():
    numbers = {item.value for item in unit_object.roots()[0].data.attributes["mu_part"].data}
    return {drawing.PARTS[number] for number in numbers}


def session():
    yield 3.0
    # In metres Blender's smallest step of a drag is 1 mm a pixel.
    assert called(bpy.ops.mu.add, millimetres=True) == {"FINISHED"}
    assert called(bpy.ops.mu.path, name="alpha4") == {"FINISHED"}
    yield 4.0
    whole = shown()
    before = stack.STACK.counts.copy()
    assert called(bpy.ops.mu.chambers, "INVOKE_DEFAULT") == {"FINISHED"}
    assert stack.STACK.counts - before == {"chambers": 1}
    yield 4.0
    yield from dragged_in_redo_panel(lambda: abs(unit().chambers.wall_mm - 0.9) > 1e-4)
    dragged = unit().chambers.wall_mm
    assert abs(dragged - 0.9) > 1e-4, "no field was found in the redo panel"
    assert abs(dragged - 0.9) < 0.5, f"24 pixels changed the wall from 0.9 to {dragged:.4g} mm"
    assert not unit_object.behind(unit_object.roots()[0])
    over_view(0.5, 0.3)
    yield 2.0
    key("Z", ctrl=True)
    yield 4.0
    assert abs(unit().chambers.wall_mm - 0.9) < 1e-6
    assert not unit_object.behind(unit_object.roots()[0])
    key("Z", ctrl=True, shift=True)
    yield 4.0
    assert abs(unit().chambers.wall_mm - dragged) < 1e-6

    called(bpy.ops.mu.mute, step="cells")
    yield 4.0
    assert shown() == whole - {"lattice"}, shown()
    over_view(0.5, 0.3)
    yield 2.0
    key("Z", ctrl=True)
    yield 4.0
    assert shown() == whole, shown()
    assert stack.muted(unit()) == frozenset()


run(session)
