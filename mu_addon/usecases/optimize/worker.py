"""One unit evaluated on any process or machine: plain data in, plain data out."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Any

import attrs

from ...design.parameters import Unit, from_toml, to_toml
from ...errors import MuError
from ...evidence.extended import load_model
from ...optimization.design_file import Design
from ...optimization.evaluation import Evaluated, evaluate, restored
from ...optimization.unit_body import Mechanics
from ...run.cache import key
from ...run.pool import each
from .job import MODEL, Job, design_of, mechanics_of


@attrs.frozen
class Task:
    """A unit to be evaluated: its text, and the run's files of inputs by name."""

    unit: str
    files: tuple[tuple[str, str], ...]

    @property
    def name(self) -> str:
        """Hash of all that decides what is found."""
        return key("unit", self.unit, self.files)


@lru_cache(maxsize=4)
def _prepared(files: tuple[tuple[str, str], ...]) -> tuple[Design, Mechanics]:
    texts = dict(files)
    design = design_of(texts)
    model = None
    if MODEL in texts:
        with tempfile.TemporaryDirectory(prefix="mu-optimize-") as folder:
            path = Path(folder) / MODEL
            path.write_text(texts[MODEL], encoding="utf-8")
            model = load_model(path)
    return design, mechanics_of(design, model)[0]


def run_task(task: Task) -> dict[str, Any]:
    """What `Evaluated.plain` gives of a task's unit, with status "done"; raises InputError."""
    design, mechanics = _prepared(task.files)
    uncertainty = design.uncertainty if design.robust else None
    found = evaluate(
        from_toml(task.unit), design.targets, design.freedoms, mechanics, uncertainty=uncertainty
    )
    return {"status": "done", **found.plain()}


def several(
    job: Job, warn: Callable[[str], None]
) -> Callable[[Sequence[Unit]], Iterator[tuple[int, Evaluated]]] | None:
    """What evaluates several units at a time, on the job's scheduler or in processes here; None for one.

    What it gives raises MuError where a process or the scheduler is lost.
    """
    files = tuple(sorted(job.texts().items()))

    def tasks(units: Sequence[Unit]) -> list[Task]:
        return [Task(to_toml(unit), files) for unit in units]

    def on_scheduler(units: Sequence[Unit]) -> Iterator[tuple[int, Evaluated]]:
        from ..parameter_study.cluster import Cluster

        with closing(Cluster(job.scheduler, job.workers)) as cluster:
            for number, row in cluster.results(tasks(units), run_task, warn):  # type: ignore[arg-type]
                if row["status"] != "done":
                    raise MuError(row["what"], row["where"], row["what_to_do"])
                yield number, restored(units[number], row)

    def here(units: Sequence[Unit]) -> Iterator[tuple[int, Evaluated]]:
        for number, row in each(run_task, tasks(units), job.workers, "evaluation of units"):
            yield number, restored(units[number], row)

    if job.scheduler is not None:
        return on_scheduler
    return here if job.workers > 1 else None
