"""Quantities of the sensor: its disturbance of the backbone, and its light's change by bending."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..design.anchors import anchor_points, window
from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..design.waveguide import waveguide
from ..errors import InputError, MeshingError
from ..fem.bending_angle import TipSection
from ..fem.kinematics import numbers_of
from ..placement.deviation import centreline
from ..sensing.embedded_waveguide import Joints, embed_waveguide
from ..sensing.light_law import Law, fit_law
from ..sensing.light_signal import response, signal_of_nodes
from ..sensing.optics import Optics
from .structure import WITHOUT, Condition, States, Structure

STATIONS = 51
STEP_MM = 1e-5
"""Half step of an anchor for the slope of the deviation."""


@attrs.frozen
class Disturbance:
    """Deviation J_hat in mm of the backbone by the sensor along a path, the mean over some pressures in kPa.

    Equally weighted pressures; `place` weighs them by the time that its protocol spends there.
    """

    name: str
    path: str
    pressures_kPa: tuple[float, ...]

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Each pressure, with and without the sensor."""
        return tuple(Condition(m, p) for p in self.pressures_kPa for m in (WITHOUT, self.path))

    def value(self, structure: Structure, states: States) -> float:
        """Value in mm."""
        anchors, numbers = _anchors(structure)
        return float(np.mean([_apart(*self._moved(anchors, numbers, states, p)) for p in self.pressures_kPa]))

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3) of each body, unitless, by differences at the anchors."""
        anchors, numbers = _anchors(structure)
        found = {}
        for p in self.pressures_kPa:
            lines = self._moved(anchors, numbers, states, p)
            for k, path in enumerate((WITHOUT, self.path)):
                own = found[Condition(path, p)] = np.zeros_like(states[Condition(path, p)])
                for node, axis in np.ndindex(anchors.shape):
                    step = np.zeros_like(anchors)
                    step[node, axis] = STEP_MM
                    ahead, behind = (
                        _apart(*(line + sign * step * (i == k) for i, line in enumerate(lines)))
                        for sign in (1.0, -1.0)
                    )
                    own[numbers[node], axis] = (ahead - behind) / (2.0 * STEP_MM * len(self.pressures_kPa))
        return found

    def _moved(self, anchors: Array, numbers: Array, states: States, pressure_kPa: float) -> list[Array]:
        """The anchors (p, 3) in mm without and with the sensor."""
        return [anchors + states[Condition(m, pressure_kPa)][numbers] for m in (WITHOUT, self.path)]


def _anchors(structure: Structure) -> tuple[Array, Array]:
    """Anchors (p, 3) in mm of a unit, and their nodes (p,): of every mesh of it, with a sensor or without."""
    anchors = anchor_points(structure.about)
    return anchors, structure.once("anchors", lambda: numbers_of(structure.model.mesh, anchors))


def _apart(one: Array, other: Array) -> float:
    """Mean distance in mm of two backbones through anchors (p, 3) in mm."""
    lines = centreline(np.array([one, other]), STATIONS)
    return float(np.linalg.norm(lines[1] - lines[0], axis=-1).mean())


@attrs.frozen
class SensorSlope:
    """Size of the light's relative change by bending at rest, 1/deg, of the waveguide along a path.

    By the fast law of the waveguide (`sensing.law`) through Model A's states at some pressures in kPa and at
    rest; the waveguide itself follows the lattice, as in `place`. The law is fitted to traced rays, whose
    scatter would exceed its change between two similar units: their difference is by one law.
    """

    name: str
    path: str
    pressures_kPa: tuple[float, ...]

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Each pressure, without the sensor."""
        return tuple(Condition(WITHOUT, p) for p in self.pressures_kPa)

    def value(self, structure: Structure, states: States) -> float:
        """Value in 1/deg. Raises MeshingError where the path has no room for a waveguide."""
        unit: Unit = structure.about
        mesh = structure.model.mesh
        chosen = window(unit, self.path)
        anchors = anchor_points(unit)
        numbers = list(chosen.indices)
        try:
            bar = embed_waveguide(waveguide(unit, chosen), anchors[numbers], unit.printed)
        except InputError as error:
            # Another design may have room for it.
            raise MeshingError(error.what, error.where, error.remedy) from error
        joints = Joints.of(mesh, anchors)
        tip = TipSection.of(mesh)
        displacements = [np.zeros_like(mesh.nodes), *(states[c] for c in self.conditions)]
        moved = [tuple(part[numbers] for part in joints.moved(u)) for u in displacements]
        law = structure.once("light", lambda: _law(unit.printed))
        light = signal_of_nodes(law, bar, moved)  # type: ignore[arg-type]
        angle = np.array([tip.angle_deg(u) for u in displacements])
        return abs(response(angle, light.transmitted, 0.0).sensitivity_per_deg)


def _law(d: Dimensions) -> Law:
    """The waveguide's law, fitted once for the lengths that it depends on."""
    sizes = (
        d.cell, d.waveguide_section, d.well_width, d.well_depth, d.well_pitch, d.waveguide_end,
        d.junction_diameter,
    )  # fmt: skip
    known = _LAWS.get(sizes)
    if known is None:
        known = _LAWS[sizes] = fit_law(d, Optics())
    return known


_LAWS: dict[tuple[float, ...], Law] = {}
