"""Small kinds of nodes for tests: numbers, a sum of them, and one that fails."""

from mu_addon.errors import InputError
from mu_addon.graph import Definition, Input, Node, NodeTree, Output, Source
from mu_addon.graph.definition import setting


def fails(call):
    raise InputError("it always fails", "its place", "leave it out")


DEFINITIONS = {
    d.kind: d
    for d in (
        Definition(
            "number", "Number", "Toys", "a number",
            outputs=(Output("number", "number"),),
            settings=(setting("value", 0.0, "the number", low=-1e6, high=1e6),),
            make=lambda call: {"number": call.settings["value"]},
        ),
        Definition(
            "sum", "Sum", "Toys", "the sum of sums and a number",
            (Input("sums", ("sum",), "link sums", needed=False, many=True),),
            (Output("sum", "sum"),),
            (setting("more", 0.0, "what is added", low=-1e9, high=1e9),),
            make=lambda call: {"sum": call.settings["more"] + sum(v for _, v in call.inputs["sums"])},
            muting="zero in its place",
            mute=lambda call: {"sum": 0.0},
        ),
        Definition(
            "twice", "Twice", "Toys", "twice a sum",
            (Input("sum", ("sum",), "link a sum"),),
            (Output("sum", "sum"),),
            make=lambda call: {"sum": 2 * call.inputs["sum"]},
            muting="nothing behind it is made",
        ),
        Definition(
            "fails", "Fails", "Toys", "nothing",
            (Input("sum", ("sum",), "link a sum", needed=False),),
            (Output("sum", "sum"),),
            make=fails,
        ),
    )
}  # fmt: skip


def node(kind, links=None, muted=False, **settings):
    """A node; links: "NODE.OUTPUT" or several, by input."""
    found = {}
    for key, texts in (links or {}).items():
        texts = [texts] if isinstance(texts, str) else texts
        found[key] = tuple(Source(*text.rsplit(".", 1)) for text in texts)
    return Node(kind, settings, found, muted)


def tree(**nodes):
    return NodeTree("toys", nodes)
