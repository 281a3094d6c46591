"""Mouse and keys for a Blender with a window of 1600 x 900, and sessions of steps that use them."""

import importlib
import os
import traceback
from pathlib import Path

import bpy

OUTCOME = Path(os.environ["MU_TEST_FOLDER"]) / "outcome.txt"
(package,) = (name for name, _ in bpy.context.preferences.addons.items() if name.endswith(".mu_addon"))
place = [800, 400]


def module(name):
    """A module of the installed extension."""
    return importlib.import_module(f"{package}.{name}")


def parts():
    """The window, its 3D view, and the view's sidebar."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return window, area, next(region for region in area.regions if region.type == "UI")


def event(kind, value, **rest):
    """One event where the mouse is."""
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type=kind, value=value, x=int(place[0]), y=int(place[1]), **rest)


def key(kind, **rest):
    """A key pressed and let go."""
    event(kind, "PRESS", **rest)
    event(kind, "RELEASE")


def move(x, y):
    """Move the mouse to a place in the window, in pixels from its lower left."""
    place[:] = [x, y]
    event("MOUSEMOVE", "NOTHING")


def over_view(right=0.4, up=0.5):
    """Move the mouse over the 3D view, where keys go, to shares of its width and height; gives the place."""
    _, area, _ = parts()
    move(area.x + area.width * right, area.y + area.height * up)
    return tuple(place)


def click(x, y):
    """A click of the left button, once Blender has seen the mouse there."""
    move(x, y)
    yield 1.0
    key("LEFTMOUSE")
    yield 1.5


def drag(start, end, steps=6, pause=0.3):
    """From one place to another with the left button held; pause: in s after each step."""
    move(*start)
    yield 1.0
    event("LEFTMOUSE", "PRESS")
    yield 0.5
    for k in range(1, steps + 1):
        move(*(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
        yield pause
    event("LEFTMOUSE", "RELEASE")
    yield 1.5


def dragged_in_redo_panel(changed):
    """Drag the first field of the last operator's redo panel by 24 pixels until `changed()`."""
    corner = over_view(0.35, 0.55)
    yield 2.0
    key("F9")
    yield 5.0
    # In the panel whose upper left corner is at the mouse; fonts differ a little.
    for down in (52, 60, 45):
        yield from drag((corner[0] + 224, corner[1] - down), (corner[0] + 248, corner[1] - down), pause=1.0)
        yield 2.5
        if changed():
            break
    key("ESC")
    yield 3.0


def called(operator, how="EXEC_DEFAULT", **settings):
    """An operator called as the interface would, in the 3D view and with an undo step."""
    window, area, _ = parts()
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return operator(how, True, **settings)


def run(session):
    """Run a generator; each number it yields is how many seconds Blender gets before it goes on."""
    bpy.context.preferences.view.show_splash = False
    steps = session()

    def step():
        try:
            return next(steps)
        except StopIteration:
            OUTCOME.write_text("all went well")
        except Exception:  # noqa: BLE001 - told to the test, which fails with it
            OUTCOME.write_text(traceback.format_exc())
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=2.0, persistent=True)
