"""Base classes of the operators: the object they act on, the core's errors, and opening files."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial, wraps
from pathlib import Path
from typing import Any

import attrs
import bpy

from ...errors import MuError
from . import displays, registration
from .wording import in_panel

_scripts = 0


def in_script() -> bool:
    """Return True while a script calls an operator."""
    return _scripts > 0


@contextmanager
def _called_by(script: bool) -> Iterator[None]:
    """Have `in_script` return True within the body if a script called the operator."""
    global _scripts
    _scripts += script
    try:
        yield
    finally:
        _scripts -= script


@attrs.define(eq=False)
class NotReady(Exception):
    """Raised by an operator on `root` that must wait; `begin` starts what it waits for."""

    root: Any

    def begin(self, again: Callable[[], None]) -> None:
        """Start it, and call `again` at its end."""
        raise NotImplementedError


def linked(root) -> str:
    """Return the reason why a unit cannot be changed here, its library, with the remedy; else ""."""
    if displays.editable(root):
        return ""
    source = root if root.library is not None else root.override_library.reference
    name = Path(source.library.filepath).name
    return f"{root.name} is linked from {name}: change it there, or use Object > Relations > Make Local"


def reports_errors(execute):
    """Wrap `execute` to report a MuError, what, where and remedy, and cancel: no undo step, no traceback."""

    @wraps(execute)
    def reported(self, context):
        try:
            try:
                with _called_by(script=not self.options.is_invoke):
                    return execute(self, context)
            except NotReady as wanted:
                owner = displays.uuid_of(wanted.root)
                wanted.begin(partial(_again, owner, self.bl_idname, self.as_keywords()))
        except MuError as error:
            self.report({"ERROR"}, in_panel(str(error)))
        # Without an undo step: that of a slow part comes with what is made.
        return {"CANCELLED"}

    return reported


def _again(uuid: str, name: str, values: dict) -> None:
    """Call an operator once more on a root, as one undo step; do nothing if the root is gone."""
    root, windows = displays.by_uuid(uuid), bpy.context.window_manager.windows
    if root is not None and windows:
        with bpy.context.temp_override(window=windows[0], object=root, active_object=root):
            getattr(bpy.ops.mu, name.rpartition(".")[2].removeprefix("MU_OT_"))(
                "INVOKE_DEFAULT", True, **values
            )


def unless(there: Callable[[Any], Any], why: str) -> Callable[[Any], str]:
    """The `trouble` of an operator that needs something of its root: why it cannot run where that lacks."""
    return lambda root: "" if there(root) else why


class RootPoll:
    """The poll of an operator on an active root: greyed out, with the reason, where it cannot run."""

    find_root: Callable[[Any], Any]
    """Return the root to work on in a context, or None."""
    no_root: str
    """Words where there is none."""
    root_name = "root"
    """What functions that are operators call it."""
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


class RootOperator(RootPoll):
    """An operator that acts at once on the active root; errors of the core become messages.

    One undo step, unless its `bl_options` say otherwise: for what is in files, processes or preferences.
    """

    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        """Do the operator's work on `root`; returns None when it is done, {"CANCELLED"} for no undo step."""
        raise NotImplementedError

    @reports_errors
    def execute(self, context):
        return self.act(context, self.find_root(context)) or {"FINISHED"}


def operator(
    base: type,
    label: str,
    *,
    undo: bool = True,
    linked_too: bool = False,
    trouble: Callable[[Any], str] | None = None,
    invoke: Callable[[Any, Any, Any], set[str]] | None = None,
    tip: Callable[[Any, Any], str] | None = None,
    **properties: Any,
) -> Callable[[Any], Any]:
    """A function as the operator of its name, its docstring in the tooltip; the function stays as it is.

    base: a `RootOperator` or `FreeOperator`; linked_too: of it; trouble: of a root, further reason why it
    cannot run; invoke: of the operator, what a press does first, such as `choose_file`; tip: of context and
    properties, what the tooltip says instead, "" for the docstring; properties: of the operator, by name. The
    function's parameters name what it is given: `context`, `root` (or `base.root_name`), properties, or the
    `operator` itself. It returns what `RootOperator.act` does.
    """

    def made(function: Any) -> Any:
        names = list(inspect.signature(function).parameters)

        def act(self, context, root):
            known = {"operator": self, "context": context, "root": root, base.root_name: root}
            return function(**{name: known[name] if name in known else getattr(self, name) for name in names})

        members = {
            "__doc__": function.__doc__,
            "__module__": function.__module__,
            "__annotations__": properties,
            "bl_label": label,
            "bl_options": {"REGISTER", "UNDO"} if undo else {"REGISTER"},
            "act": act,
        }
        if linked_too:
            members["linked_too"] = True
        if invoke is not None:
            members["invoke"] = invoke
        if tip is not None:
            members["description"] = classmethod(
                lambda cls, context, properties: tip(context, properties) or cls.__doc__
            )
        if trouble is not None:
            members["trouble"] = lambda root: base.trouble(root) or trouble(root)
        registration.made(type(f"MU_OT_{function.__name__}", (base, bpy.types.Operator), members))
        return function

    return made


class FreeOperator:
    """An operator that needs no root."""

    bl_options = {"REGISTER", "UNDO"}
    root_name = ""

    @reports_errors
    def execute(self, context):
        return self.act(context, None) or {"FINISHED"}


def choose_file(operator: Any, context: Any, event: Any) -> set[str]:
    """Ask for the operator's file or files first."""
    context.window_manager.fileselect_add(operator)
    return {"RUNNING_MODAL"}


def ask_properties(operator: Any, context: Any, event: Any) -> set[str]:
    """Ask for the operator's properties first."""
    return set(context.window_manager.invoke_props_dialog(operator))


def open_file(context, path: Path) -> None:
    """Open a page in the browser, a folder in the file browser, anything else as a text in Blender."""
    if path.is_dir():
        bpy.ops.wm.path_open(filepath=str(path))
    elif path.suffix == ".html":
        bpy.ops.wm.url_open(url=path.as_uri())
    else:
        name = f"MU {path.name}"
        text = bpy.data.texts.get(name) or bpy.data.texts.new(name)
        text.from_string(path.read_text(encoding="utf-8", errors="replace"))
        for area in context.screen.areas if context.screen else ():
            if area.type == "TEXT_EDITOR":
                area.spaces.active.text = text
