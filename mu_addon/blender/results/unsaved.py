"""Where runs go when the file is saved: beside it, and found again from wherever it is saved to.

A unit of a file that was never saved keeps its runs in the user's own folder. Saving moves them beside the
file, and what the file keeps of them is the way from there. A save elsewhere leaves them where they are, and
changes that way.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...errors import MuError
from ...usecases.simulate_and_place import history
from ..shared import displays, handlers
from ..shared.compat import user_folder
from ..shared.displays import MOTION
from ..simulate import study_folder as studies
from ..unit import object as unit_object

_homes: dict[str, Path] = {}
"""By UUID: the folders that units named as the file was about to be saved."""


def _units() -> list[Any]:
    return [root for root in unit_object.roots() if root.mu_unit.study.folder]


@persistent
def _before_save(path: str = "", *_: Any) -> None:
    _homes.clear()
    # Nothing for the startup file, which has no place.
    if not isinstance(path, str) or not path:
        return
    blend = Path(bpy.path.abspath(path))
    for root in _units():
        home = studies.folder_of(root)
        if home.parent == user_folder("studies"):
            home = _moved(root, home, blend)
        _homes[root.mu_unit.uuid] = home
        root.mu_unit.study.folder = _way(home, blend)


@persistent
def _after_save(*_: Any) -> None:
    # A copy is saved elsewhere, and this file goes on from its own place.
    for root in _units():
        home = _homes.get(root.mu_unit.uuid)
        if home is not None:
            way = studies.relative(home)
            if root.mu_unit.study.folder != way:
                root.mu_unit.study.folder = way
    _homes.clear()


def _moved(root: Any, old: Path, blend: Path) -> Path:
    """The unit's folder beside the file, where it could be moved there; else where it is."""
    new = studies.beside(blend, old.name)
    try:
        if not history.move_home(old, new):
            return old
    except MuError:
        # The file is saved all the same; the runs stay where they were and are found there.
        return old
    for part in root.children:
        modifier = part.modifiers.get("Motion") if part.get(MOTION) else None
        if modifier is not None:
            played = Path(bpy.path.abspath(modifier.filepath))
            if played.is_relative_to(old):
                modifier.filepath = str(new / played.relative_to(old))
    return new


def _way(home: Path, blend: Path) -> str:
    """A folder as a file keeps it: relative to the file where both are on one drive."""
    try:
        return str(bpy.path.relpath(str(home), start=str(blend.parent)))
    except ValueError:
        return str(home)


@persistent
def _loaded(*_: Any) -> None:
    """Point caches whose way has changed with the file are found again in the folder of their run."""
    for root in unit_object.roots():
        for part in root.children:
            modifier = part.modifiers.get("Motion") if part.get(MOTION) else None
            if modifier is None or Path(bpy.path.abspath(modifier.filepath)).is_file():
                continue
            name = Path(bpy.path.abspath(modifier.filepath)).name
            found = studies.results_folder(root) / "motion" / "played" / name
            if found.is_file() and displays.editable(part):
                modifier.filepath = studies.relative(found)


_HANDLERS = {"save_pre": _before_save, "save_post": _after_save, "load_post": _loaded}


def register() -> None:
    """Handlers of saving and loading."""
    handlers.add(_HANDLERS)


def unregister() -> None:
    """Take them out."""
    handlers.remove(_HANDLERS)
    _homes.clear()
