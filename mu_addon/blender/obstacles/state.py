"""Obstacles of a unit: closed meshes of the scene that it may touch, rigid and fixed.

They remain the user's objects. After a change they are read again, in the unit's frame, and earlier
simulations with them become stale. Copies of an obstacle are obstacles; undo and deletion need no handling.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import re
from typing import Any

import attrs
import bpy

from ...design.body import Body, Flaw, flaws, overlaps, require_sound
from ...design.parameters import Unit
from ...design.rigid_body import RigidBody
from ...design.settings import FRICTION
from ..body import state as bodies
from ..shared.blender_property import Number, Text, blender_property, exact
from ..shared.registration import at_end, handler, property_of
from ..unit import envelope

ODD_SIZE_MM = (0.1, 2000.0)
"""An obstacle outside this range is probably in another unit of length."""


@property_of(bpy.types.Object, "mu_obstacle")
class MU_PG_obstacle(bpy.types.PropertyGroup):
    """An object as an obstacle of a unit."""

    unit: Text("Unit", "UUID of the unit that may touch it", options={"HIDDEN"})
    mm: Number(
        "Millimetre",
        "Length of a millimetre in the scene that the object's size is right for; 0: not known",
        options={"HIDDEN"},
    )
    friction: blender_property(FRICTION, soft_max=1.0, precision=2, step=5)


@attrs.frozen(eq=False)
class Placed:
    """An obstacle in its present place, in mm of the unit's frame; flaws: its faults, if checked."""

    body: Body
    flaws: list[Flaw] | None = None


_placed: dict[tuple[str, str], tuple[Any, Placed]] = {}
"""By unit and object: the object's transform relative to the unit, and its surface there."""


def of_unit(root: Any) -> list[Any]:
    """Objects that are obstacles of a unit, by name."""
    found = [o for o in bpy.data.objects if o.mu_obstacle.unit == root.mu_unit.uuid and o.users_collection]
    return sorted(found, key=lambda o: o.name)


def placed(root: Any, obj: Any) -> Placed:
    """An obstacle in its present place; raises InputError for an object without a surface."""
    key = root.mu_unit.uuid, obj.name_full
    where = _where(root, obj)
    kept = _placed.get(key)
    if kept is None or kept[0] != where:
        kept = _placed[key] = where, Placed(bodies.of_object(obj, root))
    return kept[1]


def examined(root: Any, obj: Any, unit: Unit) -> list[Flaw]:
    """Reasons why an object cannot be an obstacle in its place: its surface, its size, its position."""
    body = placed(root, obj).body
    found = unsound(body) or overlaps(body, unit.dimensions, envelope.envelope_in(root, unit))
    _placed[root.mu_unit.uuid, obj.name_full] = _where(root, obj), Placed(body, found)
    return found


def unsound(body: Body) -> list[Flaw]:
    """Reasons why a surface cannot be an obstacle anywhere."""
    found = flaws(body)
    size = float((body.bounds[1] - body.bounds[0]).max())
    low, high = ODD_SIZE_MM
    if found or low <= size <= high:
        return found
    return [
        Flaw(
            f"it is {size:.3g} mm long: it seems to be in another unit of length",
            "scale it; one Blender unit is one millimetre",
            body.bounds,
        )
    ]


def inputs(root: Any) -> list[tuple[str, float]]:
    """Hash of the surface and friction of every obstacle, sorted; InputError for one without a surface."""
    return sorted((placed(root, o).body.hash, exact(o.mu_obstacle.friction)) for o in of_unit(root))


def rigid_bodies(root: Any, unit: Unit) -> tuple[RigidBody, ...]:
    """A unit's obstacles as inputs of a simulation; InputError for one invalid in its present place."""
    found: dict[str, RigidBody] = {}
    for number, obj in enumerate(of_unit(root), 1):
        body = placed(root, obj).body
        require_sound(body, examined(root, obj, unit), "an obstacle")
        # Its name in reports.
        name = re.sub(r"[^A-Za-z0-9._-]+", "-", obj.name)
        name = f"{name}-{number}" if f"{name}.obj" in found else name
        found[f"{name}.obj"] = RigidBody(
            attrs.evolve(body, name=f"{name}.obj"), exact(obj.mu_obstacle.friction)
        )
    return tuple(found.values())


def _where(root: Any, obj: Any) -> Any:
    """Transform of an object relative to a unit."""
    return [tuple(row) for row in root.matrix_world.inverted() @ obj.matrix_world]


@handler("depsgraph_update_post")
def _edited(scene, depsgraph):
    """Drop edited surfaces, to be read again; `placed` itself notices moves."""
    changed = {u.id.name_full for u in depsgraph.updates if u.is_updated_geometry}
    for key in [key for key in _placed if key[1] in changed]:
        del _placed[key]


@at_end
@handler("load_post")
def _loaded(*_):
    _placed.clear()
