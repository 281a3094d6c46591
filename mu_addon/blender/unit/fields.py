"""Blender properties of the core's parameters, and what a panel shows of a length: its true one."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import textwrap
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...design.nearest import tied
from ...design.quantity import Description, describe
from ..shared import scene_units, updates
from ..shared.texts import sentence

UNITS = ("mm", "kPa", "s")


def exact(value: float) -> float:
    """The shortest decimal number that Blender's single precision stands for: 0.9 for 0.8999999762."""
    return float(str(np.float32(value)))


_NAMES = {
    "count": "Chambers",
    "bladder_diameter_mm": "Bladder Ø",
    "neck_diameter_mm": "Neck Ø",
    "row": "Anchor Row",
    "cells_y_minus": "Cells -Y",
    "cells_y_plus": "Cells +Y",
    "allow_symmetric": "Allow Symmetry",
    "minus_y": "-Y Side",
    "plus_y": "+Y Side",
    "beside_x": "X Sides",
}
"""Parameters whose own names say too little beside a field, or are too long for it."""


def label(d: Description) -> str:
    """Name of a parameter for a panel: `junction_diameter_mm` becomes "Junction Diameter"."""
    if d.name in _NAMES:
        return _NAMES[d.name]
    words = d.name.split("_")
    unit = words.pop() if words[-1] in UNITS else ""
    text = " ".join(word if word.isupper() else word.capitalize() for word in words)
    return f"{text} ({unit})" if unit and unit != "mm" else text


def tooltip(d: Description) -> str:
    """What a parameter is, its bounds and where its value comes from; Blender adds the last full stop."""
    allowed = f". {d.allowed} {d.unit}".rstrip() if d.allowed else ""
    fixed = ". The same at every scale" if d.fixed else ""
    return f"{sentence(d.text)}{allowed}{fixed}.\nSource: {d.source}"


def blender_property(d: Description, update=None, options=frozenset()):
    """The Blender property of one parameter."""
    shared = {
        "name": label(d),
        "description": tooltip(d),
        "update": update,
        "options": {"ANIMATABLE", *options},
    }
    if d.choices:
        items = [
            (name, name.replace("-", " ").capitalize(), textwrap.shorten(d.text, 60)) for name in d.choices
        ]
        return EnumProperty(items=items, default=d.default, **shared)
    if d.type is str:
        return StringProperty(default=d.default, **shared)
    if d.type is bool:
        return BoolProperty(default=d.default, **shared)
    if d.type is int:
        return IntProperty(default=d.default, min=int(d.low), max=int(d.high), **shared)
    length = {"subtype": "DISTANCE"} if d.unit == "mm" else {}
    return FloatProperty(
        default=d.default,
        min=d.low,
        max=d.high,
        precision=3 if d.high < 1000 else 1,
        step=step_of(d.high),
        **length,
        **shared,
    )


def step_of(high_mm: float) -> int:
    """Hundredths of a millimetre by which a drag of one pixel changes a length of up to so many mm."""
    return 10 if high_mm > 20 else 1


def true_lengths(name: str, title: str, text: str, scales: bool, step: float) -> dict[str, Any]:
    """Two fields for the length `name`, in mm at scale 1 where it `scales`: as it is, in the scene's unit.

    Typed or dragged, each sets that length, within its bounds. Blender shows fields of lengths in the unit of
    the scene, and of numbers in Blender units; so these are in those. A drag goes by steps that a field has
    for good, hundredths of a Blender unit: `step` in one field, a thousandth of it in the other, which
    Blender rounds to 1 mm in a scene of metres.
    """

    def read(group) -> float:
        return exact(getattr(group, name)) * in_scene(group.id_data.mu_unit, scales)

    def write(group, value: float) -> None:
        setattr(group, name, exact(value / in_scene(group.id_data.mu_unit, scales)))

    shared = {"name": title, "description": text, "get": read, "set": write, "options": {"SKIP_SAVE"}}
    return {name + end: distance(step, end, **shared) for end in (TRUE, FINE)}


def distance(step: float, end: str, **shared):
    """A property in Blender units, for names that end so."""
    return FloatProperty(
        subtype="DISTANCE", precision=6, step=step * (1e-3 if end == FINE else 1.0), **shared
    )


def in_scene(unit, scales: bool) -> float:
    """Blender units of the scene in a millimetre of a parameter of a unit."""
    return scene_units.mm(bpy.context.scene) * (exact(unit.scale) if scales else 1.0)


def shown_value(group, d: Description, value: float) -> str:
    """A value of a parameter in words: a length as it is at the unit's scale."""
    if d.unit != "mm":
        return f"{value:.6g}"
    scale = 1.0 if d.fixed else exact(group.id_data.mu_unit.scale)
    return scene_units.length(bpy.context.scene, value * scale, digits=6)


TRUE, FINE = "_true", "_true_fine"
"""What the names of the two fields of `true_lengths` end with."""


def true_end(scene) -> str:
    """Which of the two is dragged by small steps in a scene: the fine one where a Blender unit is a metre."""
    return FINE if scene_units.mm(scene) < 0.05 else TRUE


def field(group, d: Description) -> str:
    """Name of the property that a panel shows of a parameter: itself, or its true length where it differs."""
    if d.unit != "mm":
        return d.name
    scaled = not d.fixed and group.id_data.mu_unit.scale != 1.0
    scene = bpy.context.scene
    return d.name + true_end(scene) if scaled or not scene_units.in_millimetres(scene) else d.name


def _tied_update(name: str, changed):
    """The update of a parameter that is tied to another one: both change as one."""

    def update(group, context):
        if not updates.are_paused():
            with updates.paused():
                for other, value in tied({name: exact(getattr(group, name))}).items():
                    if other != name:
                        setattr(group, other, value)
        changed(group, context)

    return update


def generated_fields(section: type, changed) -> dict[str, Any]:
    """Blender properties of every parameter of a section, and of every length as it is."""
    annotations = {}
    for d in describe(section):
        update = _tied_update(d.name, changed) if len(tied({d.name: 0.0})) > 1 else changed
        annotations[d.name] = blender_property(d, update)
        if d.unit == "mm":
            annotations |= true_lengths(d.name, label(d), tooltip(d), not d.fixed, step_of(d.high))
    return annotations
