"""The node of a study: sockets, settings and run, from its declaration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from ...design.gates import GateError
from ...graph.definition import Call, Definition, Input, Output, Outputs, Setting
from ...studies import study
from .parts import refuse_body

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order
    from ...run.study import Study

SOCKETS: dict[str, tuple[Input, Callable[[Any], Any]]] = {
    "unit": (Input("unit", ("unit",), "link a unit"), lambda linked: linked.unit),
    "bending": (
        Input("bending", ("recording", "data"), "link recordings, or measured data", many=True),
        lambda linked: tuple(getattr(value, "folder", value) for _, value in linked),
    ),
    "gripper": (Input("gripper", ("gripper",), "link a gripper"), lambda linked: linked),
    "recording": (Input("recording", ("recording",), "link a node Record or Recording"), Path),
    "measured": (Input("data", ("data",), "link a node Measured Data"), lambda linked: linked),
    "calibration": (Input("calibration", ("calibration",), "link a node Calibrate or Calibration"), Path),
}
"""By kind of an input that is no plain value: its socket, and the value of what is linked there."""
REMARK = "remark"
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
        outputs = node.read(done) if node.read else {output: done for output, *_ in node.outputs}
        return {**outputs, REMARK: node.remark(done.summary)}

    return Definition(
        kind.name,
        node.label or kind.__name__,
        node.category,
        node.text,
        tuple(_socket(one) for one in inputs.values() if one.kind in SOCKETS),
        tuple(Output(*one) for one in node.outputs),
        tuple(
            Setting(d, one.path)
            for one in inputs.values()
            if one.kind not in ("window", *SOCKETS)
            for d in one.descriptions
        ),
        order=lambda call: _order(kind, call),
        read=read,
        muting=MUTED,
        remark=lambda outputs: str(outputs[REMARK]),
    )


def _socket(one: Any) -> Input:
    """The socket of an input, of one that a study may do without too."""
    return attrs.evolve(SOCKETS[one.kind][0], needed=getattr(one, "needed", True))


def _order(kind: type[Study], call: Call) -> Order:
    from ...graph.evaluation import Order
    from ...studies.use_case import use_case

    assert kind.node is not None
    if kind.node.no_body:
        refuse_body(call.inputs["unit"], kind.node.no_body)
    values: dict[str, Any] = {}
    for name, one in kind.inputs().items():
        if one.kind in SOCKETS:
            socket, value_of = SOCKETS[one.kind]
            linked = call.inputs[socket.name]
            values[name] = None if linked is None else value_of(linked)
        elif one.kind == "window":
            values[name] = one.made((call.inputs["unit"].path,), values)
        elif one.descriptions and name not in kind.node.hidden:
            values[name] = one.made(tuple(call.settings[d.name] for d in one.descriptions), values)
    return Order(use_case(kind.name), kind(**values).complete(), answers=kind.node.answers)
