"""Motion of a unit with a sensor, for display, as differences from Model A's."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from ..arrays import Array
from ..fem.kinematics import MIRROR
from ..fem.state import State
from ..meshing.mesh import Mesh, images
from ..report.motion_files import IMAGE, REGIONS, SurfaceFields, surface_of
from .mechanics import Mechanics


@attrs.frozen(eq=False)
class PathMotion:
    """Difference (r, n, 3) in mm of a path's unit from Model A at pressures (r,) in kPa, and of its fields.

    fields: by the names of `report.motion_files`.
    """

    pressure_kPa: Array
    difference_mm: Array
    fields: dict[str, Array]


class PathMotions:
    """Motions of paths on a mesh, for display on a study's own.

    own: the study's mesh; mesh: the same, or its mirror, the whole body's, if that is a half; states: Model
    A's on it by pressure in kPa.
    """

    def __init__(self, mechanics: Mechanics, own: Mesh, mesh: Mesh, states: Mapping[float, State]) -> None:
        self._own, self._states = own, states
        self._image = None if mesh.symmetry == own.symmetry else images(own, "x")
        self._nodes = {region: surface_of(own, number).node for region, number in REGIONS.items()}
        image = self._image
        both = {r: n if image is None else np.concatenate([n, image[n]]) for r, n in self._nodes.items()}
        self._looked, self._materials = SurfaceFields(mesh, both), mechanics.materials(mesh)
        self._without: dict[float, dict[str, Array]] = {}

    def of(self, difference_mm: Mapping[float, Array]) -> PathMotion:
        """Motion of a path from its differences (n, 3) in mm on the mesh, by pressure in kPa."""
        pressures = sorted(difference_mm)
        for p in pressures:
            if p not in self._without:
                self._without[p] = self._looked.of_states([self._states[p].u], self._materials)
        apart = np.array([difference_mm[p] for p in pressures])
        moved = [self._states[p].u + d for p, d in zip(pressures, apart, strict=True)]
        still = [self._without[p] for p in pressures]
        found = self._looked.of_states(moved, self._materials)
        fields = {name: v - np.concatenate([one[name] for one in still]) for name, v in found.items()}
        further = {}
        if self._image is not None:
            further["image_mm"] = apart[:, self._image] * MIRROR
            for name, values in fields.items():
                count = len(self._nodes[name.partition("_")[0]])
                fields[name], further[IMAGE + name] = values[:, :count], values[:, count:]
            apart = apart[:, : len(self._own.nodes)]
        return PathMotion(np.array(pressures), apart, {**fields, **further})
