"""The candidates of a study against Model A, and their ranking by deviation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.anchors import anchor_points
from ..errors import ConvergenceError
from ..fem.trajectory import Trajectory
from ..placement.candidates import Candidate
from ..placement.deviation import Deviation, rank
from .compared_pressures import PathCheck, RankingSetup, Standing, evaluated, evaluated_in_time
from .mechanics import Mechanics

COLUMNS = [
    "path",
    "start",
    "length",
    "J_hat_mm",
    "J_cont_mm",
    "rank",
    "mesh_uncertainty_mm",
    "tied_with_chosen",
    "J_hat_at_least_mm",
]


@attrs.frozen(eq=False)
class Ranking:
    """Deviations of candidates by path, and the mesh uncertainty of J_hat in mm; None: not known.

    at_least_mm: lower bound of J_hat of paths that were not solved further, since they cannot be the best;
    not_reached: pressures or instants that are not compared, and why.
    """

    deviations: dict[str, Deviation] = attrs.field(factory=dict)
    uncertainty_mm: float | None = None
    at_least_mm: dict[str, float] = attrs.field(factory=dict)
    not_reached: tuple[str, ...] = ()

    @property
    def compared(self) -> Array:
        """True for each instant (k,) at which all paths are compared."""
        return np.isfinite([d.over_time for d in self.deviations.values()]).all(axis=0)

    @property
    def J_hat_mm(self) -> dict[str, float]:
        """J_hat in mm by path."""
        return {name: d.J_hat for name, d in self.deviations.items()}

    @property
    def chosen(self) -> str:
        """The path of least J_hat."""
        J = self.J_hat_mm
        return min(J, key=lambda name: J[name])

    @property
    def tied(self) -> list[str]:
        """Paths whose J_hat differs from the chosen one's by less than the mesh uncertainty."""
        J, best, limit = self.J_hat_mm, self.chosen, self.uncertainty_mm or 0.0
        return [name for name, value in J.items() if name != best and value - J[best] < limit]

    @property
    def rank(self) -> dict[str, int]:
        """Rank from 1 of each path whose J_hat is known and below all bounds of the others."""
        J, least = self.J_hat_mm, min(self.at_least_mm.values(), default=np.inf)
        ranks = dict(zip(J, rank(np.array([*J.values()])).tolist(), strict=True))
        return {name: place for name, place in ranks.items() if J[name] <= least}

    def best(self, count: int) -> list[str]:
        """The `count` solved paths of least J_hat, the best first."""
        J = self.J_hat_mm
        return sorted(J, key=lambda name: J[name])[:count]

    def rows(self, paths: Sequence[Candidate]) -> list[tuple[Any, ...]]:
        """Rows of deviation.csv."""
        # One uncertainty for all: the largest change of a path's J_hat on another mesh.
        mesh = "" if self.uncertainty_mm is None else f"{self.uncertainty_mm:.3g}"
        ties = {name: "yes" if name in self.tied else "no" for name in self.deviations} if mesh else {}
        rows: list[tuple[Any, ...]] = []
        for c in paths:
            if (d := self.deviations.get(c.name)) is not None:
                figures = f"{d.J_hat:.9g}", f"{d.J_cont:.9g}", self.rank.get(c.name, ""), mesh
                rows.append((c.name, c.start, c.length, *figures, ties.get(c.name, ""), ""))
            else:
                bound = f"{self.at_least_mm[c.name]:.9g}"
                rows.append((c.name, c.start, c.length, "", "", "", "", "no" if mesh else "", bound))
        return rows


def ranked(
    motion: Trajectory,
    compared: RankingSetup,
    mechanics: Mechanics,
    stations: int,
    standing: Standing | None,
    check: PathCheck | None,
    moved: Mapping[str, Array] | None,
) -> Ranking:
    """The ranking of candidates by pressure (standing, check), or instant by instant (moved)."""
    anchors = anchor_points(mechanics.unit)
    if standing is None:
        found, not_reached = evaluated_in_time(compared.names, moved or {}, motion, anchors, stations)
        return Ranking(found, not_reached=tuple(not_reached))
    own = attrs.evolve(standing, anchors={**standing.anchors}, not_reached=[*standing.not_reached])
    every = evaluated(compared, own, check or PathCheck(), motion, anchors, stations)
    return Ranking(every, None, own.at_least_mm, tuple(own.not_reached))


def mesh_change_mm(
    fine: Mapping[str, Deviation], coarse: Mapping[str, Deviation], instants: Sequence[int]
) -> float:
    """Largest change of any path's J_hat in mm on a coarser mesh.

    instants: those of the fine mesh that the coarse one was solved at; the relative change of the deviation
    there is used as that of J_hat. Raises ConvergenceError if none of them is compared on both.
    """
    change = 0.0
    for name, found in coarse.items():
        deviation = fine[name]
        both = np.array([deviation.delta[list(instants)], found.delta])
        there, coarser = both[:, np.isfinite(both).all(axis=(0, 2))].reshape(2, -1)
        if not len(there):
            raise ConvergenceError("no pressure is compared on both meshes")
        same = there.mean()
        # A sensor as soft as the lattice disturbs nothing, on any mesh.
        scale = deviation.J_hat / same if same else 0.0
        change = max(change, float(abs(coarser.mean() - same)) * scale)
    return change


def extremes(pressure_kPa: Array) -> Array:
    """Extreme pressures of a protocol, ascending, without 0."""
    found = np.unique([pressure_kPa.min(), pressure_kPa.max()])
    return found[found != 0]
