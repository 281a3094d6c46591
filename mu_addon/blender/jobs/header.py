"""Jobs at the right end of the status bar: the running one, the queue's length, and a notice at its end.

Blender itself shows nothing there. If the user hides the status bar they are at the end of the 3D view's
header.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ...errors import InputError
from ...run.child import CANCELLED, DONE, WAITING
from ...run.progress import spell
from ..shared import viewports
from ..shared.blender_property import Text
from ..shared.operators import FreeOperator, operator
from ..shared.registration import at_end, at_start, handler, menu
from . import start_child
from .panel import shortened, whole

WIDTH = 16
"""Width of the bar in units of the interface, fixed while its text changes."""
STAGE_LETTERS, NOTICE_LETTERS = 14, 64
"""Number of letters that fit: of a stage's name with its number and the time left; of a notice."""


def listed() -> list[start_child.Job]:
    """The jobs in the header: running ones, then waiting ones."""
    return [job for job in start_child.running() if job.title]


def _of(key: str) -> start_child.Job | None:
    """The listed job of that key, the first one for ""."""
    return next((job for job in listed() if key in ("", job.key)), None)


def _which(context, properties) -> str:
    job = _of(properties.key)
    return f"{job.title}: {whole(job.child)[1]}.\n{job_cancel.__doc__}" if job else ""


@operator(
    FreeOperator,
    "Cancel Job",
    undo=False,
    tip=_which,
    key=Text("Job", "Key of the job", options={"HIDDEN"}),
)
def job_cancel(key):
    """Stop this job, or take it out of the queue; finished stages are kept"""
    job = _of(key)
    if job is None:
        raise InputError("this job is not running", "jobs", "start one first")
    job.child.cancel()
    viewports.redraw()


@operator(
    FreeOperator,
    "Dismiss",
    undo=False,
    tip=lambda *_: "\n".join([*map(_words, start_child.ended()), str(job_dismiss.__doc__)]),
)
def job_dismiss():
    """Dismiss the notices of ended jobs, here and in their panels; their results stay"""
    for job in start_child.ended():
        start_child.forget(job.key)
    viewports.redraw()
    viewports.redraw_status()


class MU_MT_jobs(bpy.types.Menu):
    """Running and waiting jobs, each with its own Cancel"""

    bl_label = "Jobs"

    def draw(self, context):
        for job in listed():
            title = f"Cancel {job.title} ({whole(job.child)[1]})"
            self.layout.operator("mu.job_cancel", text=title, icon="CANCEL").key = job.key
        self.layout.separator()
        going = sum(job.goes_on for job in listed())
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


@at_start
def _draw_in_status_bar() -> None:
    viewports.extend_status_bar(draw)


@at_end
def _leave_status_bar() -> None:
    viewports.reduce_status_bar(draw)


@menu("VIEW3D_HT_header")
def draw_in_view(self, context) -> None:
    """Draw the same in the 3D view's header, if the status bar is hidden."""
    if not context.screen.show_statusbar:
        _jobs(self.layout)


def _jobs(layout) -> None:
    jobs, ended = listed(), start_child.ended()
    if jobs:
        _running(layout, jobs)
    elif ended:
        _notice(layout, ended[-1])


def _running(layout, jobs: list[start_child.Job]) -> None:
    row = layout.row(align=True)
    # First in a row of fixed width, so that it stays under the mouse.
    row.operator("mu.job_cancel", text="", icon="CANCEL").key = jobs[0].key
    more = row.row(align=True)
    more.ui_units_x = 3
    waiting = sum(job.child.state == WAITING for job in jobs)
    more.menu("MU_MT_jobs", text=f"+{waiting}" if waiting else "Jobs")
    fraction, text = whole(jobs[0].child, STAGE_LETTERS)
    bar = row.row(align=True)
    bar.ui_units_x = WIDTH
    # The job's name and all of its words are in the tooltip of Cancel and in the menu.
    bar.progress(factor=fraction, text=text)


def _words(job: start_child.Job) -> str:
    """Result of an ended job, as text."""
    child, title = job.child, job.title
    if child.state == DONE:
        return f"Done in {spell(child.seconds)}: {title}"
    if child.state == CANCELLED:
        return f"Cancelled: {title}"
    return f"Failed: {title}, {(child.error or {}).get('what', 'without a message')}"


def _notice(layout, job: start_child.Job) -> None:
    row = layout.row(align=True)
    row.operator("mu.job_dismiss", text="", icon="X")
    words = row.row(align=True)
    icon = {DONE: "CHECKMARK", CANCELLED: "CANCEL"}.get(job.child.state, "ERROR")
    words.alert = icon == "ERROR"
    words.label(text=shortened(_words(job), NOTICE_LETTERS), icon=icon)


@handler("load_post")
def _loaded(*_):
    # They were of another file; their panels still tell.
    for job in start_child.ended():
        job.title = ""
