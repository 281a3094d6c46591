"""Obstacles of a unit: make selected meshes obstacles, add a box, check them, remove them."""

import bpy
import numpy as np
from mathutils import Vector

from ...design.body import require_sound
from ...design.printing.finding import counted
from ...design.settings import FRICTION
from ...errors import InputError
from ..body.operators import report_flaws, selected_meshes
from ..preview import materials, skeletons
from ..shared import viewports
from ..shared.blender_property import FloatVector, Number, Text, blender_property, exact
from ..shared.operators import operator, unless
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import state as obstacles

NO_OBSTACLE = "No obstacle yet: select a closed mesh and use it as one"


_NAME = Text("Obstacle", "Name of its object. Empty: all of this unit", options={"SKIP_SAVE"})


class _OfObstacles(UnitOperator):
    """An operator on the obstacles of the active unit; greyed out, with the reason, without any."""

    trouble = unless(obstacles.of_unit, NO_OBSTACLE)


def _chosen(root, name):
    """Objects to act on; raises InputError for an unknown name."""
    found = obstacles.of_unit(root)
    chosen = [o for o in found if name in ("", o.name)]
    if not chosen:
        names = ", ".join(o.name for o in found)
        raise InputError(f"{name!r} is not an obstacle of this unit", root.name, f"choose one of {names}")
    return chosen


@operator(ValidUnitOperator, "Use as Obstacle", friction=blender_property(FRICTION, precision=2))
def obstacle(operator, context, root, friction):
    """Make the selected closed meshes obstacles of the unit: rigid, in place, with friction"""
    core, chosen = to_unit(root.mu_unit), selected_meshes(context)
    for obj in chosen:
        body = obstacles.placed(root, obj).body
        require_sound(body, obstacles.unsound(body), "an obstacle")
    for obj in chosen:
        obj.mu_obstacle.unit, obj.mu_obstacle.friction = root.mu_unit.uuid, friction
        # An overlap is only reported, since the obstacle may be moved; a simulation refuses it.
        for flaw in obstacles.examined(root, obj, core):
            operator.report({"WARNING"}, f"{obj.name}: {flaw.what}: {flaw.remedy}")


@operator(
    ValidUnitOperator,
    "Add Box",
    size=FloatVector(
        "Size (mm)", "Edges of the box in mm", subtype="XYZ", default=(25.0, 25.0, 25.0), min=0.1
    ),
    gap=Number("Gap (mm)", "Distance between unit and box in mm", default=5.0, min=0.0),
    friction=blender_property(FRICTION, precision=2),
)
def obstacle_box(context, root, size, gap, friction):
    """Add a box as an obstacle, in front of the tip on the side that the unit bends to"""
    d = to_unit(root.mu_unit).dimensions
    size = np.array([exact(edge) for edge in size])
    mesh = bpy.data.meshes.new("Obstacle")
    skeletons.write(mesh, skeletons.box(-size / 2.0, size / 2.0))
    materials.assign(mesh, "MU Obstacle")
    obj = bpy.data.objects.new("Obstacle", mesh)
    context.collection.objects.link(obj)
    reach = d.bounds[1][1] + exact(gap) + 0.5 * float(size[1])
    obj.matrix_world = root.matrix_world.copy()
    obj.location = root.matrix_world @ Vector((0.0, reach, d.height - 0.5 * float(size[2])))
    obj.mu_obstacle.unit, obj.mu_obstacle.friction = root.mu_unit.uuid, friction


@operator(_OfObstacles, "Check Obstacles", name=_NAME)
def obstacle_check(operator, root, name):
    """Check obstacles for open edges, self-intersections, size and overlap; mark the places"""
    core, chosen = to_unit(root.mu_unit), _chosen(root, name)
    found = [flaw for obj in chosen for flaw in obstacles.examined(root, obj, core)]
    sound = f"{counted(len(chosen), 'obstacle', 'obstacles')}, valid and clear of the unit"
    report_flaws(operator, root, found, sound)


@operator(_OfObstacles, "Remove Obstacle", name=_NAME)
def obstacle_remove(root, name):
    """Remove an object from the obstacles; the object stays"""
    for obj in _chosen(root, name):
        obj.property_unset("mu_obstacle")


@operator(_OfObstacles, "Select Obstacle", name=_NAME)
def obstacle_select(context, root, name):
    """Select an obstacle, to move it"""
    viewports.select(context, _chosen(root, name))
