"""Laws of one mechanism: those with more freedom take another one's place, and none is a second cause."""

import attrs
import numpy as np
import pytest

from benchmarks.evidence.second_code.judging import simulator_of
from benchmarks.evidence.second_code.recording import write
from benchmarks.evidence.second_code.sets import Order, made
from mu_addon.evidence.acceptance import of_the_law
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effects.viscoelasticity import spread_lag
from mu_addon.evidence.found_causes import LAW
from mu_addon.evidence.instants import turns
from mu_addon.evidence.lags import first_order_lag
from mu_addon.evidence.prediction.coupon import CouponStress
from mu_addon.measured import read_folder
from tests.evidence import bench


def stepped(t, p, time_s):
    """A lag by the exact solution from sample to sample."""
    x = [p[0]]
    for k, h in enumerate(np.diff(t)):
        a = np.exp(-h / time_s)
        slope = (p[k + 1] - p[k]) / h
        x.append(a * (x[-1] - p[k] + slope * time_s) + p[k + 1] - slope * time_s)
    return np.array(x)


@pytest.mark.parametrize("time_s", [0.02, 1.0, 400.0])
def test_a_lag_on_an_uneven_clock_is_the_solution_from_sample_to_sample(time_s):
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.05, 2.0, 300))
    p = rng.normal(size=300)
    np.testing.assert_allclose(first_order_lag(t, p, time_s), stepped(t, p, time_s), atol=1e-10)


def test_times_that_spread_over_no_decade_are_one_time():
    t = np.linspace(0.0, 30.0, 200)
    p = np.sin(t)
    np.testing.assert_allclose(spread_lag(t, p, 3.0, 0.0), first_order_lag(t, p, 3.0), atol=1e-12)
    wide = spread_lag(t, p, 3.0, 2.0)
    each = [first_order_lag(t, p, 3.0 * 10.0**k) for k in np.linspace(-1.0, 1.0, 7)]
    np.testing.assert_allclose(wide, np.mean(each, axis=0), atol=1e-12)


def test_softening_by_the_largest_strain_acts_on_unloading_alone():
    strain = np.concatenate([np.linspace(0.0, 0.4, 50), np.linspace(0.4, 0.0, 51)[1:]])
    e = bench.experiment("coupon", {"time_s": np.arange(100.0), "strain": strain, "stress_kPa": 0 * strain})
    model = CouponStress([e])
    plain = model.predict(e, {})[0]
    found = model.predict(e, {"mullins_softening.by_peak": 0.5, "mullins_softening.power": 0.5})[0]
    np.testing.assert_array_equal(found[:50], plain[:50])
    back = plain[50:] * np.exp(-0.5 * np.sqrt(0.4 - strain[50:]))
    np.testing.assert_allclose(found[50:], back, atol=1e-9)


def test_softening_that_ends_goes_by_the_way_below_the_largest_strain_over_it():
    strain = np.concatenate([np.linspace(0.0, 0.4, 50), np.linspace(0.4, 0.0, 51)[1:]])
    e = bench.experiment("coupon", {"strain": strain, "stress_kPa": 0 * strain})
    model = CouponStress([e])
    plain = model.predict(e, {})[0]
    values = {"mullins_softening.lost": 0.3, "mullins_softening.width": 0.2, "mullins_softening.shape": 1.5}
    found = model.predict(e, values)[0]
    np.testing.assert_array_equal(found[:50], plain[:50])
    way = (0.4 - strain[50:]) / (0.2 * 0.4)
    np.testing.assert_allclose(found[50:], plain[50:] * (0.7 + 0.3 * np.exp(-(way**1.5))), atol=1e-9)


def test_a_turn_between_two_samples_is_where_straight_lines_meet():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0.0, 10.0, 60))
    x = np.interp(t, [0.0, 3.3, 5.0, 8.0, 10.0], [0.0, 1.0, 0.2, 1.5, 0.0])
    found = turns(t, x)
    changed = np.flatnonzero(found != x)
    np.testing.assert_allclose(found[changed], [1.0, 1.5], rtol=1e-9)
    assert (t[changed - 1] < [3.3, 8.0]).all()
    assert (t[changed] > [3.3, 8.0]).all()


def test_a_round_turn_stays_as_it_was_sampled():
    t = np.linspace(0.0, 10.0, 41)
    np.testing.assert_array_equal(turns(t, np.sin(t)), np.sin(t))


def test_softening_knows_the_largest_strain_though_no_sample_was_there():
    """Between samples 0.5 s apart the machine turned at 0.4: the same instants of a finer record."""
    fine = np.linspace(0.0, 20.0, 2001)
    way = np.interp(fine, [0.0, 10.13, 20.0], [0.0, 0.4, 0.0])

    def made_of(rows):
        columns = {"time_s": fine[rows], "strain": way[rows], "stress_kPa": 0 * way[rows]}
        return bench.experiment("coupon", columns)

    values = {"mullins_softening.by_peak": 0.5, "mullins_softening.power": 0.5}
    rows = slice(0, None, 50)
    coarse, whole = (CouponStress([e]).predict(e, values)[0] for e in map(made_of, (rows, slice(None))))
    np.testing.assert_allclose(coarse, whole[rows], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "faults", "tied"),
    [
        # A lamp's loss by a law that ends, in a room whose light grows.
        (
            "waveguide_bending",
            {"led_drift": {"share": 0.0425, "time_s": 284.0}, "ambient_light": {"share": 0.0597}},
            (),
        ),
        # A tanh of the way below the largest strain, and one warm block, which may as well be another one.
        pytest.param(
            "lattice_compression",
            {"mullins_softening": {"rate": 0.71, "tanh": 1.0}, "temperature_drift": {"rate": 0.0081}},
            ("experiment warm", "specimen D"),
            marks=pytest.mark.nightly("test_two_effects_by_other_laws_are_both_named"),
        ),
    ],
    ids=["light", "softening"],
)
def test_two_effects_by_other_laws_are_both_named(tmp_path, kind, faults, tied):
    """Before, a law's own error was left as structure, so that both were only what partly explains it.

    tied: owners to which one of them is tied, whose own effects are its only rivals.
    """
    verdict = judged(tmp_path, faults, kind=kind, seed=6)
    assert (verdict.kind, set(verdict.names)) == ("ambiguous" if tied else "named", set(faults))
    rivals = set(verdict.ambiguity) - set(faults) if tied else set()
    assert bool(rivals) == bool(tied)
    assert all(name.endswith(tied) for name in rivals)


def test_two_effects_that_pass_for_slow_noise_one_by_one_are_found_together(tmp_path):
    """Before, the verdict was none: a slow noise as long as the records took it all."""
    faults = {"led_drift": {"share": 0.0425, "time_s": 284.0}, "ambient_light": {"share": 0.0597}}
    verdict = judged(tmp_path, faults, kind="waveguide_bending", seed=5)
    assert (verdict.kind, set(verdict.names)) == ("named", set(faults))


def judged(tmp_path, faults, noise="white", level=0.0015, kind="coupon", seed=5):
    write(tmp_path / "measured", made(Order("single", kind, faults, noise, level, seed)))
    experiments = read_folder(tmp_path / "measured").experiments
    return diagnose(experiments, simulator_of(experiments))


@pytest.mark.nightly("test_two_effects_by_other_laws_are_both_named")
def test_a_stretched_exponential_is_viscoelasticity_and_nothing_beside_it(tmp_path):
    """Before, a lag of the load cell and Mullins' softening made up for what one law missed."""
    hidden = {"share": 0.13, "time_s": 8.0, "beta": 0.5}
    verdict = judged(tmp_path, {"viscoelasticity": hidden}, "uneven", 0.0017)
    assert (verdict.kind, verdict.names) == ("named", ("viscoelasticity",))
    assert "viscoelasticity.spread_share" in verdict.intervals


def test_nothing_is_named_of_readings_in_coarse_steps(tmp_path):
    """Forces in steps of four times their noise: on a ramp rounding is a tone, on a hold an offset."""
    for seed in (5, 6, 7):
        verdict = judged(tmp_path / str(seed), {}, "quantised", 0.004, "lattice_compression", seed)
        assert verdict.kind == "none", (seed, verdict.selection.left)


@attrs.frozen
class Found:
    chi2: float
    names: tuple[str, ...]


def test_what_a_law_s_own_error_would_gain_is_no_second_cause():
    first, taken = Found(1000.0, ("leak",)), 4e5
    little = LAW**2 * taken
    assert of_the_law(first, Found(1000.0 - 0.9 * little, ("leak", "pressure_drift")), taken)
    assert not of_the_law(first, Found(1000.0 - 1.1 * little, ("leak", "pressure_drift")), taken)
