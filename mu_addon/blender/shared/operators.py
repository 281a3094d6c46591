"""Base classes of the operators: the unit they act on, errors as the core words them, and opening files."""

from __future__ import annotations

from functools import wraps
from pathlib import Path

import bpy

from ...errors import MuError
from ..unit.object import active_root

NO_UNIT = "Select a Monolithic Unit, or add one: Add > Mesh > Monolithic Unit"


class UnitOperator:
    """An operator on the active unit; greyed out, with the reason, where there is none."""

    find_root = staticmethod(active_root)
    no_root = NO_UNIT

    @classmethod
    def poll(cls, context):
        if cls.find_root(context) is None:
            cls.poll_message_set(cls.no_root)
            return False
        return True


class ValidUnitOperator(UnitOperator):
    """An operator on the active unit that needs parameters within the design rules."""

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        trouble = active_root(context).mu_unit.trouble
        if trouble:
            cls.poll_message_set(f"A design rule is broken: {trouble.splitlines()[0]}")
            return False
        return True


def reports_errors(execute):
    """`execute` that reports a MuError, what, where and remedy, and cancels: no undo step, no traceback."""

    @wraps(execute)
    def reported(self, context):
        try:
            return execute(self, context)
        except MuError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return reported


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
