"""The sensitivity map, and the search of the whole lattice for the best path."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from ...body.response import bar_response
from ...body.waveguide import bar_of
from ...design.quantity import in_kPa
from ...errors import ConvergenceError, InputError
from ...fem.kinematics import probe
from ...fem.materials import Materials
from ...fem.model import Model
from ...fem.trajectory import Trajectory, whole_body
from ...files import write_csv
from ...placement.candidates import Candidate
from ...placement.graph import Graph, lattice_graph
from ...placement.response import Response
from ...placement.search import SearchSettings, front, search_paths
from ...placement.sensitivity_map import (
    Parity,
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
from ...report.motion_files import write_sensitivity
from ...report.results import LatticePath, LatticeSearch
from ...report.vtk import write_fields

if TYPE_CHECKING:
    from .job import Job
    from .study import Study

Array = np.ndarray[Any, Any]

MAP = "sensitivity.vtu"
PATHS = "paths.csv"
# Beyond this their list alone takes gigabytes.
MOST_PATHS = 200_000


def sensitivity_map(study: Study) -> Array | None:
    """dJ_hat (m,) in mm by each element's relative stiffening, from Model A on, as `sensitivity.vtu`.

    Over the pressures at which the unit is stable; None, and no file, without any.
    """
    assert study.mesh is not None
    with study.progress.stage("map"):
        model = study.job.model(study.mesh)
        monitor = probe(study.mesh, study.anchors)
        materials = study.job.materials(study.mesh)
        sides = parities(model)
        trajectory = _stable(study, model, materials, sides, "The sensitivity map leaves")
        if not loaded(trajectory):
            return None
        chosen = representative_pressures(trajectory)
        found = influence_map(model, materials, trajectory, monitor, chosen, sides)
        pressures = np.array([s.pressure_MPa for s in loaded(trajectory)])
        gradients = gradients_of(trajectory, study.anchors, monitor, study.job.stations)
        dJ = deviation_map(found.at(pressures), gradients, shares_of_time(trajectory))
        modulus, _ = materials.small_strain(len(dJ))
        fields = {
            "dJ_by_relative_stiffening_mm": dJ,
            "dJ_by_modulus_mm_per_MPa": dJ / modulus,
            "modulus_MPa": modulus,
        }
        write_fields(study.folder / MAP, study.mesh, fields)
        write_sensitivity(study.folder, study.mesh, dJ / modulus)
    study.context.summary["sensitivity"] = {"file": MAP, "largest_mm": float(dJ.max())}
    return dJ


def _stable(
    study: Study, model: Model, materials: Materials, sides: list[Parity], what_leaves: str
) -> Trajectory:
    """Stable part of Model A's motion; the study warns of pressures that `what_leaves` out."""
    assert study.trajectory is not None
    found = stable_part(model, materials, study.trajectory, sides)
    kept = {s.pressure_MPa for s in found.solved}
    out = [in_kPa(s.pressure_MPa) for s in study.trajectory.solved if s.pressure_MPa not in kept]
    if out:
        study.warn(
            f"{what_leaves} out {', '.join(f'{p:g}' for p in sorted(out))} kPa: there the unit is "
            "unstable and would leave its bending plane. Angles and J_hat there are those of a unit that is "
            "kept in its plane."
        )
    return found


def chains_within(job: Job) -> tuple[Graph, list[tuple[int, ...]]]:
    """The lattice graph and its chains within a job's limits; raises InputError for none or too many."""
    graph = lattice_graph(job.unit.printed)
    chains = list(itertools.islice(graph.chains(job.limits), MOST_PATHS + 1))
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


def search_graph(study: Study) -> LatticeSearch:
    """The path of the whole lattice graph that disturbs Model A least, within the study's limits.

    All chains are ranked by a reduced response; the best are then solved on the whole body, until no
    other is likely to beat them. Raises InputError where no chain is within the limits.
    """
    assert study.mesh is not None
    assert study.trajectory is not None
    job = study.job
    graph, chains = chains_within(job)
    lengths = np.array([graph.lengths[graph.steps_of(c)].sum() for c in chains])
    with study.progress.stage("ranking of the lattice's paths"):
        predicted = _predicted(study, graph, chains)
    mesh, trajectory = whole_body(study.mesh, study.trajectory)

    def check(numbers: Array) -> Array:
        paths = {n: graph.nodes[list(chains[n])] for n in numbers.tolist()}
        made = [n for n, points in paths.items() if _is_printable(study, points)]
        candidates = [Candidate(f"path{n}", 0, paths[n]) for n in made]
        solved = study.solve_candidates(mesh, trajectory, candidates)[0] if candidates else []
        found = dict(zip(made, (e.deviation.J_hat for e in solved), strict=True))
        return np.array([found.get(n, np.nan) for n in paths])

    with study.progress.stage("check of the best paths"):
        outcome = search_paths(predicted, check, SearchSettings(most=job.most_checks))
    if not outcome.complete:
        study.warn(
            f"After {job.most_checks} full solutions, the probability that an unsolved path is better than "
            f"the best one is up to {outcome.risk:.0%}: increase --checks."
        )
    if len(outcome.left_out):
        study.warn(
            f"{len(outcome.left_out)} paths that the search found are left out: no waveguide can be "
            "printed along them."
        )
    best = set(front(lengths, outcome.exact_mm).tolist())
    known = np.isfinite(outcome.exact_mm)
    order = np.lexsort((predicted, np.where(known, outcome.exact_mm, np.inf)))
    order = order[~np.isin(order, outcome.left_out)]
    every = [
        LatticePath(
            f"path{n}",
            graph.nodes[list(chains[n])],
            float(lengths[n]),
            float(predicted[n]),
            float(outcome.exact_mm[n]),
            n in best,
        )
        for n in order.tolist()
    ]
    _write(study, every)
    study.search = LatticeSearch(every[: len(outcome.checked)], len(chains), outcome.risk)
    first = every[0]
    # A motion to look at is of a whole mesh, or of a half and its image.
    if study.mesh.symmetry in ((), ("x",)):
        with study.progress.stage("motion of the best path"):
            alone = Candidate(first.name, 0, first.points)
            study.solve_candidates(mesh, trajectory, [alone], to_look_at=True)
    study.context.summary["search"] = {
        "paths": len(chains),
        "checked": len(outcome.checked),
        "risk_that_an_unchecked_one_is_better": outcome.risk,
        "best": {
            "name": first.name,
            "points_mm": first.points.tolist(),
            "length_mm": first.length_mm,
            "J_hat_mm": first.j_hat,
            "predicted_J_hat_mm": first.predicted_mm,
        },
    }
    return study.search


def _is_printable(study: Study, points: Array) -> bool:
    """Return True if a waveguide can be printed along a path (h, 3) in mm."""
    try:
        bar_of(study.job.unit, points)
    except InputError:
        return False
    return True


def _response(study: Study, stable: Trajectory, graph: Graph) -> Response:
    """The response that ranks paths, about Model A's motion so far, `stable`."""
    assert study.mesh is not None
    job = study.job
    mesh, trajectory = whole_body(study.mesh, stable)
    monitor = probe(mesh, study.anchors)
    return bar_response(job.model(mesh), job.materials(mesh), job.unit.printed, trajectory, monitor, graph)


def _predicted(study: Study, graph: Graph, chains: list[tuple[int, ...]]) -> Array:
    """Predicted J_hat (n,) in mm of every chain."""
    assert study.mesh is not None
    monitor = probe(study.mesh, study.anchors)
    model, materials = study.job.model(study.mesh), study.job.materials(study.mesh)
    stable = _stable(study, model, materials, parities(model), "The ranking of paths leaves")
    if not loaded(stable):
        raise ConvergenceError(
            "the unit is unstable at every pressure of the protocol, so that its paths cannot be ranked",
            "--paths graph",
            "simulate smaller pressures, or leave out --paths graph",
        )
    found = _response(study, stable, graph)
    pressures = np.array([s.pressure_MPa for s in loaded(stable)])
    gradients = gradients_of(stable, study.anchors, monitor, study.job.stations)
    shares = shares_of_time(stable)
    # Not all displacements at once: there may be tens of thousands of paths.
    parts = [chains[i : i + 2000] for i in range(0, len(chains), 2000)]
    return np.concatenate(
        [mean_deviation(gradients, found.displacements(part, pressures), shares) for part in parts]
    )


def _write(study: Study, paths: list[LatticePath]) -> None:
    """paths.csv: every path, the solved ones first, by J_hat or else by its prediction."""
    rows = [
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
    columns = ["path", "length_mm", "predicted_J_hat_mm", "J_hat_mm", "on_front", "points_mm"]
    write_csv(study.folder / PATHS, columns, rows)
