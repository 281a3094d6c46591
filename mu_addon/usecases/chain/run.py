"""`chain`: units in series, their motion under their pressures, or the pressures that reach a point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...chain.settings import REFINE
from ...run.context import RunContext
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .job import LAYOUT, Job, read_job
from .report import write_report
from .running import Running

JOINT_S = 300.0
"""Seconds in which a joint is learned on the default mesh at seven pressures."""


def run_chain(job: Job, folder: Path, context: RunContext) -> Running:
    """Learn the units' joints, solve the chain, write its motion and a report of all finished stages."""
    run = Running(job, folder, context)
    context.report = lambda stopped: write_report(run, stopped)
    run.run()
    return run


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a run's `summary`."""
    lines = []
    for joint in summary["joints"]:
        lines.append(
            f"{joint['unit']}: {joint['mass_g']:.1f} g, held-out error {joint['error_deg']:.2f} deg and "
            f"{joint['error_mm']:.2f} mm"
        )
    lines = list(dict.fromkeys(lines))
    found = summary["chain"]
    x, y, z = found["tip_mm"]
    rest = ", ".join(f"{v:.1f}" for v in found["tip_at_rest_mm"])
    lines.append(
        f"tip of {found['units']} units at ({x:.1f}, {y:.1f}, {z:.1f}) mm, "
        f"{found['angle_deg']:.1f} deg; at rest ({rest}) mm"
    )
    if "target" in summary:
        target = summary["target"]
        pressures = ", ".join(f"{p:.4g}" for p in target["pressures_kPa"])
        lines.append(f"target missed by {target['miss_mm']:.3g} mm, at {pressures} kPa")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of a chain's run with the expected seconds of each on two cores."""
    # Alike units share a joint.
    spans = {one.unit.hash(): span for one, span in zip(job.units, job.ranges_kPa(), strict=True)}
    plan = []
    for n, span in enumerate(spans.values(), 1):
        joint_s = JOINT_S * (job.mesh.refine / REFINE.default) ** 2 * len(job.joint.pressures(*span)) / 7
        plan += [(f"mesh of unit {n}", 4.0), (f"joint of unit {n}", max(joint_s, 10.0))]
    return [*plan, ("chain", 20.0), ("files", 3.0), ("report", 10.0)]


USE_CASE = UseCase("chain", LAYOUT, read_job, run_chain, console_summary, plan=plan_of)
