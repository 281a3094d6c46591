"""Folders of runs when the file is saved: moved next to it, and found again after moving the file.

A unit or a gripper of a file that was never saved keeps its runs in the user's folder. Saving moves them next
to the file, which stores a relative path. Saving elsewhere leaves them in place and changes that path.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from ...errors import MuError
from ...studies import unit_runs
from ..gripper import object as gripper_object
from ..gripper import state as grasps
from ..shared import displays
from ..shared.compat import user_folder
from ..shared.registration import at_end, handler
from ..simulate import study_folder as studies
from ..unit import object as unit_object

_homes: dict[str, Path] = {}
"""By UUID: folders of units and grippers before the file was saved."""


def _owners() -> list[tuple[Any, Any, Path]]:
    """Object, owner of its folder's name, and that folder, of every unit and gripper with one."""
    units = [(root, root.mu_unit.study, studies.folder_of(root)) for root in unit_object.roots()]
    grippers = [(root, root.mu_gripper, grasps.folder_of(root)) for root in gripper_object.roots()]
    return [owner for owner in (*units, *grippers) if owner[1].folder]


@handler("save_pre")
def _before_save(path: str = "", *_: Any) -> None:
    _homes.clear()
    # Nothing for the startup file, which has no path.
    if not isinstance(path, str) or not path:
        return
    blend = Path(bpy.path.abspath(path))
    for root, named, home in _owners():
        if home.parent == user_folder("studies"):
            home = _moved(root, home, blend)
        _homes[displays.uuid_of(root)] = home
        named.folder = _way(home, blend)


@handler("save_post")
def _after_save(*_: Any) -> None:
    # A copy is saved elsewhere, and this file keeps its path.
    for root, named, _home in _owners():
        home = _homes.get(displays.uuid_of(root))
        if home is not None and named.folder != (way := studies.relative(home)):
            named.folder = way
    _homes.clear()


def _moved(root: Any, old: Path, blend: Path) -> Path:
    """The folder next to the file, if it could be moved there; else its present place."""
    new = studies.beside(blend, old.name)
    try:
        if not unit_runs.move_home(old, new):
            return old
    except MuError:
        # The file is saved all the same; the runs stay in place and are found there.
        return old
    for _part, modifier, played in _caches(root):
        if played.is_relative_to(old):
            modifier.filepath = str(new / played.relative_to(old))
    return new


def _way(home: Path, blend: Path) -> str:
    """Path of a folder stored in a file: relative to the file if both are on one drive."""
    try:
        return str(bpy.path.relpath(str(home), start=str(blend.parent)))
    except ValueError:
        return str(home)


@handler("load_post")
def _loaded(*_: Any) -> None:
    """Find point caches whose path has changed with the file, in the folder of their run."""
    for root in (*unit_object.roots(), *gripper_object.roots()):
        for part, modifier, before in _caches(root):
            if before.is_file():
                continue
            if root.mu_gripper.uuid:
                found = grasps.folder_of(root) / before.parent.name / before.name
            else:
                found = studies.results_folder(root) / "motion" / "played" / before.name
            if found.is_file() and displays.editable(part):
                modifier.filepath = studies.relative(found)


def _caches(root: Any) -> Iterator[tuple[Any, Any, Path]]:
    """Parts that play a run's motion, with the modifier that plays it, and its file."""
    for part in root.children:
        found = part.modifiers.get("Motion")
        if found is not None and found.type == "MESH_CACHE":
            yield part, found, Path(bpy.path.abspath(found.filepath))


@at_end
def _forget() -> None:
    _homes.clear()
