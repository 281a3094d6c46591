"""Tables of a study's motion: every instant; stretch and self-contact of every state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...body.joint_stretch import joint_stretch
from ...design.body import covering
from ...fem.bending_angle import TipSection
from ...fem.kinematics import cavity_volume_mm3
from ...fem.state import State
from ...fem.stress import peak_stretch
from ...files import write_csv
from ...meshing.mesh import LATTICE, MEMBRANE, Mesh
from ...report.results import SELF_CONTACT_COLUMNS, STRETCH_COLUMNS

if TYPE_CHECKING:
    from ...fem.model import Model
    from .job import Job

Array = np.ndarray[Any, Any]
Row = tuple[str, ...]


def in_order(job: Job, states: Sequence[State]) -> list[tuple[float, State]]:
    """Pressure in kPa and state of a motion as far as it was computed.

    One state a pressure, ascending; one an instant where contact, the wall or an effect has history.
    """
    if _has_history(job):
        return [(p, s) for _, p, s in instants(job, states)]
    return [(s.pressure_kPa, s) for s in sorted(states, key=lambda s: s.pressure_MPa)]


def instants(job: Job, states: Sequence[State]) -> list[tuple[float, float, State]]:
    """Time in s, supplied pressure in kPa and state of every instant of the protocol that was reached."""
    time, effective = job.samples
    by_pressure = {round(s.pressure_kPa, 9): s for s in states}
    at = states if job.in_time else [by_pressure.get(p) for p in effective.tolist()]
    found = zip(time.tolist(), job.supplied_kPa.tolist(), at, strict=False)
    return [(t, p, state) for t, p, state in found if state is not None]


def _has_history(job: Job) -> bool:
    """Return True if the way back differs from the way there."""
    return job.in_time or job.effects.in_time


MOTION = "motion.csv"
MOTION_COLUMNS = ("time_s", "pressure_kPa", "angle_deg", "tip_x_mm", "tip_y_mm", "tip_z_mm", "volume_mm3")


def write_motion(folder: Path, job: Job, mesh: Mesh, states: Sequence[State]) -> dict[str, float]:
    """Write motion.csv; return the angle in degrees by pressure, ascending. Raises OutputError.

    A row an instant that was reached: the tip is the middle of its end plane, the volume that of the whole
    cavity without the inlet. With effects in time `effective_kPa` is the pressure on the unit without them.
    """
    tip = TipSection.of(mesh)
    reached = instants(job, states)
    measured = {
        id(s): (tip.angle_deg(s.u) + 0.0, *tip.middle_mm(s.u), cavity_volume_mm3(mesh, s.u))
        for _, _, s in reached
    }
    head = [*MOTION_COLUMNS, *(["effective_kPa"] if job.effects.in_time else [])]
    rows = [(t, p, *measured[id(s)], s.pressure_kPa)[: len(head)] for t, p, s in reached]
    write_csv(folder / MOTION, head, [(f"{t:.9g}", *(f"{v:.6g}" for v in row)) for t, *row in rows])
    # Of a pressure met twice, what it was the first time.
    first = {p: angle for _, p, angle, *_ in reversed(rows)}
    return {f"{p:.6g}": first[p] for p in sorted(first)}


def write_stretch(
    folder: Path, job: Job, model: Model, states: Sequence[State], cache: Path | None = None
) -> list[Row]:
    """Write the largest stretches of wall, struts and joints in every state, and where; return the rows.

    cache: as in `joint_stretch`.
    """
    mesh, elongation = model.mesh, job.unit.material.elongation_at_break
    d = covering(job.unit.printed, job.body)
    rows: list[Row] = []
    for state in states:
        found = {"wall": peak_stretch(mesh, state.u, MEMBRANE)}
        found["struts"] = peak_stretch(mesh, state.u, LATTICE)
        joints = joint_stretch(model, job.materials(mesh), d, state.u, cache) if len(mesh.beams) else None
        if joints is not None:
            found["joints"] = joints
        for part, peak in found.items():
            place = (f"{x:.2f}" for x in peak.place_mm)
            share = f"{100.0 * (peak.exceeded - 1.0) / elongation:.3g}"
            values = (f"{peak.largest:.4f}", *place, f"{peak.exceeded:.4f}", share)
            rows.append((f"{state.pressure_kPa:.6g}", part, *values))
    write_csv(folder / "stretch.csv", list(STRETCH_COLUMNS), rows)
    return rows


def write_self_contact(folder: Path, model: Model, states: Sequence[State]) -> tuple[list[Row], list[Array]]:
    """Write the self-contact of every state; return the rows and the pressures (n,) in kPa at all nodes."""
    if model.self_contact is None:
        return [], []
    found = [model.self_contact.touch(state.u) for state in states]
    rows: list[Row] = []
    for state, touch in zip(states, found, strict=True):
        row = [f"{state.pressure_kPa:.6g}", f"{touch.force_N:.4g}", "", "", "", "", ""]
        if touch.force_N:
            node = int(touch.pressure_kPa.argmax())
            place = (f"{x:.2f}" for x in model.mesh.nodes[node])
            row[2:] = [f"{touch.gap_mm:.4f}", f"{touch.pressure_kPa[node]:.4g}", *place]
        rows.append(tuple(row))
    write_csv(folder / "self_contact.csv", list(SELF_CONTACT_COLUMNS), rows)
    return rows, [touch.pressure_kPa for touch in found]
