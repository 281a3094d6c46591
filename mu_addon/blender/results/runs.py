"""The list of a unit's runs in Blender: an entry for each run, with the name and star in its folder."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import CollectionProperty, StringProperty

from ...errors import MuError
from ...studies import unit_runs
from ..jobs.start_child import JOB_ENDED
from ..shared import viewports
from ..shared.blender_property import Flag, Integer, Text
from ..shared.registration import connected, handler, property_of, timer
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from . import motion as motion_parts


def of_active():
    """The active unit and its runs, the latest first."""
    root = unit_object.active_root(bpy.context)
    return root, ([] if root is None else studies.runs_of(root))


def _run_of(entry):
    return next((run for run in of_active()[1] if run.key == entry.key), None)


def _title(entry) -> str:
    run = _run_of(entry)
    return run.title if run is not None else ""


def _labelled(entry, **changes) -> None:
    run = _run_of(entry)
    if run is None:
        return
    try:
        unit_runs.label(run, changes.get("name", run.name), changes.get("starred", run.starred))
    except MuError:
        # A property cannot refuse a value: the entry keeps showing that of the file.
        return
    viewports.redraw()


def _rename(entry, value: str) -> None:
    name = "".join(c for c in value if c.isprintable())[: unit_runs.LONGEST_NAME]
    if name != _title(entry):
        _labelled(entry, name=name)


def _starred(entry) -> bool:
    run = _run_of(entry)
    return run is not None and run.starred


def _star(entry, value: bool) -> None:
    _labelled(entry, starred=value)


class MU_PG_run(bpy.types.PropertyGroup):
    """An entry of the list: a run, by its key."""

    key: StringProperty(options={"HIDDEN"})
    title: Text("Name", "Your name for this run; empty for a description", get=_title, set=_rename)
    starred: Flag("Star", "Mark this run, to find it again", get=_starred, set=_star)


def _index(listed) -> int:
    root, _ = of_active()
    run = None if root is None else studies.shown_run(root)
    keys = [entry.key for entry in listed.entries]
    return keys.index(run.key) if run is not None and run.key in keys else -1


def _choose(listed, value: int) -> None:
    root, _ = of_active()
    if root is not None and 0 <= value < len(listed.entries):
        show(root, listed.entries[value].key)


@property_of(bpy.types.WindowManager, "mu_runs")
class MU_PG_runs(bpy.types.PropertyGroup):
    """Runs of the active unit, read from their folders: no file keeps the list, and undo leaves it alone."""

    entries: CollectionProperty(type=MU_PG_run, description="Runs, the latest first")
    index: Integer(
        "Shown Run",
        "The run whose results are shown. A click shows another one, a double click renames it",
        get=_index,
        set=_choose,
    )


def show(root, key: str) -> bool:
    """Show the results of the unit's run of that key, also on the model; return True if there is one."""
    run = studies.run_by_key(root, key)
    if run is None:
        return False
    studies.choose(root, run)
    motion_parts.follow(root)
    # Candidate paths have their J from the shown run.
    unit_object.rebuild(root)
    viewports.show_colours()
    viewports.redraw()
    return True


def listed():
    """The list, scheduled for an update if it is behind; for a panel, which may not write itself."""
    found = bpy.context.window_manager.mu_runs
    if _behind():
        _later.soon()
    return found


def _behind() -> bool:
    entries = bpy.context.window_manager.mu_runs.entries
    return [entry.key for entry in entries] != [run.key for run in of_active()[1]]


@timer()
def _later() -> None:
    refresh()
    viewports.redraw()


@connected(JOB_ENDED)
@handler("load_post")
def refresh(*_) -> None:
    """List the runs of the active unit."""
    if not _behind():
        return
    entries = bpy.context.window_manager.mu_runs.entries
    entries.clear()
    for run in of_active()[1]:
        entries.add().key = run.key
