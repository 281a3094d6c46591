"""A unit in the scene: one mesh object that holds its parameters, and a mesh that is rebuilt from them.

Its mesh is the preview or, where the user wants to see that, the printable solid; both are kept by pointers
of its properties, with the user's own envelope. The object is found by its UUID, since undo deletes and
restores objects.
"""

from __future__ import annotations

import json
import uuid
from typing import Any

import attrs
import bpy

from ...design.anchors import Window, windows
from ...design.parameters import Unit
from ...errors import InputError, MuError
from ..preview import materials, nodes, skeletons
from ..preview.nodes import unit as unit_group
from ..shared import displays, scene_units, updates, viewports
from ..shared.compat import set_modifier_input
from . import broken, drawing, envelope, stack
from .properties import from_unit, shape_hash, to_unit

SOLID, RESULT = "solid", "result"
REBUILT = updates.Signal()
"""Sent with a unit whose preview was rebuilt: its parameters may have changed."""
PREVIEW_DRAWN = updates.Signal()
"""Sent with a unit while its preview is drawn: what is drawn beside it follows; may raise MuError."""
DRAWN_BESIDE = updates.Signal()
"""Asked with a unit: what is drawn beside it at present, a text or value that differs whenever that would."""


def roots() -> list[Any]:
    """All units of this file, without those of linked libraries."""
    return [o for o in bpy.data.objects if o.mu_unit.uuid and displays.editable(o)]


def root_of(obj: Any) -> Any | None:
    """The unit that an object is or belongs to, or None."""
    found = displays.root_above(obj)
    return found if found is not None and found.mu_unit.uuid else None


def active_object(context: Any) -> Any | None:
    """Active object, or None, also without a window: while a file loads."""
    return getattr(context, "object", None)


def active_root(context: Any) -> Any | None:
    """Unit to work on: that of the active object, or the only one if no gripper is active."""
    found = displays.root_above(active_object(context))
    if found is not None:
        return found if found.mu_unit.uuid else None
    every = [o for o in context.scene.objects if o.mu_unit.uuid]
    return every[0] if len(every) == 1 else None


def first_that(context: Any, shows: Any) -> Any | None:
    """The active unit, or else another one, of which `shows` is true; None without any."""
    active = active_root(context)
    every = [active, *(root for root in roots() if root != active)]
    return next((root for root in every if root is not None and shows(root)), None)


def by_uuid(name: str) -> Any | None:
    """The unit of that UUID, or None where it was deleted."""
    return next((o for o in roots() if o.mu_unit.uuid == name), None)


def create(context: Any, unit: Unit) -> Any:
    """A new unit at the 3D cursor of the scene, with its preview, selected and active."""
    root = new_root(context, unit.name)
    with updates.paused():
        root.mu_unit.uuid = uuid.uuid4().hex
        stack.fill(root.mu_unit)
        from_unit(root.mu_unit, unit)
    rebuild(root)
    make_active(context, root)
    return root


def new_root(context: Any, title: str) -> Any:
    """A root object, to hold parameters and a mesh in mm, in its true size at the scene's 3D cursor."""
    viewports.object_mode(context)
    root = bpy.data.objects.new(title, bpy.data.meshes.new(title))
    context.collection.objects.link(root)
    root.location = context.scene.cursor.location
    root.scale = (scene_units.mm(context.scene),) * 3
    # Its size is the design's: scaled by hand it would differ from the simulated unit.
    root.lock_scale = (True, True, True)
    return root


def take(root: Any, unit: Unit) -> bool:
    """Give a unit other parameters; return as `rebuild` does."""
    with updates.paused():
        from_unit(root.mu_unit, unit)
    return rebuild(root)


def make_active(context: Any, obj: Any) -> None:
    """Select an object, alone, and make it the active one."""
    viewports.select(context, [obj], obj)


def delete(root: Any) -> None:
    """Remove a unit with its displays; the user's children are kept."""
    displays.remove_root(root, root.mu_unit.preview, root.mu_unit.solid, root.mu_unit.envelope)


def chosen_window(root: Any, unit: Unit) -> Window | None:
    """Window of the chosen sensor path; None without one, if it is muted, or unknown to the unit."""
    if "path" in stack.muted(root.mu_unit):
        return None
    return next((w for w in windows(unit.dimensions.count) if w.name == root.mu_unit.path), None)


def behind(root: Any) -> bool:
    """Return True if the preview was built from other parameters than the unit now has."""
    return bool(root.mu_unit.built != _fingerprint(root))


def rebuild(root: Any) -> bool:
    """Build the preview from the parameters; if they break a rule the last valid one stays."""
    props = root.mu_unit
    if root.mode == "EDIT":
        return not props.trouble
    with updates.paused():
        stack.fill(props)
    try:
        unit = to_unit(props)
        _draw(root, unit)
        broken.keep(root, unit)
        trouble = ""
    except MuError as error:
        trouble = broken.words(error)
    if props.trouble != trouble:
        props.trouble = trouble
    props.built = _fingerprint(root)
    REBUILT.send(root)
    return not trouble


def _fingerprint(root: Any) -> str:
    """Text that differs whenever the preview would."""
    props = root.mu_unit
    try:
        unit = to_unit(props)
    except InputError as error:
        return error.what
    steps = "".join(f"{entry.name}{entry.muted:d}{entry.shown:d}" for entry in props.stack)
    shown = shape_hash(unit), props.path, props.cut, props.candidates, steps, envelope.fingerprint(root)
    return "|".join(map(str, (*shown, *DRAWN_BESIDE.answers(root))))


def _draw(root: Any, unit: Unit) -> None:
    props = root.mu_unit
    given = stack.given(root, unit)
    drawn = drawing.shapes(given, [entry.name for entry in props.stack if entry.shown], props.cut)
    separate(root)
    drawing.write(root, props.preview, drawn)
    PREVIEW_DRAWN.send(root)
    show(root)


def separate(root: Any) -> None:
    """Give a unit a separate preview, which no duplicate shares."""
    props = root.mu_unit
    if props.preview is None and props.solid != root.data:
        props.preview = root.data
    others = [m for o in roots() if o != root for m in (o.data, o.mu_unit.preview)]
    mesh = drawing.own_mesh(root, props.preview, others)
    if mesh != props.preview:
        props.preview = mesh
        show(root)


def show(root: Any) -> None:
    """Show preview, solid or result by the unit's properties; if that is missing, the preview."""
    props = root.mu_unit
    if root.mode == "EDIT" or props.preview is None:
        return
    mesh, old = props.preview, root.data
    if props.show == SOLID and props.solid is not None:
        mesh = props.solid
    if old != mesh:
        root.data = mesh
        if old is not None and not old.users and old.library is None:
            bpy.data.meshes.remove(old)
    modifier = nodes.skin(root, unit_group.NAME)
    skinned = mesh == props.preview
    if modifier.show_viewport != skinned:
        modifier.show_viewport = modifier.show_render = skinned
    for name, part in zip(unit_group.RESULTS, [*in_place(root), None, None], strict=False):
        set_modifier_input(modifier, name, part)


def in_place(root: Any) -> list[Any]:
    """Objects that a unit shows in place of its design: a study's motion, or its shape bent live."""
    props = root.mu_unit
    if props.show == RESULT:
        return displays.on_unit(root)
    # Candidates lie on the unit at rest.
    at_rest = props.candidates or (props.show == SOLID and props.solid is not None)
    return [] if at_rest else displays.on_unit(root, displays.LIVE)


def hide_candidates(root: Any) -> None:
    """Hide the candidate paths; setting an unchanged property would draw the whole unit again."""
    if root.mu_unit.candidates:
        root.mu_unit.candidates = False


def shows_result(root: Any) -> bool:
    """Return True if the motion of a study is shown in the unit's place."""
    return root.mu_unit.show == RESULT and bool(displays.on_unit(root))


def put_solid(root: Any, solid: Any, unit: Unit) -> Any:
    """Store the core's printable solid as a mesh of the unit, with its gates and its inputs."""
    old = root.mu_unit.solid
    mesh = bpy.data.meshes.new(f"{root.name} solid")
    skeletons.write(mesh, skeletons.Skeleton(solid.vertices, faces=(solid.triangles,)))
    materials.assign(mesh, "MU Solid")
    mesh["mu_unit_hash"], mesh["mu_path"], mesh["mu_body"] = _of_solid(root, unit, solid.window)
    mesh["mu_quality"] = solid.quality
    mesh["mu_gates"] = json.dumps(attrs.asdict(solid.gates))
    # A shown one is removed by `show`, after which its users must not be read.
    beside = old if old != root.data else None
    with updates.paused():
        root.mu_unit.solid, root.mu_unit.show = mesh, SOLID
    show(root)
    if beside is not None and not beside.users:
        bpy.data.meshes.remove(beside)
    return mesh


def solid_is_current(root: Any) -> bool:
    """Return True if there is a solid of the unit's present parameters, path and body."""
    mesh = root.mu_unit.solid
    if mesh is None:
        return False
    try:
        unit = to_unit(root.mu_unit)
    except InputError:
        return False
    made_of = mesh["mu_unit_hash"], mesh["mu_path"], mesh["mu_body"]
    return made_of == _of_solid(root, unit, chosen_window(root, unit))


def _of_solid(root: Any, unit: Unit, window: Window | None) -> tuple[str, str, str]:
    """What a solid is made of: hash of the unit, path of its waveguide, and the user's body."""
    return shape_hash(unit), window.name if window else "", envelope.fingerprint(root)
