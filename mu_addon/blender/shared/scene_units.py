"""Lengths of the scene: units and grippers are in mm, and their object's scale gives them their true size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def mm(scene: Any) -> float:
    """Length of a millimetre in Blender units of a scene.

    A scene without a unit system has lengths without a unit: there one Blender unit is a millimetre.
    """
    units = scene.unit_settings
    # Blender keeps single precision: 0.001 for 0.0010000000475.
    return 1.0 if units.system == "NONE" else 0.001 / float(str(np.float32(units.scale_length)))


def in_millimetres(scene: Any) -> bool:
    """Whether one Blender unit of the scene is a millimetre, and is shown so."""
    return bool(scene.unit_settings.system != "IMPERIAL" and abs(mm(scene) - 1.0) < 1e-6)


def use_millimetres(scene: Any) -> None:
    """One Blender unit is a millimetre, shown as such."""
    units = scene.unit_settings
    units.system, units.scale_length, units.length_unit = "METRIC", 0.001, "MILLIMETERS"


SHOWN = {
    "KILOMETERS": (1e6, " km"),
    "METERS": (1e3, " m"),
    "CENTIMETERS": (10.0, " cm"),
    "MICROMETERS": (1e-3, " µm"),
    "MILES": (1609344.0, " mi"),
    "FEET": (304.8, "'"),
    "INCHES": (25.4, '"'),
    "THOU": (0.0254, " thou"),
}
"""Units of length that a scene's fields may be shown in: mm in one, and its sign as fields have it."""


def shown_unit(scene: Any) -> tuple[float, str]:
    """The unit of length that fields of a scene show: mm in one of it, and its sign.

    Where Blender chooses by the value (*Adaptive*), millimetres, or inches in an imperial scene.
    """
    units = scene.unit_settings
    if units.system == "NONE":
        return 1.0, ""
    return SHOWN.get(units.length_unit, SHOWN["INCHES"] if units.system == "IMPERIAL" else (1.0, " mm"))


def length(scene: Any, value_mm: float, digits: int = 4) -> str:
    """A length in the unit that the scene's fields show, a plain number in a scene without units."""
    in_mm, sign = shown_unit(scene)
    value = float(f"{value_mm / in_mm:.{digits}g}")
    return f"{np.format_float_positional(value, trim='-')}{sign}"


def size(scene: Any, values_mm: Sequence[float]) -> str:
    """Lengths of a body's sides as `length` has one, the unit said once: "37.5 x 50 x 81 mm"."""
    sign = shown_unit(scene)[1]
    return " x ".join(length(scene, value, digits=3).removesuffix(sign) for value in values_mm) + sign
