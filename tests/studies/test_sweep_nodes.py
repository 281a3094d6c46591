"""Nodes of parameter studies: they ask for the study that a sweep.toml of the same words describes."""

import csv
import json
import sys
from pathlib import Path

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.graph.evaluation import Finished
from mu_addon.nodes import sweep_nodes
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.parts import Design
from mu_addon.studies.parameter_study import variable
from mu_addon.studies.parameter_study.plan import parse_plan
from mu_addon.studies.parameter_study.point import run_point
from mu_addon.studies.sweep import Sweep

from .node_calls import call, order_of


def range_of(**settings):
    return definitions()["range"].make(call("range", **settings))["range"]


def study(*ranges, unit="mu-0.75x", **settings):
    inputs = {"unit": Design(load_preset(unit)), "ranges": tuple((f"r{k}", r) for k, r in enumerate(ranges))}
    return call("sweep", inputs, **settings)


def test_names_and_choices_are_those_of_the_parameter_study():
    parameters = next(s for s in definitions()["range"].settings if s.name == "parameter")
    assert set(parameters.description.choices) <= set(variable.variable_names())


def test_a_tree_asks_for_what_a_sweep_file_says():
    text = """
format = 1
preset = "mu-0.75x"
method = "grid"
[simulate]
times = 5
mesh = { refine = 0.5 }
[vary]
"chambers.wall_mm" = { low = 0.8, high = 1.0, steps = 3 }
"chambers.count" = { values = [4, 6] }
"""
    walls = range_of(low=0.8, high=1.0, steps=3)
    counts = range_of(parameter="chambers.count", values="4 6")
    made = order_of(study(walls, counts, times=5)).study.plan

    wanted = parse_plan(text, Path("/"))
    texts = Sweep(plan=made).texts()
    assert texts == Sweep(plan=wanted).texts() | {"sweep.toml": texts["sweep.toml"]}
    assert made.variables == wanted.variables
    assert (made.inputs.unit, made.inputs.tables) == (wanted.inputs.unit, wanted.inputs.tables)
    assert made.values == [
        {"chambers.wall_mm": w, "chambers.count": n} for w in (0.8, 0.9, 1.0) for n in (4, 6)
    ]


def test_how_many_studies_at_a_time_decides_no_key_and_a_step_more_does():
    walls = range_of()
    keys = [order_of(study(r, workers=n)).key for r, n in ((walls, 1), (walls, 7), (range_of(steps=4), 1))]
    assert keys[0] == keys[1] != keys[2]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"low": 1.0, "high": 0.8}, "are not a range"),
        ({"low": -1.0, "log": True}, "log = True with low"),
        ({"values": "0.8 thick"}, "not values"),
        ({"parameter": "chambers.count", "low": 2.5, "high": 4.0}, "not a whole number"),
    ],
)
def test_ranges_that_are_none_are_refused(settings, words):
    with pytest.raises(InputError, match=words):
        range_of(**settings)


def test_one_parameter_in_two_ranges_is_refused():
    with pytest.raises(InputError, match=r"chambers\.wall_mm is varied by two"):
        order_of(study(range_of(), range_of(values="0.9")))


def table(tmp_path, rows, *ranges):
    with (tmp_path / "points.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, ["point", "status", "mass_g", "angle_range_deg", "seconds", "what"])
        writer.writeheader()
        writer.writerows(rows)
    order = order_of(study(*ranges))
    return definitions()["sweep"].read(study(*ranges), Finished(tmp_path, {}, order.study))["table"]


def test_the_best_study_gives_its_unit_whatever_failed_beside_it(tmp_path):
    rows = [
        {"point": 1, "status": "done", "mass_g": 7.0, "angle_range_deg": 12.0, "seconds": 3},
        {"point": 2, "status": "failed", "what": "too thick"},
        {"point": 3, "status": "done", "mass_g": 9.0, "angle_range_deg": 12.0, "seconds": 3},
    ]
    found = table(tmp_path, rows, range_of(values="0.8 0.9 1.0"))
    assert found.remark() == "3 studies, 1 failed"
    assert found.columns == ("mass_g", "angle_range_deg")

    def best(**settings):
        return sweep_nodes.best.make(call("best", {"table": found}, **settings))

    assert best(figure="mass_g")["unit"].unit.chambers.wall_mm == 1.0
    least = best(figure="mass_g", goal="smallest")
    assert (least["unit"].unit.chambers.wall_mm, least["number"]) == (0.8, 7.0)
    assert best()["point"] == 1, "of equal ones the first"
    with pytest.raises(InputError, match="no study has a number") as caught:
        best(figure="mass")
    assert "mass_g" in caught.value.remedy


def test_a_table_in_which_nothing_succeeded_says_why(tmp_path):
    with pytest.raises(InputError, match="every study failed: too thick"):
        table(tmp_path, [{"point": 1, "status": "failed", "what": "too thick"}], range_of(values="3.0"))


@pytest.mark.nightly("test_a_tree_asks_for_what_a_sweep_file_says")
def test_a_study_that_starts_at_blenders_entry_gives_the_same_figures(monkeypatch):
    """As in Blender, where the package has another name and there is no psutil."""

    from mu_addon.blender.jobs import child_main

    plan = order_of(study(range_of(), refine=0.4, times=2, stages="design")).study.plan
    task = attrs.evolve(plan.task(1), memory_MB=2000, minutes=5.0)
    here = run_point(task)
    monkeypatch.setenv("MU_ENTRY", child_main.__file__)
    monkeypatch.setitem(sys.modules, "psutil", None)
    there = run_point(task)
    assert (here.status, there.status) == ("done", "done"), (here, there)
    assert json.loads(here.summary)["gates"] == json.loads(there.summary)["gates"]
    if sys.platform == "linux":
        np.testing.assert_allclose(there.memory_MB, here.memory_MB, rtol=0.5)
