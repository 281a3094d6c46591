"""Nodes of measured data and of comparison, and plain numbers."""

from __future__ import annotations

import math
from pathlib import Path

from ..errors import InputError
from ..graph.definition import FOLDER, Call, Definition, Input, Output, Outputs, node, setting
from ..measured import read_folder
from .studies import node_of

DATA, NUMBERS = "Data", "Number"
COMPARED = ("unit", "study", "grasp", "diagnosis")
OPERATIONS = ("add", "subtract", "multiply", "divide", "minimum", "maximum")


@node(
    DATA,
    outputs=(Output("data", "data", "the experiments"),),
    settings=(setting("folder", "", "folder of experiments.toml and its CSV files", path=FOLDER),),
    label="Measured Data",
    remark=lambda outputs: f"{len(outputs['data'].experiments)} experiments",
)
def data(call: Call) -> Outputs:
    """A folder of measured data, read and checked."""
    folder = call.settings["folder"]
    if not folder:
        raise InputError("no folder of measured data is named", "folder", "give the one of experiments.toml")
    return {"data": read_folder(Path(folder))}


@node(
    DATA,
    (Input("items", COMPARED, "link two or more of one kind", many=True),),
    (Output("table", "table", "the comparison"),),
    muting="nothing is compared",
    remark=lambda outputs: str(outputs["table"].remark()),
)
def compare(call: Call) -> Outputs:
    """Differences between units, studies, grasps or diagnoses: a table, and charts."""
    # Reads the library of materials, which loads the solver.
    from .comparison import compare

    return {"table": compare(call.inputs["items"])}


@node(
    NUMBERS,
    outputs=(Output("number", "number", "the number"),),
    settings=(setting("value", 0.0, "the number", low=-1e9, high=1e9),),
    remark=lambda outputs: f"{outputs['number']:g}",
)
def number(call: Call) -> Outputs:
    """A number, for any number of settings."""
    return {"number": call.settings["value"]}


@node(
    NUMBERS,
    outputs=(Output("number", "number", "the result"),),
    settings=(
        setting("operation", "add", "the operation", choices=OPERATIONS),
        setting("a", 0.0, "the first", low=-1e9, high=1e9),
        setting("b", 0.0, "the second", low=-1e9, high=1e9),
    ),
    remark=lambda outputs: f"{outputs['number']:g}",
)
def calculate(call: Call) -> Outputs:
    """A number from two."""
    a, b, what = call.settings["a"], call.settings["b"], call.settings["operation"]
    if what == "divide" and b == 0.0:
        raise InputError("a division by zero", "b", "give another number")
    found = {
        "add": a + b,
        "subtract": a - b,
        "multiply": a * b,
        "divide": a / b if b else math.nan,
        "minimum": min(a, b),
        "maximum": max(a, b),
    }[what]
    # Decimal fractions stay what they read as: 0.9 and 0.1 more are 1, not a digit beside it.
    return {"number": float(f"{found:.12g}")}


def evidence_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of measured data, comparison and numbers."""
    return data, node_of("diagnose"), compare, number, calculate
