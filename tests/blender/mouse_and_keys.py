"""Runs inside a Blender with a window of 1600 x 900: Shift A, "mono", Return; a slider; undo and redo."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from simulated import drag, key, module, over_view, parts, run

unit_object = module("blender.unit.object")


def settled():
    """A change and the rebuild that follows it are a few frames apart, and a frame may take seconds."""
    for _ in range(20):
        if not unit_object.behind(unit_object.roots()[0]):
            return
        yield 1.0


def session():
    """Each number is how many seconds Blender gets before the next step; frames may take one each."""
    _, area, _ = parts()
    area.spaces.active.show_region_ui = True
    yield 3.0
    parts()[2].active_panel_category = "MU"
    yield 2.0
    over_view()
    yield 2.0
    key("A", shift=True)
    yield 3.0
    for letter in "mono":
        key(letter.upper(), unicode=letter)
        yield 1.5
    yield 3.0
    key("RET")
    yield 5.0
    (root,) = unit_object.roots()
    assert bpy.context.scene.unit_settings.scale_length == 1.0, "the scene's unit is the user's"
    assert abs(root.dimensions.z - 0.081) < 1e-3, "and the unit has its true size in it"

    def wall():
        return unit_object.roots()[0].mu_unit.chambers.wall_mm

    # The slider, with the panel as it first opens; a few rows up and down where fonts differ.
    region = parts()[2]
    for rows in (0, -1, 1, -2, 2, 3):
        start = region.x + 175, region.y + region.height - 450 + 20 * rows
        built = unit_object.roots()[0].mu_unit.built
        yield from drag(start, (start[0] + 24, start[1]), pause=1.2)
        yield 1.5
        if abs(wall() - 0.9) > 1e-4:
            break
        if unit_object.roots()[0].mu_unit.built != built:
            key("Z", ctrl=True)  # another parameter
            yield 3.0
    dragged = wall()
    assert abs(dragged - 0.9) > 1e-4, "no slider was found"
    yield from settled()
    dragged = wall()
    (root,) = unit_object.roots()
    assert not unit_object.behind(root)
    over_view()
    yield 1.5
    key("Z", ctrl=True)
    yield 3.0
    assert abs(wall() - 0.9) < 1e-6
    yield from settled()
    assert not unit_object.behind(unit_object.roots()[0])
    key("Z", ctrl=True)
    yield 3.0
    assert unit_object.roots() == [], "adding a unit is more than one undo step"
    for _ in range(2):
        key("Z", ctrl=True, shift=True)
        yield 3.0
    (root,) = unit_object.roots()
    assert abs(wall() - dragged) < 1e-6
    yield from settled()
    (root,) = unit_object.roots()
    assert not unit_object.behind(root)
    assert list(root.children) == []
    assert len(root.data.vertices) > 5_000


run(session)
