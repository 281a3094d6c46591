"""A layer of the print in the 3D view: a section of the solid, and its enclosed areas in another colour."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...design.printing.slices import Layers
from ...design.solid import chamber
from ...errors import InputError, MuError
from ..preview import materials, skeletons
from ..shared import displays
from ..unit import envelope
from ..unit import object as unit_object
from ..unit.properties import to_unit

MATERIALS = ("MU Layer", "MU Enclosed")
FACTS = ("height_mm", "whole_mm", "area_mm2", "enclosed_mm2")

# The last sliced solid: slicing it again takes milliseconds, making it a second.
_kept: dict[tuple[Any, ...], Layers] = {}


def layer_object(root: Any) -> Any | None:
    """The object that shows a layer of a unit, or None."""
    return displays.part(root, displays.LAYER, "1")


def facts(shown: Any) -> dict[str, float]:
    """Height of the layer shown and of the whole in mm, and the layer's areas in mm2."""
    return {name: float(shown[name]) for name in FACTS}


def put(root: Any) -> Any:
    """Show the set layer, replacing the shown one; raises MuError without a solid."""
    shown = layer_object(root)
    if shown is None:
        shown = displays.lock(displays.add(root, displays.LAYER, "1", bpy.data.meshes.new("Layer"), "Layer"))
        shown.hide_render = True
        # In front of the part, which would hide a section of itself.
        shown.show_in_front = True
    _draw(root, shown)
    return shown


def follow(root: Any) -> None:
    """Redraw the shown layer, after the height or the build direction changed."""
    shown = layer_object(root)
    if shown is not None and unit_object.solid_is_current(root):
        _draw(root, shown)


def clear(root: Any) -> None:
    """Remove the layer from the scene."""
    shown = layer_object(root)
    if shown is not None:
        displays.remove(shown)


def _draw(root: Any, shown: Any) -> None:
    settings = root.mu_print
    try:
        layers = _layers(root, settings.up)
    except MuError:
        shown.data.clear_geometry()
        raise
    # A plane at either end only touches the part: half a layer within it there is a section.
    height = float(np.clip(settings.layer * layers.height_mm, 1e-3, layers.height_mm - 1e-3))
    found = layers.filled(height)
    slots = np.repeat([0, 1], [len(found.material), len(found.enclosed)])
    skeletons.write(
        shown.data,
        skeletons.Skeleton(
            found.vertices,
            faces=(np.concatenate([found.material, found.enclosed]),),
            slots=slots,
            smooth=False,
        ),
    )
    if not shown.data.materials:
        for name in MATERIALS:
            shown.data.materials.append(materials.unlit(name))
    values = height, layers.height_mm, found.area_mm2, found.enclosed_mm2
    for name, value in zip(FACTS, values, strict=True):
        shown[name] = value


def _layers(root: Any, up: Any) -> Layers:
    if Vector(up).length < 1e-3:
        raise InputError("Up is not a direction", "Print", "give three numbers, such as 0 0 1")
    mesh = root.mu_unit.solid
    # An earlier solid may have had another chamber.
    is_current = unit_object.solid_is_current(root)
    key = (
        is_current,
        mesh.name,
        *(mesh[f"mu_{name}"] for name in ("unit_hash", "path", "quality", "body")),
        len(mesh.polygons),
        *up,
    )
    if key not in _kept:
        _kept.clear()
        within = chamber(to_unit(root.mu_unit)) if is_current else None
        _kept[key] = Layers(*envelope.arrays_in(mesh), tuple(up), within)
    return _kept[key]
