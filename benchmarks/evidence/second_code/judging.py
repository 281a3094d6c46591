"""The judge's side: the engine's verdict on a folder, and what it is worth beside the truth."""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mu_addon.design.parameters import read_unit
from mu_addon.errors import MuError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import Parameter
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.blocked_force import BlockedForce
from mu_addon.evidence.prediction.pressure_step import PressureStep
from mu_addon.evidence.prediction.unit_pose import STATIONS, UnitPose
from mu_addon.evidence.prediction.unit_pressure import UnitPressure, UnitResponse, Variant
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.verdict import Verdict
from mu_addon.measured import Experiment, read_folder
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress, terminal
from mu_addon.studies.diagnose import Diagnose
from mu_addon.studies.starting import start

from .recording import write
from .sets import Order, made, noise_of
from .units import bent, force

# What two codes of a unit differ by, as the engine believes.
DISCREPANCY = 0.04
PRESSURES = np.linspace(-25.0, 50.0, 61)
# Faults of what measures and holds: naming one of them blames no part of the unit or its resin.
INSTRUMENTS = frozenset(
    (
        "pressure_offset", "pressure_gain", "pressure_nonlinearity", "pressure_drift", "force_scale",
        "force_nonlinearity", "force_drift", "force_lag", "angle_offset", "angle_drift", "camera_scale",
        "camera_tilt", "camera_perspective", "lens_distortion", "clock_offset", "line_lag", "led_drift",
        "ambient_light", "seating", "frame_compliance", "marker_slip",
    )
)  # fmt: skip
WEIGHT = Parameter("density_kg_m3", "kg/m3", 0.0, 2500.0, 0.0, (1000.0,))
STANDS_OFF = Parameter("tip_gap_mm", "mm", 0.0, 3.0, 0.0, (0.2,))


def simulator_of(experiments: Sequence[Experiment]) -> Composite:
    """The judge's models: its own of the bench, and a table of another code's unit."""
    found: dict[str, Any] = dict(bench_simulators(experiments))
    kinds = {e.kind for e in experiments}
    if "unit_pressure" in kinds:
        volume = UnitResponse(
            ("volume_mm3",), PRESSURES, 900.0 * np.arctan(PRESSURES / 30.0)[None], discrepancy=DISCREPANCY
        )
        found["unit_pressure"] = UnitPressure([volume], experiments)
    if "pressure_step" in kinds:
        found["pressure_step"] = PressureStep([_angle()], experiments)
    if "unit_pose" in kinds:
        found["unit_pose"] = UnitPose([_angle(s) for s in STATIONS], experiments)
    if "blocked_force" in kinds:
        sizes = (0.0, 0.5, 1.5, 3.0)
        gaps = {"seating": Variant(STANDS_OFF, sizes, [force(PRESSURES, g)[None] for g in sizes])}
        pressed = UnitResponse(("force_N",), PRESSURES, force(PRESSURES)[None], gaps, discrepancy=DISCREPANCY)
        found["blocked_force"] = BlockedForce([pressed], experiments)
    return Composite(found)


def _angle(orientation_deg: float = 0.0) -> UnitResponse:
    sizes = (0.0, 500.0, 1200.0, 2500.0)
    values = [bent(PRESSURES, s / 1000.0, orientation_deg)[None] for s in sizes]
    weight = {"gravity": Variant(WEIGHT, sizes, values)}
    return UnitResponse(
        ("angle_deg",), PRESSURES, values[0], weight, 1.0, orientation_deg, discrepancy=DISCREPANCY
    )


def judged(of: Order) -> dict[str, Any]:
    """One set as a row of plain data: what was hidden, what was said, and what that is worth."""
    began = time.process_time()
    row: dict[str, Any] = {
        "part": of.part, "kind": of.kind, "truth": list(of.truth), "faults": of.faults, "noise": of.noise,
        "level": of.level, "seed": of.seed,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "measured"
        write(folder, made(of))
        try:
            experiments = read_folder(folder).experiments
            verdict = diagnose(experiments, simulator_of(experiments))
        except MuError as error:
            return {**row, "verdict": "refused", "outcome": "refused", "names": [], "said": str(error)}
    causes = verdict.selection.causes
    return {
        **row,
        "verdict": verdict.kind,
        "names": list(verdict.names),
        "of": [c.effect.whose or c.effect.among for c in causes],
        "ambiguity": sorted(_set(verdict)),
        "left": list(verdict.selection.left),
        "doubted": verdict.selection.doubted,
        "partly": list(verdict.selection.chosen.names),
        "share": verdict.share_taken,
        "error_over_noise": error_over_noise(of, experiments, verdict),
        "values": {k: verdict.selection.chosen.values[k] for k in verdict.intervals},
        "intervals": {k: list(v) for k, v in verdict.intervals.items()},
        "outcome": lab_outcome(of, verdict) if of.part == "lab" else outcome(of.truth, verdict),
        "seconds": round(time.process_time() - began, 2),
    }


def error_over_noise(of: Order, experiments: Sequence[Experiment], verdict: Verdict) -> float:
    """The largest root mean square error of the base model in an experiment, over the noise that was added.

    Both of the channel that was measured, without readings that were set aside.
    """
    values, noise, worst = verdict.selection.base.values, noise_of(of), 0.0
    simulator = simulator_of(experiments)
    for e in verdict.experiments:
        for row, channel in enumerate(simulator.channels(e)):
            if (added := added_to(noise, e, channel)) is not None:
                off = e[channel] - simulator.predict(e, values)[row]
                worst = max(worst, float(np.sqrt(np.nanmean(off**2))) / added)
    return worst


def added_to(noise: Mapping[tuple[str, str], float], e: Experiment, channel: str) -> float | None:
    """Noise added to a predicted channel, in its unit; of a stress read as a force by the section."""
    if channel == "stress_kPa" and e.section_mm and (newton := noise.get((e.name, "force_N"))) is not None:
        return 1e3 * newton / (e.section_mm[0] * e.section_mm[1])
    return noise.get((e.name, channel))


def _set(verdict: Verdict) -> set[str]:
    return {title.split(" of ")[0].split(" among ")[0] for title in verdict.ambiguity}


def lab_outcome(of: Order, verdict: Verdict) -> str:
    """As `outcome`, of a mishap that any of several names is right for: in_set where one of them is there."""
    found = outcome((), verdict)
    return "in_set" if found in ("wrong", "wrong_set") and set(of.truth) & _set(verdict) else found


def outcome(truth: Sequence[str], verdict: Verdict) -> str:
    """What a verdict is worth: exact, in_set, partly, wrong, wrong_set, none, unexplained, unidentifiable.

    Of a set with nothing in it that the library has: none, unexplained, unidentifiable, wrong (one cause is
    named) or wrong_set. Of effects: exact, all named and no more; in_set, all among those named and their
    rivals; partly, some named and nothing else; wrong, something is named that is not there.
    """
    if verdict.kind not in ("named", "ambiguous"):
        return verdict.kind
    names, every, hidden = set(verdict.names), _set(verdict), set(truth)
    if hidden and hidden <= names and not names - hidden and verdict.kind == "named":
        return "exact"
    if hidden and hidden <= every and len(names) <= len(hidden):
        return "in_set"
    if verdict.kind == "named":
        return "partly" if hidden and names <= hidden else "wrong"
    return "partly" if hidden & every else "wrong_set"


def verdict_on(folder: Path, unit: Path, out: Path) -> dict[str, Any]:
    """The program's verdict on a folder, in one folder for all sets: its simulations are kept there."""
    with run_to_end(Progress([terminal(sys.stderr)])) as context:
        study = Diagnose(data=read_folder(folder), unit=read_unit(unit)).complete()
        start(study, out, context)
    if context.status:
        raise SystemExit(context.status)
    return dict(json.loads((out / "verdict.json").read_text()))
