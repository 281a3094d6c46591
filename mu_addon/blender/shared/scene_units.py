"""Lengths of the scene: units and grippers are in mm, and their object's scale gives them their true size."""

from __future__ import annotations

from typing import Any

import numpy as np

from .updates import Signal

CHANGED = Signal()
"""Sent with a scene that was given another unit of length by `mu.millimetres` or `mu.add`."""


def mm(scene: Any) -> float:
    """Length of a millimetre in Blender units of a scene.

    A scene without a unit system has lengths without a unit: there one Blender unit is a millimetre.
    """
    units = scene.unit_settings
    # Blender keeps single precision: 0.001 for 0.0010000000475.
    return 1.0 if units.system == "NONE" else 0.001 / float(str(np.float32(units.scale_length)))


def true_scale(obj: Any, scene: Any) -> float | None:
    """Scale of an object in mm at which it has its true size in a scene, whatever its parents' scale.

    None if a parent is scaled differently along other axes: no scale undoes that.
    """
    if obj.parent is None:
        return mm(scene)
    above = (obj.parent.matrix_world @ obj.matrix_parent_inverse).to_scale()
    if max(above) - min(above) > 1e-4 * max(above) or min(above) <= 0.0:
        return None
    return mm(scene) / float(above[0])


def shown_factor(obj: Any, scene: Any) -> float:
    """Ratio of an object's displayed size in a scene to its true one, along its worst axis."""
    factors = [float(f) / mm(scene) for f in obj.matrix_world.to_scale()]
    return max(factors, key=lambda f: abs(np.log(max(abs(f), 1e-12))))
