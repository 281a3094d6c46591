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

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..reading import is_number, parse_toml, read_text
from ..toml_writer import toml_text
from .tree import Node, NodeTree, Source

FORMAT = 1
HEADER = "# A node tree; `run.py graph` evaluates it."
# Far more than any tree that somebody wires.
MOST_BYTES, MOST_NODES = 1 << 22, 10_000
_KEYS = ("kind", "settings", "links", "muted", "at", "frame")


def tree_text(tree: NodeTree, run: Mapping[str, Any] | None = None) -> str:
    """TOML text of a tree; run: more for its table [run], which decides no result."""
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
    values = {"format": FORMAT, "name": tree.name, "nodes": nodes, **({"run": run} if run else {})}
    return toml_text(values, HEADER)


def read_tree(path: str | Path) -> NodeTree:
    """The tree in a TOML file; raises InputError with the fault and its place."""
    text = read_text(path, "node tree", "give the TOML file of a node tree", MOST_BYTES)
    return parse_tree(text, str(path))


def parse_tree(text: str, origin: str = "node tree") -> NodeTree:
    """The tree in TOML text; raises InputError. The meaning of nodes is checked by `check.faults`."""
    return tree_of(parse_toml(text, origin), origin)


def tree_of(document: Mapping[str, Any], origin: str) -> NodeTree:
    """The tree in a TOML document; raises InputError."""
    found = document.get("format")
    if found != FORMAT or isinstance(found, bool):
        raise InputError(
            f"format = {'missing' if found is None else repr(found)} is not known here",
            origin,
            f"write format = {FORMAT}; a newer version of the program may have written the file",
        )
    for key in document:
        if key not in ("format", "name", "nodes", "run"):
            raise InputError(f"unknown key {key!r}", origin, "known: format, name, nodes, run")
    name, nodes = document.get("name", "node tree"), document.get("nodes", {})
    if not _is_name(name):
        raise InputError(f"name = {name!r} is not a name", origin, "give one line of text")
    if not isinstance(nodes, Mapping) or not nodes:
        raise InputError("there are no nodes", f"{origin}, [nodes]", "write a table [nodes.NAME] for each")
    if len(nodes) > MOST_NODES:
        raise InputError(f"there are more than {MOST_NODES} nodes", f"{origin}, [nodes]", "divide the tree")
    return NodeTree(str(name), {key: _node(key, table, origin) for key, table in nodes.items()})


def _node(name: str, table: Any, origin: str) -> Node:
    where = f"{origin}, [nodes.{name}]"
    if not _is_name(name):
        raise InputError(f"{name!r} is not a name", where, "give one line of 1 to 120 printable characters")
    if not isinstance(table, Mapping):
        raise InputError(f"{table!r} is not a table", where, "write it as a table")
    for key in table:
        if key not in _KEYS:
            raise InputError(f"unknown key {key!r}", where, f"known: {', '.join(_KEYS)}")
    kind, muted, frame = table.get("kind"), table.get("muted", False), table.get("frame", "")
    settings, links, at = table.get("settings", {}), table.get("links", {}), table.get("at", [0.0, 0.0])
    for key, good, words in (
        ("kind", isinstance(kind, str) and kind, "the kind of node, in quotes"),
        ("muted", isinstance(muted, bool), "true or false"),
        ("frame", isinstance(frame, str), "text in quotes"),
        ("settings", isinstance(settings, Mapping), "a table of settings"),
        ("links", isinstance(links, Mapping), "a table of links"),
        ("at", isinstance(at, list) and len(at) == 2 and all(map(is_number, at)), "two numbers"),
    ):
        if not good:
            raise InputError(f"{key} = {table.get(key)!r} does not fit", where, f"give {words}")
    return Node(
        kind=str(kind),
        settings=dict(settings),
        links={key: _sources(value, f"{where}, links, {key}") for key, value in links.items()},
        muted=muted,
        at=(float(at[0]), float(at[1])),
        frame=frame,
    )


def _sources(value: Any, where: str) -> tuple[Source, ...]:
    texts = [value] if isinstance(value, str) else value
    if not isinstance(texts, list) or not texts or not all(isinstance(text, str) for text in texts):
        raise InputError(f"{value!r} is not a link", where, 'give "NODE.OUTPUT", or several in an array')
    found = []
    for text in texts:
        # Names of nodes may hold dots, those of outputs do not.
        node, dot, output = text.rpartition(".")
        if not (dot and node and output):
            raise InputError(f"{text!r} is not a link", where, 'give "NODE.OUTPUT"')
        found.append(Source(node, output))
    return tuple(found)


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= 120 and value.isprintable()
