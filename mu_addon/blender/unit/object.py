"""A unit in the scene: a root object that holds its parameters, and parts that are rebuilt from them.

The root is found by its UUID, since undo deletes and restores objects; parts are the root's children, known
by the custom property `mu_part`.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable
from typing import Any

import attrs
import bpy
import numpy as np

from ...design.anchors import Window, windows
from ...design.body import Body
from ...design.parameters import Unit
from ...design.solid import Solid
from ...errors import InputError, MuError
from ..body import state as bodies
from ..path import ranking
from ..preview import materials, nodes, skeletons
from ..shared import updates
from ..shared.compat import set_modifier_input
from ..shared.texts import error_text
from ..steps import state as stack
from .properties import from_unit, to_unit

PART = "mu_part"
MOTION = "mu_motion"
"""Marks the parts that show a study's motion, see `results.motion`."""
EVIDENCE = "mu_evidence_part"
"""Marks the parts that show measured motion, see `evidence.motion`."""
CHECK = "mu_check"
"""Marks the objects that show what a print check found, see `printing.marks`."""
LEGEND = "mu_legend"
"""Marks the objects of a legend in the scene, see `results.legend_object`."""
TWIN = "mu_twin"
"""Marks the parts that move as the real unit does, see `sensor.twin`."""
CANDIDATE = "candidate:"
FREE = "free"
"""The best path of the whole lattice, where a study has looked for it."""
SOLID = "solid"


def roots() -> list[Any]:
    """Root objects of all units in the file."""
    return [o for o in bpy.data.objects if o.mu_unit.uuid]


def root_of(obj: Any) -> Any | None:
    """The root that an object is or belongs to, or None."""
    while obj is not None:
        if obj.mu_unit.uuid:
            return obj
        obj = obj.parent
    return None


def active_root(context: Any) -> Any | None:
    """The unit to work on: that of the active object, or the only one there is."""
    found = root_of(context.object)
    if found is None:
        every = [o for o in context.scene.objects if o.mu_unit.uuid]
        found = every[0] if len(every) == 1 else None
    return found


def by_uuid(name: str) -> Any | None:
    """The root of that UUID, or None where it was deleted."""
    return next((o for o in roots() if o.mu_unit.uuid == name), None)


def part(root: Any, name: str) -> Any | None:
    """The root's part of that name, or None."""
    return next((child for child in root.children if child.get(PART) == name), None)


def create(context: Any, unit: Unit) -> Any:
    """A new unit at the 3D cursor of the scene, with its preview, selected and active."""
    root = new_root(context, "Monolithic Unit", unit.dimensions.cell)
    with updates.paused():
        root.mu_unit.uuid = uuid.uuid4().hex
        stack.fill(root.mu_unit)
        from_unit(root.mu_unit, unit)
    rebuild(root)
    make_active(context, root)
    return root


def new_root(context: Any, title: str, size: float) -> Any:
    """A root object, to hold parameters and parts, at the scene's 3D cursor; size in mm of its axes."""
    root = bpy.data.objects.new(title, None)
    root.empty_display_type = "ARROWS"
    root.empty_display_size = size
    context.collection.objects.link(root)
    root.location = context.scene.cursor.location
    return root


def make_active(context: Any, obj: Any) -> None:
    """Select an object, alone, and make it the active one."""
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


def delete(root: Any) -> None:
    """Remove a unit with all its parts."""
    for child in root.children_recursive:
        if any(child.get(mark) for mark in (PART, MOTION, EVIDENCE, CHECK, TWIN, LEGEND)):
            remove_part(child)
    bpy.data.objects.remove(root)


def remove_part(obj: Any) -> None:
    """Remove a part and, where nothing else uses it, its mesh or text."""
    data = obj.data
    bpy.data.objects.remove(obj)
    if data is not None and not data.users:
        (bpy.data.curves if isinstance(data, bpy.types.Curve) else bpy.data.meshes).remove(data)


def chosen_window(root: Any, unit: Unit) -> Window | None:
    """The window of the chosen sensor path; None without one, where it is muted, or unknown to the unit."""
    if "path" in stack.muted(root.mu_unit):
        return None
    return next((w for w in windows(unit.dimensions.count) if w.name == root.mu_unit.path), None)


def behind(root: Any) -> bool:
    """Whether the preview was built from other parameters than the root now has."""
    return bool(root.mu_unit.built != _fingerprint(root))


def rebuild(root: Any) -> bool:
    """Build the preview from the parameters; where they break a rule the last good one stays."""
    props = root.mu_unit
    _own_uuid(root)
    with updates.paused():
        stack.fill(props)
    try:
        unit = to_unit(props)
        _draw(root, unit)
        trouble = ""
    except MuError as error:
        trouble = error_text(error)
    if props.trouble != trouble:
        props.trouble = trouble
    props.built = _fingerprint(root)
    return not trouble


def _own_uuid(root: Any) -> None:
    """A duplicate carries its original's UUID: the later of the two, by name, becomes a unit of its own."""
    same = sorted(o.name for o in roots() if o.mu_unit.uuid == root.mu_unit.uuid)
    if len(same) > 1 and same[0] != root.name:
        root.mu_unit.uuid = uuid.uuid4().hex
        root.mu_unit.study.folder = ""


def _fingerprint(root: Any) -> str:
    """Text that differs whenever the preview would."""
    props = root.mu_unit
    try:
        unit = to_unit(props)
    except InputError as error:
        return error.what
    steps = "".join(f"{entry.name}{entry.muted:d}{entry.shown:d}" for entry in props.stack)
    known = (ranking.ranked(root), ranking.free(root)) if props.candidates else ()
    shown = unit.hash(), props.path, props.cut, props.candidates, steps, bodies.fingerprint(root), known
    return "|".join(map(str, shown))


def _draw(root: Any, unit: Unit) -> None:
    props = root.mu_unit
    given = stack.given(root, unit)
    shown = [entry.name for entry in props.stack if entry.shown]
    shapes = {}
    try:
        for step in shown:
            if step in DRAWN:
                name, draw = DRAWN[step]
                skeleton = draw(stack.STACK.value(step, given), given, props.cut)
                if skeleton is not None:
                    shapes[name] = skeleton
        if props.candidates:
            paths = skeletons.candidates(unit)
            shapes |= {CANDIDATE + name: skeleton for name, skeleton in paths.items()}
            free = ranking.free(root)
            if free is not None:
                name, _, points = free
                shapes[FREE] = skeletons.free_path(points, name, unit.dimensions.cell)
    finally:
        for name, skeleton in shapes.items():
            _put(root, name, skeleton)
        tubes = {n.removeprefix(CANDIDATE): part(root, n) for n in shapes if n.startswith(CANDIDATE)}
        ranking.colour_and_label(root, tubes)
        for child in list(root.children):
            name = child.get(PART)
            if name not in (None, SOLID, *bodies.PARTS, *shapes):
                remove_part(child)
    show_parts(root)


DRAWN: dict[str, tuple[str, Callable[[Any, Any, bool], skeletons.Skeleton | None]]] = {
    "profile": ("profile", lambda value, given, cut: skeletons.outline(value)),
    "chambers": ("chambers", lambda value, given, cut: skeletons.cavity(value, cut)),
    "membranes": ("actuator", lambda value, given, cut: skeletons.actuator(value, cut)),
    "cells": ("cells", lambda value, given, cut: skeletons.boxes(value)),
    "trim": ("trim", lambda value, given, cut: skeletons.lines(value, cut)),
    "struts": ("lattice", lambda value, given, cut: skeletons.lattice(value, cut)),
    "anchors": (
        "anchors",
        lambda value, given, cut: skeletons.anchor_skeleton(value, stack.STACK.value("struts", given)),
    ),
    "path": ("path", lambda value, given, cut: skeletons.line_through(value)),
    "wells": ("waveguide", lambda value, given, cut: skeletons.bar(value)),
}
"""The part that a step's value becomes, and how it is drawn: from the value, what was given, the cut."""

_LOOKS = {
    "actuator": ("Actuator", ("MU Membrane", "MU Section"), ""),
    "lattice": ("Lattice", ("MU Lattice",), "MU Tubes"),
    "anchors": ("Anchors", ("MU Anchors",), "MU Balls"),
    "waveguide": ("Waveguide", ("MU Waveguide", "MU Wells"), ""),
    "profile": ("Profile", ("MU Membrane",), ""),
    "chambers": ("Chambers", ("MU Section",), ""),
    "cells": ("Cells", ("MU Lattice",), ""),
    "trim": ("Strut Axes", ("MU Lattice",), ""),
    "path": ("Path", ("MU Waveguide",), ""),
    FREE: ("Free Path", ("MU Waveguide",), "MU Labelled Tube"),
    bodies.ENVELOPE: ("Envelope", ("MU Lattice",), ""),
    bodies.FLAWS: ("Flaws", ("MU Flaws",), "MU Balls"),
    SOLID: ("Solid", ("MU Solid",), ""),
}


def _put(root: Any, name: str, skeleton: skeletons.Skeleton) -> None:
    title, colours, group = _LOOKS.get(
        name, (name.removeprefix(CANDIDATE), ("MU Candidate",), "MU Labelled Tube")
    )
    obj = part(root, name) or _new_part(root, name, title)
    if obj.mode == "EDIT":
        return
    if obj.data.users > 1:  # a linked duplicate's
        obj.data = bpy.data.meshes.new(title)
    skeletons.write(obj.data, skeleton, smooth=name != "waveguide")
    materials.assign(obj.data, *colours)
    if name.startswith(CANDIDATE):
        chosen = name == CANDIDATE + root.mu_unit.path
        obj.data.materials[0] = materials.material("MU Waveguide" if chosen else "MU Candidate")
    _skin(obj, group, skeleton)


def draw_part(obj: Any, name: str, skeleton: skeletons.Skeleton) -> None:
    """Draw a skeleton as the part of that name looks, on any object with a mesh of its own."""
    _, colours, group = _LOOKS[name]
    skeletons.write(obj.data, skeleton, smooth=name != "waveguide")
    materials.assign(obj.data, *colours)
    _skin(obj, group, skeleton)


def _skin(obj: Any, group: str, skeleton: skeletons.Skeleton) -> None:
    if not skeleton.attributes:
        obj.modifiers.clear()  # struts without thickness stay lines
    elif group:
        modifier = nodes.skin(obj, group)
        for socket, value in {"Material": obj.data.materials[0], **skeleton.inputs}.items():
            set_modifier_input(modifier, socket, value)


def _new_part(root: Any, name: str, title: str) -> Any:
    obj = bpy.data.objects.new(title, bpy.data.meshes.new(title))
    obj[PART] = name
    for collection in root.users_collection:
        collection.objects.link(obj)
    obj.parent = root
    # Parts follow their root; moved by hand they would no longer show the unit.
    obj.lock_location = obj.lock_rotation = obj.lock_scale = (True, True, True)
    return obj


def put_solid(root: Any, solid: Any, unit: Unit) -> Any:
    """Make the core's printable solid the root's part `solid`, with its gates and what it was built from."""
    obj = part(root, SOLID) or _new_part(root, SOLID, "Solid")
    skeleton = skeletons.Skeleton(solid.vertices, faces=(solid.triangles,))
    skeletons.write(obj.data, skeleton)
    materials.assign(obj.data, "MU Solid")
    obj["mu_unit_hash"] = unit.hash()
    obj["mu_path"] = solid.window.name if solid.window else ""
    obj["mu_body"] = bodies.fingerprint(root)
    obj["mu_quality"] = solid.quality
    obj["mu_gates"] = json.dumps(attrs.asdict(solid.gates))
    with updates.paused():
        root.mu_unit.show = SOLID
    show_parts(root)
    return obj


def solid_is_current(root: Any, obj: Any) -> bool:
    """Whether the solid was built from the parameters, the path and the body that the root has now."""
    try:
        unit = to_unit(root.mu_unit)
    except InputError:
        return False
    window = chosen_window(root, unit)
    now = unit.hash(), window.name if window else "", bodies.fingerprint(root)
    return now == (obj["mu_unit_hash"], obj["mu_path"], obj.get("mu_body", ""))


def solid_of(root: Any, unit: Unit, quality: str = "interactive") -> Solid:
    """The printable solid of a unit in the scene; raises InputError and GateError."""
    solid: Solid = stack.STACK.value("solid", stack.given(root, unit, quality))
    return solid


def put_envelope(root: Any, body: Body) -> Any:
    """Keep a body of the user's as the unit's envelope: a wire, hidden, since the lattice shows it."""
    obj = part(root, bodies.ENVELOPE) or _new_part(root, bodies.ENVELOPE, body.name)
    skeletons.write(obj.data, skeletons.Skeleton(body.vertices, faces=(body.triangles,)), smooth=False)
    obj.display_type = "WIRE"
    obj.hide_render = True
    obj.hide_set(True)
    return obj


def remove_bodies(root: Any) -> None:
    """Take the user's envelope out of the unit, and the marks of flaws."""
    for child in list(root.children):
        if child.get(PART, "") in bodies.PARTS:
            remove_part(child)


def mark(root: Any, places: list[Any]) -> None:
    """Put a red ball at every place (3,) in mm of the unit's frame, in place of those that were there."""
    old = part(root, bodies.FLAWS)
    if old is not None:
        remove_part(old)
    if len(places):
        radius = np.full(len(places), 0.08 * to_unit(root.mu_unit).dimensions.cell)
        _put(root, bodies.FLAWS, skeletons.Skeleton(np.array(places), attributes={"radius": radius}))
        part(root, bodies.FLAWS).show_in_front = True


def show_parts(root: Any) -> None:
    """Show preview or solid, as the root says; without a solid, the preview."""
    solid = part(root, SOLID)
    whole = root.mu_unit.show == SOLID and solid is not None
    for child in root.children:
        name = child.get(PART)
        if name is None or name.startswith(CANDIDATE):
            continue
        hidden = whole != (name == SOLID)
        if child.hide_viewport != hidden:
            child.hide_viewport = child.hide_render = hidden
