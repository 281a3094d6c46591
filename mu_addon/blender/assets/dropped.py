"""Resins and printers dropped on a unit from the asset browser: they set its parameters.

A resin is a material: Blender puts it into a slot of the unit's mesh. A printer is a box of its build volume:
Blender adds it to the scene, and the nearest unit gets it. No operator may be called in a depsgraph update,
so a timer then applies their parameters to the unit, in one undo step, and removes them.
"""

from typing import Any

import bpy

from ...errors import InputError
from ...reading import parse_json
from ..preview import materials
from ..shared import displays, restoring, viewports
from ..shared.blender_property import Text
from ..shared.operators import FreeOperator, linked, operator
from ..shared.registration import handler, timer
from ..unit import drawing, resins
from ..unit import object as unit_object

RESIN, PRINTER = "mu_resin", "mu_printer"
"""On a material: parameters as JSON, by section and name. On an object: the name of a shipped printer."""


@operator(
    FreeOperator,
    "Use Dropped Asset",
    unit=Text("Unit", "UUID of the unit", options={"HIDDEN"}),
    asset=Text("Asset", "Name of the material or object", options={"HIDDEN"}),
)
def take_asset(operator, unit, asset):
    """Give a unit the resin or printer that was dropped on it"""
    root = unit_object.by_uuid(unit)
    resin, box = bpy.data.materials.get(asset), bpy.data.objects.get(asset)
    if root is None or linked(root):
        raise InputError("there is no unit to take it", asset, "drop it on a unit of this file")
    if resin is not None and resin.get(RESIN):
        resins.take(root, resin.name, parse_json(resin[RESIN], f"{resin.name}, {RESIN}"))
        _restore_slots(root)
        unit_object.rebuild(root)
        words = f"{root.name} is of {resin.name}: its wall's modulus, Poisson's ratio and law"
    elif box is not None and box.get(PRINTER):
        words = f"{root.name} is printed by {box.name}"
        root.mu_print.printer = box[PRINTER]
        _remove(box)
        unit_object.make_active(bpy.context, root)
    else:
        raise InputError(
            f"{asset!r} is neither a resin nor a printer", "assets", "drop one of this extension"
        )
    operator.report({"INFO"}, words)


def _restore_slots(root: Any) -> None:
    """Remove resins from a unit's slots, which hold the colours of its parts."""
    usual = drawing.SLOTS if root.data == root.mu_unit.preview else ()
    # Struts get their colour from nodes: after them Blender appends a slot.
    while usual and len(root.data.materials) > len(usual) and root.data.materials[-1].get(RESIN):
        root.data.materials.pop()
    for number, slot in enumerate(root.material_slots):
        if slot.material is not None and slot.material.get(RESIN):
            slot.link = "DATA"
            own = root.data.materials[number]
            if own is None or own.get(RESIN):
                name = usual[number] if number < len(usual) else "MU Solid"
                root.data.materials[number] = materials.material(name)


def _remove(box: Any) -> None:
    mesh = box.data
    bpy.data.objects.remove(box)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


def waiting() -> tuple[str, str] | None:
    """UUID of a unit and name of the asset that was dropped on it, or None."""
    resins = {m for m in bpy.data.materials if m.get(RESIN) and m.users}
    boxes = [o for o in bpy.context.scene.objects if o.get(PRINTER) and not o.asset_data]
    if not resins and not boxes:
        return None
    roots = [root for root in unit_object.roots() if root.type == "MESH" and displays.editable(root)]
    for root in roots:
        for slot in root.material_slots:
            if slot.material in resins:
                return root.mu_unit.uuid, slot.material.name
    for box in boxes:
        if roots:
            at = box.matrix_world.translation
            nearest = min(roots, key=lambda root, at=at: (root.matrix_world.translation - at).length)
            return nearest.mu_unit.uuid, box.name
    return None


def take() -> None:
    """Apply a dropped asset to its unit, with one undo step."""
    found = waiting()
    if found is not None and bpy.context.mode == "OBJECT":
        unit, asset = found
        bpy.ops.mu.take_asset("EXEC_DEFAULT", True, unit=unit, asset=asset)


@timer()
def _later() -> None:
    with viewports.in_window():
        take()


@handler("undo_post", "redo_post")
def _restored(*_: Any) -> None:
    """Remove a drop that undo restored before it was applied: the drop itself is undone, too."""
    while (found := waiting()) is not None:
        root, box = unit_object.by_uuid(found[0]), bpy.context.scene.objects.get(found[1])
        if box is not None and box.get(PRINTER):
            _remove(box)
        else:
            _restore_slots(root)


@handler("depsgraph_update_post")
def _updated(*_: Any) -> None:
    if not restoring.now() and waiting() is not None:
        _later.soon()
