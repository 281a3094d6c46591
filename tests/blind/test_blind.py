"""Data whose fault is hidden from the judge: the verdict is held against it afterwards."""

import numpy as np
import pytest

from mu_addon.evidence.lags import first_order_lag
from tests.blind import truth, unit_runs
from tests.blind.judge import IN_SET, judged

SMALL = {"count": 3, "dt": 0.3}
HIDDEN = pytest.mark.nightly("test_a_hidden_cause_is_found")


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ({"seed": 12}, {"clean"}),
        pytest.param({"seed": 8, "noise": "two"}, {"clean"}, marks=HIDDEN),
        pytest.param({"seed": 2, "effect": "mullins_softening"}, {"exact"}, marks=HIDDEN),
        pytest.param({"seed": 3, "effect": "rate_independent_hysteresis"}, {"exact"}, marks=HIDDEN),
        pytest.param({"seed": 4, "effect": "line_lag"}, IN_SET, marks=HIDDEN),
        ({"seed": 5, "effect": "wall_thickness"}, {"exact", "exact_with_rivals"}),
        pytest.param({"seed": 6, "effect": "marker_slip", "times": 10.0}, {"exact"}, marks=HIDDEN),
        # From a finer mesh than the judge's.
        ({"seed": 9, "effect": "clogged_chamber", "unit": "simulated", "times": 10.0}, {"exact"}),
    ],
    ids=["clean", "noise that is not the judge's", "Mullins", "friction", "lag", "wall", "slip", "simulated"],
)
def test_a_hidden_cause_is_found(order, expected):
    assert judged(SMALL | order)["outcome"] in expected


def test_a_name_that_only_the_mesh_s_error_decides_is_not_given():
    # What overcure does on the bench's mesh is more like what a thicker wall does on the judge's.
    row = judged({"seed": 2_000_001, "effect": "overcure", "times": 2.0, "unit": "simulated", "most": 6})
    assert (row["verdict"], row["outcome"]) == ("ambiguous", "in_set")


@pytest.mark.nightly(
    "tests/evidence/test_laws.py::test_two_effects_that_pass_for_slow_noise_one_by_one_are_found_together"
)
def test_two_causes_are_found_though_neither_looks_best_alone():
    row = judged({"seed": 4100000, "dt": 0.3, "count": 5, "times": 8.0} | TWO)
    assert row["outcome"] in IN_SET
    assert set(row["chosen"]) == set(TWO["effect"])


TWO = {"effect": ["wall_thickness", "strain_stiffening"]}


@pytest.mark.parametrize(
    ("effect", "times"),
    [
        ("resonance", 4.0),
        pytest.param(
            "resonance", 10.0, marks=pytest.mark.nightly("test_what_is_outside_the_library_gets_no_name")
        ),
    ],
)
def test_what_is_outside_the_library_gets_no_name(effect, times):
    row = judged(SMALL | {"seed": 6, "effect": effect, "times": times})
    assert (row["verdict"], row["names"]) == ("unexplained", [])


def test_a_finer_mesh_than_the_judge_s_is_no_cause():
    assert judged(SMALL | {"seed": 10, "unit": "simulated", "level": 0.03})["outcome"] == "clean"


def test_the_bench_integrates_by_a_rule_of_its_own_that_agrees_where_both_are_exact():
    t = np.arange(0.0, 20.0, 0.02)
    p = np.interp(t, [0, 5, 10, 20], [0, 30, 30, 0])
    for time_s in (0.005, 0.3, 4.0):
        np.testing.assert_allclose(truth.first_order(t, p, time_s), first_order_lag(t, p, time_s), atol=2e-4)
    step = truth.first_order(t, np.where(t > 0, 1.0, 0.0), 2.0)
    # The first sample's ramp delays the step by half of it.
    np.testing.assert_allclose(step[1:], 1.0 - np.exp(-(t[1:] - 0.01) / 2.0), atol=1e-4)


def test_the_simulated_bench_differs_from_the_judge_s_model_by_the_mesh_alone():
    hidden = truth.Simulated()
    model = hidden.responses([(1.0, 0.0)])[0]
    p = np.linspace(-15.0, 30.0, 40)
    truly, known = hidden.still(p, {}, 1.0, 0.0, 1.0), model.at(p, {})
    apart = np.abs(truly - known)[0]
    assert 0.02 < apart.max() < 0.5
    # All the way to the finer mesh, and a little beyond, as the bench's is finer still.
    better = [np.abs(truly - model.at(p, {"mesh_share": s}))[0].max() for s in (0.5, 1.0)]
    assert better[1] < better[0] < apart.max()
    np.testing.assert_allclose(hidden.still(np.zeros(1), {}, 1.0, 0.0, 1.0)[0], 0.0, atol=1e-9)
    assert hidden.still(np.array([20.0]), {"wall_thickness": 1.2}, 1.0, 0.0, 1.0)[0] < truly[0, -10]


def test_the_table_of_runs_holds_what_battery_and_judge_ask_of_it():
    runs = unit_runs.table()
    assert all(np.isfinite(v).all() for v in runs.values())
    assert {f"hidden {n} {s:g} 0" for n, sizes in unit_runs.SIZES.items() for s in sizes} <= set(runs)
    assert {"mesh_share", *unit_runs.SIZES} == set(unit_runs.response(runs, 0.0).variants)
