"""Interface of every kind of run: inputs as files in a folder, work, a report and a summary."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

import attrs

from . import unchanged
from .context import RunContext
from .folder import FolderLayout, begin
from .processes import require_memory
from .progress import Message
from .progress_estimate import Plan, remaining, shares_done

Job = TypeVar("Job")


@attrs.frozen
class UseCase(Generic[Job]):
    """One kind of run. Its job is a frozen class whose `texts()` gives the files of inputs by name.

    name: of its command. read: the job that a folder's inputs describe; raises InputError. run: does the job
    in its folder, fills `context.summary`, sets `context.report` and returns the result. console_summary: a
    run's summary in a few lines of text. begin: prepares a folder, if `folder.begin` is not enough. plan:
    expected stages of a job, with their seconds on two cores; kept: first letters of the names of stages that
    a resumed run takes from its cache; plan_in: in their place, the stages with the seconds that are left.
    """

    name: str
    layout: FolderLayout
    read: Callable[[Path], Job]
    run: Callable[[Job, Path, RunContext], Any]
    console_summary: Callable[[dict[str, Any]], list[str]]
    begin: Callable[[Job, Path, RunContext], None] | None = None
    plan: Callable[[Job], Plan] = lambda job: ()
    kept: tuple[str, ...] = ()
    plan_in: Callable[[Job, Path, RunContext], Plan] | None = None

    def start(self, job: Job, folder: Path, context: RunContext) -> Any:
        """Run a job in a folder and write its report, also if it stops early; return the result.

        Raises InputError, also for a folder that is in use or of another kind of run; OutputError; MuError if
        the process may use too little memory; and the errors of the job.
        """
        require_memory()
        if self.begin is not None:
            self.begin(job, folder, context)
        else:
            begin(context, folder, self.layout, job.texts())  # type: ignore[attr-defined]
        if (before := unchanged.finished(folder, context)) is not None:
            return unchanged.tell(before, context)
        warnings: list[Message] = []
        context.progress.sinks.append(lambda m: warnings.append(m) if m["type"] == "warning" else None)
        context.console_summary = self.console_summary
        if self.plan_in is not None:
            plan = self.plan_in(job, folder, context)
        else:
            plan = remaining(self.plan(job), shares_done(folder), self.kept)
        context.progress.plan([stage for stage in plan if context.wants_report or stage[0] != "report"])
        found = self.run(job, folder, context)
        context.write_report()
        unchanged.remember(folder, context, warnings)
        return found
