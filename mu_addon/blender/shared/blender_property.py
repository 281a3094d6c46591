"""The Blender property of a parameter or setting of the core, made from its description.

Blender shows and drags a field of the subtype DISTANCE in the unit of the scene, in steps of a hundredth of
that: 0.0009 m in its start-up scene. Lengths of lenses are in millimetres in every scene, and accept other
metric units when typed; fields of lengths here use that subtype.
"""

import textwrap
from collections.abc import Callable
from typing import Any
from zlib import crc32

import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)

from ...design.quantity import Description
from .wording import choice_label, label, tooltip

MILLIMETRES = "DISTANCE_CAMERA"
"""Subtype of a property that is in millimetres in any scene."""
BESIDE_BLEND_FILE = {"PATH_SUPPORTS_BLEND_RELATIVE"}
"""Options of a path that may be relative to the .blend file."""
MOST_INT = 2**31 - 1
"""The largest whole number of a property in Blender."""


def exact(value: float) -> float:
    """Shortest decimal number for a value in Blender's single precision: 0.9 for 0.8999999762."""
    return float(str(np.float32(value)))


def blender_property(d: Description, update=None, options=frozenset(), name="", items=(), **more):
    """The Blender property of one parameter or setting; name, items and more: replace derived values."""
    shared = {
        "name": name or label(d),
        "description": tooltip(d),
        "update": update,
        "options": {"ANIMATABLE", *options},
    }
    if d.choices or items:
        text = textwrap.shorten(d.text, 60)
        # A file keeps the number, which is the name's: it stays when a choice is added.
        items = items or [(name, choice_label(name), text, crc32(name.encode()) >> 1) for name in d.choices]
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


def _described(make: Callable[..., Any]) -> Callable[..., Any]:
    """A maker of Blender properties that is given the name and what it is first, then the rest by name."""
    return lambda name, description, **more: make(name=name, description=description, **more)


Flag, Text, Choice = map(_described, (BoolProperty, StringProperty, EnumProperty))
Number, FloatVector, Integer = map(_described, (FloatProperty, FloatVectorProperty, IntProperty))
"""Properties that no setting of the core describes, by name and description."""


def millimetres(step: float, **shared):
    """A property in true millimetres; step: change in hundredths of one by a drag of a pixel."""
    return FloatProperty(subtype=MILLIMETRES, precision=3, step=step, **shared)


def path_property(name: str, description: str, folder: bool = False, **more):
    """A property that is the path of a file or a folder, relative to the .blend file if the user wants it."""
    subtype = "DIR_PATH" if folder else "FILE_PATH"
    return StringProperty(
        name=name, description=description, subtype=subtype, options=BESIDE_BLEND_FILE, **more
    )


def listed(
    make: Callable[[], list[tuple[str, str, str]]],
) -> Callable[[Any, Any], list[tuple[str, str, str]]]:
    """Items of a menu that are made anew each time it opens; Blender does not keep their strings alive."""
    kept: list[tuple[str, str, str]] = []

    def items(owner: Any, context: Any) -> list[tuple[str, str, str]]:
        kept[:] = make()
        return kept

    return items
