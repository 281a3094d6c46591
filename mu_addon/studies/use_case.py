"""A study as a use case of runs: how its command, a node and `resume` start it."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path

from ..run.context import RunContext
from ..run.execution import Execution
from ..run.progress_estimate import Plan
from ..run.study import REPORT_S, Study
from ..run.usecase import UseCase
from . import study


@cache
def use_case(name: str) -> UseCase[Study]:
    """The use case of a study's command."""
    kind = study(name)
    return UseCase(
        name,
        kind.layout(),
        kind.read,
        run,
        console_summary=lambda summary: [],
        plan=lambda study: [*study.expected().items(), *_report(study)],
        plan_in=plan,
        begin=_join if kind.joins else None,
    )


def _join(job: Study, folder: Path, context: RunContext) -> None:
    """Leave the folder as it is until the first file, and every run of its own."""
    context.words = None


def run(job: Study, folder: Path, context: RunContext) -> Execution:
    """Make every result of a study in its folder, and report those that there are."""
    from ..report.study_page import write_page

    work: Execution = context.work or Execution(job, folder, context)
    if job.joins:
        work.opening = partial(context.open_folder, folder)
    if job.page:
        context.report = lambda stopped: write_page(work, stopped)
    context.console_summary = lambda summary: work.lines
    work.run()
    if work.fault is not None:
        # It is the result, and no reason to leave early: the report is written first.
        context.write_report()
        context.report = None
        raise work.fault
    return work


def plan(job: Study, folder: Path, context: RunContext) -> Plan:
    """Stages with the seconds that are left of each."""
    context.work = Execution(job, folder, context)
    return [*context.work.plan(), *_report(job)]


def _report(job: Study) -> Plan:
    return [("report", REPORT_S)] if job.page else []
