"""The stages of a study beyond the windows: the sensitivity map, and the best path of the whole lattice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..errors import InputError
from ..fem.kinematics import probe
from ..fem.model import Model
from ..fem.unit import materials_of
from ..files import write_csv
from ..placement.candidates import Candidate, Evaluation
from ..placement.graph import lattice_graph
from ..placement.influence import (
    deviation_map,
    gradients_of,
    influence,
    loaded,
    mean_deviation,
    shares_of_time,
    telling_pressures,
)
from ..placement.response import response
from ..placement.search import SearchSettings, front, search
from ..placement.whole import whole_body
from .vtk_out import write_fields

if TYPE_CHECKING:
    from .study import Study

Array = np.ndarray[Any, Any]

MAP = "sensitivity.vtu"
PATHS = "paths.csv"


def sensitivity_map(study: Study) -> Array:
    """dJ_hat (m,) in mm by each element's relative stiffening, from Model A on, as `sensitivity.vtu`."""
    assert study.mesh is not None
    assert study.trajectory is not None
    with study.progress.stage("map"):
        model = Model(study.mesh)
        monitor = probe(study.mesh, study.anchors)
        materials = materials_of(study.job.unit, study.mesh)
        chosen = telling_pressures(study.trajectory)
        found = influence(model, materials, study.trajectory, monitor, chosen)
        pressures = np.array([s.pressure_MPa for s in loaded(study.trajectory)])
        gradients = gradients_of(study.trajectory, study.anchors, monitor, study.job.stations)
        dJ = deviation_map(found.at(pressures), gradients, shares_of_time(study.trajectory))
        modulus, _ = materials.small_strain(len(dJ))
        fields = {
            "dJ_by_relative_stiffening_mm": dJ,
            "dJ_by_modulus_mm_per_MPa": dJ / modulus,
            "modulus_MPa": modulus,
        }
        write_fields(study.folder / MAP, study.mesh, fields)
    study.ending.summary["sensitivity"] = {"file": MAP, "largest_mm": float(dJ.max())}
    return dJ


@attrs.frozen(eq=False)
class FoundPath:
    """A path of the lattice graph: its points (h, 3) and length in mm, predicted and exact J_hat in mm."""

    name: str
    points: Array
    length_mm: float
    predicted_mm: float
    evaluation: Evaluation


def search_graph(study: Study) -> FoundPath:
    """The path of the whole lattice graph that disturbs Model A least, within the study's limits.

    All chains are ranked by a reduced response; the best are then solved on the whole body, until no
    other is likely to beat them. Raises InputError where no chain is within the limits.
    """
    assert study.mesh is not None
    assert study.trajectory is not None
    job, rule = study.job, study.headline_rule
    graph = lattice_graph(job.unit.dimensions)
    chains = list(graph.chains(job.limits))
    if not chains:
        raise InputError(
            "no path of the lattice is within the limits",
            "--shortest-cells, --longest-cells, --bend-deg",
            "admit shorter or longer paths, or sharper bends",
        )
    lengths = np.array([graph.lengths[graph.steps_of(c)].sum() for c in chains])
    with study.progress.stage("ranking of the lattice's paths"):
        predicted = _predicted(study, chains, rule)
    mesh, trajectory = whole_body(study.mesh, study.trajectory)
    found: dict[int, Evaluation] = {}

    def check(numbers: Array) -> Array:
        jobs = [(Candidate(f"path{n}", 0, graph.nodes[list(chains[n])]), rule) for n in numbers]
        for n, evaluation in zip(numbers, study.sweep(mesh, trajectory, jobs), strict=True):
            found[int(n)] = evaluation
        return np.array([found[int(n)].deviation.J_hat for n in numbers])

    with study.progress.stage("check of the best paths"):
        outcome = search(predicted, check, SearchSettings(most=job.most_checks))
    if not outcome.complete:
        study.warn(
            f"After {job.most_checks} checks an unchecked path may still be better than the best one, with a "
            f"probability of up to {outcome.risk:.0%}: give more checks (--checks)."
        )
    _write(study, chains, lengths, outcome, graph.nodes)
    best = outcome.best
    study.ending.summary["search"] = {
        "rule": rule,
        "paths": len(chains),
        "checked": len(outcome.checked),
        "risk_that_an_unchecked_one_is_better": outcome.risk,
        "best": {
            "name": f"path{best}",
            "points_mm": graph.nodes[list(chains[best])].tolist(),
            "length_mm": float(lengths[best]),
            "J_hat_mm": float(outcome.exact_mm[best]),
            "predicted_J_hat_mm": float(predicted[best]),
        },
    }
    points = graph.nodes[list(chains[best])]
    return FoundPath(f"path{best}", points, float(lengths[best]), float(predicted[best]), found[best])


def _predicted(study: Study, chains: list[tuple[int, ...]], rule: str) -> Array:
    """Predicted J_hat (n,) in mm of every chain."""
    assert study.mesh is not None
    assert study.trajectory is not None
    unit = study.job.unit
    model = Model(study.mesh)
    monitor = probe(study.mesh, study.anchors)
    found = response(
        model,
        materials_of(unit, study.mesh),
        unit.material.sensor_modulus_kPa / 1e3,
        study.trajectory,
        monitor,
        lattice_graph(unit.dimensions),
        rule,
        unit.dimensions.inclusion_radius,
    )
    pressures = np.array([s.pressure_MPa for s in loaded(study.trajectory)])
    gradients = gradients_of(study.trajectory, study.anchors, monitor, study.job.stations)
    shares = shares_of_time(study.trajectory)
    # Not all displacements at once: there may be tens of thousands of paths.
    parts = [chains[i : i + 2000] for i in range(0, len(chains), 2000)]
    return np.concatenate(
        [mean_deviation(gradients, found.displacements(part, pressures), shares) for part in parts]
    )


def _write(study: Study, chains: list[tuple[int, ...]], lengths: Array, outcome: Any, nodes: Array) -> None:
    """paths.csv: every path, in the order of its exact or else its predicted J_hat."""
    known = np.isfinite(outcome.exact_mm)
    best = set(front(lengths, np.where(known, outcome.exact_mm, np.nan)).tolist())
    order = np.lexsort((outcome.predicted_mm, np.where(known, outcome.exact_mm, np.inf)))
    rows = [
        (
            f"path{n}",
            f"{lengths[n]:.6g}",
            f"{outcome.predicted_mm[n]:.6g}",
            f"{outcome.exact_mm[n]:.9g}" if known[n] else "",
            "yes" if n in best else "no",
            "; ".join(" ".join(f"{c:.6g}" for c in point) for point in nodes[list(chains[n])]),
        )
        for n in order.tolist()
    ]
    columns = ["path", "length_mm", "predicted_J_hat_mm", "J_hat_mm", "on_front", "points_mm"]
    write_csv(study.folder / PATHS, columns, rows)
