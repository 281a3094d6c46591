"""`homogenize`: from a unit's struts and resin to its lattice's moduli, virtual tests and law."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...run.context import RunContext
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .homogenisation import Homogenisation
from .job import LAYOUT, Job, read_job
from .report import write_report


def homogenize(job: Job, folder: Path, context: RunContext) -> Homogenisation:
    """Run every stage of a homogenisation, and report the finished ones."""
    study = Homogenisation(job, folder, context)
    context.report = lambda stopped: write_report(study, stopped)
    study.run()
    return study


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a homogenisation's `summary`."""
    moduli = summary["moduli_kPa"]
    lines = [
        f"Young's modulus {moduli['E100']:.4g} kPa along an axis of the cell, {moduli['E111']:.4g} kPa "
        f"along a strut; relative density {summary['relative_density']:.4f}"
    ]
    for friction, found in summary.get("specimen", {}).items():
        values = ", ".join(f"{name} {value:.4g} kPa" for name, value in found["modulus_kPa"].items())
        lines.append(f"block between plates ({friction}): {values}")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of a homogenisation with the expected seconds of each on two cores."""
    # Unknowns grow as the cube of the refinement, and a factorisation's time somewhat faster.
    factor = job.refine**3.5
    block = 110.0 * (job.cells / 3.0) ** 3
    cell = {"mesh of the cell": 30.0, "moduli": 5.0, "stretch of the cell": 35.0, "law": 12.0}
    specimen = [("printable specimen", 2.0), *((f"specimen, {name}", block) for name in job.frictions)]
    stages = [*((name, s * factor) for name, s in cell.items()), *(specimen if job.frictions else [])]
    return [*stages, ("report", 10.0)]


USE_CASE = UseCase("homogenize", LAYOUT, read_job, homogenize, console_summary, plan=plan_of)
