"""A parameter study in its folder: finished points are kept, others run; the table is kept up to date."""

from __future__ import annotations

import csv
import json
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...errors import InputError, OutputError
from ...files import write_csv
from ...materials.library import load_material, read_material
from ...reading import file_text
from ...run.cache import Cache
from ...run.context import RunContext
from ...run.progress import Progress
from ...run.usecase import UseCase
from ..simulate_and_place.expected import plan_of
from .cluster import Work, cluster_at
from .plan import LAYOUT, PLAN, REPORT, TABLE, Plan, Point, read_plan_of_run
from .point import Task, run_point, version
from .report import write_report
from .results import Found, Row, cell, column_names, figures
from .settings import ADD, GRID, WORKERS

Array = np.ndarray[Any, Any]

# Columns after the figures: a point's cost, and why it failed.
LAST = ("seconds", "memory_MB", "worker", "what", "where", "what_to_do")
# Seconds between two writings of the table.
EVERY_S = 10.0
# What the process of a point takes before its first stage and after its last.
BEGIN_S = 2.0


@attrs.frozen(eq=False)
class Job:
    """A plan to be run, and how.

    scheduler: address of a Dask scheduler, or None for a cluster of `workers` on this machine; add: number of
    additional points; retry: run failed ones again; work: runs a task.
    """

    plan: Plan
    scheduler: str | None = None
    workers: int = WORKERS.field()
    add: int = ADD.field()
    retry: bool = False
    work: Work = run_point

    def __attrs_post_init__(self) -> None:
        if self.add and self.plan.method == GRID:
            raise InputError("points cannot be added to a grid", "--add", "give more steps in sweep.toml")
        _density(self.plan)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; sweep.toml is the first."""
        return self.plan.texts()


def read_job(folder: Path) -> Job:
    """The sweep that a folder describes, with the points that it has; raises InputError."""
    return Job(read_plan_of_run(folder))


def sweep(job: Job, folder: Path, context: RunContext) -> Found:
    """Run a plan's unfinished points, and write points.csv and report.html.

    Raises InputError, OutputError, and MuError if the scheduler stays away.
    """
    plan, progress = job.plan, context.progress
    values, places = _extended(plan, folder, job.add)
    run = Run(plan, plan.points(values), folder, places, _density(plan))
    run.look(job.retry)
    run.write()
    progress.plan([("points", run.expected_s(job.workers)), ("report", 3.0)])
    try:
        with progress.stage("points"):
            run.solve(progress, job.scheduler, job.workers, job.work)
    except BaseException:
        with suppress(OutputError):
            run.write()
        raise
    found = run.found()
    context.summary |= summary(found)
    context.report = lambda stopped: write_report(found, folder / REPORT, progress, stopped)
    return found


@attrs.define
class Run:
    """State of a sweep in its folder: its points, their positions (n, d), and known results by number.

    density: of the resin, in g/ml.
    """

    plan: Plan
    points: list[Point]
    folder: Path
    places: Array
    density: float
    known: dict[int, dict[str, Any]] = attrs.field(factory=dict)

    @property
    def cache(self) -> Cache:
        """Results of the points."""
        return Cache(self.folder / "cache")

    def task(self, point: Point) -> Task:
        """Task of a point that breaks no rule."""
        assert point.job is not None
        return Task(point.job.texts(), self.plan.memory_MB, self.plan.minutes, version())

    def look(self, retry: bool) -> None:
        """Take results of earlier runs; with `retry`, no failed ones."""
        for point in self.points:
            stored = None if point.job is None else self.cache.get("point", self.task(point).name)
            if stored is not None:
                row = json.loads(str(stored["row"]))
                if not (retry and row["status"] == "failed"):
                    self.known[point.number] = row

    @property
    def todo(self) -> list[Point]:
        """Points that break no rule and have no result yet."""
        return [p for p in self.points if p.job is not None and p.number not in self.known]

    def expected_s(self, workers: int) -> float:
        """Expected seconds of the remaining points, on two cores at most."""
        stages = [plan_of(point.job)[:-1] for point in self.todo if point.job is not None]
        return sum(BEGIN_S + sum(seconds for _, seconds in one) for one in stages) / min(max(workers, 1), 2)

    def solve(self, progress: Progress, scheduler: str | None, workers: int, work: Work) -> None:
        """Run the points without a result; each result is kept at once."""
        todo = self.todo
        if not todo:
            return
        tasks = [self.task(point) for point in todo]
        written = time.monotonic()
        with (
            closing(cluster_at(scheduler, workers)) as found,
            closing(found.results(tasks, work, progress.warning)) as results,
        ):
            for done, (position, row) in enumerate(results, 1):
                self.known[todo[position].number] = row
                if not row.get("again"):
                    self.cache.put("point", tasks[position].name, {"row": np.array(json.dumps(row))})
                progress.update(done / len(todo))
                if time.monotonic() - written > EVERY_S:
                    self.write()
                    written = time.monotonic()
        self.write()

    def found(self) -> Found:
        """The table of the results so far."""
        rows = [self._row(point) for point in self.points]
        inputs = tuple(v.name for v in self.plan.variables)
        known = ("point", "status", *inputs, *LAST)
        outputs = tuple(name for name in column_names(rows) if name not in known)
        return Found(self.plan, tuple(rows), inputs, outputs)

    def _row(self, point: Point) -> Row:
        row: Row = {"point": point.number, "status": "waiting", **point.values}
        if point.error is not None:
            e = point.error
            return row | {"status": "failed", "what": e.what, "where": e.where, "what_to_do": e.remedy}
        found = self.known.get(point.number)
        if found is None:
            return row
        figured = figures(found["summary"], self.density) if found["status"] == "done" else {}
        return row | figured | {name: found[name] for name in ("status", *LAST) if name in found}

    def write(self) -> None:
        """Write points.csv, a row for each point, failed ones included, and plan.csv, for later additions."""
        found = self.found()
        names = ["point", "status", *found.inputs, *found.outputs, *LAST]
        write_csv(self.folder / TABLE, names, [[cell(row.get(name)) for name in names] for row in found.rows])
        write_csv(self.folder / PLAN, found.inputs, self.places.tolist())


def _extended(plan: Plan, folder: Path, add: int) -> tuple[list[dict[str, Any]], Array]:
    """Values and positions of the points: those of the folder's plan.csv first, then new ones."""
    before = _places(folder / PLAN, [v.name for v in plan.variables])
    if before is None:
        return plan.values(count=plan.count + add)
    return plan.values(before, max(plan.count, len(before)) if not add else len(before) + add)


def _places(path: Path, names: list[str]) -> Array | None:
    """Positions (n, d) in a plan.csv, or None if there is none or it is damaged."""
    try:
        head, *rows = csv.reader(file_text(path).splitlines())
        found = np.array([[float(value) for value in row] for row in rows])
    except (OSError, ValueError):
        return None
    sound = head == names and found.ndim == 2 and len(found) and bool(((found >= 0) & (found < 1)).all())
    return found if sound else None


def _density(plan: Plan) -> float:
    path = plan.folder / plan.resin
    material = read_material(path) if path.suffix == ".toml" else load_material(plan.resin)
    return material.density_g_per_ml


def summary(found: Found) -> dict[str, Any]:
    """Figures of a sweep for summary.json."""
    done = found.done
    seconds = [row["seconds"] for row in done]
    return {
        "points": len(found.rows),
        "done": len(done),
        "failed": len(found.failed),
        "failures": sorted({str(row.get("what", "")) for row in found.failed}),
        "seconds_a_point": float(np.mean(seconds)) if seconds else None,
        "most_memory_MB": max((row["memory_MB"] for row in done), default=None),
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a sweep's `summary`."""
    lines = [f"{summary['done']} of {summary['points']} points done, {summary['failed']} failed"]
    if summary["seconds_a_point"] is not None:
        lines[0] += f"; {summary['seconds_a_point']:.1f} s and up to {summary['most_memory_MB']} MB each"
    return [*lines, *(f"failed: {what}" for what in summary["failures"][:5])]


USE_CASE = UseCase("sweep", LAYOUT, read_job, sweep, console_summary)
