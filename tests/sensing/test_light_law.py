"""The law of a waveguide's light, against traces it never saw and against itself."""

from __future__ import annotations

import itertools

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.sensing.guide import Centreline, arc
from mu_addon.sensing.light_law import FEATURES, MISFIT, Law, features, fit_law, straight_guide, traced
from mu_addon.sensing.notched import well_angles
from mu_addon.sensing.optics import Optics

D = load_preset("mu-1.0x").dimensions


@pytest.fixture(scope="module")
def law_of_d() -> Law:
    return fit_law(D, Optics(), traces=80)


def test_wells_keep_clear_of_junctions_and_ends() -> None:
    shape = straight_guide(D, 3 * D.cell)
    assert len(shape.junctions) == 4
    for well, (a, b) in itertools.product(shape.wells, shape.junctions):
        assert not a - D.well_width / 2 < well < b + D.well_width / 2
    assert len(straight_guide(D, 5 * D.cell).wells) / len(shape.wells) == 5 / 3
    with pytest.raises(InputError, match="too short for a well"):
        straight_guide(D, 3.0)


def test_a_sensor_tells_which_way_it_bends() -> None:
    """Light runs along the outer side of a bend: wells there cost it, wells on the inner side do not."""
    shape = straight_guide(D, 2 * D.cell)
    losses = [-np.log(traced(shape, arc(30, a), Optics(), 20_000).detected) for a in (-30, -15, 0, 15, 30)]
    assert (np.diff(losses) > 0.03).all()


def test_the_law_follows_traces_it_never_saw(law_of_d: Law) -> None:
    assert law_of_d.rms < 0.16
    shape = straight_guide(D, 3 * D.cell)
    length = 3 * D.cell + 2 * D.waveguide_end
    for angle in (-25, 0, 25):
        line = arc(length, angle)
        light = traced(shape, line, Optics(), rays=30_000)
        error = np.hypot(light.error / light.detected, MISFIT)
        assert np.log(law_of_d.transmitted(shape, [line]) / light.detected) == pytest.approx(0, abs=3 * error)


def test_a_law_of_known_coefficients_is_exact() -> None:
    shape = straight_guide(D, 25)
    bent = arc(30, 20)
    line = Centreline(bent.s, 1.02 * bent.points, bent.normals)
    kappa = np.radians(20) / 30
    law = Law(np.array([0.1, 0.02, 0.3, 0.05, 0.2, 2.0, 4.0, 60.0]), np.eye(8), 0.0)
    n, m = len(shape.wells), len(shape.junctions)
    kink = (np.hypot(well_angles(shape, line), 0.1) - 0.1).sum()
    expected = 0.1 + 0.02 * 30 + 0.3 * np.log1p(n) + 0.05 * m
    expected += 0.2 * 0.02 * 30 + 2 * kink + 4 * n * kappa + 60 * kappa**2 * 30
    assert -np.log(law.transmitted(shape, [line])) == pytest.approx(expected, rel=2e-3)
    assert law.error(np.zeros(8)) == 0
    assert law.error(np.array([0, 0, 0, 0, 3.0, 4.0, 0, 0])) == pytest.approx(
        np.sqrt(25 + 2 * MISFIT**2 + (0.45 * 8.6) ** 2)
    )


def test_a_guide_in_two_legs_has_the_features_of_one() -> None:
    shape, line = straight_guide(D, 37.5), arc(42.5, 15, steps=170)
    shape = attrs.evolve(shape, junctions=())
    halves = [
        Centreline(line.s[part], line.points[part], line.normals[part])
        for part in (slice(0, 86), slice(85, None))
    ]
    one, two = features(shape, [line]), features(shape, halves)
    kinked = FEATURES.index("kinks")
    np.testing.assert_allclose(np.delete(two, kinked), np.delete(one, kinked), rtol=1e-3, atol=1e-6)
    assert two[kinked] == pytest.approx(one[kinked], rel=0.2)


def test_a_stretched_guide_loses_light(law_of_d: Law) -> None:
    """A bar that is pulled opens and kinks at its wells."""
    shape = straight_guide(D, 3 * D.cell)
    rest = arc(3 * D.cell + 5, 0)
    longer = Centreline(rest.s, 1.05 * rest.points, rest.normals)
    lights = [traced(shape, line, Optics(), rays=60_000) for line in (rest, longer)]
    transmitted = [law_of_d.transmitted(shape, [line]) for line in (rest, longer)]
    error = law_of_d.error(features(shape, [longer]) - features(shape, [rest]))
    error = np.hypot(error, np.hypot(*(light.error / light.detected for light in lights)))
    change = np.log(lights[1].detected / lights[0].detected)
    assert change < -0.15
    assert np.log(transmitted[1] / transmitted[0]) == pytest.approx(change, abs=3 * error)


def test_a_resin_that_lets_hardly_any_light_through_is_named() -> None:
    with pytest.raises(InputError, match="almost no light"):
        fit_law(D, Optics(attenuation_per_mm=1.0), rays=200, traces=10)
