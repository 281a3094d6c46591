"""The sensitivity map, and the search of the whole lattice for the best path."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..body.response import bar_response
from ..body.waveguide import bar_of
from ..design.anchors import anchor_points
from ..design.parameters import Unit
from ..design.quantity import in_kPa
from ..errors import ConvergenceError, InputError
from ..fem.kinematics import probe
from ..fem.trajectory import Trajectory, whole_body
from ..placement.graph import Graph, Limits, lattice_graph
from ..placement.search import Search, front
from ..placement.sensitivity_map import (
    deviation_map,
    gradients_of,
    influence_map,
    loaded,
    mean_deviation,
    parities,
    representative_pressures,
    shares_of_time,
    stable_part,
)
from ..report.results import LatticePath
from .mechanics import Mechanics

# Beyond this their list alone takes gigabytes.
MOST_PATHS = 200_000


@attrs.frozen(eq=False)
class Sensitivity:
    """dJ_hat (m,) in mm by each element's relative stiffening; empty of a unit that is stable nowhere.

    modulus_MPa (m,): of each element; unstable_kPa: pressures that are left out.
    """

    dJ_mm: Array
    modulus_MPa: Array
    unstable_kPa: tuple[float, ...]


def sensitivity_map(mechanics: Mechanics, motion: Trajectory, stations: int) -> Sensitivity:
    """The map from Model A on, over the pressures at which the unit is stable."""
    model, materials = mechanics.model(motion.mesh), mechanics.materials(motion.mesh)
    anchors = anchor_points(mechanics.unit)
    monitor, sides = probe(motion.mesh, anchors), parities(model)
    stable = stable_part(model, materials, motion, sides)
    out = _left_out(motion, stable)
    if not loaded(stable):
        return Sensitivity(np.empty(0), np.empty(0), out)
    chosen = representative_pressures(stable)
    found = influence_map(model, materials, stable, monitor, chosen, sides)
    pressures = np.array([s.pressure_MPa for s in loaded(stable)])
    gradients = gradients_of(stable, anchors, monitor, stations)
    dJ = deviation_map(found.at(pressures), gradients, shares_of_time(stable))
    modulus, _ = materials.small_strain(len(dJ))
    return Sensitivity(dJ, modulus, out)


def _left_out(motion: Trajectory, stable: Trajectory) -> tuple[float, ...]:
    kept = {s.pressure_MPa for s in stable.solved}
    return tuple(sorted(in_kPa(s.pressure_MPa) for s in motion.solved if s.pressure_MPa not in kept))


def unstable_at(pressures_kPa: Sequence[float], what_leaves: str) -> str:
    """Warning of pressures at which a unit is unstable; "" without any."""
    if not pressures_kPa:
        return ""
    return (
        f"{what_leaves} out {', '.join(f'{p:g}' for p in pressures_kPa)} kPa: there the unit is "
        "unstable and would leave its bending plane. Angles and J_hat there are those of a unit that is "
        "kept in its plane."
    )


def chains_within(unit: Unit, limits: Limits) -> tuple[Graph, list[tuple[int, ...]]]:
    """The lattice graph and its chains within limits; raises InputError for none or too many."""
    graph = lattice_graph(unit.printed)
    chains = list(itertools.islice(graph.chains(limits), MOST_PATHS + 1))
    options = "--shortest-cells, --longest-cells, --bend-deg"
    if not chains:
        raise InputError(
            "no path of the lattice satisfies the limits",
            options,
            "allow shorter or longer paths, or sharper bends",
        )
    if len(chains) > MOST_PATHS:
        raise InputError(
            f"more than {MOST_PATHS} paths of the lattice are within the limits",
            options,
            "shorten the longest path or forbid sharper bends",
        )
    return graph, chains


@attrs.frozen(eq=False)
class Predicted:
    """Predicted J_hat (n,) in mm of every chain of the lattice; unstable_kPa: pressures that are left out."""

    J_mm: Array
    unstable_kPa: tuple[float, ...]


def predicted(mechanics: Mechanics, motion: Trajectory, limits: Limits, stations: int) -> Predicted:
    """Every chain's deviation by the reduced response about Model A's stable states.

    Raises ConvergenceError where there is none.
    """
    graph, chains = chains_within(mechanics.unit, limits)
    model, materials = mechanics.model(motion.mesh), mechanics.materials(motion.mesh)
    stable = stable_part(model, materials, motion, parities(model))
    if not loaded(stable):
        raise ConvergenceError(
            "the unit is unstable at every pressure of the protocol, so that its paths cannot be ranked",
            "--paths graph",
            "simulate smaller pressures, or leave out --paths graph",
        )
    anchors = anchor_points(mechanics.unit)
    mesh, whole = whole_body(motion.mesh, stable)
    found = bar_response(
        mechanics.model(mesh),
        mechanics.materials(mesh),
        mechanics.unit.printed,
        whole,
        probe(mesh, anchors),
        graph,
    )
    pressures = np.array([s.pressure_MPa for s in loaded(stable)])
    gradients = gradients_of(stable, anchors, probe(motion.mesh, anchors), stations)
    shares = shares_of_time(stable)
    # Not all displacements at once: there may be tens of thousands of paths.
    parts = [chains[i : i + 2000] for i in range(0, len(chains), 2000)]
    J = [mean_deviation(gradients, found.displacements(part, pressures), shares) for part in parts]
    return Predicted(np.concatenate(J), _left_out(motion, stable))


def is_printable(unit: Unit, points: Array) -> bool:
    """Return True if a waveguide can be printed along a path (h, 3) in mm."""
    try:
        bar_of(unit, points)
    except InputError:
        return False
    return True


def lattice_paths(unit: Unit, limits: Limits, predicted_mm: Array, outcome: Search) -> list[LatticePath]:
    """Every possible path of the lattice, the solved ones first, by J_hat or else by its prediction."""
    graph, chains = chains_within(unit, limits)
    lengths = np.array([graph.lengths[graph.steps_of(c)].sum() for c in chains])
    best = set(front(lengths, outcome.exact_mm).tolist())
    known = np.isfinite(outcome.exact_mm)
    order = np.lexsort((predicted_mm, np.where(known, outcome.exact_mm, np.inf)))
    order = order[~np.isin(order, outcome.left_out)]
    return [
        LatticePath(
            f"path{n}",
            graph.nodes[list(chains[n])],
            float(lengths[n]),
            float(predicted_mm[n]),
            float(outcome.exact_mm[n]),
            n in best,
        )
        for n in order.tolist()
    ]


COLUMNS = ("path", "length_mm", "predicted_J_hat_mm", "J_hat_mm", "on_front", "points_mm")


def rows(paths: Sequence[LatticePath]) -> list[tuple[str, ...]]:
    """Rows of paths.csv."""
    return [
        (
            p.name,
            f"{p.length_mm:.6g}",
            f"{p.predicted_mm:.6g}",
            f"{p.j_hat:.9g}" if np.isfinite(p.j_hat) else "",
            "yes" if p.on_front else "no",
            "; ".join(" ".join(f"{c:.6g}" for c in point) for point in p.points),
        )
        for p in paths
    ]
