"""Actions on the list of runs: show one, compare two, restore the parameters of one, delete one."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from ...errors import InputError
from ...studies import unit_runs
from ..shared import updates
from ..shared.blender_property import Text
from ..shared.operators import operator, unless
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from ..unit.properties import from_unit
from . import motion as motion_parts
from . import runs


class _OfRun(UnitOperator):
    """An operator on a run of the active unit; greyed out, with the reason, without any."""

    trouble = unless(studies.runs_of, "No run yet: simulate this unit first")


_KEY = Text("Run", "Name of the run's folder; empty: the run that is shown")


def _run_of(root, key):
    """The run of a key, the shown one for ""; raises InputError."""
    found = studies.run_by_key(root, key) if key else studies.shown_run(root)
    if found is None:
        raise InputError(
            f"there is no run {key!r}",
            str(studies.folder_of(root)),
            f"choose one of {', '.join(run.key for run in studies.runs_of(root))}",
        )
    return found


@operator(_OfRun, "Show Run", key=_KEY)
def run_show(root, key):
    """Show the results of this run, until the unit's parameters change"""
    runs.show(root, _run_of(root, key).key)


@operator(_OfRun, "Compare", key=_KEY)
def run_compare(root, key):
    """Compare the shown run with this one, side by side and on the model; again to stop comparing"""
    study, run = root.mu_unit.study, _run_of(root, key)
    shown = studies.shown_run(root)
    if shown is not None and run.key == shown.key:
        raise InputError("this run is the one that is shown", str(run.folder), "compare with another one")
    study.against = "" if study.against == run.key else run.key
    motion_parts.refresh(root)


@operator(_OfRun, "Use Its Parameters", key=_KEY)
def run_restore(operator, root, key):
    """Give the unit the parameters that this run was made with"""
    run, props = _run_of(root, key), root.mu_unit
    title = props.title
    with updates.paused():
        from_unit(props, run.unit)
        props.title = title
        props.study.command = "place" if "place" in run.tables else "simulate"
        props.study.refine = run.refine
    unit_object.rebuild(root)
    if studies.design_of(root) != run.design:
        # Bodies, obstacles and named effects belong to the scene, and stay.
        words = "The run had another body, other obstacles or other effects: those are not restored"
        operator.report({"WARNING"}, words)


def _ask_before(operator, context, event):
    root, key = unit_object.active_root(context), operator.key
    found = studies.run_by_key(root, key) if key else studies.shown_run(root)
    if found is None:
        return operator.execute(context)
    # The run that was asked about, whatever is shown when the answer comes.
    operator.key = found.key
    return context.window_manager.invoke_confirm(
        operator,
        event,
        title=f"Delete the run {found.title!r}?",
        message=f"{unit_runs.bytes_of(found) / 1e6:.0f} MB in {found.folder}. This cannot be undone.",
        confirm_text="Delete",
        icon="WARNING",
    )


@operator(_OfRun, "Delete Run", undo=False, invoke=_ask_before, key=_KEY)
def run_remove(root, key):
    """Delete this run's files from the disk, which cannot be undone"""
    run = _run_of(root, key)
    unit_runs.remove(run)
    study = root.mu_unit.study
    if study.against == run.key:
        study.against = ""
    for name, what in motion_parts.shown(root):
        if motion_parts.one(root, name, what).get(motion_parts.RUN) == run.key:
            motion_parts.hide(root, name, what)
    runs.refresh()
    unit_object.rebuild(root)
