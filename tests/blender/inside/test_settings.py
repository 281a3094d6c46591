"""Panels and nodes show usual settings at once, and advanced ones in folds of their groups."""

import bpy

from mu_addon.blender.node_tree.classes import TREE, attribute
from mu_addon.blender.shared.blender_property import described_fields
from mu_addon.blender.shared.wording import heading
from mu_addon.blender.unit.fields import TRUE
from mu_addon.design.gripper import SECTIONS as OF_GRIPPER
from mu_addon.design.parameters import SECTIONS

from .acting import add
from .drawing import Folds, draw

GROUPS = ("MU_PG_study", "MU_PG_optimize", "MU_PG_gripper", "MU_PG_printing")


def in_its_group(seen):
    """{(class, setting): its description} of what was drawn, each in the fold of its group or in none."""
    found = {}
    for owner, name, fold in seen:
        d = described_fields(owner).get(name.removesuffix(TRUE))
        if d is not None:
            assert fold == heading(d.group), (type(owner).__name__, name, fold)
            found[type(owner).__name__, d.name] = d
    return found


def test_every_panel_shows_usual_settings_and_folds_advanced_ones_by_their_group():
    root, seen = add(), []
    every = [cls for cls in bpy.types.Panel.__subclasses__() if cls.__name__.startswith("MU_PT_")]
    of_unit = [cls for cls in every if cls.bl_space_type == "VIEW_3D"]
    for command, law in (("place", "ogden-roxburgh"), ("simulate", "yeoh")):
        root.mu_unit.study.command, root.mu_unit.wall.law = command, law
        draw(of_unit, Folds(seen))
    root.mu_unit.wall.law = "prony"
    root.mu_unit.wall.friction_share, root.mu_optimize.has_gravity = 0.5, True
    root.mu_unit.study.effects = '[effect.gravity]\ndirection = {value = 1.0, unit = ""}\n'
    draw(of_unit, Folds(seen))
    bpy.ops.mu.gripper_add()
    draw(of_unit, Folds(seen))
    found = in_its_group(seen)
    for section in (*SECTIONS, *OF_GRIPPER):
        assert {name for kind, name in found if kind.endswith(f"_{section.section}")}, section
    every = {cls.__name__: cls for cls in bpy.types.PropertyGroup.__subclasses__()}
    for kind in [*GROUPS, *(f"MU_PG_{section.section}" for section in SECTIONS)]:
        of_kind = described_fields(every[kind])
        assert of_kind, kind
        assert {d.name for d in of_kind.values()} == {name for k, name in found if k == kind}, kind
    assert len({d.group for d in found.values()}) > 8


def test_every_node_folds_the_settings_of_its_study_by_their_group():
    tree, kinds = bpy.data.node_groups.new("tree", TREE), bpy.types.Node.__subclasses__()
    ours = [kind for kind in kinds if hasattr(kind, "definition")]
    assert len(ours) > 30
    for kind in ours:
        seen, node = [], tree.nodes.new(kind.bl_idname)
        node.draw_buttons_ext(bpy.context, Folds(seen))
        found = in_its_group(seen)
        assert {name for _, name, _ in seen} == {attribute(s) for s in node.definition.settings if s.shown}
        assert len(found) == len(seen), kind.bl_idname
