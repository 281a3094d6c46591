"""One unit evaluated on any process or machine: plain data in, plain data out."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Any

import attrs

from ...design.parameters import from_toml, to_toml
from ...errors import MuError
from ...optimization.evaluation import Candidate, Evaluated, evaluate, restored
from ...optimization.targets import Target
from ...optimization.unit_body import Mechanics
from ...run.cache import key
from ...run.pool import each
from .job import Job, mechanics_of, read_job


@attrs.frozen
class Task:
    """A unit to be evaluated: its text, the run's files of inputs by name, and a chosen path and resin."""

    unit: str
    files: tuple[tuple[str, str], ...]
    choice: tuple[tuple[str, str], ...] = ()

    @property
    def name(self) -> str:
        """Hash of all inputs that decide the result."""
        return key("unit", self.unit, self.files, self.choice)


@lru_cache(maxsize=4)
def _prepared(files: tuple[tuple[str, str], ...]) -> Job:
    """The job of a run's input texts, with unit, resins, body and model; raises InputError."""
    with tempfile.TemporaryDirectory(prefix="mu-optimize-") as name:
        folder = Path(name)
        for file, text in files:
            (folder / file).write_text(text, encoding="utf-8")
        return read_job(folder)


def run_task(task: Task) -> dict[str, Any]:
    """Return `Evaluated.plain` of a task's unit, with status "done"; raises InputError."""
    job = _prepared(task.files)
    targets, mechanics = asked_of(job, dict(task.choice))
    uncertainty = job.design.uncertainty if job.design.robust else None
    found = evaluate(from_toml(task.unit), targets, job.design.freedoms, mechanics, uncertainty=uncertainty)
    return {"status": "done", **found.plain()}


def asked_of(
    job: Job, choice: Mapping[str, str], refine: float | None = None
) -> tuple[Sequence[Target], Mechanics]:
    """Targets of a chosen path and resin, and the mechanics of such units; see `mechanics_of`."""
    design = job.design.chosen(choice)
    return design.targets, mechanics_of(design, job.model, refine)[0]


def several(
    job: Job, warn: Callable[[str], None]
) -> Callable[[Sequence[Candidate]], Iterator[tuple[int, Evaluated]]] | None:
    """Function that evaluates several units at a time, on a scheduler or in processes; None for one.

    Its results raise MuError if a process or the scheduler is lost.
    """
    files = tuple(sorted(job.texts().items()))

    def tasks(units: Sequence[Candidate]) -> list[Task]:
        return [Task(to_toml(c.unit), files, c.choice) for c in units]

    def on_scheduler(units: Sequence[Candidate]) -> Iterator[tuple[int, Evaluated]]:
        from ..parameter_study.cluster import Cluster

        with closing(Cluster(job.scheduler, job.workers)) as cluster:
            for number, row in cluster.results(tasks(units), run_task, warn):  # type: ignore[arg-type]
                if row["status"] != "done":
                    raise MuError(row["what"], row["where"], row["what_to_do"])
                yield number, restored(units[number].unit, row)

    def here(units: Sequence[Candidate]) -> Iterator[tuple[int, Evaluated]]:
        for number, row in each(run_task, tasks(units), job.workers, "evaluation of units"):
            yield number, restored(units[number].unit, row)

    if job.scheduler is not None:
        return on_scheduler
    return here if job.workers > 1 else None
