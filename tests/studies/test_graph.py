"""Nodes of the use cases: those of steps give the core's own geometry, errors stand at their cause."""

import json

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset, preset_names
from mu_addon.design.settings import QUALITY
from mu_addon.design.solid import QUALITY as FACETS
from mu_addon.design.steps import STEPS, Stack, Step, StepInputs
from mu_addon.errors import InputError
from mu_addon.graph import Evaluation, Kept, Node, NodeTree, Source, faults, read_tree, tree_text
from mu_addon.nodes import design_nodes
from mu_addon.nodes.comparison import compare
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.templates import steps_of, template, template_names
from mu_addon.nodes.tree_study import Graph

from .unit_runs import ended


def evaluated(tree, kept=None):
    found = Evaluation(tree, definitions(), kept=kept if kept is not None else Kept())
    found.run()
    return found


def changed(tree, name, **values):
    node = attrs.evolve(tree.nodes[name], settings={**tree.nodes[name].settings, **values})
    return NodeTree(tree.name, {**tree.nodes, name: node})


def muted(tree, name):
    return NodeTree(tree.name, {**tree.nodes, name: attrs.evolve(tree.nodes[name], muted=True)})


@pytest.mark.parametrize("name", template_names())
def test_templates_are_sound_and_go_through_their_file(name, tmp_path):
    tree = template(name)
    assert faults(tree, definitions()) == ()
    (tmp_path / "tree.toml").write_text(tree_text(tree), encoding="utf-8")
    assert read_tree(tmp_path / "tree.toml") == tree


def test_every_step_of_the_core_is_a_node_a_new_one_by_itself(monkeypatch):
    assert set(STEPS) <= set(definitions())
    new = Step(
        "skin", "a skin on the membranes", "surface", lambda *_: None, ("membranes",), ("chambers.wall_mm",)
    )
    monkeypatch.setitem(STEPS, "skin", new)
    made = {d.kind: d for d in design_nodes.design_nodes()}["skin"]
    assert [i.name for i in made.inputs] == ["membranes"]
    assert [s.name for s in made.settings] == ["wall_mm"]
    assert (made.outputs[0].name, made.outputs[0].type) == ("skin", "surface")


def test_lists_that_stand_in_for_those_of_the_use_cases():
    assert QUALITY.choices == tuple(FACETS)


@pytest.mark.parametrize("path", ["", "alpha4"])
@pytest.mark.parametrize("name", preset_names())
def test_the_steps_of_a_unit_give_that_unit(name, path):
    unit = load_preset(name)
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, wall_mm=1.05))
    found = evaluated(steps_of(unit, path))
    design = found.outputs["Assemble Unit"]["unit"]
    assert (design.unit, design.path) == (unit, path)
    # The geometry at each node is what the core's steps make of the whole unit.
    whole = StepInputs(unit, path)
    for node, outputs in found.outputs.items():
        kind = found.tree.nodes[node].kind
        if kind in STEPS and (path or kind not in ("path", "wells")):
            assert_alike(outputs["value"], Stack().value(kind, whole))


def assert_alike(a, b):
    if isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            assert_alike(one, other)
    elif attrs.has(type(a)):
        for field in attrs.fields(type(a)):
            assert_alike(getattr(a, field.name), getattr(b, field.name))
    else:
        assert a == b


def test_a_slider_makes_only_what_depends_on_it():
    tree, kept = template("unit"), Kept()
    evaluated(tree, kept)
    before, steps = kept.counts.copy(), design_nodes.STACK.counts.copy()
    evaluated(changed(tree, "Chambers", wall_mm=0.87), kept)
    assert set(kept.counts - before) == {"Chambers", "Membranes", "Wells", "Assemble Unit"}
    assert not {"profile", "cells", "trim", "struts", "anchors", "path"} & set(
        design_nodes.STACK.counts - steps
    )


def test_a_broken_rule_is_an_error_of_the_node_whose_parameter_breaks_it():
    found = evaluated(changed(template("unit"), "Chambers", wall_mm=3.0))
    assert found.states["Chambers"].state == "failed"
    assert "too thick" in found.states["Chambers"].error.what
    assert "the largest wall that fits" in found.states["Chambers"].error.remedy
    assert found.states["Assemble Unit"].because == "Chambers"
    assert found.states["Struts"].state == "computed"


def test_an_unknown_path_is_told_with_the_valid_ones():
    found = evaluated(changed(template("unit"), "Path", path="alpha99"))
    failed = [s.error for s in found.states.values() if s.error is not None]
    assert failed
    assert "alpha10" in failed[0].remedy + failed[0].what


def test_parts_of_two_designs_are_refused_with_both_nodes():
    tree = template("unit")
    other = attrs.evolve(tree.nodes["Profile"], settings={"neck_diameter_mm": 13.0})
    nodes = {**tree.nodes, "Other": other}
    links = {**nodes["Membranes"].links, "profile": (Source("Other", "profile"),)}
    nodes["Membranes"] = attrs.evolve(nodes["Membranes"], links=links)
    error = evaluated(NodeTree("two", nodes)).states["Membranes"].error
    assert "'Other'" in error.what
    assert "'Profile'" in error.what
    assert "neck_diameter_mm" in error.what


def test_muted_steps_pass_on_what_they_would_change_and_no_solid_is_made():
    found = evaluated(muted(template("unit"), "Trim"))
    design = found.outputs["Assemble Unit"]["unit"]
    assert design.muted == {"trim"}
    nodes = {
        **found.tree.nodes,
        "Solid": Node("solid", links=dict(found.tree.nodes["Assemble Unit"].links)),
    }
    with pytest.raises(InputError, match="solid without trim"):
        definitions()["solid"].order(
            design_nodes.Call(
                "Solid",
                {"quality": "interactive"},
                {k: found.outputs[v[0].node][v[0].output] for k, v in nodes["Solid"].links.items()},
            )
        )


def test_a_parameter_is_set_by_a_node_or_by_a_number_and_checked_by_its_bounds():
    unit = Node("unit", {"preset": "mu-0.75x"})
    by = Node("set_parameter", {"value": 1.0}, {"unit": (Source("U", "unit"),)})
    found = evaluated(NodeTree("t", {"U": unit, "W": by}))
    assert found.outputs["W"]["unit"].unit.chambers.wall_mm == 1.0
    number = Node("number", {"value": 0.95})
    linked = attrs.evolve(by, links={**by.links, "value": (Source("N", "number"),)})
    found = evaluated(NodeTree("t", {"U": unit, "N": number, "W": linked}))
    assert found.outputs["W"]["unit"].unit.chambers.wall_mm == 0.95
    found = evaluated(NodeTree("t", {"U": unit, "W": attrs.evolve(by, settings={"value": 500.0})}))
    assert "out of bounds" in found.states["W"].error.what
    assert found.states["W"].state == "failed"


def test_units_are_compared_by_what_differs_and_kinds_are_not_mixed():
    tree = template("three-walls")
    found = evaluated(tree)
    designs = [(n, found.outputs[n]["unit"]) for n in tree.nodes if tree.nodes[n].kind == "set_parameter"]
    rows = dict(compare(designs).rows())
    assert rows["chambers.wall_mm"] == (0.8, 0.9, 1.0)
    assert "chambers.cell_mm" not in rows
    np.testing.assert_allclose(rows["wall_mm"], [0.6, 0.675, 0.75])
    with pytest.raises(InputError, match="only one is given"):
        compare(designs[:1])


def test_a_tree_in_its_folder_runs_again_with_its_wishes_and_a_fault_stops_it_before_anything(tmp_path):
    tree = NodeTree(
        "t", {"U": Node("unit"), "W": Node("set_parameter", links={"unit": (Source("U", "unit"),)})}
    )
    job = Graph(tree=tree, wanted=("U",))
    (tmp_path / "graph.toml").write_text(job.texts()["graph.toml"], encoding="utf-8")
    assert Graph.read(tmp_path).texts() == job.texts()
    with pytest.raises(InputError, match="there is no node 'X'"):
        Graph(tree=tree, wanted=("X",))
    bad = Graph(tree=changed(tree, "W", parameter="chambers.nothing"))
    assert ended(bad, tmp_path / "out")[0].status == 2
    assert not (tmp_path / "out" / "nodes").exists()


def test_paths_in_a_file_are_beside_it(tmp_path):
    (tmp_path / "mine.toml").write_text("format = 1\nscale = 1.5\n", encoding="utf-8")
    text = tree_text(NodeTree("t", {"U": Node("unit", {"file": "mine.toml"})}))
    (tmp_path / "tree.toml").write_text(text, encoding="utf-8")
    job = Graph.read_file(tmp_path / "tree.toml")
    assert evaluated(job.tree).outputs["U"]["unit"].unit.scale == 1.5
    # The content counts, not the name alone.
    kept = Kept()
    evaluated(job.tree, kept)
    (tmp_path / "mine.toml").write_text("format = 1\nscale = 1.25\n", encoding="utf-8")
    assert evaluated(job.tree, kept).outputs["U"]["unit"].unit.scale == 1.25


def test_a_run_leaves_states_a_table_and_a_report_and_one_failure_does_not_keep_the_rest(tmp_path):
    walls = {
        f"W{w}": Node("set_parameter", {"value": w}, {"unit": (Source("U", "unit"),)}) for w in (0.8, 1.0)
    }
    nodes = {
        "U": Node("unit", {"preset": "mu-0.75x"}),
        **walls,
        "thick": Node("set_parameter", {"value": 3.0}, {"unit": (Source("U", "unit"),)}),
        "C": Node("compare", links={"items": (Source("W0.8", "unit"), Source("W1.0", "unit"))}),
    }
    context, messages = ended(Graph(tree=NodeTree("walls", nodes)), tmp_path)
    assert context.status == 2
    assert "node 'thick'" in messages[-1]["where"]
    states = json.loads((tmp_path / "nodes.json").read_text())["nodes"]
    assert {name: s["state"] for name, s in states.items()} == {
        "U": "computed", "W0.8": "computed", "W1.0": "computed", "thick": "failed", "C": "computed",
    }  # fmt: skip
    table = (tmp_path / "compare-C.csv").read_text().splitlines()
    assert table[0] == "quantity,W0.8,W1.0,W1.0 - W0.8"
    assert any(line.startswith("chambers.wall_mm,0.8,1.0,0.19999") for line in table)
    report = (tmp_path / "report.html").read_text()
    assert "too thick" in report
    assert "FAILED" in report


def test_obstacles_are_what_a_simulation_may_touch(tmp_path):
    """Two boxes beside a unit are those of the study; one that stands in the unit is told of."""
    unit = load_preset("mu-0.75x")
    vertices = np.array([(x, y, z) for x in (-9.0, 9.0) for y in (0.0, 12.0) for z in (40.0, 50.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]

    def box(name, y):
        lines = [f"v {a} {b + y} {c}" for a, b, c in vertices]
        lines += ["f " + " ".join(str(k + 1) for k in face) for face in faces]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return Node("obstacle", settings={"file": str(tmp_path / name), "friction": 0.3})

    aside = unit.dimensions.height
    nodes = {
        "Unit": Node("unit", settings={"preset": "mu-0.75x"}),
        "Near": box("near.obj", aside),
        "Far": box("far.obj", -2.0 * aside),
        "Motion": Node(
            "simulate",
            links={
                "unit": (Source("Unit", "unit"),),
                "obstacles": (Source("Near", "obstacle"), Source("Far", "obstacle")),
            },
        ),
    }
    tree = NodeTree("touch", nodes)
    assert faults(tree, definitions()) == ()

    class Orders:
        def find(self, order):
            found.append(order.study)
            raise InputError("this far", "", "")

    found = []
    Evaluation(tree, definitions(), Orders()).run()
    (job,) = found
    assert [(o.name, o.friction) for o in job.obstacles] == [("near.obj", 0.3), ("far.obj", 0.3)]
    inside = attrs.evolve(tree, nodes={**nodes, "Far": box("inside.obj", 0.0)})
    failed = Evaluation(inside, definitions(), Orders()).run()["Motion"]
    assert "inside" in str(failed.error)
    assert len(found) == 1
    empty = attrs.evolve(tree, nodes={**nodes, "Far": Node("obstacle")})
    assert "no body is named" in Evaluation(empty, definitions()).run()["Far"].error.what
