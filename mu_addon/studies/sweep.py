"""`sweep`: a parameter study, many studies over ranges of inputs, in one table."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from csv import DictReader
from csv import Error as CsvError
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import attrs

from .. import design
from ..design.quantity import described
from ..errors import InputError
from ..reading import parse_json, text_in
from ..run.parts import Beside, Chart, Fact, Part, Sentence, Table, csv, echo, recorded
from ..run.study import Dropped, Found, Input, Node, Over, Study, Written, given, section, stage
from ..simulate_and_place.settings import STAGES
from . import parameter_study
from .inputs import UNIT, SchedulerInput, once
from .parameter_study.settings import ADD, WORKERS

TABLE, PROTOCOL = "points.csv", "protocol.csv"
LAST = ("seconds", "memory_MB", "worker", "what", "where", "what_to_do")
"""Columns after the figures: a point's cost, and why it failed."""
BEGIN_S = 2.0
"""What the process of a point takes before its first stage and after its last."""
USUAL = ("angle_range_deg", "mass_g", "J_hat_mm", "J_hat_mm lattice")
"""Figures whose effects are shown by default."""
FEWEST, MOST_ROWS, SAMPLED = 4, 200, 64
"""Points that say something about an effect, rows of a table of the page, points whose time is expected."""
Row = dict[str, Any]
Points = Mapping[int, "parameter_study.Outcome"]


@attrs.frozen
class PlanInput(Input):
    """What is varied and how, of a sweep.toml; a run's has unit and protocol beside it."""

    kind: str = "plan"
    text: str = "Plan of the parameter study, a sweep.toml: which inputs are varied, and how."

    def write(self, name: str, value: parameter_study.Plan) -> Written:
        """Its keys. The numbers of points decide nothing, since more may be added to those that are there."""
        from .unit_inputs import protocol_text

        texts = {UNIT: design.to_toml(value.inputs.unit), PROTOCOL: protocol_text(value.inputs.protocol)}
        run = {"points": list(value.counts), "files": str(value.folder.resolve())}
        return Written(value.tables, run, texts)

    def read(self, name: str, found: Found) -> parameter_study.Plan:
        """The plan of the folder; raises InputError."""
        from .parameter_study.plan import counts_of, planned

        folder, keys = found.path.parent, {"protocol": str(found.path.parent / PROTOCOL)} | found.keys
        table = found.table
        found.keys.clear()
        counts = counts_of(found.run.get("points", []), str(found.path))
        last = [stage for stage in STAGES if stage in keys][-1:]
        more = {"stages": last[0] if last else STAGES[0]} | ({"points": counts[-1]} if counts else {})
        files = Path(str(found.run.get("files", folder)))
        document = attrs.evolve(table, values=keys | more)
        return planned(document, design.read_unit(folder / UNIT), files, counts)

    def file_names(self, name: str) -> tuple[str, ...]:
        """Its files."""
        return (UNIT, PROTOCOL)


def _expected_s(study: Sweep) -> float:
    # Some of many points tell enough.
    numbers = range(1, study.plan.size + 1)[:: -(-study.plan.size // SAMPLED)]
    jobs = [study.plan.point(number).job for number in numbers]
    seconds = [BEGIN_S + sum(job.expected().values()) for job in jobs if job is not None]
    return study.plan.size / len(numbers) * sum(seconds) / min(max(study.workers, 1), 2)


@attrs.frozen(eq=False)
class StudyTable:
    """A finished parameter study: its plan, folder, and a row for each point as in points.csv."""

    plan: parameter_study.Plan
    folder: Path
    rows: tuple[Mapping[str, str], ...]

    @property
    def done(self) -> tuple[Mapping[str, str], ...]:
        """Rows of the studies that were solved."""
        return tuple(row for row in self.rows if row["status"] == "done")

    def remark(self) -> str:
        """Number of studies, and of failed ones."""
        failed = len(self.rows) - len(self.done)
        return f"{len(self.rows)} studies" + (f", {failed} failed" if failed else "")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the figures' columns in which some study has a number."""
        inputs = ("point", "status", *(v.name for v in self.plan.variables), *LAST)
        names = dict.fromkeys(name for row in self.done for name in row if name not in inputs)
        return tuple(name for name in names if any(number_in(row, name) is not None for row in self.done))


def table_of(done: Any) -> StudyTable:
    """Table of a parameter study; raises InputError where it has no usable row."""
    path = done.folder / TABLE
    try:
        rows = tuple(DictReader(text_in(path, TABLE, "evaluate this node again").splitlines()))
    except CsvError as error:
        raise InputError(f"cannot read {TABLE}: {error}", str(path), "evaluate this node again") from error
    found = StudyTable(done.study.plan, done.folder, rows)
    if not found.done:
        why = next((row.get("what", "") for row in rows if row.get("what")), "see its table")
        raise InputError(
            f"every study failed: {why}", str(path), "see points.csv; vary less, or other inputs"
        )
    return found


def number_in(row: Mapping[str, str], name: str) -> float | None:
    """The number in a column of a row, None without one."""
    try:
        found = float(row.get(name) or "nan")
    except ValueError:
        return None
    return found if math.isfinite(found) else None


def _table(done: Any, call: Any) -> dict[str, Any]:
    found = table_of(done)
    return {"table": found, "remark": found.remark()}


@attrs.frozen(kw_only=True, eq=False)
class Sweep(Study):
    """Run a parameter study: many studies over ranges of inputs, with one table, main effects and the Pareto
    front.
    """

    name = "sweep"
    node = Node(
        "Parameter Study",
        "many studies of a unit over ranges of its parameters: a table, main effects, Pareto fronts",
        (("table", "study table", "a row for each study"),),
        lambda summary: "",
        label="Parameter Study",
        read=_table,
        hidden=("scheduler", "add", "retry"),
    )
    example = "sweep assets/examples/sweep/sweep.toml --out out/sweep"
    files = {TABLE: "a row for each point: inputs, figures, or why it failed"}

    plan: parameter_study.Plan = given(PlanInput())
    workers: int = once(WORKERS, metavar="N")
    scheduler: str = given(SchedulerInput(), default="")
    add: int = once(ADD, metavar="N")
    retry: bool = once(described("retry", False, "run the failed points again"))

    def __attrs_post_init__(self) -> None:
        self.density  # noqa: B018  A resin that is not there is reported before any work.

    @cached_property
    def density(self) -> float:
        """Density of the resin in g/ml."""
        return self.plan.density

    @stage(
        "points",
        _expected_s,
        over=Over(
            ("task",),
            lambda study: range(1, study.plan.size + 1),
            gives=lambda study, number: {"task": study.plan.task(number)},
        ),
        failing="point {member} has not been run",
        parallel=True,
        again=lambda study, found: study.retry and found.status == "failed",
    )
    def points(self, task: parameter_study.Task) -> parameter_study.Outcome:
        """The study of a point, submitted by `run.execution`; one that breaks a rule has none."""
        from .parameter_study import point

        if task is None:
            raise Dropped
        return point.run_point(task)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it its size."""
        method = self.plan.method.replace("_", " ")
        return (
            f"Parameter study of {self.plan.inputs.unit.name}",
            f"{len(self.plan.variables)} inputs, {method}, {' + '.join(self.plan.stages)}",
        )

    def rows(self, points: Points) -> list[Row]:
        """A row for each point: its number, status, inputs and figures, or why it failed."""
        return [self._row(number, points.get(number)) for number in range(1, self.plan.size + 1)]

    def _row(self, number: int, found: parameter_study.Outcome | None) -> Row:
        from .parameter_study.results import figures

        inputs = self.plan.values[number - 1]
        if found is None:
            e, row = self.plan.error(number), {"point": number, "status": "waiting", **inputs}
            failed = (
                {"status": "failed", "what": e.what, "where": e.where, "what_to_do": e.remedy} if e else {}
            )
            return row | failed
        figured = figures(dict(parse_json(found.summary, TABLE)), self.density)
        return (
            {"point": number, "status": found.status, **inputs}
            | figured
            | {name: getattr(found, name) for name in LAST}
        )

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(v.name for v in self.plan.variables)

    def outputs(self, rows: Sequence[Row]) -> list[str]:
        """Names of the figures, in the order in which rows first have them."""
        known = ("point", "status", *self.varied, *LAST)
        return [name for name in dict.fromkeys(name for row in rows for name in row) if name not in known]

    def shown(self, rows: Sequence[Row]) -> list[str]:
        """Figures to show: those that the sweep names, else the usual ones that vary."""
        wanted = [*self.plan.minimize, *self.plan.maximize] or USUAL
        return [n for n in wanted if n in self.outputs(rows) and len(_with_number(rows, n)) > 1]

    @section()
    def table(self, points: Points | None = None) -> Iterator[Part]:
        """points.csv, and how many points there are."""
        rows = self.rows(points or {})
        names = ["point", "status", *self.varied, *self.outputs(rows), *LAST]
        yield csv(TABLE, names, [[_cell(row.get(name)) for name in names] for row in rows])
        done, failed = _done(rows), [row for row in rows if row["status"] == "failed"]
        seconds = [row["seconds"] for row in done]
        mean = sum(seconds) / len(seconds) if seconds else None
        most = max((row["memory_MB"] for row in done), default=None)
        yield Fact("points", len(rows), str(len(rows)), key="points")
        yield Fact("done", len(done), str(len(done)), key="done")
        yield Fact("failed", len(failed), str(len(failed)), key="failed")
        yield Fact("time per point", mean, "-" if mean is None else f"{mean:.1f} s", key="seconds_a_point")
        yield Fact("largest memory", most, "-" if most is None else f"{most} MB", key="most_memory_MB")
        failures = sorted({str(row.get("what", "")) for row in failed})
        yield recorded("failures", failures)
        words = f"{len(done)} of {len(rows)} points done, {len(failed)} failed"
        words += "" if mean is None else f"; {mean:.1f} s and up to {most} MB each"
        yield from echo(words, *(f"failed: {what}" for what in failures[:5]))
        if failed:
            words = f"{len(failed)} of {len(rows)} points failed: they are rows of points.csv, too."
            yield Sentence(words, note=True)
        if waiting := len(rows) - len(done) - len(failed):
            yield Sentence(f"{waiting} points have not been run.", note=True)

    @section("effects", "Main effects")
    def effects(self, points: Points) -> Iterator[Part]:
        """Each figure against each input."""
        import numpy as np

        from .parameter_study.charts import effect_chart
        from .parameter_study.main_effects import main_effect

        rows = self.rows(points)
        outputs = [name for name in self.shown(rows) if len(_with_number(rows, name)) >= FEWEST]
        if not outputs:
            return
        yield Sentence(
            "Each dot is a study. The line joins means of studies with similar values of one input; bars are "
            "their standard error. The other inputs are averaged out."
        )
        shares: dict[str, list[str]] = {name: [] for name in self.varied}
        for output in outputs:
            own = _with_number(rows, output)
            y = np.array([float(row[output]) for row in own])
            drawn = []
            for name in self.varied:
                x = [row[name] for row in own]
                effect = main_effect(x, y)
                shares[name].append("-" if np.isnan(effect.share) else f"{effect.share:.0%}")
                alt = f"{output} against {name}: one dot per study, and the mean."
                drawn.append(Chart(partial(effect_chart, effect, x, y, name, output), "", alt))
            yield Beside(drawn, across=3)
        caption = "First-order share of each result's variance due to one input, corrected for chance."
        head = ["input", *Table.numbers(*outputs)]
        yield Table(caption, head, [[name, *row] for name, row in shares.items()])

    @section("pareto", "Pareto front")
    def fronts(self, points: Points) -> Iterator[Part]:
        """Points that are Pareto-optimal for the objectives."""
        import numpy as np

        from ..arrays import pareto
        from .parameter_study.charts import front_chart

        rows = self.rows(points)
        goals = [(n, 1.0) for n in self.plan.minimize] + [(n, -1.0) for n in self.plan.maximize]
        goals = [(name, sign) for name, sign in goals if name in self.outputs(rows)]
        own = [r for r in _done(rows) if all(isinstance(r.get(name), int | float) for name, _ in goals)]
        if len(goals) < 2 or len(own) < 2:
            return
        costs = np.array([[sign * float(row[name]) for name, sign in goals] for row in own])
        aims = ", ".join(f"{'small' if sign > 0 else 'large'} {name}" for name, sign in goals)
        yield Sentence(f"Objectives: {aims}.")
        drawn = []
        for i, j in itertools.combinations(range(len(goals)), 2):
            front = pareto(costs[:, [i, j]])
            alt = (
                f"{goals[j][0]} against {goals[i][0]}; {len(front)} of {len(own)} studies are Pareto-optimal."
            )
            drawn.append(Chart(partial(front_chart, own, goals[i], goals[j], front), "", alt))
        yield Beside(drawn)
        best = pareto(costs)
        columns = [*(name for name, _ in goals), *self.varied]
        listed = [own[n] for n in best[np.argsort(costs[best, 0], kind="stable")]]
        yield Table(
            f"The {len(best)} of {len(own)} points that are Pareto-optimal.",
            ["point", *Table.numbers(*columns)],
            [[row["point"], *(_shown(row[name]) for name in columns)] for row in listed],
        )

    @section("inputs", "Inputs varied")
    def ranges(self) -> Iterator[Part]:
        """What is varied, and the settings."""
        rows = []
        for v in self.plan.variables:
            words = f"{v.low:g} to {v.high:g}" if not v.values else ", ".join(map(str, v.values))
            rows.append([v.name, words + (", evenly in its logarithm" if v.log else "")])
        yield Table("", ["input", "values"], rows)
        p = self.plan
        facts = {
            "method": p.method,
            "seed": p.seed,
            "memory limit of a study [MB]": p.memory_MB,
            "time limit of a study [min]": p.minutes,
            "resin of the mass": p.resin,
        }
        yield Table("", ["setting", ""], list(facts.items()))

    @section("points", "Points")
    def listed(self, points: Points) -> Iterator[Part]:
        """The points, failures with their reasons."""
        rows = self.rows(points)
        columns = [*self.varied, *self.shown(rows)]
        more = len(rows) - MOST_ROWS
        caption = "points.csv holds all results" + (f", and {more} more points." if more > 0 else ".")
        head = ["point", "status", *Table.numbers(*columns), ("seconds", "n")]
        shown = []
        for row in rows[:MOST_ROWS]:
            status = "FAILED" if row["status"] == "failed" else row["status"]
            shown.append([row["point"], status, *(_shown(row.get(name)) for name in (*columns, "seconds"))])
        yield Table(caption, head, shown)
        failed = [row for row in rows if row["status"] == "failed"][:MOST_ROWS]
        if failed:
            why = ("what", "where", "what_to_do")
            head = ["failed point", *((name.replace("_", " "), "text") for name in why)]
            yield Table("", head, [[row["point"], *(row.get(name, "") for name in why)] for row in failed])


def _done(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["status"] == "done"]


def _with_number(rows: Sequence[Row], output: str) -> list[Row]:
    """Rows of solved points with a number for a figure."""
    return [row for row in _done(rows) if isinstance(row.get(output), int | float)]


def _cell(value: Any) -> Any:
    """A value as a cell of the table: lists as text, None as an empty cell."""
    if value is None:
        return ""
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else value


def _shown(value: Any) -> Any:
    return "-" if value is None else _cell(value)
