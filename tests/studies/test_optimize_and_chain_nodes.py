"""The nodes Optimize and Chain ask for the runs that their files describe, and read what these found."""

import pytest

from mu_addon.design.parameters import load_preset, write_unit
from mu_addon.errors import InputError
from mu_addon.graph.evaluation import Finished
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.parts import Design
from mu_addon.optimization import read_design
from mu_addon.studies.chain import Chain
from mu_addon.studies.optimize import Optimize

from .node_calls import call, order_of

DESIGN = """
format = 1
preset = "mu-1.0x"
evaluations = 5
[[target]]
kind = "mass"
objective = "minimise"
[[freedom]]
parameter = "chambers.wall_mm"
low = 0.6
high = 1.4
"""
UNIT = load_preset("mu-0.75x")


def read(call, done):
    return definitions()[call.node].read(call, done)


@pytest.fixture
def node(tmp_path):
    (tmp_path / "design.toml").write_text(DESIGN)
    inputs = {"unit": Design(UNIT, path="alpha2"), "model": None}
    return lambda **settings: call("optimize", inputs, **{"file": str(tmp_path / "design.toml"), **settings})


def test_the_linked_unit_is_optimised_by_the_files_targets(node, tmp_path):
    order = order_of(node())
    assert order.study.texts() == Optimize(design=read_design(tmp_path / "design.toml", UNIT)).texts()
    assert order.study.design.unit == UNIT
    assert order_of(node(proposed=2)).key == order.key, "another of the front is no other run"
    (tmp_path / "design.toml").write_text(DESIGN.replace("evaluations = 5", "evaluations = 6"))
    assert order_of(node()).key != order.key
    with pytest.raises(InputError, match="no targets are named"):
        order_of(node(file=""))


def test_a_proposed_unit_keeps_its_path_and_a_missing_one_is_named(node, tmp_path):
    thin = load_preset("mu-1.0x")
    write_unit(thin, tmp_path / "proposed-1.toml")
    row = {"file": "proposed-1.toml", "targets": [{"name": "mass", "met": False}]}
    done = Finished(tmp_path, {"proposed": [row], "outcome": "found"})
    found = read(node(), done)
    assert (found["unit"].unit.chambers, found["unit"].unit.name) == (thin.chambers, UNIT.name)
    assert found["unit"].path == "alpha2"
    definition = definitions()["optimize"]
    assert definition.remark(found) == "misses mass"
    with pytest.raises(InputError, match="there is no number 2"):
        read(node(proposed=2), done)
    muted = definition.mute(node())
    assert muted["unit"].unit == UNIT
    assert definition.remark(muted) == ""


def chain(*units, **settings):
    return call(
        "chain", {"units": tuple((f"u{n}", Design(unit)) for n, unit in enumerate(units))}, **settings
    )


def test_a_chain_of_linked_units_is_that_of_its_file(tmp_path):
    (tmp_path / "chain.toml").write_text("""
format = 1
protocol = "p.csv"
tip_mass_g = 20.0
[mesh]
refine = 0.25
[[unit]]
preset = "mu-0.75x"
[[unit]]
preset = "mu-1.0x"
turn_deg = 90.0
""")
    (tmp_path / "p.csv").write_text("time_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n1,10,20\n")
    asked = {"turns_deg": "0 90", "tip_mass_g": 20.0, "refine": 0.25, "protocol": str(tmp_path / "p.csv")}
    made = order_of(chain(UNIT, load_preset("mu-1.0x"), **asked)).study
    assert made.texts() == Chain.read(tmp_path).texts()


def test_a_point_to_reach_and_what_is_wrong_with_aorder_of(tmp_path):
    job = order_of(chain(UNIT, copies=3, reach="0 -25 200", high_kPa=20.0)).study
    assert [one.pressure_kPa for one in job.units] == [(0.0, 20.0)] * 3
    assert job.reach == (0.0, -25.0, 200.0)
    for settings, words in (
        ({}, "neither a protocol nor a target"),
        ({"copies": 8, "turns_deg": "0 1"}, "2 turns for 8 units"),
        ({"reach": "0 a 1"}, "are not numbers"),
        ({"reach": "0 1"}, "is no vector"),
        ({"protocol": str(tmp_path / "none.csv")}, "cannot read the protocol"),
    ):
        with pytest.raises(InputError, match=words):
            order_of(chain(UNIT, **settings))
    with pytest.raises(InputError, match="a chain of 16 units"):
        order_of(chain(UNIT, UNIT, copies=8))


def test_what_a_finished_chain_gives(tmp_path):
    summary = {"chain": {"angle_deg": 12.5, "tip_mm": [0.0, -3.0, 150.0]}}
    found = read(chain(UNIT), Finished(tmp_path, summary))
    assert (found["tip"].name, found["angle"]) == ("tip.csv", 12.5)
    assert definitions()["chain"].remark(found) == "tip at 0.0, -3.0, 150.0 mm"
    reached = read(chain(UNIT), Finished(tmp_path, {**summary, "target": {}}))
    assert reached["tip"].name == "target.csv"
