"""A study as a use case of runs: how its command, a node and `resume` start it."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any

from ..run.context import RunContext
from ..run.execution import Execution
from ..run.folder import begin, claim, keep_inputs, require_space
from ..run.lock import FolderLock
from ..run.progress_estimate import Plan
from ..run.study import Study
from ..run.summary import SUMMARY, read_summary
from ..run.usecase import UseCase
from ..run.versions import package_versions
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
        begin=_join if kind.joins else begin_study,
    )


def begin_study(job: Study, folder: Path, context: RunContext) -> None:
    """Make a folder a study's; figures there of further targets of the same inputs stay in the summary.

    Raises InputError, also where another process works in the folder, and OutputError.
    """
    context.lock_folder(folder)
    job = job.complete()
    texts, _, valid = job.texts_in(folder)
    if valid:
        # Further targets of the same inputs make the file of inputs longer, and nothing stale.
        keep_inputs(folder, texts, job.layout().inputs)
        context.summary = _earlier(folder) | context.summary
    begin(context, folder, job.layout(), texts)
    require_space(folder, job.bytes_needed())


def write_study(job: Study, folder: Path) -> None:
    """Write a study's inputs into its folder, for another process to `resume` it; results there stay.

    Of further targets of the same inputs, too: the table [run] then names those of this run. Raises
    InputError, also where another process works in the folder, and OutputError.
    """
    lock = FolderLock(folder)
    try:
        job = job.complete()
        texts, _, valid = job.texts_in(folder, asked=True)
        if valid:
            keep_inputs(folder, texts, job.layout().inputs)
        claim(folder, job.layout(), texts)
    finally:
        lock.release()


def _earlier(folder: Path) -> dict[str, Any]:
    """Figures of a folder's last run, if this version of the program computed them."""
    found = read_summary(folder / SUMMARY)
    if found.get("versions") != package_versions():
        return {}
    return {name: value for name, value in found.items() if name not in ("status", "reason", "warnings")}


def _join(job: Study, folder: Path, context: RunContext) -> None:
    """Leave the folder as it is until the first file, and every run of its own."""
    context.words = None


def run(job: Study, folder: Path, context: RunContext) -> Execution:
    """Make every result of a study in its folder, and report those that there are.

    The report of further targets is kept.
    """
    from ..report.study_page import write_page

    work: Execution = context.work or Execution(job, folder, context)
    if job.joins:
        work.opening = partial(context.open_folder, folder)
    else:
        context.summary["versions"] = package_versions()
    if job.page and not (work.study.further_in(folder) and (folder / job.page).is_file()):
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
    return [*context.work.plan(), *_report(context.work.study)]


def _report(job: Study) -> Plan:
    return [("report", job.report_s)] if job.page else []
