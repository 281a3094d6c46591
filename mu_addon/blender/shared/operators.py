"""Base classes of the operators: the unit they act on, the core's errors, and opening files."""

from __future__ import annotations

from functools import partial, wraps
from pathlib import Path

import bpy

from ...errors import MuError
from ..jobs.prepared import NotPrepared, called_by
from ..unit.object import active_root, by_uuid
from .displays import editable
from .wording import in_panel

NO_UNIT = "Select a Monolithic Unit, or add one: Add > Mesh > Monolithic Unit"


def linked(root) -> str:
    """Return the reason why a unit cannot be changed here, its library, with the remedy; else ""."""
    if editable(root):
        return ""
    source = root if root.library is not None else root.override_library.reference
    name = Path(source.library.filepath).name
    return f"{root.name} is linked from {name}: change it there, or use Object > Relations > Make Local"


def reports_errors(execute):
    """Wrap `execute` to report a MuError, what, where and remedy, and cancel: no undo step, no traceback."""

    @wraps(execute)
    def reported(self, context):
        try:
            with called_by(script=not self.options.is_invoke):
                return execute(self, context)
        except NotPrepared as wanted:
            root = active_root(context)
            try:
                wanted.begin(root, partial(_again, root.mu_unit.uuid, self.bl_idname, self.as_keywords()))
            except MuError as error:
                self.report({"ERROR"}, in_panel(str(error)))
            # Without an undo step: that comes with what is made.
            return {"CANCELLED"}
        except MuError as error:
            self.report({"ERROR"}, in_panel(str(error)))
            return {"CANCELLED"}

    return reported


def _again(uuid: str, name: str, values: dict) -> None:
    """Call an operator once more on a unit, as one undo step; do nothing if the unit is gone."""
    root, windows = by_uuid(uuid), bpy.context.window_manager.windows
    if root is not None and windows:
        with bpy.context.temp_override(window=windows[0], object=root, active_object=root):
            getattr(bpy.ops.mu, name.rpartition(".")[2].removeprefix("MU_OT_"))(
                "INVOKE_DEFAULT", True, **values
            )


class UnitPoll:
    """The poll of an operator on the active unit: greyed out, with the reason, where it cannot run."""

    find_root = staticmethod(active_root)
    no_root = NO_UNIT
    linked_too = False
    """True if it also runs on what is linked from a library."""

    @classmethod
    def trouble(cls, root) -> str:
        """Return the reason why the operator cannot run on `root` now; "" where it can."""
        return ""

    @classmethod
    def poll(cls, context):
        root = cls.find_root(context)
        barred = "" if root is None or cls.linked_too else linked(root)
        why = cls.no_root if root is None else barred or cls.trouble(root)
        if why:
            cls.poll_message_set(why)
        return not why


class UnitOperator(UnitPoll):
    """An operator that acts at once on the active unit; errors of the core become messages."""

    def act(self, context, root):
        """Do the operator's work on `root`; returns None when it is done, {"CANCELLED"} for no undo step."""
        raise NotImplementedError

    @reports_errors
    def execute(self, context):
        return self.act(context, self.find_root(context)) or {"FINISHED"}


class ValidUnitOperator(UnitOperator):
    """An operator on the active unit that needs parameters within the design rules."""

    @classmethod
    def trouble(cls, root):
        broken = root.mu_unit.trouble
        return f"A design rule is broken: {broken.splitlines()[0]}" if broken else ""


def open_file(context, path: Path) -> None:
    """Open a page in the browser, a folder in the file browser, anything else as a text in Blender."""
    if path.is_dir():
        bpy.ops.wm.path_open(filepath=str(path))
    elif path.suffix == ".html":
        bpy.ops.wm.url_open(url=path.as_uri())
    else:
        _show_text(context, path)


def _show_text(context, path: Path) -> None:
    """Load a file as a text of Blender's, and show it if a text editor is open."""
    name = f"MU {path.name}"
    text = bpy.data.texts.get(name) or bpy.data.texts.new(name)
    text.from_string(path.read_text(encoding="utf-8", errors="replace"))
    for area in context.screen.areas if context.screen else ():
        if area.type == "TEXT_EDITOR":
            area.spaces.active.text = text
