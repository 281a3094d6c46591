"""A unit's motion and its sensors' without a solver: by formulas, on a printed mesh."""

import functools

import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem.kinematics import probe
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import Trajectory
from mu_addon.meshing.settings import MeshSettings

from .unit_runs import ran

UNIT = load_preset("mu-1.0x").evolve(count=4)
MESH = MeshSettings(refine=0.35)


@functools.cache
def mesh():
    """The half mesh of `UNIT`."""
    return mesh_printed(UNIT, MESH)


def bent(mesh, angle_deg):
    """Displacements (n, 3) in mm: sections turn toward +y with their height, by angle_deg at the tip."""
    y, z = mesh.nodes[:, 1], mesh.nodes[:, 2]
    turn = np.radians(angle_deg) * np.clip(z / z.max(), 0.0, None)
    # About the middle of the base: sections stay plane.
    u = np.zeros_like(mesh.nodes)
    u[:, 1] = y * np.cos(turn) + z * np.sin(turn) - y
    u[:, 2] = -y * np.sin(turn) + z * np.cos(turn) - z
    turns, first = np.unique(mesh.beams[:, 1::2], return_index=True)
    u[turns] = [-1.0, 0.0, 0.0] * turn[mesh.beams[:, 0::2].ravel()[first], None]
    return u


def state(mesh, pressure_MPa, more=1.0):
    """Bent by half a degree at 1 kPa, more and more at higher pressure, `more` times as far."""
    p = 1e3 * pressure_MPa
    return State(pressure_MPa, bent(mesh, more * (0.5 * p + 0.01 * p**2)))


def motion(mesh, time_s, pressure_kPa):
    """Model A's motion through the pressures (k,) in kPa at times (k,) in s."""
    distinct, index = np.unique(pressure_kPa, return_inverse=True)
    states = tuple(state(mesh, p / 1e3) for p in distinct)
    return Trajectory(np.asarray(time_s), np.asarray(pressure_kPa), states, index.ravel(), mesh)


class Waveguides:
    """Stands for `PrintedWaveguides`: candidate n bends the unit 0.95 - n/100 times as far."""

    along = 0.0
    """What a path from rest adds to that factor."""

    def __init__(self, unit, mesh, paths, anchors, *_):
        self.mesh, self.anchors, self.monitor = mesh, anchors, probe(mesh, anchors)

    def states(self, number, way):
        return [state(self.mesh, way[-1].pressure_MPa, 0.95 - 0.01 * number)]

    def alone(self, number, pressures_MPa):
        more = 0.95 - 0.01 * number + self.along
        return self.points([state(self.mesh, p, more) for p in pressures_MPa])

    def points(self, states):
        return np.array([self.anchors + self.monitor.displacement(s.u) for s in states])

    def of_unit(self, number, own):
        return own.u


def place(folder, job):
    """Run a study in a folder, in this process; its motion, map and lattice's paths are made up."""
    from mu_addon.placement.sensitivity_map import Influence, loaded
    from mu_addon.simulate_and_place import graph_search

    def influence(model, materials, trajectory, monitor, pressures, sides):
        height = model.mesh.nodes[model.mesh.corners].mean(axis=1)[:, 2]
        moved = np.zeros((len(pressures), len(monitor.nodes), 3, len(height)))
        moved[:, :, 1] = 1e-6 * height
        assert len(loaded(trajectory, pressures)) == len(pressures)
        return Influence(pressures, moved)

    def predicted(mechanics, motion, limits, stations):
        _, chains = graph_search.chains_within(mechanics.unit, limits)
        return graph_search.Predicted(0.1 + np.arange(len(chains)), ())

    made_up = {
        "compared_pressures.PrintedWaveguides": Waveguides,
        "graph_search.influence_map": influence,
        "graph_search.predicted": predicted,
        "graph_search.stable_part": lambda model, materials, motion, sides: motion,
        "motion.state_after": lambda equilibrium, p, earlier: state(equilibrium.model.mesh, p / 1e3),
        # Seeking crossings in made-up states takes minutes.
        "motion_checks.first_self_intersection": lambda *_: None,
        "place_stages.estimated_J_mm": lambda *_: {"alpha1": 1.0},
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, value in made_up.items():
            patch.setattr(f"mu_addon.simulate_and_place.{name}", value)
        ran(job, folder)
