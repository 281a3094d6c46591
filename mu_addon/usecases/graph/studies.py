"""The node of a study: sockets, settings and run, from its declaration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...design.gates import GateError
from ...graph.definition import Call, Definition, Input, Output, Outputs, Setting
from ...studies import study
from .parts import refuse_body

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order
    from ...run.study import Study

SOCKETS = {"unit": Input("unit", ("unit",), "link a unit")}
"""By kind of an input that is no plain value."""
MUTED = "this node and those that need it are not computed"


def node_of(name: str) -> Definition:
    """Definition of a study's node."""
    kind = study(name)
    node = kind.node
    assert node is not None
    inputs = {name: one for name, one in kind.inputs().items() if name not in node.hidden}

    def read(call: Call, done: Finished) -> Outputs:
        if node.answers and done.summary.get("verdict") == "error":
            faults = done.summary.get("faults") or ["see its report"]
            raise GateError(f"not printable: {faults[0]}", str(done.folder), "see report.html in that folder")
        return {output: done for output, *_ in node.outputs}

    return Definition(
        kind.name,
        node.label or kind.__name__,
        node.category,
        node.text,
        tuple(SOCKETS[one.kind] for one in inputs.values() if not one.descriptions),
        tuple(Output(*one) for one in node.outputs),
        tuple(Setting(d) for one in inputs.values() if one.kind != "window" for d in one.descriptions),
        order=lambda call: _order(kind, call),
        read=read,
        muting=MUTED,
        remark=lambda outputs: node.remark(next(iter(outputs.values())).summary),
    )


def _order(kind: type[Study], call: Call) -> Order:
    from ...graph.evaluation import Order
    from ...studies.use_case import use_case

    assert kind.node is not None
    linked: Any = call.inputs.get("unit")
    if linked is not None and kind.node.no_body:
        refuse_body(linked, kind.node.no_body)
    values: dict[str, Any] = {}
    for name, one in kind.inputs().items():
        if one.kind == "unit":
            values[name] = linked.unit
        elif one.kind == "window":
            values[name] = one.made((linked.path,), values)
        elif name not in kind.node.hidden:
            values[name] = one.made(tuple(call.settings[d.name] for d in one.descriptions), values)
    return Order(use_case(kind.name), kind(**values), answers=kind.node.answers)
