"""A study of one unit by stages: its solid, its motion, the ranking of sensor paths."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...body.waveguide import bar_of
from ...design.anchors import window, windows
from ...errors import InputError
from ...run.context import RunContext
from ...run.usecase import UseCase
from .expected import BEST, plan_of
from .graph_search import chains_within, search_graph, sensitivity_map
from .job import Job, read_job
from .light import signals
from .report_data import write_report
from .study import ESTIMATED, Study, begin_study, estimate_words
from .study_file import LAYOUT


def simulate_and_place(job: Job, folder: Path, context: RunContext) -> Study:
    """Run a study's stages in its folder, and report the finished ones."""
    study = Study.begun(job, folder, context)
    context.report = lambda stopped: write_report(study, stopped)
    run_stages(study)
    return study


def run_stages(study: Study) -> None:
    """Every stage of a study's job, in the order they need each other."""
    job = study.job
    # What cannot be placed is found before an hour's work, not after.
    path = window(job.unit, job.path) if job.path else None
    if "place" in job.stages:
        if job.paths == "graph":
            chains_within(job)
        else:
            _require_a_waveguide(job)
    study.design()
    if path is not None:
        study.design(path)
    if "simulate" in job.stages:
        study.make_mesh()
        study.simulate(candidates_beside="place" in job.stages)
    if "place" in job.stages:
        chosen = study.place()
        if job.in_time:
            where = "With obstacles" if job.obstacles else "With a wall whose state depends on its history"
            study.warn(
                f"{where} neither the sensitivity map nor the light signal is computed: both need a unit "
                "whose state depends on pressure only."
            )
        else:
            if job.effects.clogged:
                study.warn("The sensitivity map is not computed for a unit with a clogged neck.")
            else:
                sensitivity_map(study)
            signals(study, job.optics)
        if job.paths == "graph":
            search_graph(study)
        study.design(window(job.unit, chosen), BEST)


def _require_a_waveguide(job: Job) -> None:
    """Raise the InputError of the first window of anchors if no window fits a waveguide."""
    refused: list[InputError] = []
    for one in windows(job.unit.chambers.count):
        try:
            bar_of(job.unit, one, job.body)
            return
        except InputError as error:
            refused.append(error)
    raise refused[0]


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a study: solid, angles, chosen path and the best of a search, of finished stages."""
    lines = []
    if isinstance(solid := summary.get("solid"), dict):
        size = " x ".join(f"{mm:.1f}" for mm in solid["size_mm"])
        lines.append(f"solid: {size} mm, {solid['ml']:.1f} ml, {solid['g']:.1f} g of {solid['resin']}")
    angles = summary.get("angle_deg")
    if isinstance(angles, dict):
        ends = sorted((float(p), a) for p, a in angles.items())
        # Without a sign on what rounds to nothing.
        ends = [(p, round(a, 1) + 0.0) for p, a in (ends[0], ends[-1])]
        lines.append("angle: " + ", ".join(f"{a:+.1f} deg at {p:g} kPa" for p, a in ends))
    if (estimated := summary.get(ESTIMATED)) and not summary.get("chosen"):
        lines.append(estimate_words(estimated))
    if name := summary.get("chosen"):
        tied = summary["tied_with_chosen"]
        equal = f", tied with {', '.join(tied)}" if tied else ""
        without = f" ({words})" if (words := summary.get("left_out")) else ""
        lines.append(f"best path: {name}, J_hat {summary['J_hat_mm'][name]:.4f} mm{equal}{without}")
        if bounds := summary.get("J_hat_at_least_mm"):
            paths = ", ".join(f"{name} {bound:.3f}" for name, bound in bounds.items())
            lines.append(f"not solved further, J_hat at least [mm]: {paths}; --all-paths solves them")
    search = summary.get("search")
    if isinstance(search, dict):
        best = search["best"]
        lines.append(
            f"whole-lattice search: {best['name']}, J_hat {best['J_hat_mm']:.4f} mm, "
            f"{best['length_mm']:.1f} mm long; {search['checked']} of {search['paths']} paths solved by the "
            "full model"
        )
    return lines


KEPT = ("mesh", "Model A", "candidates", "light", "check of the best paths", "motion of the best path")
USE_CASE = UseCase(
    "place", LAYOUT, read_job, simulate_and_place, console_summary, begin_study, plan=plan_of, kept=KEPT
)
