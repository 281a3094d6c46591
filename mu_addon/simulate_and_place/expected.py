"""Expected duration of a study's stages, and the disk space that they take."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..placement.elimination import first_and_rest

if TYPE_CHECKING:
    from ..studies.unit_motion import UnitMotion
    from ..studies.unit_ranking import UnitStudy

BEST = "solid with the best path"
"""Stage of the printable unit with the path that a ranking chose."""
PATHS_MOTION = "motion of the paths"
"""Stage of the displacements, stresses and stretches of units with a sensor, for display."""
FULL_S = {
    "solid": 1.5, "mesh": 5.0, "Model A": 195.0, "candidates": 1400.0, "mesh check": 200.0, "map": 8.0,
    PATHS_MOTION: 25.0,
    "light": 7.0, BEST: 2.5, "ranking of the lattice's paths": 30.0, "check of the best paths": 1450.0,
    "motion of the best path": 60.0, "report": 14.0,
}  # fmt: skip
"""Seconds on two cores, on the default mesh under the shipped protocol."""
UNSOLVED_REPORT_S = 7.0
"""Seconds of a report on a unit that was not simulated."""
LEAST_S = {"Model A": 1.0, "candidates": 1.5, "mesh check": 3.5, "map": 0.3}
"""Seconds of a stage that are independent of the mesh, for stages that depend on it."""
SOLVED = ("Model A", "candidates", "mesh check", "check of the best paths", PATHS_MOTION)
TOUCHING = 3.0
"""Factor on the seconds of a state at -20 kPa where walls touch, by the square of the pressure: those under
pressure are solved beside it."""
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


def stage_names(place: bool, mesh_check: bool, graph: bool, simulate: bool = True) -> list[str]:
    """Names of a study's stages."""
    names = ["solid", *(["mesh", "Model A"] if simulate else [])]
    if place:
        names += ["candidates", *(["mesh check"] if mesh_check else []), PATHS_MOTION, "map", "light"]
        names += [n for n in FULL_S if "path" in n and n not in (BEST, PATHS_MOTION)] if graph else []
        names.append(BEST)
    return [*names, "report"]


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
        states = max(work(self, self.pressures_kPa), 1.0) / work(shipped, SHIPPED_KPA)
        body = of_mesh(self.refine) * self.chambers / 6
        if stage != "candidates":
            return body * states
        paths = (self.chambers - 1) * (self.chambers - 2) / 2
        _, rest = first_and_rest(np.array(self.pressures_kPa))
        later = work(self, [self.pressures_kPa[n] for n in rest]) / work(shipped, SHIPPED_KPA)
        left = later * max(paths - self.known, 0) if self.known else 0.0
        if min(self.pressures_kPa) >= 0.0:
            left *= LEFT_UNDER_PRESSURE
        return body * (states * paths - left) / 10


def work(job: Size, pressures_kPa: Iterable[float]) -> float:
    """Work of the states at these pressures, in units of one under pressure; none at 0 kPa."""
    touches = job.self_contact
    return sum(max(TOUCHING * (p / 20.0) ** 2, 1.0) if touches and p < 0 else 1.0 for p in pressures_kPa if p)


def seconds_of(name: str, factor: float = 1.0) -> float:
    """Seconds of a stage on two cores. factor: work by that of the shipped protocol on the default mesh."""
    seconds = FULL_S[BEST if name.startswith("solid with ") else name]
    return max(LEAST_S.get(name, 0.0), seconds * (factor if name in LEAST_S or name in SOLVED else 1.0))


def of_mesh(refine: float) -> float:
    """Work on a mesh of that refinement, in units of the work on the default one."""
    return float(refine ** (BY_WALL if refine < 1.0 else BY_REFINEMENT))


def seconds(job: UnitStudy, name: str) -> float:
    """Expected seconds of a study's stage on two cores."""
    return seconds_of(name, Size.of(job).factor(name) if "simulate" in job.stages else 1.0)
