"""Geometry Nodes groups that skin skeletons: built in code, versioned, rebuilt in place when older."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...shared.compat import input_defaults, modifier_inputs, set_modifier_input
from . import unit, waveguide
from .groups import BALLS, COLOUR_FIELD, LABELLED, TUBES, Group

GROUPS = {one.name: one for one in (TUBES, BALLS, LABELLED, waveguide.WAVEGUIDE, COLOUR_FIELD)}
"""Groups for any geometry, which are assets."""
_ALL = {**GROUPS, unit.UNIT.name: unit.UNIT}

CATALOGUE = "6f0f3a5e-5f0b-4a37-9a39-0c2f7c1b9d21"
"""Identifier of the groups' catalogue in the asset browser."""


def group(name: str):
    """The node group of that name, built or brought up to date; those of `GROUPS` are assets of the file."""
    asked = _ALL[name]
    found = bpy.data.node_groups.get(name)
    if found is None:
        found = bpy.data.node_groups.new(name, "GeometryNodeTree")
        found.is_modifier = True
        if name in GROUPS:
            found.asset_mark()
    if found.get("mu_version") != asked.version:
        _build(found, asked)
    return found


@contextmanager
def no_assets() -> Iterator[None]:
    """Clear the asset marks of this file's groups temporarily, to write a file of other assets."""
    marked = [g for g in map(bpy.data.node_groups.get, GROUPS) if g is not None and g.asset_data is not None]
    kept = [(tree, tree.asset_data.description, tree.asset_data.catalog_id) for tree in marked]
    for tree in marked:
        tree.asset_clear()
    try:
        yield
    finally:
        for tree, description, catalogue in kept:
            tree.asset_mark()
            tree.asset_data.description, tree.asset_data.catalog_id = description, catalogue


def unite(trees) -> None:
    """Let the file's own groups take the place of copies that came with an import, "MU Unit.001".

    A copy has no users then, and Blender does not save it. By both a unit would be skinned twice.
    """
    for tree in trees:
        name = re.sub(r"\.\d{3,}$", "", tree.name)
        own = group(name) if name in _ALL and name in bpy.data.node_groups else tree
        if own == tree or tree.library is not None:
            continue
        with _inputs_kept(tree, own):
            tree.user_remap(own)
        tree.asset_clear()
        tree.use_fake_user = False


@contextmanager
def _inputs_kept(tree, after) -> Iterator[None]:
    """Keep the inputs, by name, of modifiers that use a tree while it is rebuilt or replaced."""
    users = [m for o in bpy.data.objects for m in o.modifiers if m.type == "NODES" and m.node_group == tree]
    kept = [modifier_inputs(modifier) for modifier in users]
    yield
    for modifier, values in zip(users, kept, strict=True):
        for name, default in input_defaults(after).items():
            set_modifier_input(modifier, name, values.get(name, default))


def _build(tree, asked: Group) -> None:
    """Rebuild a group; modifiers that use it keep their values, by the name of the input."""
    with _inputs_kept(tree, tree):
        _fill(tree, asked)


def _fill(tree, asked: Group) -> None:
    tree.nodes.clear()
    tree.interface.clear()
    asked.build(tree, *(group(name) for name in asked.uses))
    if tree.asset_data is not None:  # the user may have taken the mark off
        tree.asset_data.description = asked.text
        tree.asset_data.catalog_id = CATALOGUE
    tree["mu_version"] = asked.version


def skin(obj, name: str):
    """Modifier with that group on an object, added if it is missing."""
    tree = group(name)
    for modifier in obj.modifiers:
        if modifier.type == "NODES" and modifier.node_group == tree:
            return modifier
    modifier = obj.modifiers.new(name, "NODES")
    modifier.node_group = tree
    return modifier
