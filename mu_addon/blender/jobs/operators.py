"""The three operators of every kind of job: cancel it, dismiss its message, open its files."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...run.child import ERRORS
from ..shared import viewports
from ..shared.blender_property import Choice
from ..shared.operators import open_file, operator, unless
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


def job_operators(
    kind: JobKind,
    first: str,
    *,
    kept: str = KEPT,
    base: type = UnitOperator,
    items: list[tuple[str, str, str]] = RUN_FILES,
    path_of: Callable[[Any, str], Path] | None = None,
) -> None:
    """Operators mu.PREFIXcancel, mu.PREFIXdismiss and mu.PREFIXopen of a kind of job, by its prefix.

    first: what to do before there is a file; kept: results that remain when it is stopped; base: operator of
    the object with the job; items: files to open, with paths by `path_of(root, what)`, by default in the
    run's folder.
    """
    noun = kind.title

    def made(what: str, text: str, act: Callable[..., None], /, **more: Any) -> None:
        act.__name__, act.__doc__ = f"{kind.prefix}{what}", text
        operator(base, what.capitalize(), undo=False, **more)(act)

    def cancel(root: Any) -> None:
        kind.child(root).cancel()
        viewports.redraw()

    def show(context: Any, root: Any, what: str) -> None:
        path = kind.folder_of(root) / FILES[what] if path_of is None else path_of(root, what)
        if not path.exists():
            raise InputError("there is no such file yet", str(path), first)
        open_file(context, path)

    runs = unless(kind.is_running, f"No {noun} is running")
    choice = Choice("What", f"File or folder of the {noun} to open", items=items)
    made("cancel", f"Stop the {noun}; {kept}", cancel, trouble=runs)
    made("dismiss", f"Remove the message of the ended {noun} from the panel", lambda root: kind.dismiss(root))
    made("open", f"Open a file or the folder of the {noun}", show, what=choice)
