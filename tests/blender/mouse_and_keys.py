"""Runs inside a Blender with a window of 1600 x 900: Shift A, "mono", Return; a slider; undo and redo."""

import importlib
import os
import traceback
from pathlib import Path

import bpy

TOLD = Path(os.environ["MU_TEST_FOLDER"]) / "told.txt"
(package,) = (name for name, _ in bpy.context.preferences.addons.items() if name.endswith(".mu_addon"))
unit_object = importlib.import_module(f"{package}.blender.unit_object")
bpy.context.preferences.view.show_splash = False
place = [800, 400]


def parts():
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return window, area, next(region for region in area.regions if region.type == "UI")


def event(kind, value, **rest):
    parts()[0].event_simulate(type=kind, value=value, x=int(place[0]), y=int(place[1]), **rest)


def key(kind, **rest):
    event(kind, "PRESS", **rest)
    event(kind, "RELEASE")


def move(x, y):
    place[:] = [x, y]
    event("MOUSEMOVE", "NOTHING")


def session():
    """Each number is how many seconds Blender gets before the next step; frames may take one each."""
    _, area, _ = parts()
    area.spaces.active.show_region_ui = True
    yield 3.0
    parts()[2].active_panel_category = "MU"
    yield 2.0
    middle = area.x + area.width * 0.4, area.y + area.height * 0.5
    move(*middle)
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
    assert abs(bpy.context.scene.unit_settings.scale_length - 0.001) < 1e-9

    def wall():
        return unit_object.roots()[0].mu_unit.chambers.wall_mm

    # The slider, with the panel as it first opens; a few rows up and down where fonts differ.
    region = parts()[2]
    for rows in (0, -1, 1, -2, 2):
        move(region.x + 175, region.y + region.height - 312 + 20 * rows)
        yield 1.5
        event("LEFTMOUSE", "PRESS")
        yield 1.0
        for _ in range(6):
            move(place[0] + 4, place[1])
            yield 1.2
        event("LEFTMOUSE", "RELEASE")
        yield 3.0
        if abs(wall() - 0.9) > 1e-4:
            break
        key("Z", ctrl=True)  # another parameter
        yield 3.0
    dragged = wall()
    assert abs(dragged - 0.9) > 1e-4, "no slider was found"
    (root,) = unit_object.roots()
    assert not unit_object.behind(root)
    move(*middle)
    yield 1.5
    key("Z", ctrl=True)
    yield 3.0
    assert abs(wall() - 0.9) < 1e-6
    assert not unit_object.behind(unit_object.roots()[0])
    key("Z", ctrl=True)
    yield 3.0
    assert unit_object.roots() == [], "adding a unit is more than one undo step"
    for _ in range(2):
        key("Z", ctrl=True, shift=True)
        yield 3.0
    (root,) = unit_object.roots()
    assert abs(wall() - dragged) < 1e-6
    assert not unit_object.behind(root)
    assert {child["mu_part"] for child in root.children} == {"actuator", "lattice", "anchors"}


steps = session()


def step():
    try:
        return next(steps)
    except StopIteration:
        TOLD.write_text("all went well")
    except Exception:  # noqa: BLE001 - told to the test, which fails with it
        TOLD.write_text(traceback.format_exc())
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(step, first_interval=2.0)
