"""A mass that rings behind the pressure: its motion, the modes that are tried, and the test of a residual."""

import math

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.record import record
from mu_addon.evidence.residual_tests.table import strict_table, structure
from mu_addon.evidence.ringing import modes, ringing
from tests.evidence import analytic


def test_the_motion_is_that_of_a_mass_on_a_spring_at_any_clock():
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.05, 0.3, 60))
    still = np.stack([np.interp(t, [2, 3, 8], [1.0, 5.0, 0.0]), rng.normal(size=60)], axis=1)
    hertz, damping = np.array([0.4, 1.7]), np.array([0.05, 0.2])
    found = ringing(t, still, hertz, damping)
    for k, w in enumerate(2 * np.pi * hertz):

        def slope(at, x, k=k, w=w):
            drive = np.array([np.interp(at, t, c) for c in still.T])
            return np.concatenate([x[2:], w * w * (drive - x[:2]) - 2 * damping[k] * w * x[2:]])

        first = np.concatenate([still[0], [0.0, 0.0]])
        way = solve_ivp(slope, (t[0], t[-1]), first, t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.02)
        np.testing.assert_allclose(found[:, :, k], way.y[:2].T - still, atol=2e-5)


def test_every_mode_between_the_bounds_is_near_one_that_is_tried():
    hertz, damping = modes(0.2, 2.0)
    assert hertz.min() == pytest.approx(0.2)
    assert hertz.max() == pytest.approx(2.0)
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 80.0, 0.1)
    step = (t > 5.0).astype(float)[:, None]
    tried = ringing(t, step, hertz, damping)[:, 0]
    truths = ringing(t, step, np.exp(rng.uniform(*np.log([0.2, 2.0]), 40)), rng.uniform(0.02, 0.3, 40))[:, 0]
    unit = [c / np.linalg.norm(c, axis=0) for c in (tried, truths)]
    kept = np.abs(unit[0].T @ unit[1]).max(axis=0) ** 2
    assert kept.min() > 0.7


@pytest.mark.parametrize("size", [0.0, 0.005])
def test_a_unit_that_rings_leaves_structure_and_the_noise_does_not(size):
    made = analytic.measured(np.random.default_rng(2), {}, dt=0.2, count=3, level=0.1)
    model = analytic.simulator(made)
    rung = []
    for e in made:
        # What is hidden swings in pressure; what is looked for is a swing of what is predicted.
        swing = ringing(e["time_s"], e["pressure_kPa"][:, None], np.array([0.7]), np.array([0.04]))[:, 0, 0]
        swung = attrs.evolve(e, columns={**e.columns, "pressure_kPa": e["pressure_kPa"] + size * swing})
        moved = model.predict(swung, {}) - model.predict(e, {})
        columns = {c: e[c] + v for c, v in zip(analytic.CHANNELS, moved, strict=True)}
        rung.append(attrs.evolve(e, columns={**e.columns, **columns}))
    data = record(rung, model)
    sd = {"unit_pressure angle": 0.3, "unit_pressure marker": 0.1}
    noise = {g: Source(v * math.sqrt(0.3), v * math.sqrt(0.7), -0.2 / math.log(0.9)) for g, v in sd.items()}
    fitter = Fitter(data, model, noise)
    table = strict_table(fitter, fitter.fit())
    assert structure(table)[:1] == (("ringing",) if size else ())
    where = next(d.where for d in table if d.against == "ringing")
    assert not size or float(where.split()[0]) == pytest.approx(0.7, rel=0.05)
