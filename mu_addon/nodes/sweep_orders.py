"""Plan of a node Parameter Study, and its results. Loads the solver."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..graph.definition import Call, Outputs
from ..simulate_and_place.settings import STAGES
from ..studies.parameter_study.plan import Plan, planned
from ..studies.parameter_study.variable import changed_inputs
from ..studies.sweep import StudyTable, number_in
from ..toml_reader import TomlTable
from .late import GOALS
from .parts import Design, refuse_body

# Such a plan names no file: its folder decides nothing, and is the same everywhere.
_NOWHERE = Path("/")


def plan_of(call: Call) -> Plan:
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
    return planned(TomlTable(keys, call.node), design.unit, _NOWHERE)


def best_of(call: Call) -> Outputs:
    """Unit, figure and number of the point whose figure is largest or smallest; raises InputError."""
    table: StudyTable = call.inputs["table"]
    figure = call.settings["figure"].strip()
    rows = [(value, row) for row in table.done if (value := number_in(row, figure)) is not None]
    if not rows:
        raise InputError(f"no study has a number {figure!r}", "figure", f"one of: {', '.join(table.columns)}")
    sign = 1.0 if call.settings["goal"] == GOALS[1] else -1.0
    value, row = min(rows, key=lambda found: (sign * found[0], int(found[1]["point"])))
    values = table.plan.values[int(row["point"]) - 1]
    inputs = changed_inputs(table.plan.inputs, values, table.plan.folder)
    return {"unit": Design(inputs.unit), "number": value, "point": int(row["point"])}
