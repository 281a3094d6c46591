"""Run of a node Parameter Study, and its results. Loads the solver."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

import attrs

from ...errors import InputError
from ...graph.definition import Call, Outputs
from ...graph.evaluation import Finished, Order
from ...reading import text_in
from ...studies.sweep import LAST, TABLE, Sweep
from ...studies.use_case import use_case
from ...toml_reader import TomlTable
from ..parameter_study.plan import Plan, planned
from ..parameter_study.variable import changed_inputs
from ..simulate_and_place.settings import STAGES
from .parts import Design, refuse_body
from .sweep_nodes import GOALS

# Such a plan names no file: its folder decides nothing, and is the same everywhere.
_NOWHERE = Path("/")


@attrs.frozen(eq=False)
class StudyTable:
    """A finished parameter study: its plan, folder, and a row for each point as in points.csv."""

    plan: Plan
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
        return tuple(name for name in names if any(_number(row, name) is not None for row in self.done))


def _plan_of(call: Call) -> Plan:
    """The plan of a node Parameter Study. Raises InputError."""
    s, design = call.settings, call.inputs["unit"]
    refuse_body(design, "a parameter study")
    ranges = [given for _, given in call.inputs["ranges"]]
    names = [name for name, _ in ranges]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(
            f"{twice[0]} is varied by two ranges",
            "ranges",
            "leave one of them out, or vary another parameter",
        )
    simulate = {
        "times": s["times"],
        "mesh": {"refine": s["refine"]},
        **({"self_contact": True} if s["self_contact"] else {}),
        **({"self_friction": s["self_friction"]} if s["self_friction"] else {}),
    }
    plain = ("stages", "method", "points", "seed", "memory_MB", "minutes", "protocol")
    keys = {
        **{name: s[name] for name in plain},
        **{name: s[name].split() for name in ("minimize", "maximize")},
        **({"simulate": simulate} if s["stages"] != STAGES[0] else {}),
        "vary": dict(ranges),
    }
    return planned(TomlTable(keys, call.node), lambda file: design.unit, _NOWHERE)


def sweep_order(call: Call) -> Order:
    """Run of a unit's parameter study."""
    return Order(use_case("sweep"), Sweep(plan=_plan_of(call), workers=call.settings["workers"]))


def table_of(call: Call, done: Finished) -> Outputs:
    """Table of a parameter study; raises InputError where it has no usable row."""
    path = done.folder / TABLE
    try:
        rows = tuple(csv.DictReader(text_in(path, TABLE, "evaluate this node again").splitlines()))
    except csv.Error as error:
        raise InputError(f"cannot read {TABLE}: {error}", str(path), "evaluate this node again") from error
    found = StudyTable(_plan_of(call), done.folder, rows)
    if not found.done:
        why = next((row.get("what", "") for row in rows if row.get("what")), "see its table")
        raise InputError(
            f"every study failed: {why}", str(path), "see points.csv; vary less, or other inputs"
        )
    return {"table": found}


def best_of(call: Call) -> Outputs:
    """Unit, figure and number of the point whose figure is largest or smallest; raises InputError."""
    table: StudyTable = call.inputs["table"]
    figure = call.settings["figure"].strip()
    rows = [(value, row) for row in table.done if (value := _number(row, figure)) is not None]
    if not rows:
        raise InputError(f"no study has a number {figure!r}", "figure", f"one of: {', '.join(table.columns)}")
    sign = 1.0 if call.settings["goal"] == GOALS[1] else -1.0
    value, row = min(rows, key=lambda found: (sign * found[0], int(found[1]["point"])))
    values = table.plan.values[int(row["point"]) - 1]
    inputs = changed_inputs(table.plan.inputs, values, table.plan.folder)
    return {"unit": Design(inputs.unit), "number": value, "point": int(row["point"])}


def _number(row: Mapping[str, str], name: str) -> float | None:
    try:
        found = float(row.get(name) or "nan")
    except ValueError:
        return None
    return found if math.isfinite(found) else None
