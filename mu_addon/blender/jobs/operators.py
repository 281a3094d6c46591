"""The three operators of every kind of job: cancel it, dismiss its message, open its files."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
from bpy.props import EnumProperty

from ...errors import InputError
from ...run.child import ERRORS
from ..shared import viewports
from ..shared.operators import open_file
from ..unit.base_classes import UnitOperator
from .start_child import OWN_FOLDER, JobKind

FILES = {"report": "report.html", "log": "log.ndjson", "errors": f"{OWN_FOLDER}/{ERRORS}", "folder": ""}
"""Files that a run writes into its folder, the folder itself last, by their name in `RUN_FILES`."""
RUN_FILES = [
    ("report", "Report", "Report of the run, in the browser"),
    ("log", "Log", "Every message of the run, as a text in Blender"),
    ("errors", "Errors", "The process's error output, as a text in Blender"),
    ("folder", "Folder", "Folder of the run"),
]
"""Files of a run that can be opened, as items of a property."""


KEPT = "finished stages are kept, and the next run continues from there"


class _Cancel:
    """Stops the job; greyed out, with the reason, where none runs."""

    @classmethod
    def trouble(cls, root):
        return "" if cls.kind.is_running(root) else cls.not_running

    def act(self, context, root):
        self.kind.child(root).cancel()
        viewports.redraw()


class _Dismiss:
    def act(self, context, root):
        self.kind.dismiss(root)


class _Open:
    def act(self, context, root):
        path = self.path_of(root, self.what)
        if not path.exists():
            raise InputError("there is no such file yet", str(path), self.first)
        open_file(context, path)


def job_operators(
    kind: JobKind,
    first: str,
    *,
    kept: str = KEPT,
    base: type = UnitOperator,
    items: list[tuple[str, str, str]] = RUN_FILES,
    path_of: Callable[[Any, str], Path] | None = None,
) -> tuple[type, type, type]:
    """Operator classes mu.PREFIXcancel, mu.PREFIXdismiss and mu.PREFIXopen of a kind of job, by its prefix.

    first: what to do before there is a file; kept: results that remain when it is stopped; base: operator of
    the object with the job; items: files to open, with paths by `path_of(root, what)`, by default in the
    run's folder.
    """
    prefix, noun = kind.prefix, kind.title

    def in_run(root: Any, what: str) -> Path:
        return kind.folder_of(root) / FILES[what]

    def made(part: type, what: str, text: str, **members: Any) -> type:
        own = {"__doc__": text, "bl_idname": f"mu.{prefix}{what}", "bl_label": what.capitalize()}
        own |= {"bl_options": {"REGISTER"}, "kind": kind}
        return type(f"MU_OT_{prefix}{what}", (part, base, bpy.types.Operator), own | members)

    choice = EnumProperty(name="What", description=f"File or folder of the {noun} to open", items=items)
    return (
        made(_Cancel, "cancel", f"Stop the {noun}; {kept}", not_running=f"No {noun} is running"),
        made(_Dismiss, "dismiss", f"Remove the message of the ended {noun} from the panel"),
        made(
            _Open,
            "open",
            f"Open a file or the folder of the {noun}",
            first=first,
            path_of=staticmethod(path_of or in_run),
            __annotations__={"what": choice},
        ),
    )
