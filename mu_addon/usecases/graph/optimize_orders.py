"""Run of a node Optimize, and the unit from its result. Loads the solver."""

from __future__ import annotations

from pathlib import Path

import attrs

from ...design.parameters import read_unit
from ...errors import InputError
from ...graph.definition import Call, Outputs
from ...graph.evaluation import Finished, Order
from ..optimize.job import job_from
from ..optimize.run import USE_CASE


def optimize_order(call: Call) -> Order:
    """Run of the optimisation of a unit by a file's targets and freedoms; raises InputError."""
    s, design = call.settings, call.inputs["unit"]
    if not s["file"]:
        raise InputError("no targets are named", "file", "give a design.toml")
    job = job_from(Path(s["file"]), call.inputs["model"], s["workers"], unit=design.unit, body=design.body)
    return Order(USE_CASE, job)


def proposed_of(call: Call, done: Finished) -> Outputs:
    """A proposed unit of an optimisation; raises InputError where there are not so many."""
    rows, number = done.summary["proposed"], call.settings["proposed"]
    if number > len(rows):
        raise InputError(
            f"{len(rows)} units are proposed: there is no number {number}",
            "proposed",
            f"choose 1 to {len(rows)}" if rows else f"see the outcome: {done.summary['outcome']}",
        )
    row = rows[number - 1]
    design = call.inputs["unit"]
    unit = attrs.evolve(read_unit(done.folder / row["file"]), name=design.unit.name)
    return {"unit": attrs.evolve(design, unit=unit, path=row.get("path", design.path)), "proposed": row}
