"""A unit in the scene: a root object that holds its parameters, and parts that are rebuilt from them.

The root is found by its UUID, since undo deletes and restores objects; parts are the root's children, known
by the custom property `mu_part`.
"""

from __future__ import annotations

import json
import uuid
from typing import Any

import attrs
import bpy

from ..design.anchors import Window, windows
from ..design.parameters import Unit
from ..errors import InputError, MuError
from . import materials, nodes, preview
from .compat import set_modifier_input
from .live import held
from .properties import from_unit, to_unit

PART = "mu_part"
CANDIDATE = "candidate:"
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
    root = bpy.data.objects.new("Monolithic Unit", None)
    root.empty_display_type = "ARROWS"
    root.empty_display_size = unit.dimensions.cell
    context.collection.objects.link(root)
    root.location = context.scene.cursor.location
    with held():
        root.mu_unit.uuid = uuid.uuid4().hex
        from_unit(root.mu_unit, unit)
    rebuild(root)
    for other in context.selected_objects:
        other.select_set(False)
    root.select_set(True)
    context.view_layer.objects.active = root
    return root


def delete(root: Any) -> None:
    """Remove a unit with all its parts."""
    for child in list(root.children):
        if child.get(PART):
            _remove(child)
    bpy.data.objects.remove(root)


def _remove(obj: Any) -> None:
    """Remove a part and, where nothing else uses it, its mesh."""
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


def chosen_window(root: Any, unit: Unit) -> Window | None:
    """The window of the chosen sensor path; None where none is chosen or the unit has no such path."""
    return next((w for w in windows(unit.dimensions.count) if w.name == root.mu_unit.path), None)


def behind(root: Any) -> bool:
    """Whether the preview was built from other parameters than the root now has."""
    return bool(root.mu_unit.built != _fingerprint(root))


def rebuild(root: Any) -> bool:
    """Build the preview from the parameters; where they break a rule the last good one stays."""
    props = root.mu_unit
    _own_uuid(root)
    try:
        unit = to_unit(props)
        _draw(root, unit)
        trouble = ""
    except MuError as error:
        trouble = _told(error)
    if props.trouble != trouble:
        props.trouble = trouble
    props.built = _fingerprint(root)
    return not trouble


def _told(error: MuError) -> str:
    return "\n".join(text for text in (error.what, error.where, error.remedy) if text)


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
    return f"{unit.hash()}|{props.path}|{props.cut}|{props.candidates}"


def _draw(root: Any, unit: Unit) -> None:
    props, d = root.mu_unit, unit.dimensions
    window = chosen_window(root, unit)
    shapes = {
        "actuator": preview.actuator(d, props.cut),
        "lattice": preview.lattice(d, props.cut),
        "anchors": preview.anchor_points(unit),
    }
    try:
        if props.candidates:
            paths = preview.candidates(unit)
            shapes |= {CANDIDATE + name: skeleton for name, skeleton in paths.items()}
        if window is not None:
            shapes["waveguide"] = preview.bar(unit, window)
    finally:
        for name, skeleton in shapes.items():
            _put(root, name, skeleton)
        for child in list(root.children):
            if child.get(PART) not in (None, SOLID, *shapes):
                _remove(child)
    show_parts(root)


_LOOKS = {
    "actuator": ("Actuator", ("MU Membrane", "MU Section"), ""),
    "lattice": ("Lattice", ("MU Lattice",), "MU Tubes"),
    "anchors": ("Anchors", ("MU Anchors",), "MU Balls"),
    "waveguide": ("Waveguide", ("MU Waveguide", "MU Wells"), ""),
    SOLID: ("Solid", ("MU Solid",), ""),
}


def _put(root: Any, name: str, skeleton: preview.Skeleton) -> None:
    title, colours, group = _LOOKS.get(
        name, (name.removeprefix(CANDIDATE), ("MU Candidate",), "MU Labelled Tube")
    )
    obj = part(root, name) or _new_part(root, name, title)
    if obj.mode == "EDIT":
        return
    if obj.data.users > 1:  # a linked duplicate's
        obj.data = bpy.data.meshes.new(title)
    preview.write(obj.data, skeleton, smooth=name != "waveguide")
    materials.assign(obj.data, *colours)
    if name.startswith(CANDIDATE):
        chosen = name == CANDIDATE + root.mu_unit.path
        obj.data.materials[0] = materials.material("MU Waveguide" if chosen else "MU Candidate")
    if group:
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
    skeleton = preview.Skeleton(solid.vertices, faces=(solid.triangles,))
    preview.write(obj.data, skeleton)
    materials.assign(obj.data, "MU Solid")
    obj["mu_unit_hash"] = unit.hash()
    obj["mu_path"] = solid.window.name if solid.window else ""
    obj["mu_quality"] = solid.quality
    obj["mu_gates"] = json.dumps(attrs.asdict(solid.gates))
    with held():
        root.mu_unit.show = SOLID
    show_parts(root)
    return obj


def solid_is_current(root: Any, obj: Any) -> bool:
    """Whether the solid was built from the parameters and the path that the root has now."""
    try:
        unit = to_unit(root.mu_unit)
    except InputError:
        return False
    window = chosen_window(root, unit)
    return bool(obj["mu_unit_hash"] == unit.hash() and obj["mu_path"] == (window.name if window else ""))


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
