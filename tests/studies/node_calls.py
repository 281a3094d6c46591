"""Nodes as an evaluation calls them."""

from mu_addon.graph.definition import Call
from mu_addon.nodes.definitions import definitions


def call(kind, inputs=None, **settings):
    """A call of a kind of node with these inputs, and its default settings but for those given."""
    definition = definitions()[kind]
    values = {s.name: s.description.default for s in definition.settings} | settings
    return Call(kind, {s.name: s.checked(values[s.name]) for s in definition.settings}, inputs or {})


def order_of(call):
    """The run that a node asks for."""
    return definitions()[call.node].order(call)
