"""Signals: of states of a mesh, the figures of a response, Pareto sets and sets of sensors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.design.anchors import window
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.sensing.light_law import FEATURES, Law, features
from mu_addon.sensing.light_signal import (
    best_sets,
    differential_pairs,
    pareto,
    response,
    signal_of_states,
    traced_signal,
)
from mu_addon.sensing.optics import Optics

from .bars import bent_to_a_circle, body, of_window

UNIT = load_preset("mu-1.0x")
# Light is lost by elongation, 0.02 a mm, and gained by curvature of wells toward them.
LAW = Law(np.array([3.0, 0, 0, 0, 0.02, 0, 4.0, 0]), np.zeros((8, 8)), 0.0)


def test_the_signal_of_states_of_a_mesh() -> None:
    """A block bent about x to a circle's arc: each well turns with it, and its axis keeps its length."""
    mesh = body(UNIT)
    bent = bent_to_a_circle(mesh.nodes, np.radians(20) / 75, y=25.0) - mesh.nodes
    found = signal_of_states(UNIT, window(UNIT, "alpha4"), mesh, [0 * bent, bent], Optics(), LAW)
    guide = of_window("alpha4").shape
    # Bent toward +y the wells' face is the inner one.
    expected = -4.0 * len(guide.wells) * np.radians(20) / 75
    assert np.log(found.transmitted[1] / found.at_rest) == pytest.approx(-expected, rel=0.02)
    assert found.delta[0] == pytest.approx(0, abs=1e-9)
    assert found.delta[1] < -0.05
    assert found.errors[0] == 0 < found.errors[1]


def test_a_stretched_body_stretches_its_waveguide() -> None:
    mesh = body(UNIT)
    longer = mesh.nodes * [0, 0, 0.03]
    found = signal_of_states(UNIT, window(UNIT, "alpha1"), mesh, [longer], Optics(), LAW)
    # Between its end nodes, two cells; beyond them it is free.
    assert np.log(found.transmitted[0] / found.at_rest) == pytest.approx(-0.02 * 0.03 * 25, rel=1e-3)
    by_rays = signal_of_states(UNIT, window(UNIT, "alpha1"), mesh, [longer], rays=30_000)
    assert by_rays.delta[0] > 2 * by_rays.errors[0]


def test_rays_in_place_of_the_law() -> None:
    """Bent toward its wells a bar keeps light, bent away it loses some, by rays as by the law."""
    bar = of_window("alpha4")
    turned = np.tile(np.eye(3), (3, 1, 1))
    moved = []
    for curvature in (0.012, -0.012):
        at = bent_to_a_circle(bar.nodes, curvature, y=25.0)
        for k, angle in enumerate(curvature * bar.nodes[:, 2]):
            turned[k, 1:, 1:] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        moved.append((at, turned.copy()))
    inward, outward = traced_signal(bar, moved, Optics(), rays=30_000).delta
    assert inward < -0.08
    assert outward > 0.08
    signed = [features(bar.shape, bar.legs(*state))[FEATURES.index("curvature_of_wells")] for state in moved]
    assert signed == pytest.approx([-0.012 * 6, 0.012 * 6], rel=1e-2)


def test_a_response_is_told_about_rest_wherever_that_is() -> None:
    """The same light seen from another zero of the angle, as that of a unit which hangs under its weight."""
    angle = np.arange(-30.0, 31.0, 10.0)
    light = np.array([0.8, 0.7, 0.9, 1.0, 1.1, 1.2, 1.1])
    drawn, hung = response(angle, light), response(angle + 45.0, light, 45.0)
    assert hung.sensitivity_per_deg == pytest.approx(drawn.sensitivity_per_deg, rel=1e-12)
    assert hung.monotonic_deg == (25.0, 65.0)
    assert hung.span == drawn.span
    np.testing.assert_array_equal(hung.delta, drawn.delta)
    with pytest.raises(InputError, match="state at rest is missing"):
        response(angle + 45.0, light)


def test_figures_of_a_response() -> None:
    angle = np.array([-30.0, -20, -10, 0, 10, 20, 30])
    found = response(angle, 1 - 0.01 * angle)
    assert found.sensitivity_per_deg == pytest.approx(0.01)
    assert found.monotonic_deg == (-30, 30)
    assert found.span == pytest.approx(0.6)
    folded = response(angle, np.array([0.8, 0.7, 0.9, 1.0, 1.1, 1.2, 1.1]))
    assert folded.monotonic_deg == (-20, 20)
    with pytest.raises(InputError, match="state at rest is missing"):
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
