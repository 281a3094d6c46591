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
from ...graph.definition import FOLDER
from ...studies import study
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


_DESCRIBED: dict[Any, Description] = {}
"""What each property was made from."""


def described_fields(owner: Any) -> dict[str, Description]:
    """Descriptions by name of the properties of a group, node or class that were made from one."""
    every = (owner if isinstance(owner, type) else type(owner)).__annotations__.items()
    return {name: _DESCRIBED[made] for name, made in every if made in _DESCRIBED}


def blender_property(d: Description, update=None, options=frozenset(), name="", **more):
    """The Blender property of one parameter or setting; name, more: replace derived values.

    path: "file" or "folder" if it names one; size: how many numbers it is, if several, the default's.
    """
    made = _made(d, update=update, options=options, name=name, **more)
    _DESCRIBED[made] = d
    return made


def _made(d: Description, update, options, name, items=(), path="", **more):
    if path:
        more["subtype"], options = ("DIR_PATH" if path == FOLDER else "FILE_PATH"), BESIDE_BLEND_FILE
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
        return EnumProperty(items=items, **{"default": d.default, **more}, **shared)
    if d.type is str:
        return StringProperty(default=d.default, **more, **shared)
    if d.type is bool:
        return BoolProperty(default=d.default, **more, **shared)
    if d.type is int:
        most = min(int(d.high), MOST_INT)
        return IntProperty(default=d.default, min=int(d.low), max=most, **more, **shared)
    number = {"default": d.default, "min": d.low, "max": d.high, "step": step_of(d.high)}
    number |= {"precision": 3 if d.high < 1000 else 1} | ({"subtype": MILLIMETRES} if d.unit == "mm" else {})
    return (FloatVectorProperty if "size" in more else FloatProperty)(**number | more, **shared)


def input_of(name: str, of: str) -> Description:
    """The description of a study's input that is one value, or several alike."""
    found: Description = study(name).inputs()[of].descriptions[0]
    return found


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
