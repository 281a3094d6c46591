"""Quantities of the sensor: its disturbance of the backbone, and its light's change by bending."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..design.anchors import anchor_points, window
from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..design.waveguide import waveguide
from ..fem.bending_angle import TipSection
from ..fem.kinematics import probe
from ..placement.deviation import centreline
from ..sensing.embedded_waveguide import Joints, embed_waveguide
from ..sensing.guide import Optics
from ..sensing.light_law import Law, fit_law
from ..sensing.light_signal import response, signal_of_nodes
from .structure import WITHOUT, Condition, States, Structure

Array = np.ndarray[Any, Any]

STATIONS = 51


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
        points = anchor_points(structure.about)
        monitor = probe(structure.model.mesh, points)
        lines = {
            m: centreline(
                np.array(
                    [points + monitor.displacement(states[Condition(m, p)]) for p in self.pressures_kPa]
                ),
                STATIONS,
            )
            for m in (WITHOUT, self.path)
        }
        return float(np.linalg.norm(lines[self.path] - lines[WITHOUT], axis=-1).mean())


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
        """Value in 1/deg. Raises InputError where the path has no room for a waveguide."""
        unit: Unit = structure.about
        mesh = structure.model.mesh
        chosen = window(unit, self.path)
        anchors = anchor_points(unit)
        numbers = list(chosen.indices)
        bar = embed_waveguide(waveguide(unit, chosen), anchors[numbers], unit.printed)
        joints = Joints.of(mesh, anchors, unit.dimensions.cell)
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
