"""The node of a study: sockets, settings and run, from its declaration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...graph.definition import Call, Definition, Input, Output, Setting
from ...studies import study

if TYPE_CHECKING:
    from ...graph.evaluation import Order
    from ...run.study import Study

OBJECTS = {"unit": (Input("unit", ("unit",), "link a unit"), lambda linked: linked.unit)}
"""By kind of an input that is no plain value: its socket, and its value from what is linked there."""
MUTED = "this node and those that need it are not computed"


def node_of(name: str) -> Definition:
    """Definition of a study's node."""
    kind = study(name)
    node = kind.node
    assert node is not None
    inputs = kind.inputs()
    return Definition(
        kind.name,
        kind.__name__,
        node.category,
        node.text,
        tuple(OBJECTS[one.kind][0] for one in inputs.values() if one.description is None),
        tuple(Output(*one) for one in node.outputs),
        tuple(Setting(one.description) for one in inputs.values() if one.description is not None),
        order=lambda call: _order(kind, call),
        read=lambda call, done: {output: done for output, *_ in node.outputs},
        muting=MUTED,
        remark=lambda outputs: node.remark(next(iter(outputs.values())).summary),
    )


def _order(kind: type[Study], call: Call) -> Order:
    from ...graph.evaluation import Order
    from ...studies.use_case import use_case

    values: dict[str, Any] = {}
    for name, one in kind.inputs().items():
        if one.description is not None:
            values[name] = one.made(call.settings[one.description.name], values)
        else:
            socket, value_of = OBJECTS[one.kind]
            values[name] = value_of(call.inputs[socket.name])
    return Order(use_case(kind.name), kind(**values))
