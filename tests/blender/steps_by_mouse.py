"""Runs inside a Blender with a window: a step's redo panel (F9) by mouse, undo, redo, a step muted."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from simulated import called, event, key, module, move, parts, place, run

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
    _, area, _ = parts()
    corner = area.x + area.width * 0.35, area.y + area.height * 0.55
    move(*corner)
    yield 2.0
    key("F9")
    yield 5.0
    # The first field, the wall, in the panel whose upper left corner is at the mouse; fonts differ a little.
    for down in (52, 60, 45):
        move(corner[0] + 224, corner[1] - down)
        yield 1.5
        event("LEFTMOUSE", "PRESS")
        yield 1.0
        for _ in range(6):
            move(place[0] + 4, place[1])
            yield 1.0
        event("LEFTMOUSE", "RELEASE")
        yield 4.0
        if abs(unit().chambers.wall_mm - 0.9) > 1e-4:
            break
    dragged = unit().chambers.wall_mm
    assert abs(dragged - 0.9) > 1e-4, "no field was found in the redo panel"
    assert abs(dragged - 0.9) < 0.5, f"24 pixels changed the wall from 0.9 to {dragged:.4g} mm"
    assert not unit_object.behind(unit_object.roots()[0])
    key("ESC")
    yield 3.0
    move(area.x + area.width * 0.5, area.y + area.height * 0.3)
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
    move(area.x + area.width * 0.5, area.y + area.height * 0.3)
    yield 2.0
    key("Z", ctrl=True)
    yield 4.0
    assert shown() == whole, shown()
    assert stack.muted(unit()) == frozenset()


run(session)
