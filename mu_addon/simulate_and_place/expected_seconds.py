"""Expected duration of a study's stages, and the disk space that they take."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..placement.deviation_bounds import first_and_rest

if TYPE_CHECKING:
    from ..studies.unit_motion import UnitMotion
    from ..studies.unit_ranking import UnitStudy

SECONDS = {
    "solid": 1.5, "mesh": 5.0, "light": 7.0, "solid with the best path": 2.5,
    "ranking of the lattice's paths": 30.0, "motion of the best path": 60.0,
}  # fmt: skip
"""Seconds of a stage on two cores."""
ON_MESH = {
    "Model A": (190.0, 1.0), "candidates": (1400.0, 1.5), "mesh check": (200.0, 3.5), "map": (8.0, 0.3),
    "motion of the paths": (25.0, 0.0), "check of the best paths": (1450.0, 0.0),
}  # fmt: skip
"""Seconds of a stage on the default mesh under the shipped protocol, and those that no mesh shortens."""
SUCTION = 3.0
"""Work of a candidate's state at -20 kPa, where walls touch or parts of the unit snap, in units of one under
pressure; it grows as the square of the pressure."""
WAY_TOUCHING, WAY_CROSSING = 14.0, 36.0
"""Work of Model A's way to -20 kPa, beside a unit for each state: where walls touch, and without
self-contact, where they pass through each other and parts of the unit snap."""
LEFT_UNDER_PRESSURE = 0.55
"""Share left out of the states after the highest pressure, of paths that are not the best, without suction:
15 of 27 of `mu-1.0x`."""
# The best paths, which the coarser mesh solves too: each costs as much there as on the fine one, and only
# paths near the best can be tied with it.
PATHS_CHECKED = 3
SHIPPED_KPA: tuple[float, ...] = (-20.0, -10.0, 10.0, 20.0, 30.0, 40.0)
"""Pressures other than 0 of the shipped protocol at the default number of times."""
# Unknowns grow as the cube of the refinement, and a factorisation's time somewhat faster.
BY_REFINEMENT = 3.5
# Below a refinement of 1 the wall alone grows coarser.
BY_WALL = 1.8

# Bytes of a study, with a margin: a constant, and a part for each node and distinct pressure.
BYTES = {"interactive": 30_000_000, "export": 150_000_000}
BYTES_A_NODE = {"simulate": 300, "place": 1000}


def expected_nodes(job: UnitMotion) -> int:
    """Expected number of a mesh's nodes, from mu-1.0x: 54 000 at a refinement of 0.35, 81 000 at 1."""
    share = {"half": 1.0, "full": 2.0}[job.mesh.fraction]
    units = job.unit.dimensions.count / 6
    return int(share * units * (50_000 + 31_000 * job.mesh.refine**2.7))


def expected_bytes(job: UnitMotion) -> int:
    """Disk space that a study takes."""
    if "simulate" not in job.stages:
        return BYTES[job.quality]
    per_node = BYTES_A_NODE["place" if "place" in job.stages else "simulate"]
    return BYTES[job.quality] + expected_nodes(job) * per_node * len(job.samples.distinct_kPa)


@attrs.frozen
class Size:
    """What a study's seconds depend on: chambers, refinement, self-contact, pressures (s,) in kPa, paths.

    known: number of paths that are solved at all pressures, where the others may drop out before; 0: all.
    """

    chambers: int
    refine: float
    self_contact: bool
    pressures_kPa: tuple[float, ...] = SHIPPED_KPA
    known: int = 0

    @classmethod
    def of(cls, job: UnitStudy) -> Size:
        """Of a study."""
        in_time = job.mechanics.in_time
        states = job.samples.pressure_kPa.tolist() if in_time else job.samples.distinct_kPa
        known = 0 if in_time or job.all_paths else PATHS_CHECKED if job.mesh_check else 1
        count = job.unit.dimensions.count
        return cls(count, job.mesh.refine, job.self_contact, tuple(states), known)

    def factor(self, stage: str) -> float:
        """Work of a stage by that of the shipped protocol on the default mesh of six chambers, in contact."""
        shipped = Size(6, 1.0, True)
        body = of_mesh(self.refine) * self.chambers / 6
        if stage == "Model A":
            return body * _side_by_side(self) / _side_by_side(shipped)
        whole = work(SHIPPED_KPA)
        states = max(work(self.pressures_kPa), 1.0) / whole
        if stage != "candidates":
            return body * states
        paths = (self.chambers - 1) * (self.chambers - 2) / 2
        _, rest = first_and_rest(np.array(self.pressures_kPa))
        later = work(self.pressures_kPa[n] for n in rest) / whole
        left = later * max(paths - self.known, 0) if self.known else 0.0
        if min(self.pressures_kPa) >= 0.0:
            left *= LEFT_UNDER_PRESSURE
        return body * (states * paths - left) / 10


def work(pressures_kPa: Iterable[float]) -> float:
    """Work of candidates' states at these pressures, in units of one under pressure; none at 0 kPa."""
    return sum(max(SUCTION * (min(p, 0.0) / 20.0) ** 2, 1.0) for p in pressures_kPa if p)


def _side_by_side(job: Size) -> float:
    """Work of Model A's states on two cores: suction beside pressure."""
    suction = [p for p in job.pressures_kPa if p < 0]
    way = WAY_TOUCHING if job.self_contact else WAY_CROSSING
    under_suction = way * (min(suction, default=0.0) / 20.0) ** 2 + len(suction)
    return max(1.0, under_suction, sum(p > 0 for p in job.pressures_kPa))


def of_mesh(refine: float) -> float:
    """Work on a mesh of that refinement, in units of the work on the default one."""
    return float(refine ** (BY_WALL if refine < 1.0 else BY_REFINEMENT))


def seconds(job: UnitStudy, title: str) -> float:
    """Expected seconds on two cores of a study's stage of that title."""
    if title not in ON_MESH:
        return SECONDS[title]
    whole, least = ON_MESH[title]
    return max(least, whole * Size.of(job).factor(title))
