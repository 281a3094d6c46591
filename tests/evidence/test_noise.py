"""Whitening against dense covariances; the noise found where a cause is hidden in the data."""

import numpy as np
import pytest

from mu_addon.evidence.diagnosis import diagnose, noise_of
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source, Whitening, repeated
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import experiment


@pytest.mark.parametrize("blocks", [1000, 40])
def test_whitening_is_the_inverse_root_of_the_covariance_of_block_means(blocks):
    rng = np.random.default_rng(0)
    t = np.arange(90) * 0.2
    e = analytic.experiment("one", t, np.linspace(0, 20, 90), {"angle_deg": rng.normal(size=90)})
    data = record([e], analytic.simulator([e]), blocks)
    source = Source(0.7, 1.3, 1.1)
    sample = 0.49 * np.eye(90) + 1.69 * np.exp(-np.abs(t[:, None] - t) / 1.1)
    s = data.series[0]
    means = np.stack([s.mean(row) for row in np.eye(90)], axis=1)
    dense = means @ sample @ means.T
    whitening = Whitening(data, {s.group: source})
    # W C W' = 1, row by row: W is applied to the columns of a root of C.
    root = np.linalg.cholesky(dense)
    white = whitening(root)
    np.testing.assert_allclose(white @ white.T, np.eye(len(dense)), atol=1e-9)
    assert whitening.log_dets[s.group] == pytest.approx(np.linalg.slogdet(dense)[1], abs=1e-8)


def test_a_gap_in_the_clock_lets_go_of_the_past():
    t = np.concatenate([np.arange(30) * 0.1, 100.0 + np.arange(30) * 0.1])
    e = analytic.experiment("gap", t, np.zeros(60), {"angle_deg": np.arange(60.0)})
    data = record([e], analytic.simulator([e]))
    source = Source(0.3, 1.0, 2.0)
    dense = 0.09 * np.eye(60) + np.exp(-np.abs(t[:, None] - t) / 2.0)
    white = Whitening(data, {data.groups[0]: source})(np.linalg.cholesky(dense))
    np.testing.assert_allclose(white @ white.T, np.eye(60), atol=1e-9)


def test_a_timed_record_of_a_few_samples_has_white_noise_and_a_verdict():
    """Too few to tell slow noise by: it is taken for none."""
    rng = np.random.default_rng(2)
    pressure = np.linspace(0.0, 20.0, 10)
    angle = analytic.channels(pressure)[0] + rng.normal(size=10)
    e = analytic.experiment("short", np.arange(10) * 0.5, pressure, {"angle_deg": angle})
    model = analytic.simulator([e])
    data = record([e], model)
    (source,) = noise_of(data, model).values()
    assert source.slow == 0.0
    white = Whitening(data, {data.groups[0]: source})(np.eye(10))
    np.testing.assert_allclose(white, np.eye(10) / source.white, atol=1e-6 / source.white)
    assert diagnose([e], model).kind == "none"


def test_series_of_one_clock_are_whitened_as_each_alone():
    rng = np.random.default_rng(5)
    made = []
    for k, dt in enumerate((0.2, 0.2, 0.5)):
        t = 7.0 * k + np.arange(60) * dt
        columns = {c: rng.normal(size=60) for c in ("marker1_y_mm", "marker1_z_mm")}
        if k == 1:
            # A sample that was not seen makes another clock of blocks.
            columns["marker1_z_mm"][20] = np.nan
        made.append(analytic.experiment(f"run {k}", t, np.zeros(60), columns))
    data = record(made, analytic.simulator(made))
    group, source = data.groups[0], Source(0.3, 1.0, 2.0)
    whitening, x = Whitening(data, {group: source}), rng.normal(size=(len(data), 3))
    assert len({s.clock for s in data.series}) == 3
    for s in data.series:
        dense = 0.09 * np.eye(len(s.time_s)) + np.exp(-np.abs(s.time_s[:, None] - s.time_s) / 2.0)
        squares = x[s.at].T @ np.linalg.solve(dense, x[s.at])
        for white in (whitening(x)[s.at], whitening.series(s, x[s.at])):
            np.testing.assert_allclose(white.T @ white, squares, rtol=1e-9)


@pytest.mark.parametrize(
    "hidden",
    [{}, {"viscoelasticity.share": 0.2, "viscoelasticity.time_s": 12.0}, {"clogged_chamber.share_lost": 0.6}],
)
def test_a_cause_neither_swells_the_noise_nor_is_taken_for_it(hidden):
    rng = np.random.default_rng(3)
    made = analytic.measured(rng, {"modulus_factor": 1.05, **hidden}, dt=0.25, count=4, rho=0.85)
    model = analytic.simulator(made)
    found = noise_of(record(made, model), model)
    marker = found["unit_pressure marker"]
    true = Source(0.1 * 0.3**0.5, 0.1 * 0.7**0.5, -0.25 / np.log(0.85))
    assert marker.white == pytest.approx(true.white, rel=0.15)
    # What counts at the frequencies of an effect is the drive of the slow part.
    assert marker.slow**2 / marker.time_s == pytest.approx(true.slow**2 / true.time_s, rel=0.3)


def test_the_fit_of_a_model_with_a_cause_left_out_would_have_swollen_it():
    rng = np.random.default_rng(3)
    made = analytic.measured(rng, {"clogged_chamber.share_lost": 0.6}, dt=0.25, count=4, rho=0.85)
    model = analytic.simulator(made)
    data = record(made, model)
    fitter = Fitter(data, model, noise_of(data, model))
    own, _ = fitter.under_its_own_noise(fitter.fit())
    group = "unit_pressure marker"
    # Of the first the true value is 0.084.
    assert fitter.sources[group].slow == pytest.approx(0.084, rel=0.15)
    assert own.sources[group].slow > 1.25 * fitter.sources[group].slow


def test_the_period_of_a_repeated_cycle():
    t, p = analytic.triangle(0.1, 8.0, 4, 0.0, 20.0)
    assert repeated(t, p) == pytest.approx(8.0, abs=0.2)
    t, p = analytic.steps(0.1, (30, 0), 20.0)
    assert repeated(t, p) is None
    assert repeated(t, 0.0 * p) is None


def test_without_a_clock_rows_that_repeat_tell_the_noise():
    rng = np.random.default_rng(4)
    mass = np.repeat(np.arange(0.0, 100.0, 10.0), 3)
    true = 0.05
    # What no effect of the library explains, since it has none, and what a line does not fit.
    sag = 0.4 * mass + 2e-3 * mass**2 + rng.normal(0.0, true, len(mass))
    e = experiment("beam_deadweight", {"added_mass_g": mass, "tip_deflection_mm": sag})
    model = Composite({"beam_deadweight": analytic.DeadLoad()})
    source = noise_of(record([e], model), model)["beam_deadweight tip_deflection"]
    assert source.slow == 0.0
    assert true / 1.3 < source.white < 1.6 * true
