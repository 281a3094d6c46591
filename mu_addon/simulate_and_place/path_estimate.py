"""Deviation of every candidate path estimated from Model A's states under pressure, before any is solved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array
from ..body.response import bar_response
from ..design.anchors import anchor_points, windows
from ..design.quantity import in_MPa
from ..fem.kinematics import probe
from ..fem.trajectory import Trajectory, whole_body
from ..placement.graph import Graph
from ..placement.sensitivity_map import gradients_of, mean_deviation

if TYPE_CHECKING:
    from ..fem.state import State
    from ..meshing.mesh import Mesh
    from .mechanics import Mechanics, Samples


def column_graph(anchors: Array, cell: float) -> Graph:
    """The graph of the anchors (n, 3) in mm alone, each with a step to the next; cell in mm."""
    numbers = np.arange(len(anchors))
    return Graph(anchors, np.stack([numbers[:-1], numbers[1:]], axis=1), numbers, cell)


def estimated_J_mm(
    mechanics: Mechanics, mesh: Mesh, states: Sequence[State], samples: Samples, stations: int
) -> dict[str, float]:
    """Estimate of J_hat in mm of every candidate path, by its name.

    states: of Model A on the mesh at the protocol's pressures above 0, ascending. The response
    (`body.response`) is taken at the highest, and in proportion at the others; in suction a path is taken to
    deviate as much as under a pressure of the same size. Measured: 5 to 22 % low, the order right but for
    neighbours; it says what to look at first, and is no ground for a choice.

    Raises IndefiniteError where Model A is unstable, InputError where the mesh is too coarse.
    """
    unit = mechanics.unit
    pressure = np.array([state.pressure_kPa for state in states])
    anchors, cell = anchor_points(unit), unit.printed.cell
    gradients = gradients_of(_motion(states, mesh), anchors, probe(mesh, anchors), stations)
    # A path's forces off the mirror plane need both sides.
    whole, last = whole_body(mesh, _motion(states[-1:], mesh))
    monitor = probe(whole, anchors)
    model, materials = mechanics.model(whole), mechanics.materials(whole)
    response = bar_response(model, materials, unit.printed, last, monitor, column_graph(anchors, cell))
    paths = windows(unit.chambers.count)
    moved = response.displacements([tuple(map(int, w.indices)) for w in paths], in_MPa(pressure))
    distance = np.array([mean_deviation(gradients, moved, one) for one in np.eye(len(states))])
    known, size = np.append(0.0, pressure), np.abs(samples.pressure_kPa)
    J = [float(np.interp(size, known, np.append(0.0, row)).mean()) for row in distance.T]
    found = dict(zip([w.name for w in paths], J, strict=True))
    return dict(sorted(found.items(), key=lambda one: one[1]))


def _motion(states: Sequence[State], mesh: Mesh) -> Trajectory:
    """Some states as a motion, an instant each."""
    pressure = np.array([state.pressure_kPa for state in states])
    return Trajectory(pressure, pressure, tuple(states), np.arange(len(states)), mesh)
