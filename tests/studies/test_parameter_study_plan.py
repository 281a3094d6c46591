"""What a sweep varies and where its points lie: every input by name, more points later, none lost."""

import tomllib
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.optimization.search import pareto
from mu_addon.run.folder import keep_inputs, same_inputs
from mu_addon.studies.parameter_study.main_effects import main_effect
from mu_addon.studies.parameter_study.plan import parse_plan, sample
from mu_addon.studies.parameter_study.variable import Variable, variable_names
from mu_addon.studies.sweep import Sweep

GOOD = """
format = 1
preset = "mu-1.0x"
stages = "place"
points = 8
[simulate]
times = 7
mesh = { refine = 0.4 }
[place]
mesh_check = false
[vary]
"chambers.wall_mm" = { low = 0.8, high = 1.2 }
material.membrane_modulus_kPa = { low = 100.0, high = 10000.0, log = true }
"simulate.mesh.refine" = { values = [0.4, 0.5] }
"place.stations" = { low = 11, high = 13 }
"protocol.factor" = { values = [0.5, 1.0] }
"""


def occupied(points, strata):
    return [len(np.unique(np.floor(axis * strata))) for axis in points.T]


@given(st.integers(1, 40), st.integers(1, 4), st.integers(1, 5), st.integers(0, 99))
def test_a_latin_hypercube_that_is_added_to_is_one_again(count, times, dimensions, seed):
    first = sample("latin_hypercube", count, dimensions, seed)
    assert occupied(first, count) == [count] * dimensions
    more = sample("latin_hypercube", times * count, dimensions, seed, first)
    np.testing.assert_array_equal(more[:count], first)
    assert occupied(more, times * count) == [times * count] * dimensions
    assert ((more >= 0) & (more < 1)).all()


@given(st.integers(2, 30), st.integers(1, 30), st.integers(1, 4))
def test_points_that_are_added_fill_what_is_empty(count, added, dimensions):
    first = sample("latin_hypercube", count, dimensions, 3)
    more = sample("latin_hypercube", count + added, dimensions, 3, first)
    shared = [count - n for n in occupied(first, count + added)]
    # What no choice could mend is all that is missing: strata that two of the first points share.
    assert occupied(more, count + added) == [count + added - s for s in shared]


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 5))
def test_a_longer_sobol_sequence_begins_as_the_shorter(count, added, dimensions):
    whole = sample("sobol", count + added, dimensions, 5)
    first = sample("sobol", count, dimensions, 5)
    np.testing.assert_array_equal(sample("sobol", count + added, dimensions, 5, first), whole)
    np.testing.assert_array_equal(whole[:count], first)


def test_every_input_has_its_name():
    known = variable_names()
    for name in (
        "scale",
        "chambers.wall_mm",
        "lattice.midspan_diameter_mm",
        "material.membrane_modulus_kPa",
        "simulate.times",
        "simulate.mesh.refine",
        "simulate.protocol",
        "protocol.factor",
        "place.bend_deg",
        "design.quality",
    ):
        assert name in known
    assert len(known) == len(set(known))


def test_values_reach_the_study(tmp_path):
    plan = parse_plan(GOOD, tmp_path)
    assert plan.places.shape == (8, 5)
    points = [plan.point(number) for number in range(1, plan.size + 1)]
    assert [p.number for p in points] == list(range(1, 9))
    for point in points:
        v, job = point.values, point.job
        assert job.unit.chambers.wall_mm == v["chambers.wall_mm"]
        assert 0.8 <= job.unit.chambers.wall_mm <= 1.2
        assert job.unit.material.membrane_modulus_kPa == v["material.membrane_modulus_kPa"]
        assert job.mesh.refine == v["simulate.mesh.refine"]
        assert (job.times, job.mesh_check, job.workers) == (7, False, 1)
        assert job.stations == v["place.stations"] in (11, 12, 13)
        assert job.protocol.pressure_kPa.max() == 40.0 * v["protocol.factor"]
    assert len({job.texts()["study.toml"] for job in (p.job for p in points)}) > 1


def test_a_range_in_its_logarithm_is_even_there():
    v = Variable("material.membrane_modulus_kPa", 100.0, 10000.0, log=True)
    assert v.at(0.5) == pytest.approx(1000.0)
    assert v.levels == pytest.approx([100.0, 1000.0, 10000.0])


@given(st.floats(0, 1, exclude_max=True), st.integers(-5, 5), st.integers(1, 9))
def test_whole_numbers_stay_whole_and_within(u, low, width):
    v = Variable("place.stations", low, low + width)
    assert isinstance(v.at(u), int)
    assert low <= v.at(u) <= low + width


def test_a_grid_is_all_levels_of_all(tmp_path):
    text = GOOD.replace("points = 8", 'method = "grid"').replace("high = 1.2", "high = 1.2, steps = 5")
    plan = parse_plan(text, tmp_path)
    rows = plan.values
    assert plan.size == len(rows) == 5 * 3 * 2 * 3 * 2
    assert len({tuple(row.values()) for row in rows}) == len(rows)
    assert sorted({row["chambers.wall_mm"] for row in rows}) == [0.8, 0.9, 1.0, 1.1, 1.2]


def test_protocols_may_be_files_beside_the_sweep(tmp_path):
    (tmp_path / "low.csv").write_text("time_s,pressure_kPa\n0,0\n1,5\n")
    text = GOOD.replace(
        '"protocol.factor" = { values = [0.5, 1.0] }', '"simulate.protocol" = { values = ["low.csv"] }'
    )
    plan = parse_plan(text, tmp_path)
    assert plan.point(1).job.protocol.pressure_kPa.tolist() == [0.0, 5.0]
    with pytest.raises(InputError, match="protocol"):
        parse_plan(text.replace("low.csv", "none.csv"), tmp_path)


def test_a_point_that_breaks_a_rule_has_failed_already(tmp_path):
    """A wall of 2.5 mm is thicker than the chamber's curvature allows."""
    plan = parse_plan(GOOD.replace("{ low = 0.8, high = 1.2 }", "{ values = [0.9, 2.5] }"), tmp_path)
    points = [plan.point(number) for number in range(1, plan.size + 1)]
    for point in points:
        assert (point.job is None) == (point.values["chambers.wall_mm"] == 2.5)
    assert any("wall" in point.error.what for point in points if point.error)


def test_the_inputs_are_written_as_toml_that_says_the_same(tmp_path):
    plan = parse_plan(GOOD, tmp_path)
    text = Sweep(plan=plan).texts()["sweep.toml"]
    document = tomllib.loads(text)
    assert document["vary"]["place.stations"] == {"low": 11, "high": 13, "log": False, "steps": 3}
    assert document["place"] == {"mesh_check": False}
    # How many points is no input: more may be added to those that are there.
    keep_inputs(tmp_path, Sweep(plan=attrs.evolve(plan, counts=(8, 99))).texts())
    assert same_inputs(tmp_path, Sweep(plan=plan).texts())
    again = parse_plan(
        text.replace("format = 1", 'format = 1\npreset = "mu-1.0x"\nstages = "place"'), tmp_path
    )
    assert again.variables == plan.variables
    assert again.inputs.unit == load_preset("mu-1.0x")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('preset = "mu-1.0x"', "", "no unit is given"),
        ('preset = "mu-1.0x"', 'preset = "mu-9x"', "mu-9x"),
        ("points = 8", "points = 1", "points = 1"),
        ("points = 8", "points = 1e9", "points"),
        ("points = 8", "pionts = 8", "did you mean 'points'"),
        ("points = 8", 'method = "random"', "is not known"),
        ("points = 8", "memory_MB = 1", "memory_MB"),
        ("points = 8", "minimize = 3", "give a list"),
        ("times = 7", 'times = 7\nobstacles = "post.obj"', "does not take obstacles"),
        ("refine = 0.4", "refine = 99.0", "refine"),
        ("mesh = {", "mesh = 3 #", "not a table"),
        ("low = 0.8, high = 1.2", "low = 1.2, high = 0.8", "are not a range"),
        ("low = 0.8, high = 1.2", "low = 0.8", "high is missing"),
        ("low = 0.8, high = 1.2", "low = 0.8, high = 1.2, log = 3", "log = 3"),
        ("low = 0.8, high = 1.2", "low = 0.8, high = 1.2, steps = 1", "steps = 1"),
        ("low = 0.8, high = 1.2", "low = nan, high = 1.2", "low = nan is not a finite number"),
        ("low = 0.8, high = 1.2", "values = []", "values is empty"),
        ("chambers.wall_mm", "chambers.wal_mm", "did you mean 'chambers.wall_mm'"),
        ("chambers.wall_mm", "__class__.x", "unknown input"),
        ('stages = "place"', 'stages = "simulate"', "is not one of its stages"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_before_any_work(tmp_path, old, new, words):
    assert old in GOOD
    with pytest.raises(InputError, match=words):
        parse_plan(GOOD.replace(old, new, 1), tmp_path)


def test_effects_of_a_known_function():
    """y = 3 a + noise of b: a explains nearly all, b nothing; the means lie on the line."""
    rng = np.random.default_rng(1)
    a, b = rng.random(400), rng.random(400)
    y = 3 * a + 0.01 * rng.standard_normal(400)
    of_a, of_b = main_effect(a.tolist(), y), main_effect(b.tolist(), y)
    assert of_a.share > 0.97
    assert of_b.share < 0.03
    np.testing.assert_allclose(of_a.mean, 3 * of_a.places, atol=0.01)
    kinds = np.where(a > 0.5, "high", "low").tolist()
    of_kind = main_effect(kinds, y)
    assert set(of_kind.labels) == {"high", "low"}
    assert of_kind.share == pytest.approx(0.75, abs=0.03)


def test_the_share_of_few_points_is_corrected_for_the_number_of_groups():
    """Epsilon squared in closed form: 1 - (4/2)/(20/3); twelve values are four groups of three."""
    assert main_effect(["a", "a", "b", "b"], np.array([1.0, 3.0, 5.0, 7.0])).share == pytest.approx(0.7)
    assert main_effect([float(v) for v in range(12)], np.arange(12.0)).places.tolist() == [
        1.0,
        4.0,
        7.0,
        10.0,
    ]


def test_an_input_that_never_changes_says_nothing():
    assert np.isnan(main_effect([1.0] * 5, np.arange(5.0)).share)


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=25))
def test_the_front_is_what_nobody_beats(points):
    costs = np.array(points, dtype=float)
    front = set(pareto(costs).tolist())

    def beats(i, j):
        return (costs[i] <= costs[j]).all() and (costs[i] < costs[j]).any()

    n = len(points)
    assert front == {j for j in range(n) if not any(beats(i, j) for i in range(n))}
    assert front


def test_a_point_without_a_figure_is_not_on_the_front():
    assert pareto(np.array([[np.nan, 0.0], [1.0, 1.0]])).tolist() == [1]


@pytest.mark.parametrize("table", ["simulate", "place", "vary"])
def test_what_is_no_table_is_told_so(table):
    text = f'format = 1\npreset = "mu-1.0x"\nstages = "place"\n{table} = 3\n'
    if table != "vary":
        text += '[vary]\n"chambers.wall_mm" = { low = 0.8, high = 1.0 }\n'
    with pytest.raises(InputError, match=r"table|no input is varied"):
        parse_plan(text, Path("/"))


@pytest.mark.parametrize(
    ("vary", "mesh", "what"),
    [
        (
            '"material.lattice_modulus_kPa" = { low = 15.0, high = 60.0 }',
            "",
            "lattice_modulus_kPa moves nothing",
        ),
        (
            '"chambers.wall_mm" = { low = 0.8, high = 1.0 }',
            'fidelity = "homogenised"',
            "unknown key 'fidelity'",
        ),
        (
            '"simulate.mesh.fidelity" = { values = ["homogenised"] }',
            "",
            "unknown input 'simulate.mesh.fidelity'",
        ),
    ],
)
def test_a_sweep_is_of_the_printed_body(vary, mesh, what):
    head = f'format = 1\npreset = "mu-1.0x"\n[simulate]\nmesh = {{ {mesh} }}\n[vary]\n'
    with pytest.raises(InputError, match=what) as error:
        parse_plan(head + vary, Path("/"))
    assert "sweep.toml" in error.value.where
    assert error.value.remedy
    found = parse_plan(head.replace(mesh, "") + '"chambers.wall_mm" = { low = 0.8, high = 1.0 }', Path("/"))
    assert found.inputs.tables["simulate"]["self_contact"]
