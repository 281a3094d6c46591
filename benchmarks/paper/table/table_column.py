"""One column of the paper's table: one unit on one mesh, its motion and all ten paths by both rules."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import Unit
from mu_addon.design.quantity import in_kPa
from mu_addon.fem.bending_angle import TipSection
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.self_intersection import first_self_intersection
from mu_addon.fem.state import State, rest
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import Mesh
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.candidates import candidate_paths, roi
from mu_addon.placement.deviation import Deviation, centreline, centreline_deviation
from mu_addon.placement.sampling import polynomials

from ..inclusion_rules import RULES, sensor_share

Array = np.ndarray[Any, Any]

# Pressures in kPa at which paths are solved; between them, and through 0, deviations are a polynomial.
SOLVED_KPA = (-20.0, 20.0, 40.0)
# The same where many units are solved: the protocol's ends.
ENDS_KPA = (-20.0, 40.0)
STATIONS = 51


@attrs.frozen(eq=False)
class Motion:
    """Model A: its states in kPa ascending with 0, the angle at each in degrees, where walls first cross.

    crossing_kPa: pressures, of either sign, from which walls pass through each other; none if empty.
    """

    pressure_kPa: Array
    angle_deg: Array
    states: tuple[State, ...]
    crossing_kPa: tuple[float, ...]

    def angle_at(self, pressure_kPa: float) -> float:
        """Bending angle in degrees at a pressure that was solved."""
        return float(self.angle_deg[np.argmin(np.abs(self.pressure_kPa - pressure_kPa))])


@attrs.frozen(eq=False)
class Paths:
    """What every path does by every rule at some pressures: plain arrays, so that they can be kept.

    pressure_kPa (s,); still (s, p, 3) the anchors without a sensor and apart (s, rules, paths, p, 3) how far
    each path moves them from there, in mm; volume_ratio (rules, paths), what a rule stiffens over the
    sensor's own volume.
    """

    rules: tuple[str, ...]
    pressure_kPa: Array
    still: Array
    apart: Array
    volume_ratio: Array

    def deviations(self, rule: str, at_rest: Array, samples_kPa: Array) -> list[Deviation]:
        """Deviation of every path over a protocol's samples (k,) in kPa; at_rest (p, 3): the anchors in mm.

        A polynomial through the pressures and through 0 at rest gives the others.
        """
        between = polynomials(self.pressure_kPa, samples_kPa)
        baseline = at_rest + np.tensordot(between, self.still - at_rest, axes=1)
        apart = np.tensordot(between, self.apart[:, self.rules.index(rule)], axes=1)
        lines = centreline(baseline, STATIONS)
        return [
            centreline_deviation(centreline(baseline + apart[:, i], STATIONS), lines)
            for i in range(apart.shape[1])
        ]

    def J_hat(self, rule: str, at_rest: Array, samples_kPa: Array) -> Array:
        """J_hat (paths,) in mm."""
        return np.array([d.J_hat for d in self.deviations(rule, at_rest, samples_kPa)])


def with_fixed_base(mesh: Mesh, height_mm: float) -> Mesh:
    """The mesh with all of its nodes up to a height held fast, as a fixture around the base would."""
    return attrs.evolve(mesh, base=np.flatnonzero(mesh.nodes[:, 2] <= height_mm * (1 + 1e-9)))


def motion(
    unit: Unit, mesh: Mesh, pressures_kPa: Sequence[float], look_for_self_intersection: bool = True
) -> Motion:
    """Model A through some pressures, each once. Raises ConvergenceError."""
    model = Model(mesh, threads=1)
    pressure = np.unique([0.0, *pressures_kPa])
    body = Equilibrium(model, materials_of(unit, mesh))
    states = simulate(body, np.arange(len(pressure), dtype=float), pressure).states
    tip = TipSection.of(mesh)
    angle = np.array([tip.angle_deg(s.u) for s in states])
    crossing = _crossings(mesh, states) if look_for_self_intersection else ()
    return Motion(pressure, angle, states, crossing)


def _crossings(mesh: Mesh, states: Sequence[State]) -> tuple[float, ...]:
    found = []
    for sign in (-1, 1):
        outward = sorted((s for s in states if s.pressure_MPa * sign > 0), key=lambda s: abs(s.pressure_MPa))
        first = first_self_intersection(mesh, [rest(mesh), *outward]) if outward else None
        if first is not None:
            found.append(in_kPa(first.pressure_MPa))
    return tuple(found)


def paths(
    unit: Unit,
    mesh: Mesh,
    moved: Motion,
    rules: Sequence[str] = RULES,
    solved_kPa: Sequence[float] = SOLVED_KPA,
) -> Paths:
    """Every window by every rule at some of the pressures of Model A. Raises ConvergenceError."""
    points = anchor_points(unit)
    every = candidate_paths(points, windows(len(points)))
    found = [roi(mesh, path, unit.dimensions.inclusion_radius) for path in every]
    shares = [sensor_share(rule, one) for rule in rules for one in found]
    monitor = probe(mesh, points)
    states = [moved.states[int(np.argmin(np.abs(moved.pressure_kPa - p)))] for p in solved_kPa]
    batch = CandidateBatch(
        Model(mesh, threads=1),
        materials_of(unit, mesh),
        (points, monitor),
        shares,
        unit.material.sensor_modulus_MPa,
    )
    still = np.array([points + monitor.displacement(s.u) for s in states])
    apart = np.array([batch.at(s) - at for s, at in zip(states, still, strict=True)])
    volumes = _volumes(mesh)
    ratio = [
        2 ** len(mesh.symmetry) * float(share @ volumes) / one.cylinder_volume_mm3
        for share, one in zip(shares, found * len(rules), strict=True)
    ]
    shape = len(rules), len(every)
    return Paths(
        tuple(rules),
        np.array(solved_kPa, float),
        still,
        apart.reshape(len(states), *shape, *points.shape),
        np.reshape(ratio, shape),
    )


def _volumes(mesh: Mesh) -> Array:
    """Volumes (m,) in mm3 of the tetrahedra between their corners."""
    a, b, c, d = np.moveaxis(mesh.nodes[mesh.corners], 1, 0)
    return np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)) / 6
