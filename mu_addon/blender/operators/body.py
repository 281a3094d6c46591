"""A body of the user's own: check it, make it the unit's envelope or an obstacle, take it out again."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import EnumProperty

from ...design.body import require_sound
from ...errors import InputError
from .. import bodies, unit_object
from ..properties import to_unit
from .acting import OnUnit, telling

_ROLE = [
    ("envelope", "Envelope", "The lattice fills this body instead of its box"),
    ("obstacle", "Obstacle", "Something rigid that the unit meets; shown, and not simulated yet"),
]


def selected_mesh(context):
    """The selected mesh that is no part of a unit; raises InputError where there is none, or more."""
    found = [o for o in context.selected_objects if o.type == "MESH" and unit_object.root_of(o) is None]
    if len(found) != 1:
        raise InputError(
            f"{len(found)} meshes are selected besides the unit", "selection", "select one closed mesh"
        )
    return found[0]


class MU_OT_body_check(OnUnit, bpy.types.Operator):
    """Examine the selected mesh: open edges, faces that cut each other, size, fit; mark the places"""

    bl_idname = "mu.body_check"
    bl_label = "Check Body"
    bl_options = {"REGISTER", "UNDO"}

    role: EnumProperty(name="As", description="What the body is to be", items=_ROLE, default="envelope")

    @telling
    def execute(self, context):
        root = unit_object.active_root(context)
        body = bodies.of_object(selected_mesh(context), root)
        dimensions = to_unit(root.mu_unit).dimensions if self.role == "envelope" else None
        found = bodies.examined(body, dimensions)
        places = [place for flaw in found for place in flaw.places]
        unit_object.mark(root, places)
        if not found:
            self.report({"INFO"}, f"{body.name} can be an {self.role}: {len(body.triangles)} triangles")
        for flaw in found:
            self.report({"WARNING"}, f"{flaw.what[:1].upper()}{flaw.what[1:]}: {flaw.remedy}")
        return {"FINISHED"}


class MU_OT_body(OnUnit, bpy.types.Operator):
    """Make a copy of the selected mesh the unit's envelope, which the lattice then fills, or an obstacle"""

    bl_idname = "mu.body"
    bl_label = "Use Body"
    bl_options = {"REGISTER", "UNDO"}

    role: EnumProperty(name="As", description="What the body is to be", items=_ROLE, default="envelope")

    @telling
    def execute(self, context):
        root = unit_object.active_root(context)
        obj = selected_mesh(context)
        body = bodies.of_object(obj, root)
        dimensions = to_unit(root.mu_unit).dimensions if self.role == "envelope" else None
        require_sound(body, bodies.examined(body, dimensions))
        name = bodies.ENVELOPE if self.role == "envelope" else bodies.OBSTACLE + obj.name
        unit_object.put_body(root, name, body)
        obj.hide_set(True)
        unit_object.mark(root, [])
        unit_object.rebuild(root)
        return {"FINISHED"}


class MU_OT_body_remove(OnUnit, bpy.types.Operator):
    """Take bodies of your own out of the unit: the lattice fills its box again"""

    bl_idname = "mu.body_remove"
    bl_label = "Remove Body"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        root = unit_object.active_root(context)
        unit_object.remove_bodies(root)
        unit_object.rebuild(root)
        return {"FINISHED"}


CLASSES = (MU_OT_body_check, MU_OT_body, MU_OT_body_remove)
