"""Repair after Blender's gestures: duplicates, deletions, hiding, collections, units.

Gestures ignore units. After each gesture this module checks all units, once, and repairs faults. It writes
nothing without a fault, so that its changes cause only one further check. Undo and redo restore states from
before a repair; the same check follows them. What it has to remember is with the objects, so that undo and
redo take it along: nothing here has to follow them.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from typing import Any

import bpy

from ...design.anchors import windows
from ..gripper import object as gripper_object
from ..path.candidates import CANDIDATE
from ..preview import nodes
from ..preview.nodes import unit as unit_group
from ..results import motion
from ..shared import displays, scene_units, updates, viewports
from ..shared.registration import connected, handler
from ..unit import broken, preview_update
from ..unit import object as unit_object

HOLDER = "mu_holder"
"""On a root: its number in this session, which undo keeps. A duplicate has that of its original."""
HIDDEN = "mu_hidden"
"""On a root: 1 if it was hidden at the last check."""
_SESSION = uuid.uuid4()
"""Names of duplicates follow from it: a redo gives them again, and no other session does."""
_looking = False


@connected(scene_units.CHANGED)
@handler("undo_post", "redo_post")
def look(*_: Any) -> None:
    """Repair the effects of the last gesture."""
    global _looking
    if _looking:
        return
    _looking = True
    try:
        roots, shown, touched, overrides = [], [], [], []
        # In a scene of thousands of objects most are neither: the distinguishing property is tested first.
        for obj in bpy.data.objects:
            if obj.get(displays.OWNER):
                found = shown
            elif obj.type == "MESH" and displays.uuid_of(obj):
                found = roots
            elif obj.mu_obstacle.unit:
                found = touched
            else:
                continue
            if displays.editable(obj):
                found.append(obj)
            elif found is roots and obj.override_library is not None:
                overrides.append(obj)
        new = {root for root in roots if not _is_known(root)}
        copies = _separate(roots)
        _follow(shown)
        _bring_into_view(new & _true_sizes([*roots, *overrides], touched))
        for root in roots:
            if root.mu_unit.show == unit_object.RESULT and not unit_object.shows_result(root):
                motion.fall_back(root)
            if root in copies or _damaged(root):
                (preview_update.schedule if root.mu_unit.uuid else gripper_object.rebuild)(root)
    finally:
        _looking = False


def own(root: Any) -> None:
    """Give a copied root an identity: a new UUID and a separate folder."""
    fresh = uuid.uuid5(_SESSION, f"{displays.uuid_of(root)} {root.session_uid}").hex
    with updates.paused():
        if root.mu_unit.uuid:
            root.mu_unit.uuid, root.mu_unit.study.folder = fresh, ""
        else:
            root.mu_gripper.uuid, root.mu_gripper.folder = fresh, ""


def _number(root: Any) -> str:
    """A root's number, of this session alone."""
    return f"{_SESSION.hex[:8]} {root.session_uid}"


def _is_known(root: Any) -> bool:
    """Return True if a root was there at an earlier check, and is no duplicate of it."""
    return bool(root.get(HOLDER) == _number(root))


def _separate(roots: list[Any]) -> list[Any]:
    """Give every duplicate an identity and a separate mesh; return the duplicates."""
    copies = []
    by_uuid: dict[str, list[Any]] = {}
    for root in roots:
        by_uuid.setdefault(displays.uuid_of(root), []).append(root)
    for same in by_uuid.values():
        first = min(same, key=lambda root: (not _is_known(root), root.name))
        for root in same:
            if root != first:
                own(root)
                if root.mu_unit.uuid:
                    unit_object.separate(root)
                copies.append(root)
            if not _is_known(root):
                root[HOLDER] = _number(root)
    return copies


def _follow(shown: list[Any]) -> None:
    """Let displays follow their root; remove those without one, and copies under another one."""
    layer = bpy.context.view_layer
    roots: dict[str, Any] = {}
    stray, own_displays = [], []
    for obj in shown:
        root = displays.root_above(obj.parent)
        if root is None or displays.uuid_of(root) != obj[displays.OWNER]:
            stray.append(obj)
            continue
        roots[displays.uuid_of(root)] = root
        own_displays.append((obj, root))
    for obj in stray:
        displays.remove(obj)
    changed = {}
    for name, root in roots.items():
        hidden = root.hide_viewport or (layer.objects.get(root.name) == root and root.hide_get())
        if bool(root.get(HIDDEN)) != hidden:
            changed[name] = root[HIDDEN] = hidden
    for obj, root in own_displays:
        if set(obj.users_collection) != set(root.users_collection):
            for collection in obj.users_collection:
                collection.objects.unlink(obj)
            for collection in root.users_collection:
                collection.objects.link(obj)
        hidden = changed.get(displays.uuid_of(root))
        if hidden is not None and layer.objects.get(obj.name) == obj:
            obj.hide_set(hidden)


def _true_sizes(roots: list[Any], touched: list[Any]) -> set[Any]:
    """Keep true sizes and positions of roots and obstacles when the scene's unit of length changes.

    A root's scale records the unit that its size is right for, an obstacle's property does; both are undone
    with the object. A scaled parent's factor is divided out. An unlocked root is left to the user. Returns
    the roots that were changed.
    """
    moved: set[Any] = set()
    for root in roots:
        own = scene_units.true_scale(root, _scene_of(root))
        if own is None or not all(root.lock_scale) or all(abs(s - own) <= 1e-5 * own for s in root.scale):
            continue
        if root.parent is None:
            root.location *= own / root.scale.x
        root.scale = (own,) * 3
        moved.add(root)
    for obj in touched:
        own, wanted = obj.mu_obstacle.mm, scene_units.mm(_scene_of(obj))
        if own and abs(own - wanted) <= 1e-6 * wanted:
            continue
        # A file of an older extension does not record the unit: the scene's is assumed.
        if own and not moved & set(_above(obj)):
            obj.location *= wanted / own
            obj.scale *= wanted / own
        obj.mu_obstacle.mm = wanted
    return moved


def _bring_into_view(arrived: set[Any]) -> None:
    """Frame what was pasted or appended from a scene of another unit of length: views are of the old size."""
    names = [displays.uuid_of(root) for root in arrived]
    if not names or bpy.app.background:
        return

    def framed() -> None:
        found = [root for root in map(displays.by_uuid, names) if root is not None]
        if found:
            viewports.frame(found)

    # A handler of an update sees the sizes before it.
    bpy.app.timers.register(framed, first_interval=0.0)


def _scene_of(obj: Any) -> Any:
    """Scene whose units an object is sized in: the one that is seen if it is there, else its own."""
    seen, own = bpy.context.scene, obj.users_scene
    return seen if seen in own or not own else own[0]


def _above(obj: Any) -> Iterator[Any]:
    """An object's parents."""
    while obj.parent is not None:
        obj = obj.parent
        yield obj


def _damaged(root: Any) -> bool:
    """Return True if a part of a unit or gripper was deleted by force, and can be rebuilt."""
    if root.mode == "EDIT" or root.data is None:
        return False
    if root.mu_gripper.uuid:
        return gripper_object.part(root, "cube") is None and not root.mu_gripper.trouble
    props, skin = root.mu_unit, bpy.data.node_groups.get(unit_group.NAME)
    if props.trouble or not props.built or props.preview is None:
        return False
    if props.preview.get("mu_points") != len(props.preview.vertices):
        return True
    if skin is None or not any(m.type == "NODES" and m.node_group == skin for m in root.modifiers):
        return True
    if not props.candidates:
        return False
    there = [child.get(displays.PART) for child in root.children]
    wanted = [CANDIDATE + window.name for window in windows(props.chambers.count)]
    return sorted(name for name in there if name in wanted) != sorted(wanted)


@handler("depsgraph_update_post")
def _after_update(scene: Any, depsgraph: Any) -> None:
    if any(depsgraph.id_type_updated(kind) for kind in ("OBJECT", "SCENE", "COLLECTION", "MESH")):
        look()


@handler("load_post")
def _after_load(*_: Any) -> None:
    broken.forget()
    look()


@handler("blend_import_post")
def _after_import(imported: Any) -> None:
    """Give appended units an identity other than in the file that they come from."""
    _size_instances({item.id for item in imported.import_items if isinstance(item.id, bpy.types.Collection)})
    objects = [item.id for item in imported.import_items if isinstance(item.id, bpy.types.Object)]
    if objects:
        groups = (item.id for item in imported.import_items)
        nodes.unite([group for group in groups if isinstance(group, bpy.types.GeometryNodeTree)])
        _without_meshes_made_objects(objects)
    if not any(displays.editable(obj) and displays.uuid_of(obj) for obj in objects):
        return
    units = []
    for obj in objects:
        if displays.editable(obj) and displays.uuid_of(obj):
            own(obj)
            if obj.mu_unit.uuid and obj.type == "MESH":
                units.append(obj)
                # Blender may reuse a mesh that it imported before.
                unit_object.separate(obj)
    look()
    preview_update.catch_up()
    for unit in units:
        unit_object.REBUILT.send(unit)


def _without_meshes_made_objects(imported: list[Any]) -> None:
    """Remove the objects that Blender makes of a unit's meshes that the unit keeps without showing them."""
    units = [obj for obj in imported if obj.mu_unit.uuid]
    kept = {m for unit in units for m in (unit.mu_unit.preview, unit.mu_unit.solid, unit.mu_unit.envelope)}
    latest = max(obj.session_uid for obj in imported)
    for obj in list(bpy.context.scene.objects):
        if obj.session_uid > latest and obj.data is not None and obj.data in kept:
            bpy.data.objects.remove(obj)


def _size_instances(collections: set[Any]) -> None:
    """Give instances of linked collections with units their true size in this scene."""
    wanted = scene_units.mm(bpy.context.scene)
    for obj in bpy.context.scene.objects:
        if obj.instance_type != "COLLECTION" or obj.instance_collection not in collections:
            continue
        roots = [o for o in obj.instance_collection.all_objects if o.type == "MESH" and displays.uuid_of(o)]
        if roots and all(roots[0].lock_scale):
            obj.scale = (wanted / roots[0].scale.x,) * 3
