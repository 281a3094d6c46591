"""List targets and freedoms, start the search, and take a proposed unit into the scene."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs
import bpy
from bpy.props import EnumProperty, IntProperty

from ..jobs import start_child
from ..jobs.operators import job_operators
from ..shared import landing, updates, viewports
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import from_unit
from . import state as optimization

LONGEST_TITLE = 80
_LIST = EnumProperty(
    name="List",
    description="Which list",
    items=[("targets", "Targets", "Targets of the unit"), ("freedoms", "Freedoms", "What may change")],
)


class MU_OT_optimize_list(UnitOperator, bpy.types.Operator):
    """Add a target, or a parameter that may change, to the unit's list"""

    bl_idname = "mu.optimize_list"
    bl_label = "Add to List"
    bl_options = {"REGISTER", "UNDO"}

    what: _LIST

    def act(self, context, root):
        props = root.mu_optimize
        if self.what == "targets":
            props.targets.add()
            return {"FINISHED"}
        taken = {freedom.parameter for freedom in props.freedoms}
        free = next((name for name in FIRST if name not in taken), FIRST[0])
        # Set explicitly, so that its range is that of the unit.
        props.freedoms.add().parameter = free
        return {"FINISHED"}


FIRST = (
    "chambers.wall_mm",
    "chambers.neck_diameter_mm",
    "chambers.bladder_share",
    "material.membrane_modulus_kPa",
    "scale",
)
"""Order in which the list proposes parameters: those with most effect on a unit's angle come first."""


class MU_OT_optimize_unlist(UnitOperator, bpy.types.Operator):
    """Remove a target, or a parameter that may change, from the unit's list"""

    bl_idname = "mu.optimize_unlist"
    bl_label = "Remove from List"
    bl_options = {"REGISTER", "UNDO"}

    what: _LIST
    index: IntProperty(name="Row", description="Row of the list, from 0", min=0)

    def act(self, context, root):
        rows = getattr(root.mu_optimize, self.what)
        if self.index >= len(rows):
            return {"CANCELLED"}
        rows.remove(self.index)
        return {"FINISHED"}


class MU_OT_optimize(ValidUnitOperator, bpy.types.Operator):
    """Search for units that meet the targets, in a child process; simulated units are kept"""

    bl_idname = "mu.optimize"
    bl_label = "Optimize"
    bl_options = {"REGISTER"}

    @classmethod
    def trouble(cls, root):
        props, why = root.mu_optimize, ""
        if optimization.OPTIMIZATION.is_running(root):
            why = "This unit is being optimised"
        elif props.source == "file":
            why = "" if props.file else "Choose a design.toml first"
        elif not props.targets or not props.freedoms:
            why = f"Add a {'parameter that may change' if props.targets else 'target'} first"
        return super().trouble(root) or why or start_child.lacking()

    def act(self, context, root):
        studies.assign_folder(root)
        optimization.OPTIMIZATION.start(
            root, optimization.folder_of(root), lambda folder: optimization.write_inputs(root, folder)
        )
        viewports.redraw()


class _OfProposed(UnitOperator):
    """Takes a proposed unit; greyed out, with the reason, where none is proposed."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        found = optimization.findings(root)
        return "" if found and found.proposed else "No unit is proposed: run the optimisation first"


_NUMBER = IntProperty(name="Proposed Unit", description="Number of the proposed unit", default=1, min=1)


class MU_OT_optimize_apply(_OfProposed, bpy.types.Operator):
    """Give the unit the parameters of a proposed one; undo takes them back"""

    bl_idname = "mu.optimize_apply"
    bl_label = "Apply"

    number: _NUMBER

    def act(self, context, root):
        core = attrs.evolve(optimization.proposed_unit(root, self.number), name=root.mu_unit.title)
        with updates.paused():
            from_unit(root.mu_unit, core)
        if not unit_object.rebuild(root):
            self.report({"ERROR"}, root.mu_unit.trouble)
            return {"CANCELLED"}
        return {"FINISHED"}


class MU_OT_optimize_add(_OfProposed, bpy.types.Operator):
    """Add a proposed unit to the scene, next to the present one"""

    bl_idname = "mu.optimize_add"
    bl_label = "Add Beside"

    number: _NUMBER

    def act(self, context, root):
        core = optimization.proposed_unit(root, self.number)
        end = f" {self.number}"
        title = root.mu_unit.title[: LONGEST_TITLE - len(end)] + end
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        added = unit_object.create(context, attrs.evolve(core, name=title))
        added.location = root.matrix_world.translation
        landing.land(context, added)


CLASSES = (
    MU_OT_optimize_list,
    MU_OT_optimize_unlist,
    MU_OT_optimize,
    MU_OT_optimize_apply,
    MU_OT_optimize_add,
    *job_operators(
        optimization.OPTIMIZATION,
        "optimize_",
        "optimisation",
        kept="units that were simulated are kept, and the next run continues from there",
        first="run the optimisation first",
    ),
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
