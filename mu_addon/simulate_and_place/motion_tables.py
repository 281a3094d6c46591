"""Tables of a study's motion: every instant; stretch and self-contact of every state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from ..arrays import Array
from ..body.joint_stretch import joint_stretch
from ..design.body import covering
from ..fem.bending_angle import TipSection
from ..fem.kinematics import cavity_volume_mm3
from ..fem.self_contact import self_contact_of
from ..fem.state import State
from ..fem.stress import peak_stretch
from ..meshing.mesh import LATTICE, MEMBRANE, Mesh

if TYPE_CHECKING:
    from ..fem.model import Model
    from .mechanics import Mechanics, Samples

Row = tuple[str, ...]


MOTION = "motion.csv"
MOTION_COLUMNS = ("time_s", "pressure_kPa", "angle_deg", "tip_x_mm", "tip_y_mm", "tip_z_mm", "volume_mm3")


@attrs.frozen(eq=False)
class Reached:
    """The instants of a protocol that a motion has reached: time in s, supplied pressure in kPa, and state.

    in_time: the way back differs from the way there.
    """

    instants: tuple[tuple[float, float, State], ...]
    in_time: bool

    @classmethod
    def of(cls, samples: Samples, states: Sequence[State], by_instant: bool, in_time: bool) -> Reached:
        """Of states at some of a protocol's pressures, or at its first instants (by_instant)."""
        by_pressure = {round(s.pressure_kPa, 9): s for s in states}
        at = states if by_instant else [by_pressure.get(p) for p in samples.pressure_kPa.tolist()]
        found = zip(samples.time_s.tolist(), samples.supplied_kPa.tolist(), at, strict=False)
        return cls(tuple((t, p, state) for t, p, state in found if state is not None), in_time)

    @property
    def in_order(self) -> list[tuple[float, State]]:
        """Supplied pressure in kPa and state, one a pressure, ascending; one an instant with history."""
        if self.in_time:
            return [(p, s) for _, p, s in self.instants]
        return sorted({p: s for _, p, s in self.instants}.items())

    def rows(self, mesh: Mesh, has_effects: bool) -> tuple[list[str], list[tuple[float, ...]]]:
        """Columns and rows of motion.csv, one an instant.

        The tip is the middle of its end plane, the volume that of the whole cavity without the inlet.
        has_effects: with effects in time, `effective_kPa` is the pressure on the unit without them.
        """
        tip = TipSection.of(mesh)
        found = {
            id(s): (tip.angle_deg(s.u) + 0.0, *tip.middle_mm(s.u), cavity_volume_mm3(mesh, s.u))
            for _, _, s in self.instants
        }
        head = [*MOTION_COLUMNS, *(["effective_kPa"] if has_effects else [])]
        return head, [(t, p, *found[id(s)], s.pressure_kPa)[: len(head)] for t, p, s in self.instants]


def angles_of(rows: Sequence[Sequence[float]]) -> dict[str, float]:
    """Angle in degrees by pressure in kPa, ascending, of rows of motion.csv."""
    # Of a pressure met twice, what it was the first time.
    first = {p: angle for _, p, angle, *_ in reversed(rows)}
    return {f"{p:.6g}": first[p] for p in sorted(first)}


def stretch_rows(
    mechanics: Mechanics, model: Model, states: Sequence[State], cache: Path | None = None
) -> tuple[Row, ...]:
    """The largest stretches of wall, struts and joints in every state, and where: rows of stretch.csv.

    cache: as in `joint_stretch`.
    """
    elongation = mechanics.unit.material.elongation_at_break
    d = covering(mechanics.unit.printed, mechanics.body)
    mesh, materials = model.mesh, mechanics.materials(model.mesh)
    rows: list[Row] = []
    for state in states:
        found = {"wall": peak_stretch(mesh, state.u, MEMBRANE)}
        found["struts"] = peak_stretch(mesh, state.u, LATTICE)
        joints = joint_stretch(model, materials, d, state.u, cache) if len(mesh.beams) else None
        if joints is not None:
            found["joints"] = joints
        for part, peak in found.items():
            place = (f"{x:.2f}" for x in peak.place_mm)
            share = f"{100.0 * (peak.exceeded - 1.0) / elongation:.3g}"
            values = (f"{peak.largest:.4f}", *place, f"{peak.exceeded:.4f}", share)
            rows.append((f"{state.pressure_kPa:.6g}", part, *values))
    return tuple(rows)


@attrs.frozen(eq=False)
class SelfContactRows:
    """Contact of a unit with itself: rows of self_contact.csv, and pressure (n,) in kPa, of every state."""

    rows: tuple[Row, ...] = ()
    pressure_kPa: tuple[Array, ...] = ()


def self_contact_rows(mechanics: Mechanics, mesh: Mesh, states: Sequence[State]) -> SelfContactRows:
    """Self-contact of every state; none where it is not simulated."""
    if not mechanics.self_contact:
        return SelfContactRows()
    contact = self_contact_of(mechanics.unit, mesh, mechanics.self_friction)
    found = [contact.touch(state.u) for state in states]
    rows: list[Row] = []
    for state, touch in zip(states, found, strict=True):
        row = [f"{state.pressure_kPa:.6g}", f"{touch.force_N:.4g}", "", "", "", "", ""]
        if touch.force_N:
            node = int(touch.pressure_kPa.argmax())
            place = (f"{x:.2f}" for x in mesh.nodes[node])
            row[2:] = [f"{touch.gap_mm:.4f}", f"{touch.pressure_kPa[node]:.4g}", *place]
        rows.append(tuple(row))
    return SelfContactRows(tuple(rows), tuple(touch.pressure_kPa for touch in found))
