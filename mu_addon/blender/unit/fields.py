"""Blender properties of the core's parameters; panels show the true length in mm.

Blender shows and drags a field of the subtype DISTANCE in the unit of the scene, in steps of a hundredth of
that: 0.0009 m in its start-up scene. Lengths of lenses are in millimetres in every scene, and accept other
metric units when typed; fields of lengths here use that subtype.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import textwrap
from typing import Any

import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...design.quantity import Description, describe
from ...design.repairs import tied
from ..shared import updates

UNITS = ("mm", "kPa", "s")
MILLIMETRES = "DISTANCE_CAMERA"
"""Subtype of a property that is in millimetres in any scene."""
MOST_INT = 2**31 - 1
"""The largest whole number of a property in Blender."""


def exact(value: float) -> float:
    """Shortest decimal number for a value in Blender's single precision: 0.9 for 0.8999999762."""
    return float(str(np.float32(value)))


_NAMES = {
    "count": "Chambers",
    "bladder_diameter_mm": "Bladder Ø",
    "neck_diameter_mm": "Neck Ø",
    "inlet_diameter_mm": "Inlet Ø",
    "junction_diameter_mm": "Junction Ø",
    "midspan_diameter_mm": "Midspan Ø",
    "row": "Anchor Row",
    "cells_y_minus": "Cells -Y",
    "cells_y_plus": "Cells +Y",
    "allow_symmetric": "Allow Symmetry",
    "minus_y": "-Y Side",
    "plus_y": "+Y Side",
    "beside_x": "X Sides",
    "lattice_modulus_kPa": "Lattice E (kPa)",
    "membrane_modulus_kPa": "Wall E (kPa)",
    "membrane_poisson": "Wall Poisson",
    "sensor_modulus_kPa": "Sensor E (kPa)",
    "elongation_at_break": "Break Strain",
    "offset_xy_mm": "Offset XY",
}
"""Parameters whose own names are too vague beside a field, or too long for it."""


def label(d: Description) -> str:
    """Name of a parameter for a panel: `tip_cap_mm` becomes "Tip Cap"."""
    if d.name in _NAMES:
        return _NAMES[d.name]
    words = d.name.split("_")
    unit = words.pop() if words[-1] in UNITS else ""
    text = " ".join(word if word.isupper() else word.capitalize() for word in words)
    return f"{text} ({unit})" if unit and unit != "mm" else text


def tooltip(d: Description) -> str:
    """Description, bounds and source of a parameter; Blender adds the last full stop."""
    allowed = f". {d.allowed} {d.unit}".rstrip() if d.allowed else ""
    fixed = ". The same at every scale" if d.fixed else ""
    source = f".\nSource: {d.source}" if d.source else ""
    return f"{sentence(d.text)}{allowed}{fixed}{source}"


def blender_property(d: Description, update=None, options=frozenset(), name="", **more):
    """The Blender property of one parameter or setting; name and more: replace derived values."""
    shared = {
        "name": name or label(d),
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
        return StringProperty(default=d.default, **more, **shared)
    if d.type is bool:
        return BoolProperty(default=d.default, **shared)
    if d.type is int:
        most = min(int(d.high), MOST_INT)
        return IntProperty(default=d.default, min=int(d.low), max=most, **more, **shared)
    length = {"subtype": MILLIMETRES} if d.unit == "mm" else {}
    return FloatProperty(
        default=d.default,
        min=d.low,
        max=d.high,
        **{"precision": 3 if d.high < 1000 else 1, "step": step_of(d.high), **length, **more},
        **shared,
    )


def step_of(high_mm: float) -> int:
    """Change in hundredths of a millimetre by a drag of one pixel, of a length of up to so many mm."""
    return 10 if high_mm > 20 else 1


def true_length(name: str, title: str, text: str, step: float) -> dict[str, Any]:
    """A field for the length `name`, in mm at scale 1, as it is at the unit's scale.

    Typed or dragged it sets that length, within its bounds.
    """

    def read(group) -> float:
        return exact(getattr(group, name)) * exact(group.id_data.mu_unit.scale)

    def write(group, value: float) -> None:
        setattr(group, name, exact(value / exact(group.id_data.mu_unit.scale)))

    shared = {"name": title, "description": text, "get": read, "set": write, "options": {"SKIP_SAVE"}}
    return {name + TRUE: millimetres(step, **shared)}


def millimetres(step: float, **shared):
    """A property in true millimetres; step: change in hundredths of one by a drag of a pixel."""
    return FloatProperty(subtype=MILLIMETRES, precision=3, step=step, **shared)


def true_scale(unit, d: Description) -> float:
    """True millimetres in a millimetre of a parameter of a unit."""
    return 1.0 if d.fixed else exact(unit.scale)


def shown_value(group, d: Description, value: float) -> str:
    """A value of a parameter as text: a length at the unit's scale."""
    if d.unit != "mm":
        return f"{value:.6g}"
    return f"{value * true_scale(group.id_data.mu_unit, d):.6g} mm"


TRUE = "_true"
"""Suffix of the name of the field of `true_length`."""


def field(group, d: Description) -> str:
    """Name of the property that a panel shows of a parameter: itself, or its true length if different."""
    scaled = d.unit == "mm" and true_scale(group.id_data.mu_unit, d) != 1.0
    return d.name + TRUE if scaled else d.name


def tied_update(name: str, changed):
    """The update of a parameter, which also changes a parameter tied to it."""
    if len(tied({name: 0.0})) == 1:
        return changed

    def update(group, context):
        if not updates.are_paused():
            with updates.paused():
                for other, value in tied({name: exact(getattr(group, name))}).items():
                    if other != name:
                        setattr(group, other, value)
        changed(group, context)

    return update


def generated_fields(section: type, changed) -> dict[str, Any]:
    """Blender properties of every parameter of a section, and of every true length."""
    annotations = {}
    for d in describe(section):
        annotations[d.name] = blender_property(d, tied_update(d.name, changed))
        if d.unit == "mm" and not d.fixed:
            annotations |= true_length(d.name, label(d), tooltip(d), step_of(d.high))
    return annotations


def readable(name: str) -> str:
    """The name of an effect or quantity with spaces: "mullins_softening" becomes "mullins softening"."""
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """A text with its first letter as a capital, the others as they are."""
    return text[:1].upper() + text[1:]


def path_symbol(name: str) -> str:
    """The name of a sensor path with its Greek letter: "alpha4" becomes "α4"."""
    return name.replace("alpha", "α")
