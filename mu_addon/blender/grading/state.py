"""The painted object: a cube in each cell, whose weights are factors on its struts' diameters."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...design.factor_list import LEAST, MOST
from ...design.grading import Field
from ...errors import InputError
from ..preview.materials import material
from ..preview.skeletons import box
from ..shared import displays

# Edge of a cube over that of its cell: small enough to see and paint the cells behind it.
_SHARE = 0.5
_CUBE = box((-0.5,) * 3, (0.5,) * 3)
_CORNERS, (_FACES,) = _CUBE.vertices, _CUBE.faces


def painted_on(root: Any) -> Any | None:
    """The object that a unit's factors are painted on, or None."""
    return displays.part(root, displays.PAINTED, "struts")


def begin(root: Any, field: Field) -> Any:
    """An object with a cube in each cell at x >= 0, its weights those of the unit's present cells."""
    centres = field.cell_centres.reshape(-1, 3)
    corners = centres[:, None] + _SHARE * field.cell * _CORNERS
    mesh = bpy.data.meshes.new("Strut Factors")
    faces = (len(_CORNERS) * np.arange(len(centres))[:, None, None] + _FACES).reshape(-1, 4)
    mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], faces.tolist())
    mesh.materials.append(material("MU Lattice"))
    obj = displays.lock(displays.add(root, displays.PAINTED, "struts", mesh))
    group = obj.vertex_groups.new(name="Strut Factor")
    # By their logarithm, 0.5 for factor 1.
    weights = np.clip(np.log(field.cell_factors.ravel() / LEAST) / np.log(MOST / LEAST), 0.0, 1.0)
    for cell, weight in enumerate(weights.tolist()):
        group.add(list(range(len(_CORNERS) * cell, len(_CORNERS) * (cell + 1))), weight, "REPLACE")
    return obj


def factors_on(obj: Any, field: Field) -> np.ndarray[Any, Any]:
    """Factors (columns, rows, chambers) of an object of `begin`: by the mean weight of each cell's cube.

    Raises InputError where the unit has other cells now.
    """
    if len(obj.data.vertices) != len(_CORNERS) * field.cell_factors.size:
        raise InputError(
            "the unit has other cells now than were painted", obj.name, "discard, and paint again"
        )
    painted = np.zeros(len(obj.data.vertices))
    for vertex in obj.data.vertices:
        for element in vertex.groups:
            painted[vertex.index] = element.weight
    weights = painted.reshape(*field.cell_factors.shape, len(_CORNERS)).mean(axis=-1)
    return np.asarray(LEAST * (MOST / LEAST) ** weights)
