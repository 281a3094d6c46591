"""Nodes of parameter studies: ranges of parameters, the studies over them, and the best of these."""

from __future__ import annotations

from ..errors import InputError
from ..graph.definition import Call, Definition, Input, Output, Outputs, node, setting
from ..meshing.settings import OF_CONTINUUM
from ..studies.sweep import StudyTable, number_in
from ..toml_reader import TomlTable
from .parts import Design, described
from .studies import node_of

STUDY = "Parameter Study"
FACTOR = "protocol.factor"
REFINE = "simulate.mesh.refine"
GOALS = ("largest", "smallest")


def _varied() -> dict[str, bool]:
    """Every parameter that can be varied, and True if it takes whole numbers only."""
    printed = {name: d for name, d in described().items() if name not in OF_CONTINUUM}
    numbers = {name: d.type is int for name, d in printed.items() if d.type in (int, float)}
    return numbers | {FACTOR: False, REFINE: False}


def _range_remark(outputs: Outputs) -> str:
    name, table = outputs["range"]
    if "values" in table:
        return f"{name}: {', '.join(f'{v:g}' for v in table['values'])}"
    return f"{name}: {table['low']:g} to {table['high']:g}"


@node(
    STUDY,
    outputs=(Output("range", "range", "the values"),),
    settings=(
        setting(
            "parameter", "chambers.wall_mm", "which parameter, by section and name", choices=tuple(_varied())
        ),
        setting("low", 0.8, "the lowest value, in the parameter's unit", low=-1e6, high=1e6),
        setting("high", 1.0, "the highest value", low=-1e6, high=1e6),
        setting("steps", 3, "how many values a grid has", low=2, high=1000),
        setting("log", False, "sample evenly in the logarithm"),
        setting("values", "", "values in place of low and high, such as 0.8 0.9 1.0"),
    ),
    muting="the parameter is not varied",
    remark=_range_remark,
)
def range_(call: Call) -> Outputs:
    """Values of one parameter, for a parameter study."""
    from ..studies.parameter_study.variable import variable

    s = call.settings
    name, whole = s["parameter"], _varied()[s["parameter"]]
    if s["values"].strip():
        try:
            found = [float(word) for word in s["values"].split()]
        except ValueError:
            what = f"{s['values']!r} are not values"
            raise InputError(what, "values", "give numbers, such as 0.8 0.9 1.0") from None
        return {"range": (name, {"values": [_number(v, whole) for v in found]})}
    table = {key: _number(s[key], whole) for key in ("low", "high")} | {k: s[k] for k in ("log", "steps")}
    variable(name, TomlTable(table))
    return {"range": (name, table)}


def _number(value: float, whole: bool) -> float | int:
    if not whole:
        return value
    if not value.is_integer():
        raise InputError(f"{value:g} is not a whole number", "low, high, values", "give whole numbers")
    return int(value)


@node(
    STUDY,
    (Input("table", ("study table",), "link a node Parameter Study"),),
    (Output("unit", "unit", "its unit"), Output("number", "number", "its figure")),
    (
        setting("figure", "angle_range_deg", "column of the table"),
        setting("goal", GOALS[0], "which of them", choices=GOALS),
    ),
    label="Best of a Study",
    remark=lambda outputs: f"point {outputs['point']}: {outputs['number']:.6g}",
)
def best(call: Call) -> Outputs:
    """The study whose figure is largest or smallest: its unit, and the figure."""
    from ..studies.parameter_study.variable import changed_inputs

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


def sweep_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of parameter studies."""
    return range_, node_of("sweep"), best
