"""A body with several closed cavities, each under its own share of the pressure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from mu_addon.errors import InputError
from mu_addon.fem import follower_pressure
from mu_addon.fem.model import Model
from mu_addon.meshing.mesh import Mesh

Array = np.ndarray[Any, Any]


class CavitiesModel(Model):
    """A body whose cavity's faces are those of several closed cavities, one after another.

    counts: faces of each cavity, in the order of `mesh.cavity`; `shares` (c,), to be set, are the parts of
    the pressure that each bears, 1 at first. Each cavity must be closed: then the load has the potential -p
    sum(share V). more: further arguments of `Model`. Raises InputError where the counts do not cover the
    faces.
    """

    def __init__(self, mesh: Mesh, counts: Sequence[int], **more: Any) -> None:
        super().__init__(mesh, **more)
        if sum(counts) != len(mesh.cavity) or min(counts, default=0) < 1:
            raise InputError(
                f"cavities of {', '.join(map(str, counts))} faces in a mesh with {len(mesh.cavity)}",
                "a body with several cavities",
                "give the number of faces of each, in the mesh's order",
            )
        ends = np.cumsum([0, *counts]).tolist()
        self._parts_of_cavity = [
            (a, self._put(mesh.cavity[a:b].astype(np.int32), int)) for a, b in itertools.pairwise(ends)
        ]
        self._volumes = [wp.zeros(count, dtype=wp.float64, device=self.device) for count in counts]
        self.shares = np.ones(len(counts))

    def _pressures(self, pressure: float) -> list[tuple[float, int, wp.array]]:
        return [
            (float(pressure * share), first, faces)
            for share, (first, faces) in zip(self.shares, self._parts_of_cavity, strict=True)
        ]

    def _pressure_work(self, pressure: float) -> float:
        return float(pressure * (self.shares @ self._volumes_mm3()))

    def cavity_volumes(self, u: Array) -> Array:
        """Volumes (c,) in mm3 of the cavities displaced by u (n, 3) in mm."""
        self._place(u)
        return self._volumes_mm3()

    def _volumes_mm3(self) -> Array:
        for (_, faces), out in zip(self._parts_of_cavity, self._volumes, strict=True):
            inputs = [self._x, faces, *self._face_rule, out]
            wp.launch(follower_pressure.enclosed_volume, len(faces), inputs, device=self.device)
        return np.array([out.numpy().sum() for out in self._volumes])
