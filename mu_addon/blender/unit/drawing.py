"""Drawing of a root object: values of the design's steps as one mesh, and candidate paths.

The mesh carries, at its points, their part (`mu_part`, a number of `PARTS`), their skin (`mu_skin`, see
`preview.nodes.unit`) and the radius of struts and anchors in mm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import attrs
import bpy
import numpy as np

from ..preview import materials, nodes, skeletons
from ..preview.nodes import unit as unit_group
from ..preview.skeletons import Skeleton
from ..shared import displays
from ..shared.compat import modifier_input, set_modifier_input
from . import stack

DRAWN: dict[str, tuple[str, Callable[[Any, Any, bool], Skeleton | None]]] = {
    "profile": ("profile", lambda value, given, cut: skeletons.outline(value)),
    "chambers": ("chambers", lambda value, given, cut: skeletons.cavity(value, cut)),
    "membranes": ("actuator", lambda value, given, cut: skeletons.actuator(value, cut)),
    "cells": ("cells", lambda value, given, cut: skeletons.boxes(value)),
    "trim": ("trim", lambda value, given, cut: skeletons.lines(value, cut)),
    "struts": ("lattice", lambda value, given, cut: skeletons.lattice(value, cut, given.unit.dimensions.R)),
    "anchors": (
        "anchors",
        lambda value, given, cut: skeletons.anchor_skeleton(value, stack.STACK.value("struts", given)),
    ),
    "path": ("path", lambda value, given, cut: skeletons.line_through(value)),
    "wells": ("waveguide", lambda value, given, cut: skeletons.bar(value)),
}
"""Part for a step's value, and its drawing: from the value, the inputs, the cut."""

PLATE = "plate"
PARTS = (*(name for name, _ in DRAWN.values()), PLATE)
"""Names of a mesh's parts by the value of its attribute `mu_part`."""
SLOTS = ("MU Membrane", "MU Section", "MU Waveguide", "MU Wells", "MU Plate")
"""Materials of a root's mesh, in the order of its slots."""
_FIRST_SLOT = {"actuator": 0, "chambers": 1, "waveguide": 2, PLATE: 4}
_SKIN = {"lattice": unit_group.TUBE, "anchors": unit_group.BALL}


def shapes(given: Any, shown: list[str], cut: bool) -> dict[str, Skeleton]:
    """Skeletons of the shown steps by part; raises MuError where a step cannot be made."""
    found = {}
    for step in shown:
        if step in DRAWN:
            name, draw = DRAWN[step]
            skeleton = draw(stack.STACK.value(step, given), given, cut)
            if skeleton is not None:
                found[name] = skeleton
    return found


def whole(drawn: Mapping[str, Skeleton]) -> Skeleton:
    """Parts by name as one skeleton; the part of a name `left:lattice` is the lattice."""
    return skeletons.joined([_part(name.rpartition(":")[2], part) for name, part in drawn.items()])


def _part(name: str, part: Skeleton) -> Skeleton:
    count = len(part.vertices)
    # Struts without thickness stay lines.
    skin = _SKIN.get(name, unit_group.PLAIN) if part.attributes else unit_group.PLAIN
    attributes = {
        **part.attributes,
        "mu_part": np.full(count, PARTS.index(name), np.int32),
        unit_group.SKIN: part.attributes.get(unit_group.SKIN, np.full(count, skin, np.int32)),
    }
    faces = sum(map(len, part.faces))
    own = np.zeros(faces, np.int64) if part.slots is None else part.slots
    return attrs.evolve(part, attributes=attributes, slots=own + _FIRST_SLOT.get(name, 0))


def write(root: Any, mesh: Any, drawn: Mapping[str, Skeleton]) -> None:
    """Write parts into a root's mesh, which the group "MU Unit" skins; the user's colours are kept."""
    skeletons.write(mesh, whole(drawn))
    mesh["mu_points"] = len(mesh.vertices)
    for name in SLOTS[len(mesh.materials) :]:
        mesh.materials.append(materials.material(name))
    modifier = nodes.skin(root, unit_group.NAME)
    for socket, name in (("Struts", "MU Lattice"), ("Anchors", "MU Anchors")):
        if modifier_input(modifier, socket) is None:
            set_modifier_input(modifier, socket, materials.material(name))


def own_mesh(root: Any, mesh: Any | None, others: list[Any]) -> Any:
    """`mesh` if only this root can write into it, else a copy; a new one for None.

    others: meshes of the other roots, which a duplicate shares with its original.
    """
    if mesh is None:
        return bpy.data.meshes.new(root.name)
    if mesh in others or not displays.editable(mesh):
        return mesh.copy()
    return mesh


def beside(root: Any, name: str) -> Any | None:
    """Display of that name: a candidate path, the free path, or flaws; None if it is not shown."""
    return displays.part(root, displays.PART, name)


def put_beside(root: Any, name: str, skeleton: Skeleton, colour: str, group: str, title: str = "") -> Any:
    """Draw a skeleton beside the unit, in a colour and skinned by a node group; return its display."""
    title = title or name.capitalize()
    obj = beside(root, name)
    if obj is None:
        obj = displays.add(root, displays.PART, name, bpy.data.meshes.new(title))
        displays.lock(obj)
    if obj.mode == "EDIT":
        return obj
    if obj.data.users > 1:  # a linked duplicate's
        obj.data = bpy.data.meshes.new(title)
    skeletons.write(obj.data, skeleton)
    materials.assign(obj.data, colour)
    obj.data.materials[0] = materials.material(colour)
    modifier = nodes.skin(obj, group)
    for socket, value in {"Material": obj.data.materials[0], **skeleton.inputs}.items():
        set_modifier_input(modifier, socket, value)
    return obj
