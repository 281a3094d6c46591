"""Shipped node trees, and the tree of a unit's design by its steps."""

from __future__ import annotations

from typing import Any

import attrs

from ..design.assets import asset_names, asset_root
from ..design.parameters import Unit
from ..design.steps import STEPS, parameter
from ..errors import InputError
from ..graph.tree import NodeTree, with_absolute_paths
from ..graph.tree_file import read_tree
from .definitions import definitions
from .parts import rest

FOLDER = "graphs"


def template_names() -> tuple[str, ...]:
    """Sorted names of the shipped trees."""
    return tuple(asset_names(FOLDER))


def template(name: str) -> NodeTree:
    """The shipped tree of this name; raises InputError."""
    if name not in template_names():
        raise InputError(
            f"there is no template {name!r}", "template", f"choose one of {', '.join(template_names())}"
        )
    path = asset_root() / FOLDER / f"{name}.toml"
    return with_absolute_paths(read_tree(path), definitions(), path.parent)


def steps_of(unit: Unit, path: str = "") -> NodeTree:
    """The tree of a unit's design, a node a step; without a path the waveguide's wells are not linked."""
    tree = template("unit")
    nodes = {}
    for name, node in tree.nodes.items():
        settings: dict[str, Any] = {}
        links = dict(node.links)
        if node.kind in STEPS:
            step = STEPS[node.kind]
            settings = {own.split(".")[1]: parameter(unit, own) for own in step.own}
            if not step.after:
                settings["scale"] = unit.scale
            if "path" in step.chosen:
                settings["path"] = path
        elif node.kind == "assemble":
            settings = {own.replace(".", "_"): parameter(unit, own) for own in rest()}
            settings["name"] = unit.name
            if not path:
                links.pop("wells", None)
        definition = definitions()[node.kind]
        differing = {
            key: value
            for key, value in settings.items()
            if (own := definition.setting(key)) is not None and value != own.description.default
        }
        nodes[name] = attrs.evolve(node, settings=differing, links=links)
    return NodeTree(unit.name, nodes)
