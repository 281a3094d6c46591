"""Deviation of every candidate path estimated from Model A's states under pressure, before any is solved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...body.response import bar_response
from ...design.anchors import anchor_points, windows
from ...design.quantity import in_MPa
from ...fem.kinematics import probe
from ...fem.trajectory import Trajectory, whole_body
from ...placement.graph import Graph
from ...placement.sensitivity_map import gradients_of, mean_deviation
from ...run.cache import Cache, key

if TYPE_CHECKING:
    from ...fem.state import State
    from ...meshing.mesh import Mesh
    from .job import Job

Array = np.ndarray[Any, Any]


def column_graph(anchors: Array, cell: float) -> Graph:
    """The graph of the anchors (n, 3) in mm alone, each with a step to the next; cell in mm."""
    numbers = np.arange(len(anchors))
    return Graph(anchors, np.stack([numbers[:-1], numbers[1:]], axis=1), numbers, cell)


def estimated_J_mm(job: Job, cache: Cache, mesh: Mesh, states: Sequence[State]) -> dict[str, float]:
    """Estimate of J_hat in mm of every candidate path, by its name; kept in the cache.

    states: of Model A on the mesh at the protocol's pressures above 0. The response (`body.response`) is
    taken at the highest, and in proportion at the others; in suction a path is taken to deviate as much as
    under a pressure of the same size. Measured: 5 to 22 % low, the order right but for neighbours; it says
    what to look at first, and is no ground for a choice.

    Raises IndefiniteError where Model A is unstable, InputError where the mesh is too coarse.
    """
    names = [w.name for w in windows(job.unit.chambers.count)]
    name = key(
        mesh.hash(), job.materials(mesh).hash(), *job.samples, job.newton, job.stations, *job.effects.parts
    )
    kept = cache.get("estimate", name)
    if kept is None:
        kept = {"J_mm": _estimated(job, mesh, sorted(states, key=lambda state: state.pressure_MPa))}
        cache.put("estimate", name, kept)
    return dict(zip(names, kept["J_mm"].tolist(), strict=True))


def _estimated(job: Job, mesh: Mesh, states: Sequence[State]) -> Array:
    """Estimates (c,) as of `estimated_J_mm`; states in order of their pressure."""
    pressure = np.array([state.pressure_kPa for state in states])
    anchors, cell = anchor_points(job.unit), job.unit.printed.cell
    gradients = gradients_of(_motion(states, mesh), anchors, probe(mesh, anchors), job.stations)
    # A path's forces off the mirror plane need both sides.
    whole, last = whole_body(mesh, _motion(states[-1:], mesh))
    monitor = probe(whole, anchors)
    response = bar_response(
        job.model(whole), job.materials(whole), job.unit.printed, last, monitor, column_graph(anchors, cell)
    )
    chains = [tuple(map(int, w.indices)) for w in windows(job.unit.chambers.count)]
    moved = response.displacements(chains, in_MPa(pressure))
    distance = np.array([mean_deviation(gradients, moved, one) for one in np.eye(len(states))])
    known, size = np.append(0.0, pressure), np.abs(job.samples[1])
    return np.array([np.interp(size, known, np.append(0.0, row)).mean() for row in distance.T])


def _motion(states: Sequence[State], mesh: Mesh) -> Trajectory:
    """Some states as a motion, an instant each."""
    pressure = np.array([state.pressure_kPa for state in states])
    return Trajectory(pressure, pressure, tuple(states), np.arange(len(states)), mesh)
