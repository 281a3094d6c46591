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


def length(scene: Any, value_mm: float, digits: int = 4) -> str:
    """A length in mm, in inches in a scene of such, a plain number in one without units."""
    system = scene.unit_settings.system
    if system == "IMPERIAL":
        return f"{value_mm / 25.4:.{digits}g} in"
    return f"{value_mm:.{digits}g}" + (" mm" if system == "METRIC" else "")


def size(scene: Any, values_mm: Sequence[float]) -> str:
    """Lengths of a body's sides as `length` has one, the unit said once: "37.5 x 50 x 81 mm"."""
    *first, last = (length(scene, value, digits=3) for value in values_mm)
    return " x ".join([*(text.partition(" ")[0] for text in first), last])
