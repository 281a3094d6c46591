"""A gauge off a straight line is found, or left open with it in the set, and no straight one is called so."""

import re

import attrs
import numpy as np
import pytest

from mu_addon.diagnose.words import sentence
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import readable
from mu_addon.evidence.instrument_curve import curved
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.sensitivity import best_seen
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic, bench

RANGE_kPa = 40.0


def parabola(p, share):
    """What a gauge reads that is right at rest and at `RANGE_kPa`, and off by a share of it half-way."""
    return p + 4.0 * share * p * (1.0 - np.abs(p) / RANGE_kPa)


def sine(p, share):
    return p + share * RANGE_kPa * np.sin(np.pi * p / RANGE_kPa)


def measured(law, share, seed=0):
    rng = np.random.default_rng(seed)
    tests = []
    for name, t, p, how in analytic.protocols(0.5, 4):
        y = analytic.channels(p)
        y += np.array([0.1, *[0.05] * 6])[:, None] * rng.normal(size=y.shape)
        read = law(p, share) + 0.02 * rng.normal(size=len(p))
        observed = dict(zip(analytic.CHANNELS, y, strict=True))
        tests.append(analytic.experiment(name, t, read, observed, **how))
    return tests


def judged(tests):
    return diagnose(tests, Composite({"unit_pressure": UnitPressure([analytic.response()], tests)}))


def test_a_curved_gauge_is_straight_at_rest_and_at_its_range_and_undone_in_between():
    p = np.linspace(-30.0, RANGE_kPa, 71)
    for bow in (-0.05, 0.03):
        values = {
            "pressure_nonlinearity.bow": bow,
            "pressure_gain.gain": 0.02,
            "pressure_offset.offset_kPa": 0.3,
        }
        read = curved(p, bow, RANGE_kPa) * 1.02 + 0.3
        undone = bench.acted("unit_pose", read, values, "zero", "gain", "curve", largest=RANGE_kPa)
        assert undone == pytest.approx(p, abs=1e-9)
        alone = curved(np.array([0.0, 20.0, 40.0]), bow, RANGE_kPa)
        assert alone == pytest.approx([0.0, 20.0 + bow * RANGE_kPa, 40.0])


@pytest.mark.parametrize(
    ("law", "share"),
    [
        (parabola, -0.03),
        pytest.param(sine, 0.02, marks=pytest.mark.nightly("test_a_curved_gauge_is_told_or_a_rival")),
    ],
)
def test_a_curved_gauge_is_told_or_a_rival(law, share):
    found = judged(measured(law, share))
    assert found.kind in ("named", "ambiguous")
    assert "pressure_nonlinearity" in found.ambiguity


@pytest.mark.parametrize(
    "seed", [0, pytest.param(1, marks=pytest.mark.nightly("test_a_straight_gauge_is_not_called_curved"))]
)
def test_a_straight_gauge_is_not_called_curved(seed):
    assert judged(measured(parabola, 0.0, seed)).kind == "none"


def test_what_a_none_cannot_show_stands_beside_it():
    """By the angle alone, a gauge's gain is another modulus: no size of it shows."""
    tests = [
        attrs.evolve(e, columns={c: e[c] for c in ("time_s", "pressure_kPa", "angle_deg")})
        for e in measured(parabola, -0.003)
    ]
    response = attrs.evolve(analytic.response(), discrepancy=0.04)
    found = diagnose(tests, Composite({"unit_pressure": UnitPressure([response], tests)}))
    _, words = sentence(found)
    assert found.kind == "none"
    shown, _, hidden = words.partition("Hidden at any size: ")
    seen = best_seen(found.seen).values()
    told = set(re.split(", | and ", hidden.rstrip(".")))
    assert told == {readable(s.effect.name) for s in seen if not s.identifiable}
    assert "pressure gain" in told
    least, *_ = (n for n in shown.partition("least visible first: ")[2].split("; ") if n)
    sizes = [s.effect.parameters[0] for s in seen]
    reach = [max(p.high - p.null, p.null - p.low) for p in sizes]
    worst = max((s.limit / r, s) for s, r in zip(seen, reach, strict=True) if s.identifiable and s.linear)[1]
    assert least.startswith(f"{readable(worst.effect.name)} (")
    assert f"{worst.limit:.2g}" in least
