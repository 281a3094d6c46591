"""A short share of the blind battery; the whole of it is `python -m benchmarks.blind`."""

import pytest

from tests.blind.judge import judged

SMALL = {"count": 3, "dt": 0.3}


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ({"seed": 1}, {"clean"}),
        ({"seed": 2, "effect": "mullins_softening"}, {"exact"}),
        ({"seed": 3, "effect": "rate_independent_hysteresis"}, {"exact"}),
        ({"seed": 4, "effect": "line_lag"}, {"exact", "exact_with_rivals", "in_set"}),
        ({"seed": 5, "effect": "wall_thickness"}, {"exact", "exact_with_rivals"}),
    ],
    ids=lambda v: v.get("effect", "clean") if isinstance(v, dict) else "",
)
def test_a_hidden_cause_is_found(order, expected):
    assert judged(SMALL | order)["outcome"] in expected


@pytest.mark.parametrize("effect", ["resonance", "marker_slip"])
def test_what_is_outside_the_library_gets_no_name(effect):
    row = judged(SMALL | {"seed": 6, "effect": effect, "times": 10.0})
    assert (row["verdict"], row["names"]) == ("unexplained", [])


def test_what_cannot_be_told_is_refused():
    row = judged(SMALL | {"seed": 7, "effect": "pressure_gain", "values": {"pressure_gain.gain": 0.08}})
    assert (row["verdict"], row["names"]) == ("none", [])
    assert "pressure_gain" in row["identifiability"]
