"""Jobs in the header of every 3D view: the one that runs, how many wait, and a notice when one has ended."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import StringProperty

from ...errors import InputError
from ...run.child import CANCELLED, DONE, WAITING
from ...run.progress import spell
from ..shared import viewports
from ..shared.operators import reports_errors
from . import start_child
from .panel import whole

WIDTH = 14
"""Width of the bar in the interface's units: what it says changes, its place does not."""


def listed() -> list[str]:
    """Keys of the jobs that the header tells of: those that run, then those that wait."""
    return [key for key in start_child.running() if start_child.title_of(key)]


class MU_OT_job_cancel(bpy.types.Operator):
    """Stop this job, or take it out of the queue; what it has finished is kept"""

    bl_idname = "mu.job_cancel"
    bl_label = "Cancel Job"
    bl_options = {"REGISTER"}

    key: StringProperty(name="Job", description="Key of the job", options={"HIDDEN"})

    @reports_errors
    def execute(self, context):
        child = start_child.child_of(self.key or next(iter(listed()), ""))
        if child is None:
            raise InputError("no such job runs", "jobs", "start one first")
        child.cancel()
        viewports.redraw()
        return {"FINISHED"}


class MU_OT_job_dismiss(bpy.types.Operator):
    """Remove the notices of ended jobs from the header; their results stay"""

    bl_idname = "mu.job_dismiss"
    bl_label = "Dismiss Notices"
    bl_options = {"REGISTER"}

    def execute(self, context):
        _seen.update(start_child.ended())
        viewports.redraw()
        return {"FINISHED"}


class MU_MT_jobs(bpy.types.Menu):
    """Jobs that run and wait, each with its own Cancel"""

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
            f"When Blender is closed {going} of them go on" if going else "They end when Blender is closed"
        )
        self.layout.label(text=words, icon="INFO")
        kept = bpy.context.preferences.addons.get(start_child.PACKAGE)
        if kept is not None and kept.preferences is not None:
            self.layout.prop(kept.preferences, "jobs_go_on")


_seen: set[str] = set()
"""Keys of ended jobs whose notice was dismissed."""


def draw(self, context) -> None:
    """Cancel, queue and bar; or the notice of the job that ended last."""
    keys = listed()
    _seen.difference_update(keys)
    if keys:
        _running(self.layout, keys)
        return
    ended = [key for key in start_child.ended() if key not in _seen]
    if ended:
        _notice(self.layout, ended[-1])


def _running(layout, keys: list[str]) -> None:
    row = layout.row(align=True)
    # First in a row of fixed width: it stays under the mouse whatever the bar says.
    row.operator("mu.job_cancel", text="", icon="CANCEL").key = keys[0]
    more = row.row(align=True)
    more.ui_units_x = 3
    waiting = sum(start_child.child_of(key).state == WAITING for key in keys)
    more.menu("MU_MT_jobs", text=f"+{waiting}" if waiting else "Jobs")
    fraction, text = whole(start_child.child_of(keys[0]))
    bar = row.row(align=True)
    bar.ui_units_x = WIDTH
    bar.progress(factor=fraction, text=f"{fraction:.0%}, {text}: {start_child.title_of(keys[0])}")


def _notice(layout, key: str) -> None:
    child, title = start_child.child_of(key), start_child.title_of(key)
    row = layout.row(align=True)
    row.operator("mu.job_dismiss", text="", icon="X")
    words = row.row(align=True)
    words.ui_units_x = WIDTH + 4
    if child.state == DONE:
        words.label(text=f"{title}: done in {spell(child.seconds)}", icon="CHECKMARK")
    elif child.state == CANCELLED:
        words.label(text=f"{title}: cancelled", icon="CANCEL")
    else:
        words.alert = True
        words.label(text=f"{title}: {(child.error or {}).get('what', 'failed')}", icon="ERROR")


CLASSES = (MU_OT_job_cancel, MU_OT_job_dismiss, MU_MT_jobs)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Operators, the menu, and the bar in the header of the 3D view."""
    _register_classes()
    bpy.types.VIEW3D_HT_header.append(draw)


def unregister() -> None:
    """Take them out again."""
    bpy.types.VIEW3D_HT_header.remove(draw)
    _unregister_classes()
    _seen.clear()
