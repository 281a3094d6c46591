"""The start of a study in its folder, by its command, by a node, by `resume` or by a window."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import attrs

from ..errors import InputError
from ..run import unchanged
from ..run.context import RunContext
from ..run.execution import Execution
from ..run.folder import begin, claim, keep_inputs, require_space
from ..run.lock import FolderLock
from ..run.processes import require_memory
from ..run.progress import Message
from ..run.study import Study
from ..run.summary import SUMMARY, read_summary
from ..run.versions import package_versions
from . import STUDIES, study


def start(job: Study, folder: Path, context: RunContext) -> Any:
    """Run a study in a folder and write its report, also if it stops early.

    Returns what did it: an `Execution`, or the result of one that streams. Raises InputError, also for a
    folder that is in use or of another kind of run; OutputError; MuError if the process may use too little
    memory; and the errors of the study.
    """
    require_memory()
    if job.joins or job.streams:
        # Every run is made anew; a joined folder stays as it is until the first file.
        context.repeats = False
    if not job.joins:
        begin_study(job, folder, context)
    if (before := unchanged.finished(folder, job, context)) is not None:
        return unchanged.tell(before, context)
    warnings: list[Message] = []
    context.progress.sinks.append(lambda m: warnings.append(m) if m["type"] == "warning" else None)
    found = job.work(folder, context) if job.streams else _execute(job, folder, context)
    context.write_report()
    unchanged.remember(folder, job, context, warnings)
    return found


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


def _execute(job: Study, folder: Path, context: RunContext) -> Execution:
    """Make every result of a study, and report those that there are; the report of further targets stays."""
    from ..report.study_report import write_page

    work = Execution(job, folder, context)
    has_report = job.page and context.wants_report
    context.progress.plan([*work.plan(), *([("report", work.study.report_s)] if has_report else [])])
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


def kind_of(folder: Path) -> type[Study]:
    """The study whose inputs are in a folder; raises InputError without one."""
    kinds = list(dict.fromkeys(kind for name in STUDIES if not (kind := study(name)).joins))
    # Not the Path's own question, which raises for a name that the system refuses.
    there = [kind for kind in kinds if os.path.isfile(folder / kind.layout().inputs)]
    if there:
        # A file whose first line is another's is read all the same: its reader reports the fault best.
        return next((kind for kind in there if kind.layout().is_of(folder)), there[0])
    raise InputError(
        "this folder contains no study and no other run",
        str(folder),
        f"give a folder that holds one of {', '.join(k.layout().inputs for k in kinds)}, as a run writes it",
    )


def resume(folder: Path, context: RunContext, given: Mapping[str, Any] = MappingProxyType({})) -> Any:
    """Run a folder's inputs, taking finished stages from its cache; returns the result.

    given: fields of the study that replace the folder's, such as `workers`, where it has them. Raises
    InputError where the inputs cannot be used or a file that they name is missing, and the errors of the run
    itself.
    """
    job = kind_of(folder).read(folder)
    fields = {field.name for field in attrs.fields(type(job))}  # type: ignore[arg-type]
    job = attrs.evolve(job, **{n: v for n, v in given.items() if n in fields})  # type: ignore[misc]
    return start(job, folder, context)
