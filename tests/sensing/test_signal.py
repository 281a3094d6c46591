"""Signals: the fast law against traces, the figures of a response, Pareto sets and sets of sensors."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.sensing.guide import Centreline, arc
from mu_addon.sensing.optics import Optics
from mu_addon.sensing.signal import (
    Guided,
    Law,
    arc_response,
    best_sets,
    differential_pairs,
    features,
    fit_law,
    pareto,
    response,
    through,
    transmitted,
)

D = load_preset("mu-1.0x").dimensions


@pytest.fixture(scope="module")
def law_of_d() -> Law:
    return fit_law(D, Optics())


def test_wells_keep_clear_of_junctions_and_ends() -> None:
    guided = Guided.straight(D, 3 * D.cell + 2 * D.waveguide_end)
    assert len(guided.junctions) == 4
    for well, (a, b) in itertools.product(guided.wells, guided.junctions):
        assert not a - D.well_width / 2 < well < b + D.well_width / 2
    # The number of wells follows the path's length.
    longer = Guided.straight(D, 5 * D.cell + 2 * D.waveguide_end)
    assert len(longer.wells) / len(guided.wells) == pytest.approx(5 / 3, rel=0.1)


def test_a_sensor_tells_which_way_it_bends() -> None:
    """Wells on the stretched side open and let light out: more loss one way, less the other."""
    found = arc_response(D, Optics(), 2 * D.cell + 5, np.array([-40.0, -20, 0, 20, 40]), rays=8000)
    assert found.monotonic_deg == (-40, 40)
    assert found.sensitivity_per_deg > 0
    assert found.delta[0] < -0.1
    assert found.delta[-1] > 0.1


def test_the_law_follows_traces_it_never_saw(law_of_d: Law) -> None:
    law = law_of_d
    assert law.rms < 0.25
    length = 3 * D.cell + 5
    guided = Guided.straight(D, length)
    for angle in (-45, 0, 45):
        traced = transmitted(guided, arc(length, angle), Optics(), rays=20_000)
        assert np.log(law.transmitted(guided, arc(length, angle)) / traced) == pytest.approx(
            0, abs=3 * law.rms
        )


def test_a_law_of_known_coefficients_is_exact() -> None:
    guided = Guided.straight(D, 30)
    bent = arc(30, 30)
    line = Centreline(bent.s, 1.02 * bent.points, bent.normals)
    kappa = np.radians(30) / 30
    law = Law(np.array([0.1, 0.02, 0.03, 0.05, 0.2, 4.0, 50.0, 60.0]), np.eye(8), 0.0)
    n, m = len(guided.wells), len(guided.junctions)
    expected = 0.1 + 0.02 * 30 + n * (0.03 + 4 * kappa + 50 * kappa**2) + 0.05 * m
    expected += 0.2 * 0.02 * 30 + 60 * kappa**2 * 30
    assert -np.log(law.transmitted(guided, line)) == pytest.approx(expected, rel=2e-3)
    assert law.error(np.array([0, 0, 0, 0, 3.0, 4.0, 0, 0])) == 5.0


def test_a_stretched_guide_loses_by_its_stretch_and_not_as_a_longer_one(law_of_d: Law) -> None:
    """Wells that open and a longer way through resin cost light; more wells and junctions would cost more."""
    length = 3 * D.cell + 5
    guided = Guided.straight(D, length)
    rest = arc(length, 0)
    longer = Centreline(rest.s, 1.08 * rest.points, rest.normals)
    traced = [transmitted(guided, line, Optics(), rays=30_000) for line in (rest, longer)]
    told = [law_of_d.transmitted(guided, line) for line in (rest, longer)]
    change = features(guided, longer) - features(guided, rest)
    # Each trace's own error is some 3 %.
    assert np.log(told[1] / told[0]) == pytest.approx(
        np.log(traced[1] / traced[0]), abs=3 * law_of_d.error(change) + 0.1
    )


def test_a_centreline_through_nodes() -> None:
    bent = arc(37.5, 45)
    lengths = np.array([0, 12.5, 25, 37.5])
    nodes = np.column_stack([np.interp(lengths, bent.s, c) for c in bent.points.T])
    line = through(nodes, lengths, 2.5)
    assert line.s[-1] == pytest.approx(37.5 + 5)
    middle = len(line.s) // 2
    assert line.curvature[middle] == pytest.approx(np.radians(45) / 37.5, rel=0.1)
    np.testing.assert_allclose(line.normals[middle], bent.normals[len(bent.s) // 2], atol=0.01)
    straight = through(np.column_stack([0 * lengths, 0 * lengths + 25, lengths]), lengths, 2.5)
    np.testing.assert_allclose(straight.normals, np.tile([0, 1.0, 0], (len(straight.s), 1)), atol=1e-12)


def test_figures_of_a_response() -> None:
    angle = np.array([-30.0, -20, -10, 0, 10, 20, 30])
    found = response(angle, 1 - 0.01 * angle)
    assert found.sensitivity_per_deg == pytest.approx(0.01)
    assert found.monotonic_deg == (-30, 30)
    assert found.span == pytest.approx(0.6)
    folded = response(angle, np.array([0.8, 0.7, 0.9, 1.0, 1.1, 1.2, 1.1]))
    assert folded.monotonic_deg == (-20, 20)
    with pytest.raises(InputError, match="not seen at rest"):
        response(angle[:3], np.ones(3))
    with pytest.raises(InputError, match="does not bend"):
        response(np.zeros(3), np.ones(3))
    two = response(np.array([0.0, 8.0]), np.array([0.5, 0.4]))
    assert two.sensitivity_per_deg == pytest.approx(0.2 / 8)


@given(
    st.lists(st.tuples(st.floats(0, 1), st.floats(-1, 1)), min_size=1, max_size=12),
)
def test_pareto(pairs: list[tuple[float, float]]) -> None:
    d, s = zip(*pairs, strict=True)
    front = pareto(d, s)
    assert any(front)
    for k, (dk, sk) in enumerate(pairs):
        beaten = any(a <= dk and abs(b) >= abs(sk) and (a < dk or abs(b) > abs(sk)) for a, b in pairs)
        assert front[k] == (not beaten)


def test_sets_of_sensors() -> None:
    # Two of a kind tell less than two that see different bends.
    signals = np.array([[1.0, 0.0], [0.98, 0.0], [0.0, 0.6]])
    (best, information), *_ = best_sets(signals, noise=0.1, size=2)
    assert best == (0, 2)
    assert information == pytest.approx(0.5 * np.log((1 + 100) * (1 + 36)))
    assert differential_pairs([0.01, -0.004, 0.002])[0] == ((0, 1), pytest.approx(0.014))
    assert differential_pairs([0.01]) == []
    with pytest.raises(InputError, match="no set of 4"):
        best_sets(signals, 0.1, 4)
