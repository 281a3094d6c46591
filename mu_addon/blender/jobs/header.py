"""Jobs at the right end of the status bar: the running one, the queue's length, and a notice at its end.

Blender itself shows nothing there. If the user hides the status bar they are at the end of the 3D view's
header.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.app.handlers import persistent
from bpy.props import StringProperty

from ...errors import InputError
from ...run.child import CANCELLED, DONE, WAITING
from ...run.progress import spell
from ..shared import viewports
from ..shared.operators import reports_errors
from ..shared.registration import add_handlers, remove_handlers
from . import start_child
from .panel import shortened, whole

WIDTH = 16
"""Width of the bar in units of the interface, fixed while its text changes."""
STAGE_LETTERS, NOTICE_LETTERS = 14, 64
"""Number of letters that fit: of a stage's name with its number and the time left; of a notice."""


def listed() -> list[str]:
    """Keys of the jobs in the header: running ones, then waiting ones."""
    return [key for key in start_child.running() if start_child.title_of(key)]


class MU_OT_job_cancel(bpy.types.Operator):
    """Stop this job, or take it out of the queue; finished stages are kept"""

    bl_idname = "mu.job_cancel"
    bl_label = "Cancel Job"
    bl_options = {"REGISTER"}

    key: StringProperty(name="Job", description="Key of the job", options={"HIDDEN"})

    @classmethod
    def description(cls, context, properties):
        child = start_child.child_of(properties.key)
        if child is None:
            return cls.__doc__
        _, text = whole(child)
        return f"{start_child.title_of(properties.key)}: {text}.\n{cls.__doc__}"

    @reports_errors
    def execute(self, context):
        child = start_child.child_of(self.key or next(iter(listed()), ""))
        if child is None:
            raise InputError("this job is not running", "jobs", "start one first")
        child.cancel()
        viewports.redraw()
        return {"FINISHED"}


class MU_OT_job_dismiss(bpy.types.Operator):
    """Dismiss the notices of ended jobs, here and in their panels; their results stay"""

    bl_idname = "mu.job_dismiss"
    bl_label = "Dismiss"
    bl_options = {"REGISTER"}

    @classmethod
    def description(cls, context, properties):
        words = [_words(key) for key in start_child.ended()]
        return "\n".join([*words, cls.__doc__])

    def execute(self, context):
        for key in start_child.ended():
            start_child.forget(key)
        viewports.redraw()
        viewports.redraw_status()
        return {"FINISHED"}


class MU_MT_jobs(bpy.types.Menu):
    """Running and waiting jobs, each with its own Cancel"""

    bl_idname = "MU_MT_jobs"
    bl_label = "Jobs"

    def draw(self, context):
        for key in listed():
            _, text = whole(start_child.child_of(key))
            title = f"Cancel {start_child.title_of(key)} ({text})"
            self.layout.operator("mu.job_cancel", text=title, icon="CANCEL").key = key
        self.layout.separator()
        going = sum(map(start_child.goes_on, listed()))
        words = (
            f"When Blender closes {going} of them continue" if going else "They end when Blender is closed"
        )
        self.layout.label(text=words, icon="INFO")
        kept = bpy.context.preferences.addons.get(start_child.PACKAGE)
        if kept is not None and kept.preferences is not None:
            self.layout.prop(kept.preferences, "jobs_go_on")


def draw(self, context) -> None:
    """Draw, in the status bar, Cancel, queue and bar, or the notice of the job that ended last."""
    _jobs(self.layout)


def draw_in_view(self, context) -> None:
    """Draw the same in the 3D view's header, if the status bar is hidden."""
    if not context.screen.show_statusbar:
        _jobs(self.layout)


def _jobs(layout) -> None:
    keys, ended = listed(), start_child.ended()
    if keys:
        _running(layout, keys)
    elif ended:
        _notice(layout, ended[-1])


def _running(layout, keys: list[str]) -> None:
    row = layout.row(align=True)
    # First in a row of fixed width, so that it stays under the mouse.
    row.operator("mu.job_cancel", text="", icon="CANCEL").key = keys[0]
    more = row.row(align=True)
    more.ui_units_x = 3
    waiting = sum(start_child.child_of(key).state == WAITING for key in keys)
    more.menu("MU_MT_jobs", text=f"+{waiting}" if waiting else "Jobs")
    child = start_child.child_of(keys[0])
    fraction, text = whole(child, STAGE_LETTERS)
    bar = row.row(align=True)
    bar.ui_units_x = WIDTH
    # The job's name and all of its words are in the tooltip of Cancel and in the menu.
    bar.progress(factor=fraction, text=text)


def _words(key: str) -> str:
    """Result of an ended job, as text."""
    child, title = start_child.child_of(key), start_child.title_of(key)
    if child.state == DONE:
        return f"Done in {spell(child.seconds)}: {title}"
    if child.state == CANCELLED:
        return f"Cancelled: {title}"
    return f"Failed: {title}, {(child.error or {}).get('what', 'without a message')}"


def _notice(layout, key: str) -> None:
    row = layout.row(align=True)
    row.operator("mu.job_dismiss", text="", icon="X")
    words = row.row(align=True)
    icon = {DONE: "CHECKMARK", CANCELLED: "CANCEL"}.get(start_child.child_of(key).state, "ERROR")
    words.alert = icon == "ERROR"
    words.label(text=shortened(_words(key), NOTICE_LETTERS), icon=icon)


@persistent
def _loaded(*_):
    # They were of another file.
    start_child.hush()


CLASSES = (MU_OT_job_cancel, MU_OT_job_dismiss, MU_MT_jobs)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Register operators, the menu, and the bar."""
    _register_classes()
    add_handlers({"load_post": _loaded})
    viewports.extend_status_bar(draw)
    bpy.types.VIEW3D_HT_header.append(draw_in_view)


def unregister() -> None:
    """Unregister them."""
    bpy.types.VIEW3D_HT_header.remove(draw_in_view)
    viewports.reduce_status_bar(draw)
    remove_handlers({"load_post": _loaded})
    _unregister_classes()
