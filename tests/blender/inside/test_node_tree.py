"""Trees of the node editor: kinds of nodes, links right and wrong, values, muting, groups, files, runs."""

import json

import attrs
import bpy
import pytest

import mu_addon
from mu_addon.blender.node_tree import (
    classes,
    conversion,
    following,
    groups,
    operators,
    panel,
    sockets,
    state,
)
from mu_addon.blender.sidebar import unit_panel
from mu_addon.blender.unit import object as unit_object
from mu_addon.design.steps import STEPS
from mu_addon.graph import read_tree
from mu_addon.graph.tree_file import STATES
from mu_addon.nodes import plan
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.templates import template, template_names
from mu_addon.run.child import DONE

from .acting import add, refused
from .drawing import drawn
from .jobs import ended


def new(name):
    """The tree of a template."""
    before = {tree.name for tree in state.trees()}
    assert bpy.ops.mu.tree_new(template=name) == {"FINISHED"}
    (made,) = {tree.name for tree in state.trees()} - before
    return bpy.data.node_groups[made]


def states(tree):
    return {name: found.state for name, found in state.refresh(tree).items()}


def link(tree, before, output, after, taken):
    out = next(s for s in tree.nodes[before].outputs if s.identifier == output)
    into = next(s for s in tree.nodes[after].inputs if s.identifier == taken)
    return tree.links.new(out, into)


def test_every_kind_of_node_of_the_core_has_its_class_sockets_fields_and_menu():
    tree = bpy.data.node_groups.new("all", classes.TREE)
    for kind, definition in definitions().items():
        node = tree.nodes.new(classes.node_class(kind))
        numbers = [s.name for s in definition.settings if s.is_number]
        assert [s.identifier for s in node.inputs] == [*(i.name for i in definition.inputs), *numbers]
        assert [s.identifier for s in node.outputs] == [o.name for o in definition.outputs]
        for s in definition.settings:
            value = getattr(node, classes.attribute(s))
            assert conversion._value(s, value) == s.description.default
    assert set(STEPS) <= {node.definition.kind for node in tree.nodes}
    listed = {d.category for d in definitions().values()}
    assert listed == set(panel.CATEGORIES)
    colours = {sockets.colour(o.type) for d in definitions().values() for o in d.outputs}
    types = {o.type for d in definitions().values() for o in d.outputs}
    assert len(colours) == len(types), "two types of one colour"


@pytest.mark.parametrize("shipped", ["unit", "three-walls", "best-wall", "gripper", "data-to-cause", "bench"])
def test_a_template_becomes_a_tree_that_becomes_the_same_file(shipped):
    assert shipped in template_names()
    tree = new(shipped)
    # Values that are the defaults need not be written.
    core = template(shipped)
    nodes = {}
    for key, node in core.nodes.items():
        definition = definitions()[node.kind]
        kept = {k: v for k, v in node.settings.items() if v != definition.setting(k).description.default}
        nodes[key] = attrs.evolve(node, settings=kept)
    assert conversion.to_tree(tree) == attrs.evolve(core, nodes=nodes)
    assert "failed" not in states(tree).values()


def test_a_trees_units_are_in_the_scene_follow_it_and_are_those_of_the_sidebar():
    bpy.ops.ed.undo_push(message="before")
    tree = new("unit")
    (root,) = unit_object.roots()
    assert following.followed(root) == tree.nodes["Assemble Unit"]
    assert root.mu_unit.path == "alpha4"
    assert unit_object.active_root(bpy.context) == root
    tree.nodes["Chambers"].wall_mm = 1.25
    state.refresh(tree)
    assert root.mu_unit.chambers.wall_mm == 1.25
    assert not unit_object.behind(root)
    root.mu_unit.chambers.wall_mm = 1.1
    assert abs(tree.nodes["Chambers"].wall_mm - 1.1) < 1e-6
    assert state.show_units(bpy.context, tree) == [], "once"
    # A unit that other nodes change is theirs: three walls are three objects.
    new("three-walls")
    walls = sorted(r.mu_unit.chambers.wall_mm for r in unit_object.roots() if r != root)
    assert len(set(walls)) == 3
    # One that was deleted comes back with the evaluation; a tree that was built by hand has its unit then.
    bpy.ops.mu.delete()
    tree.nodes["Assemble Unit"].follower = None
    state.refresh(tree)
    (again,) = state.show_units(bpy.context, tree)
    assert again.mu_unit.chambers.wall_mm == pytest.approx(1.1)


def test_a_preset_in_a_node_has_its_object_too():
    tree = bpy.data.node_groups.new("t", classes.TREE)
    node = tree.nodes.new(classes.node_class("unit"))
    node.preset = "mu-0.75x"
    state.refresh(tree)
    (root,) = state.show_units(bpy.context, tree)
    assert (root.mu_unit.scale, node.follower, node.source) == (0.75, root, None)
    node.preset = "mu-1.0x"
    state.refresh(tree)
    assert root.mu_unit.scale == 1.0
    assert "parameters" not in conversion.to_tree(tree).nodes["Unit"].settings, "still the preset"
    # Changed in the sidebar it is no preset any more: the tree takes what the sidebar has.
    root.mu_unit.chambers.wall_mm = 1.2
    assert (node.source, node.follower) == (root, None)
    state.refresh(tree)
    assert state._designs[tree.session_uid]["Unit"].unit.chambers.wall_mm == 1.2
    assert state.show_units(bpy.context, tree) == [], "once"


def test_links_of_every_type_are_valid_where_the_core_takes_them_and_red_with_a_reason_elsewhere():
    kinds = definitions()
    for into in kinds.values():
        for taken in into.inputs:
            for before in kinds.values():
                for output in before.outputs:
                    tree = bpy.data.node_groups.new("t", classes.TREE)
                    a = tree.nodes.new(classes.node_class(before.kind))
                    b = tree.nodes.new(classes.node_class(into.kind))
                    a.name, b.name = "a", "b"
                    made = link(tree, "a", output.name, "b", taken.name)
                    found = state.refresh(tree)
                    refusal = taken.refusal(output)
                    assert made.is_valid == (refusal == ""), (before.kind, output.name, into.kind)
                    if refusal:
                        assert found["b"].state == "failed"
                        assert found["b"].error.what == refusal
                    bpy.data.node_groups.remove(tree)


def test_a_wrong_link_mended_is_valid_again_and_a_circle_is_named():
    tree = new("unit")
    wrong = link(tree, "Cells", "cells", "Grading", "trim")
    assert states(tree)["Grading"] == "failed"
    assert not wrong.is_valid
    good = link(tree, "Trim", "trim", "Grading", "trim")
    assert states(tree)["Assemble Unit"] in ("cached", "computed")
    assert good.is_valid
    walls = new("three-walls")
    link(walls, "Wall 0.8 mm", "unit", "Wall 0.9 mm", "unit")
    link(walls, "Wall 0.9 mm", "unit", "Wall 0.8 mm", "unit")
    found = state.refresh(walls)
    assert "circle" in found["Wall 0.8 mm"].error.what
    assert found["Wall 1.0 mm"].error is None


def test_a_slider_makes_only_what_depends_on_it_and_its_error_stands_on_its_node():
    tree = new("unit")
    state.refresh(tree)
    tree.nodes["Chambers"].wall_mm = 0.83
    assert {n for n, s in states(tree).items() if s == "computed"} == {
        "Chambers", "Membranes", "Wells", "Assemble Unit",
    }  # fmt: skip
    tree.nodes["Chambers"].wall_mm = 3.0
    found = state.refresh(tree)
    assert "too thick" in found["Chambers"].error.what
    assert found["Assemble Unit"].because == "Chambers"
    assert classes.state_of(tree.nodes["Chambers"]).error is found["Chambers"].error


def test_values_come_by_sockets_and_by_drivers():
    tree = new("unit")
    number = tree.nodes.new(classes.node_class("number"))
    number.value = 1.05
    link(tree, number.name, "number", "Chambers", "wall_mm")
    assert "wall 1.05 mm" in state.refresh(tree)["Assemble Unit"].remark
    (into,) = (x for x in tree.links if x.to_socket.identifier == "wall_mm")
    tree.links.remove(into)
    driver = tree.driver_add('nodes["Chambers"].wall_mm').driver
    driver.expression = "0.8 + 0.01 * frame"
    state.refresh(tree)
    scene = bpy.context.scene
    for frame, wall in ((10, 0.9), (20, 1.0)):
        scene.frame_set(frame)
        assert f"wall {wall:g} mm" in state.refresh(tree)["Assemble Unit"].remark


def test_muting_a_node_or_a_link_is_the_cores_muting():
    tree = new("three-walls")
    tree.nodes["Wall 0.8 mm"].mute = True
    found = state.refresh(tree)
    assert found["Wall 0.8 mm"].remark == found["Unit"].remark, "the unit passes unchanged"
    tree.nodes["Motion, wall 0.8"].mute = True
    assert states(tree)["Motion, wall 0.8"] == "muted"
    tree.nodes["Unit"].mute = True
    assert "cannot be muted" in state.refresh(tree)["Unit"].error.what
    tree.nodes["Unit"].mute = False
    (into,) = (x for x in tree.links if x.to_node.name == "Wall 1.0 mm")
    into.is_muted = True
    assert "not linked" in state.refresh(tree)["Wall 1.0 mm"].error.what


def test_frames_and_reroutes_change_nothing():
    tree = new("unit")
    before = conversion.to_tree(tree)
    assert before.nodes["Cells"].frame == "Lattice"
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(tree.nodes["Grading"].outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], tree.nodes["Struts"].inputs[0])
    tree.nodes.new("NodeFrame")
    assert conversion.to_tree(tree) == before


def test_a_group_is_its_nodes_used_twice_it_is_two_and_taken_apart_it_is_as_before():
    tree = new("unit")
    before = conversion.to_tree(tree)
    state.refresh(tree)
    node = groups.make_group(tree, [tree.nodes[name] for name in ("Cells", "Trim", "Grading", "Struts")])
    assert [s.name for s in node.inputs] == ["Profile"]
    assert sorted(s.name for s in node.outputs) == ["Cells", "Struts"]
    found = state.refresh(tree)
    assert {"Group/Cells", "Group/Trim", "Group/Grading", "Group/Struts"} <= set(found)
    assert {s.state for s in found.values()} <= {"cached", "computed"}
    # An error inside shows on the group, too.
    inner = node.node_tree.nodes["Struts"]
    inner.midspan_diameter_mm = 0.6
    inner.junction_diameter_mm = 5.0
    failed = {name for name, s in state.refresh(tree).items() if s.error is not None}
    assert "Group/Struts" in failed
    assert classes.state_of(node).error is not None
    inner.junction_diameter_mm, inner.midspan_diameter_mm = 0.8, 1.0
    other = tree.nodes.new(classes.GROUP)
    other.node_tree = node.node_tree
    state.refresh(tree)
    assert f"{other.name}/Cells" in conversion.to_tree(tree).nodes
    tree.nodes.remove(other)
    own = {n: node.node_tree.nodes[n] for n in ("Cells", "Trim", "Grading", "Struts")}
    defaults = {s.name: s.description.default for s in definitions()["struts"].settings}
    for name in ("junction_diameter_mm", "midspan_diameter_mm"):
        setattr(own["Struts"], name, defaults[name])
    groups.take_apart(tree, node)
    after = conversion.to_tree(tree)
    assert set(after.nodes) == set(before.nodes)
    assert {n: x.links for n, x in after.nodes.items()} == {n: x.links for n, x in before.nodes.items()}
    assert {n: x.settings for n, x in after.nodes.items()} == {n: x.settings for n, x in before.nodes.items()}


def test_groups_and_evaluation_are_operators_of_the_editor():
    tree = new("unit")
    with editor(tree):
        for node in tree.nodes:
            node.select = node.name in ("Cells", "Trim", "Grading", "Struts")
        assert bpy.ops.mu.node_group_make() == {"FINISHED"}
        (group,) = (node for node in tree.nodes if node.bl_idname == classes.GROUP)
        assert bpy.ops.mu.node_group_edit(node=group.name) == {"FINISHED"}
        assert bpy.context.space_data.edit_tree == group.node_tree
        assert operators.root_tree(bpy.context) == tree, "the whole tree is evaluated from within a group"
        assert bpy.ops.mu.node_group_edit() == {"FINISHED"}
        assert bpy.context.space_data.edit_tree == tree
        assert "No evaluation is running" in refused(bpy.ops.mu.tree_cancel)
        for node in tree.nodes:
            node.select = node == group
        assert bpy.ops.mu.node_group_ungroup() == {"FINISHED"}
        assert not any(node.bl_idname == classes.GROUP for node in tree.nodes)
        tree.links.remove(next(x for x in tree.links if x.to_node.name == "Struts"))
        assert "not linked" in refused(bpy.ops.mu.tree_evaluate)
        assert not state.RUN.is_running(tree)
    assert "node editor" in refused(bpy.ops.mu.tree_evaluate)


def test_a_group_in_itself_is_told():
    tree = new("three-walls")
    node = groups.make_group(tree, [tree.nodes["Wall 0.8 mm"]])
    again = node.node_tree.nodes.new(classes.GROUP)
    again.node_tree = node.node_tree
    if again.node_tree is None:
        return
    found = state.refresh(tree)
    assert any(s.error is not None and "nested more than" in s.error.what for s in found.values())


def test_saved_and_opened_again_a_tree_is_the_same_driven_and_all_even_without_the_extension(tmp_path):
    tree = new("unit")
    tree.nodes["Chambers"].wall_mm = 0.95
    tree.driver_add('nodes["Path"].section_mm').driver.expression = "1.5 + frame * 0.0"
    groups.make_group(tree, [tree.nodes[name] for name in ("Cells", "Trim")])
    state.refresh(tree)
    name, before = tree.name, conversion.to_tree(tree)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "tree.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "tree.blend"))
    tree = bpy.data.node_groups[name]
    assert conversion.to_tree(tree) == before
    assert len(tree.animation_data.drivers) == 1
    assert {s.state for s in state.refresh(tree).values()} <= {"cached", "computed"}
    assert state.folder_of(tree).parent.name == "tree.mu"
    if bpy.app.version < (5, 0):
        return  # Without the extension, Blender 4.5 ends where it reads a group whose sockets it lacks.
    mu_addon.unregister()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "tree.blend"))
    bpy.ops.wm.save_mainfile()
    mu_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "tree.blend"))
    assert conversion.to_tree(bpy.data.node_groups[name]) == before


def test_undo_and_redo_bring_values_and_links_back():
    tree = new("unit")
    name = tree.name
    bpy.ops.ed.undo_push(message="template")
    tree.nodes["Chambers"].wall_mm = 1.1
    tree.links.remove(tree.nodes["Struts"].inputs[0].links[0])
    bpy.ops.ed.undo_push(message="wall")
    bpy.ops.ed.undo()
    tree = bpy.data.node_groups[name]
    assert abs(tree.nodes["Chambers"].wall_mm - 0.9) < 1e-6
    assert "failed" not in states(tree).values()
    bpy.ops.ed.redo()
    tree = bpy.data.node_groups[name]
    assert abs(tree.nodes["Chambers"].wall_mm - 1.1) < 1e-6
    assert states(tree)["Struts"] == "failed"


def test_the_sidebar_and_the_trees_node_edit_the_same_fields():
    root = add(preset="mu-0.75x")
    assert bpy.ops.mu.tree_of_unit() == {"FINISHED"}
    (tree,) = state.trees()
    (node,) = tree.nodes
    assert node.source == root
    root.mu_unit.chambers.wall_mm = 1.0
    assert "wall 0.75 mm" in state.refresh(tree)[node.name].remark
    node.source.mu_unit.chambers.wall_mm = 0.8
    assert "wall 0.6 mm" in state.refresh(tree)[node.name].remark
    # As a file the unit's parameters are written out.
    design = conversion.to_tree(tree).nodes[node.name]
    assert "wall_mm = 0.8" in design.settings["parameters"]
    root.mu_unit.chambers.wall_mm = 9.0
    assert state.refresh(tree)[node.name].error is not None


def test_the_sidebar_of_a_unit_that_follows_edits_the_trees_fields():
    root = add(preset="mu-1.0x")
    assert following.followed(root) is None
    assert "follows no tree" in refused(bpy.ops.mu.tree_show)
    assert bpy.ops.mu.tree_of_unit(steps=True) == {"FINISHED"}
    (tree,) = state.trees()
    state.refresh(tree)
    assert f"Edits the tree {tree.name}" in drawn([unit_panel.MU_PT_unit])
    root.mu_unit.chambers.wall_mm = 1.15
    assert abs(tree.nodes["Chambers"].wall_mm - 1.15) < 1e-6
    # The next change of a node overwrites nothing, and the other way round.
    tree.nodes["Struts"].junction_diameter_mm = 1.5
    state.refresh(tree)
    assert abs(root.mu_unit.chambers.wall_mm - 1.15) < 1e-6
    assert abs(root.mu_unit.lattice.junction_diameter_mm - 1.5) < 1e-6
    # Material, path and scale, and what operators set.
    root.mu_unit.material.membrane_modulus_kPa = 900.0
    root.mu_unit.scale = 1.5
    bpy.ops.mu.path(name="alpha5")
    assert (tree.nodes["Path"].path, tree.nodes["Profile"].scale) == ("alpha5", 1.5)
    assert tree.nodes["Assemble Unit"].material_membrane_modulus_kPa == 900.0
    state.refresh(tree)
    assert root.mu_unit.path == "alpha5", "the waveguide is linked with its path"
    bpy.ops.mu.path(name="none")
    state.refresh(tree)
    assert root.mu_unit.path == ""
    # A wall that breaks a rule is the tree's, too, and so is its repair.
    root.mu_unit.chambers.wall_mm = 4.4
    assert "failed" in states(tree).values()
    assert bpy.ops.mu.fit_all() == {"FINISHED"}
    assert "failed" not in states(tree).values()
    assert root.mu_unit.trouble == ""
    bpy.data.objects.remove(root)
    tree.nodes["Chambers"].wall_mm = 1.0
    assert "failed" not in states(tree).values(), "it lets go of a deleted one"


def test_what_a_driver_or_a_link_gives_is_the_trees_and_the_sidebar_says_so():
    root = add(preset="mu-1.0x")
    assert bpy.ops.mu.tree_of_unit(steps=True) == {"FINISHED"}
    (tree,) = state.trees()
    tree.nodes["Chambers"].driver_add("wall_mm").driver.expression = "0.9"
    state.refresh(tree)
    root.mu_unit.chambers.wall_mm = 1.2
    root.mu_unit.chambers.neck_diameter_mm = 13.0
    assert following.kept_by_tree(root) == ["Wall"]
    state.refresh(tree)
    state.refresh(tree)
    assert abs(root.mu_unit.chambers.wall_mm - 0.9) < 1e-6
    assert tree.nodes["Profile"].neck_diameter_mm == root.mu_unit.chambers.neck_diameter_mm == 13.0
    assert "By a link or driver of the tree: Wall" in drawn([unit_panel.MU_PT_unit]).replace("  ", " ")


def test_cell_and_bladder_are_coupled_in_the_node_as_in_the_sidebar():
    tree = new("unit")
    profile = tree.nodes["Profile"]
    profile.cell_mm = 13.0
    assert profile.bladder_diameter_mm == 26.0
    assert "failed" not in states(tree).values()
    profile.bladder_diameter_mm = 24.0
    assert profile.cell_mm == 12.0


def test_a_tree_is_written_for_the_command_line_and_opened_from_its_file(tmp_path):
    tree = new("three-walls")
    tree.nodes["Wall 0.8 mm"].value = 0.85
    core = conversion.to_tree(tree)
    path = tmp_path / "mine.toml"
    assert "node editor" in refused(bpy.ops.mu.tree_save, filepath=str(path))
    with editor(tree):
        assert bpy.ops.mu.tree_save(filepath=str(path)) == {"FINISHED"}
    assert read_tree(path) == core
    bpy.ops.mu.tree_load(filepath=str(path))
    again = next(t for t in state.trees() if t.name != tree.name)
    assert conversion.to_tree(again).nodes == core.nodes
    path.write_text("format = 1\n[nodes.a]\nkind = 'nothing'\n")
    assert "there is no kind of node" in refused(bpy.ops.mu.tree_load, filepath=str(path))
    path.write_text("not toml")
    assert "not TOML" in refused(bpy.ops.mu.tree_load, filepath=str(path))


def editor(tree):
    """A node editor that shows a tree, for operators that are called from one."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.ui_type = classes.TREE
    area.spaces.active.node_tree = tree
    (region,) = (r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


@pytest.mark.nightly("tests/headless/test_graph.py::test_a_thicker_wall_bends_less_and_the_table_says_so")
def test_a_tree_runs_in_a_process_of_its_own_and_its_states_stay_with_the_file(tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "runs.blend"))
    tree = new("three-walls")
    for name in ("Wall 0.9 mm", "Motion, wall 0.9"):
        tree.nodes.remove(tree.nodes[name])
    (tmp_path / "pressed.csv").write_text("time_s,pressure_kPa\n0,0\n1,2\n")
    # The fewest chambers, pressed once: seconds.
    tree.nodes["Unit"].parameters = "format = 1\nscale = 0.75\n[chambers]\ncount = 3\n"
    for node in tree.nodes:
        if node.definition.kind == "simulate":
            node.refine, node.times, node.protocol = 0.2, 2, str(tmp_path / "pressed.csv")
    assert states(tree)["Compare"] == "waiting"
    child = ended(state.start(tree))
    assert child.state == DONE, child.error
    found = state.refresh(tree)
    assert {s.state for s in found.values()} == {"cached"}
    assert "° at 2 kPa" in found["Motion, wall 0.8"].remark
    folder = state.folder_of(tree)
    assert json.loads((folder / "nodes.json").read_text())["nodes"]["Compare"]["state"] == "computed"
    assert state.place_of(tree, tree.nodes["Compare"], "table").is_file()
    # A slider and back: what was computed is found again.
    tree.nodes["Wall 0.8 mm"].value = 0.85
    waiting = {n for n, s in states(tree).items() if s == "waiting"}
    assert waiting == {"Motion, wall 0.8", "Compare"}
    tree.nodes["Wall 0.8 mm"].value = 0.8
    assert set(states(tree).values()) == {"cached"}


def test_the_run_of_a_tree_is_planned_over_all_of_its_nodes(tmp_path):
    """What ran before is expected to take as long again; what is there is not done again."""
    tree = new("three-walls")
    found = state.refresh(tree)
    core = conversion.to_tree(tree)
    motions = [name for name in core.nodes if name.startswith("Motion")]
    assert len(motions) == 3
    assert plan.plan_of(core, found, (), tmp_path) == [(name, plan.SECONDS["simulate"]) for name in motions]
    assert plan.plan_of(core, found, (motions[1],), tmp_path) == [(motions[1], plan.SECONDS["simulate"])]
    (tmp_path / STATES).write_text(json.dumps({"nodes": {motions[0]: {"cost_s": 7.5}, "x": {}}}))
    found[motions[2]] = attrs.evolve(found[motions[2]], state="cached")
    assert plan.plan_of(core, found, (), tmp_path) == [
        (motions[0], 7.5),
        (motions[1], plan.SECONDS["simulate"]),
    ]
    (tmp_path / STATES).write_text("[")
    assert len(plan.plan_of(core, found, (), tmp_path)) == 2
