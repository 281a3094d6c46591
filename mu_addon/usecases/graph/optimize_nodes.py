"""The node of an optimisation: a unit, a file of targets and freedoms, and a unit that meets them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from ...errors import InputError
from ...graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, setting
from ...optimization.settings import WORKERS

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order

OPTIMIZE = "Optimize"


def _remark(outputs: Outputs) -> str:
    proposed = outputs.get("proposed")
    if proposed is None:
        return ""
    missed = [t["name"] for t in proposed["targets"] if not t["met"]]
    return f"misses {', '.join(missed)}" if missed else "meets every target"


def _optimize(call: Call) -> Order:
    from ...evidence import load_model
    from ...graph.evaluation import Order
    from ...optimization import read_design
    from ...studies.optimize import Optimize
    from ...studies.use_case import use_case

    s, design = call.settings, call.inputs["unit"]
    if not s["file"]:
        raise InputError("no targets are named", "file", "give a design.toml")
    found, model = read_design(Path(s["file"]), design.unit, design.body), call.inputs["model"]
    job = Optimize(design=found, model=None if model is None else load_model(model), workers=s["workers"])
    return Order(use_case(job.name), job)


def _proposed(call: Call, done: Finished) -> Outputs:
    from ...design.parameters import read_unit

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


def optimize_nodes() -> tuple[Definition, ...]:
    """Definition of the node Optimize."""
    return (
        Definition(
            "optimize",
            "Optimize",
            OPTIMIZE,
            "a unit that meets the targets of a design.toml, found from the linked one",
            (
                Input("unit", ("unit",), "link the unit where the search starts"),
                Input("model", ("model",), "an extended model, by a node Diagnose", needed=False),
            ),
            (Output("unit", "unit", "the proposed unit"),),
            (
                setting(
                    "file",
                    "",
                    "design.toml of targets and freedoms; the linked unit and body replace those in it",
                    path=FILE,
                ),
                setting("proposed", 1, "which of the proposed units", low=1, high=6),
                Setting(WORKERS),
            ),
            order=_optimize,
            read=_proposed,
            muting="the unit is passed on unchanged",
            mute=lambda call: {"unit": call.inputs["unit"]},
            remark=_remark,
        ),
    )
