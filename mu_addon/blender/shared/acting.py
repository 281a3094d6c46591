"""What the operators share: the unit they act on, and errors told as the core tells them."""

from __future__ import annotations

from functools import wraps
from pathlib import Path

import bpy

from ...errors import InputError, MuError
from ...run.child import RUNNING
from ..simulate import state as simulation
from ..simulate import study_folder as studies
from ..unit import live_update as live
from ..unit.object import active_root

NO_UNIT = "Select a Monolithic Unit, or add one: Add > Mesh > Monolithic Unit"


class OnUnit:
    """An operator on the active unit; greyed, with the reason, where there is none."""

    seek = staticmethod(active_root)
    lacking = NO_UNIT

    @classmethod
    def poll(cls, context):
        if cls.seek(context) is None:
            cls.poll_message_set(cls.lacking)
            return False
        return True


class OnSoundUnit(OnUnit):
    """An operator on the active unit that needs parameters which break no rule."""

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        trouble = active_root(context).mu_unit.trouble
        if trouble:
            cls.poll_message_set(f"The parameters break a rule: {trouble.splitlines()[0]}")
            return False
        return True


class OnJob(OnUnit):
    """An operator on a job that runs, or ran, for the active unit in a process of its own."""

    @staticmethod
    def job_of(root) -> str:
        """The job's name, see `simulation.of`: the unit's own simulation."""
        return root.mu_unit.uuid


class CancelsJob(OnJob):
    """Stops the job; greyed, with the reason, where none runs."""

    idle = "Nothing runs for this unit"

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        child = simulation.of(cls.job_of(cls.seek(context)))
        if child is None or child.state != RUNNING:
            cls.poll_message_set(cls.idle)
            return False
        return True

    def execute(self, context):
        simulation.of(self.job_of(self.seek(context))).cancel()
        live.redraw()
        return {"FINISHED"}


class DismissesJob(OnJob):
    """Takes the message of an ended job off the panel."""

    def execute(self, context):
        simulation.forget(self.job_of(self.seek(context)))
        return {"FINISHED"}


RUN_FILES = [
    ("report", "Report", "Report of the run, in the browser"),
    ("log", "Log", "Every message of the run, as a text in Blender"),
    ("errors", "Errors", "What the process wrote to its error output, as a text in Blender"),
    ("folder", "Folder", "Folder of the run"),
]
"""What can be opened of a job's run: the keys of `studies.FILES`."""


def telling(execute):
    """`execute` that reports a MuError, what, where and remedy, and cancels: no undo step, no traceback."""

    @wraps(execute)
    def reported(self, context):
        try:
            return execute(self, context)
        except MuError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return reported


class OpensFile(OnUnit):
    """Opens what a job has left: `path_of(root)` says which file or folder, `first` what makes it."""

    first = ""

    @telling
    def execute(self, context):
        path = self.path_of(self.seek(context))
        if not path.exists():
            raise InputError("there is no such file yet", str(path), self.first)
        open_file(context, path)
        return {"FINISHED"}


class OpensRun(OpensFile):
    """Opens a file of a job's run, one of `RUN_FILES`, `what`; `folder_of(root)` is the run's folder."""

    def path_of(self, root) -> Path:
        """The file or folder that `what` stands for."""
        return self.folder_of(root) / studies.FILES[self.what]


def open_file(context, path: Path) -> None:
    """Open a page in the browser, a folder where folders are shown, anything else as a text in Blender."""
    if path.is_dir():
        bpy.ops.wm.path_open(filepath=str(path))
    elif path.suffix == ".html":
        bpy.ops.wm.url_open(url=path.as_uri())
    else:
        _show_text(context, path)


def _show_text(context, path: Path) -> None:
    """Put a file into a text of Blender's, and show it where a text editor is open."""
    name = f"MU {path.name}"
    text = bpy.data.texts.get(name) or bpy.data.texts.new(name)
    text.from_string(path.read_text(encoding="utf-8", errors="replace"))
    for area in context.screen.areas if context.screen else ():
        if area.type == "TEXT_EDITOR":
            area.spaces.active.text = text
