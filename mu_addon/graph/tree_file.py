"""A node tree as TOML: a table a node, its settings and links by name.

format = 1
name = "two walls"

[nodes.Thin]
kind = "set_parameter"
at = [300, 0]

[nodes.Thin.settings]
value = 0.7

[nodes.Thin.links]
unit = ["Unit.unit"]     # output `unit` of the node `Unit`
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import attrs

from ..errors import InputError
from ..toml_reader import TomlTable, parsed_toml, read_toml
from ..toml_writer import toml_text
from .tree import Node, NodeTree, Source

FORMAT = 1
HEADER = "# A node tree; `run.py graph` evaluates it."
STATES = "nodes.json"
"""File of the states of an evaluated tree's nodes."""
# Far more than any tree that somebody wires.
MOST_NODES = 10_000


def tree_text(tree: NodeTree) -> str:
    """TOML text of a tree."""
    return toml_text({"format": FORMAT, **tree_keys(tree)}, HEADER)


def tree_keys(tree: NodeTree) -> dict[str, Any]:
    """The keys of a tree's file."""
    nodes = {}
    for name, node in tree.nodes.items():
        table: dict[str, Any] = {"kind": node.kind}
        if node.muted:
            table["muted"] = True
        if any(node.at):
            table["at"] = list(node.at)
        if node.frame:
            table["frame"] = node.frame
        if node.settings:
            table["settings"] = dict(node.settings)
        if node.links:
            table["links"] = {
                key: [f"{s.node}.{s.output}" for s in sources] for key, sources in node.links.items()
            }
        nodes[name] = table
    return {"name": tree.name, "nodes": nodes}


def read_tree(path: str | Path) -> NodeTree:
    """The tree in a TOML file; raises InputError with the fault and its place."""
    return tree_of(read_toml(Path(path), "node tree", "give the TOML file of a node tree"))


def parse_tree(text: str, origin: str = "node tree") -> NodeTree:
    """The tree in TOML text; raises InputError. The meaning of nodes is checked by `check.faults`."""
    return tree_of(parsed_toml(text, origin))


def tree_of(document: TomlTable) -> NodeTree:
    """The tree in a TOML document; raises InputError."""
    keys = {k: v for k, v in document.of_format(FORMAT).values.items() if k not in ("format", "run")}
    return tree_of_keys(attrs.evolve(document, values=keys))


def tree_of_keys(document: TomlTable) -> NodeTree:
    """The tree of the keys of its file; raises InputError."""
    document.only(("name", "nodes"))
    name, nodes = document.word("name", default="node tree"), document.inner("nodes")
    _require_name(name, document.at("name"))
    if not nodes.values:
        raise InputError("there are no nodes", nodes.at(), "write a table [nodes.NAME] for each")
    if len(nodes.values) > MOST_NODES:
        raise InputError(f"there are more than {MOST_NODES} nodes", nodes.at(), "divide the tree")
    return NodeTree(name, {key: _node(key, nodes) for key in nodes.values})


def _node(name: str, nodes: TomlTable) -> Node:
    _require_name(name, nodes.at(name))
    table = nodes.inner(name).only(("kind", "settings", "links", "muted", "at", "frame"))
    links = table.inner("links")
    return Node(
        kind=table.word("kind"),
        settings=dict(table.inner("settings").values),
        links={key: _sources(links, key) for key in links.values},
        muted=table.take("muted", bool, False),
        at=table.take("at", tuple[float, float], (0.0, 0.0)),
        frame=table.take("frame", str, ""),
    )


def _sources(links: TomlTable, key: str) -> tuple[Source, ...]:
    texts = (links.word(key),) if isinstance(links.values[key], str) else links.words(key)
    found = []
    for text in texts or ("",):
        # Names of nodes may hold dots, those of outputs do not.
        node, dot, output = text.rpartition(".")
        if not (dot and node and output):
            raise InputError(f"{text!r} is not a link", links.at(key), 'give "NODE.OUTPUT", or several in []')
        found.append(Source(node, output))
    return tuple(found)


def file_name(node: str) -> str:
    """A node's name as part of a file's: letters, digits, dots, hyphens and underscores."""
    return re.sub(r"[^\w.-]+", "_", node)


def _require_name(value: str, where: str) -> None:
    if not (0 < len(value) <= 120 and value.isprintable()):
        what = f"{value!r} is not a name"
        raise InputError(what, where, "give one line of 1 to 120 printable characters")
