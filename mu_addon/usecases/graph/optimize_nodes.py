"""The node of an optimisation: a unit, a file of targets and freedoms, and a unit that meets them."""

from __future__ import annotations

from ...graph.definition import FILE, Definition, Input, Output, Outputs, Setting, setting
from ...optimization.settings import WORKERS
from .common import of_orders

OPTIMIZE = "Optimize"
_ORDERS = "optimize_orders"


def _remark(outputs: Outputs) -> str:
    proposed = outputs.get("proposed")
    if proposed is None:
        return ""
    missed = [t["name"] for t in proposed["targets"] if not t["met"]]
    return f"misses {', '.join(missed)}" if missed else "meets every target"


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
                    "design.toml of targets and freedoms; the linked unit and its body stand for its own",
                    path=FILE,
                ),
                setting("proposed", 1, "which of the proposed units", low=1, high=6),
                Setting(WORKERS),
            ),
            order=of_orders("optimize_order", _ORDERS),
            read=of_orders("proposed_of", _ORDERS),
            muting="the unit passes on as it is",
            mute=lambda call: {"unit": call.inputs["unit"]},
            remark=_remark,
        ),
    )
