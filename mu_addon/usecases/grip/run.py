"""`grip`: a gripper's printable part, its grasp of cubes and its light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...run.context import RunContext
from ...run.usecase import UseCase
from .expected import GRASP_OF
from .job import LAYOUT, Job, plan_of, read_job
from .report import write_report
from .stages import Gripping


def grip(job: Job, folder: Path, context: RunContext) -> Gripping:
    """Design a gripper, close it on cubes, trace its light, and report finished stages."""
    run = Gripping(job, folder, context)
    context.report = lambda stopped: write_report(run, stopped)
    run.run()
    return run


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a grasp's `summary`."""
    x, y, z = summary["size_mm"]
    lines = [f"one part of {x:g} x {y:g} x {z:.4g} mm, {summary['gates']['inner_shells']} chambers"]
    for side, g in summary.get("grasps", {}).items():
        hung = f"held, {g['margin']:.3g} times its weight" if g["held"] else "not lifted"
        lines.append(
            f"cube of {side} mm: {g['angle_at_hold_deg']:.1f} deg and {g['normal_at_hold_N']:.3g} N a finger "
            f"at the plateau, {hung}"
        )
    return lines


USE_CASE = UseCase("grip", LAYOUT, read_job, grip, console_summary, plan=plan_of, kept=(GRASP_OF,))
