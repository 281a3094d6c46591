"""What benchmarks of printed units share: a protocol outward from rest, a study in a folder of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mu_addon.fem.protocol import Protocol
from mu_addon.run.context import RunContext
from mu_addon.run.execution import Execution
from mu_addon.run.progress import Progress
from mu_addon.studies.starting import begin_study
from mu_addon.studies.unit_ranking import UnitStudy


def outward(pressures_kPa: Sequence[float]) -> Protocol:
    """From rest outward on either side, suction first: each state starts from one nearer to rest."""
    pressures = [0.0, *sorted((p for p in pressures_kPa if p < 0), reverse=True)]
    if any(p > 0 for p in pressures_kPa):
        pressures += [*([0.0] if len(pressures) > 1 else []), *sorted(p for p in pressures_kPa if p > 0)]
    return Protocol(np.arange(float(len(pressures))), np.array(pressures))


def run_study(job: UnitStudy, folder: Path) -> dict[str, Any]:
    """The study's summary; a run that was stopped goes on in its folder. May raise MuError."""
    context = RunContext(Progress())
    begin_study(job, folder, context)
    Execution(job, folder, context).run()
    return context.summary


def angles_deg(summary: dict[str, Any]) -> dict[float, float]:
    """Bending angle in degrees by pressure in kPa."""
    return {float(pressure): angle for pressure, angle in summary["angle_deg"].items()}
