"""Actions on the list of runs: show one, compare two, restore the parameters of one, delete one."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import StringProperty

from ...errors import InputError
from ...usecases.simulate_and_place import unit_runs
from ..shared import updates
from ..shared.operators import unless
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from ..unit.properties import from_unit
from . import motion as motion_parts
from . import runs


class RunOperator(UnitOperator):
    """An operator on a run of the active unit: the one of its property `key`, else the shown one."""

    trouble = unless(studies.runs_of, "No run yet: simulate this unit first")

    def run_of(self, root):
        """The run; raises InputError."""
        found = studies.run_by_key(root, self.key) if self.key else studies.shown_run(root)
        if found is None:
            raise InputError(
                f"there is no run {self.key!r}",
                str(studies.folder_of(root)),
                f"choose one of {', '.join(run.key for run in studies.runs_of(root))}",
            )
        return found


KEY = StringProperty(name="Run", description="Name of the run's folder; empty: the run that is shown")


class MU_OT_run_show(RunOperator, bpy.types.Operator):
    """Show the results of this run, until the unit's parameters change"""

    bl_label = "Show Run"

    key: KEY

    def act(self, context, root):
        runs.show(root, self.run_of(root).key)


class MU_OT_run_compare(RunOperator, bpy.types.Operator):
    """Compare the shown run with this one, side by side and on the model; again to stop comparing"""

    bl_label = "Compare"

    key: KEY

    def act(self, context, root):
        study, run = root.mu_unit.study, self.run_of(root)
        shown = studies.shown_run(root)
        if shown is not None and run.key == shown.key:
            raise InputError("this run is the one that is shown", str(run.folder), "compare with another one")
        study.against = "" if study.against == run.key else run.key
        motion_parts.refresh(root)


class MU_OT_run_restore(RunOperator, bpy.types.Operator):
    """Give the unit the parameters that this run was made with"""

    bl_label = "Use Its Parameters"

    key: KEY

    def act(self, context, root):
        run, props = self.run_of(root), root.mu_unit
        title = props.title
        with updates.paused():
            from_unit(props, run.unit)
            props.title = title
            props.study.command = "place" if "place" in run.tables else "simulate"
            props.study.refine = run.refine
        unit_object.rebuild(root)
        if studies.design_of(root) != run.design:
            # Bodies, obstacles and named effects belong to the scene, and stay.
            self.report(
                {"WARNING"},
                "The run had another body, other obstacles or other effects: those are not restored",
            )


class MU_OT_run_remove(RunOperator, bpy.types.Operator):
    """Delete this run's files from the disk, which cannot be undone"""

    bl_label = "Delete Run"
    bl_options = {"REGISTER"}

    key: KEY

    def invoke(self, context, event):
        root = unit_object.active_root(context)
        found = studies.run_by_key(root, self.key) if self.key else studies.shown_run(root)
        if found is None:
            return self.execute(context)
        # The run that was asked about, whatever is shown when the answer comes.
        self.key = found.key
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=f"Delete the run {found.title!r}?",
            message=f"{unit_runs.bytes_of(found) / 1e6:.0f} MB in {found.folder}. This cannot be undone.",
            confirm_text="Delete",
            icon="WARNING",
        )

    def act(self, context, root):
        run = self.run_of(root)
        unit_runs.remove(run)
        study = root.mu_unit.study
        if study.against == run.key:
            study.against = ""
        for name, what in motion_parts.shown(root):
            if motion_parts.one(root, name, what).get(motion_parts.RUN) == run.key:
                motion_parts.hide(root, name, what)
        runs.refresh()
        unit_object.rebuild(root)
