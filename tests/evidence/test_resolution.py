"""Readings as gauges give them: in steps, at uneven times, now and then plainly wrong."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.diagnose.words import sentence
from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.drive import reading_noise
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.readings import (
    between_steps,
    clipped_readings,
    display_steps,
    divided,
    dwell,
    quantum,
    stretch,
    unpredicted_readings,
    without_unpredicted_readings,
    wrong_readings,
)
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence import bench


@given(
    st.sampled_from([1.0, 0.5, 0.2, 0.05, 1e-3]), st.lists(st.integers(-500, 500), min_size=2, max_size=50)
)
def test_the_step_of_readings_is_their_common_measure(step, counts):
    counts = [*counts, 0, 1]
    assert quantum(step * np.array(counts)) == pytest.approx(step)


def test_what_was_not_read_off_a_display_has_no_step():
    rng = np.random.default_rng(0)
    assert quantum(rng.normal(size=100)) == 0.0
    assert quantum(np.full(9, math.pi)) == 0.0


@given(st.floats(1e-4, 10.0), st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_a_converter_s_step_need_not_be_decimal(step, seed):
    """Readings written with eight digits, and as forces over a section."""
    rng = np.random.default_rng(seed)
    levels = np.round(40.0 * np.sin(np.linspace(0.0, 6.0, 240)) + 0.3 * rng.normal(size=240))
    written = np.array([float(f"{v:.8g}") for v in step * levels])
    assert quantum(written) == pytest.approx(step, rel=1e-4)
    assert quantum(written / 37.13) == pytest.approx(step / 37.13, rel=1e-4)


@pytest.mark.parametrize("counts", [(18, 59, 105), (3, 4, 5), (-7, 0, 12, 30)])
def test_records_that_stand_at_one_reading_each_show_the_step_together(counts):
    step = 0.1 * math.pi
    written = np.repeat(np.round(step * np.array(counts), 7), 18)
    assert quantum(written) == pytest.approx(step, rel=1e-5)
    # Of few readings, and of levels that are no multiples, none is seen but that of their digits.
    assert quantum(written[::18]) < 1e-5
    assert quantum(written + np.repeat(np.round(np.sqrt(np.arange(len(counts))), 7), 18)) < 1e-5


def test_a_display_s_step_is_seen_in_all_of_its_records_together():
    """Held, moved and held: seven levels each, of which none alone shows the step, as their zero is off."""
    step = 0.0524 * 4.0003
    records = [
        (0, 5, 10, 25, 46, 62, 84),
        (0, 1, 11, 12, 45, 106, 137),
        (0, 9, 10, 35, 76, 100, 140),
    ]
    t = np.arange(280.0)
    made = []
    for k, levels in enumerate(records):
        angle = (np.repeat(np.array(levels), 40) + 0.37) * step
        columns = {"time_s": t, "angle_deg": t, "voltage_V": np.array([float(f"{v:.8g}") for v in angle])}
        made.append(bench.experiment("waveguide_bending", columns, f"record {k}"))
    assert max(quantum(e["voltage_V"]) for e in made) < 1e-3 * step
    simulator = Composite(bench_simulators(made))
    found = display_steps(made, simulator)["waveguide_bending", "voltage_V"]
    assert found == pytest.approx(step, rel=1e-5)
    assert {s.step for s in record(made, simulator).series} == {found}
    # A reading that goes over by one step stands alone by its digits alone.
    over = made[1]["voltage_V"].copy()
    over[100] += step
    assert wrong_readings(t, over).any()
    assert not wrong_readings(t, over, found).any()


def test_a_part_that_is_held_shows_in_the_run_of_a_reading():
    """Ten quick steps and one reading that stays: most readings lie in a run of 200."""
    read = np.concatenate([np.arange(10.0), np.full(200, 9.0)])
    assert dwell(read) == 1.0
    assert 180.0 < stretch(read) < 201.0
    assert stretch(np.random.default_rng(0).normal(size=50)) == 1.0


def test_a_wrong_reading_of_a_fast_motion_shows_in_what_is_not_predicted():
    """Angles go by 10 degrees a sample, so that by its neighbours alone nothing is wrong."""
    t = np.arange(0.0, 100.0, 0.5)
    angle = 40.0 * np.sin(2.0 * np.pi * t / 8.0)
    volts = 2.0 * np.exp(-0.01 * angle) + 0.003 * np.random.default_rng(0).normal(size=len(t))
    volts[57] += 0.05
    volts[100:102] += 0.08, 0.1
    columns = {"time_s": t, "angle_deg": angle, "voltage_V": volts}
    e = bench.experiment("waveguide_bending", columns, "fast")
    simulator = Composite(bench_simulators([e]))
    assert not wrong_readings(t, volts).any()
    values = {"straight_V": 2.0, "loss_per_deg": 0.01}
    (found,), words = without_unpredicted_readings([e], simulator, values)
    assert np.flatnonzero(np.isnan(found["voltage_V"])).tolist() == [57, 100, 101]
    assert "28.5 s" in words[0]


def test_what_a_late_clock_does_at_every_step_is_no_wrong_reading():
    """A camera that is a frame behind is off for one frame wherever the prediction steps."""
    predicted = np.repeat([0.0, 10.0, 4.0, 12.0], 60)
    read = np.roll(predicted, 1)
    read[0] = 0.0
    read = read + 0.01 * np.random.default_rng(0).normal(size=len(read))
    assert not unpredicted_readings(read, predicted).any()
    read[100] += 1.0
    assert not unpredicted_readings(read, read - 0.0).any()


def test_a_hold_after_a_ramp_is_no_display_that_stands():
    ramp = np.concatenate([np.linspace(0.0, 1.0, 21), np.ones(200)])
    assert dwell(ramp) == 1.0
    assert dwell(np.round(np.linspace(0.0, 5.0, 501))) > 50


def test_a_slow_ramp_read_in_steps_comes_back():
    t = np.linspace(0.0, 100.0, 1001)
    truth = 20.0 * np.sin(2 * np.pi * t / 100.0)
    read = np.round(truth / 0.5) * 0.5
    found = between_steps(t, read)
    assert np.abs(found - truth).max() <= 0.5
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.3 * np.sqrt(np.mean((read - truth) ** 2))


@given(st.integers(1, 6), st.integers(0, 1000))
def test_at_even_times_divided_differences_are_plain_ones(order, seed):
    y = np.random.default_rng(seed).normal(size=40)
    plain = np.abs(np.diff(y, order)) / math.sqrt(math.comb(2 * order, order))
    np.testing.assert_allclose(np.abs(divided(0.2 * np.arange(40), y, order)), plain, rtol=1e-6, atol=1e-9)


def test_missing_rows_are_no_noise():
    """A wave without noise, of which a third of the rows is missing."""
    rng = np.random.default_rng(2)
    t = np.sort(rng.choice(np.arange(600) * 0.1, 400, replace=False))
    wave = 0.1 * np.sin(2 * np.pi * t / 20.0)
    assert reading_noise(t, wave) < 1e-6
    noise = 1e-3 * rng.normal(size=len(t))
    assert reading_noise(t, wave + noise) == pytest.approx(1e-3, rel=0.2)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.integers(5, 118), st.sampled_from([-1.0, 1.0]))
def test_one_wrong_reading_is_found_and_nothing_else(seed, place, sign):
    rng = np.random.default_rng(seed)
    t = np.arange(200) * 0.1
    clean = np.abs(t - 7.03) + np.where(t > 12.34, 5.0, 0.0)
    y = clean + 0.02 * rng.normal(size=200)
    assert not wrong_readings(t, y).any(), "a corner and a step are none"
    y[place] += sign * 30.0
    assert np.flatnonzero(wrong_readings(t, y)).tolist() == [place]


def test_what_happens_often_is_no_accident():
    rng = np.random.default_rng(0)
    y = 0.01 * rng.normal(size=200)
    y[10:190:9] += 5.0
    assert not wrong_readings(np.arange(200.0), y).any()


def verdict(*experiments):
    return diagnose(experiments, Composite(bench_simulators(experiments)))


@pytest.mark.parametrize(("step", "seed"), [(0.5, 0), (1.0, 1), (1.0, 2)])
def test_a_tight_hold_read_in_coarse_steps_is_clean(step, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 400.0, 0.5)
    made = []
    for number, kPa in enumerate((50.0, 30.2)):
        read = np.round((kPa + 0.05 * rng.normal(size=len(t))) / step) * step
        columns = {"time_s": t, "pressure_kPa": read}
        made.append(bench.experiment("pressure_hold", columns, f"hold {number}"))
    assert verdict(*made).kind == "none"


def coupons(rng):
    t = np.arange(0.0, 40.0, 0.1)
    strain = 0.3 * (1 - np.abs((t % 20.0) / 10.0 - 1.0))
    stress = 1000.0 / 3.0 * ((1 + strain) - (1 + strain) ** -2.0) + 0.3 * rng.normal(size=len(t))
    columns = {"time_s": t, "strain": strain, "stress_kPa": stress}
    return [bench.experiment("coupon", columns, f"test {n}", mode="uniaxial") for n in range(2)]


def test_one_wrong_reading_decides_no_verdict_and_is_told():
    first, second = coupons(np.random.default_rng(3))
    stress = np.array(first["stress_kPa"])
    stress[123] += 40.0
    found = verdict(attrs.evolve(first, columns={**first.columns, "stress_kPa": stress}), second)
    assert found.kind == "none"
    (words,) = found.set_aside
    assert "test 0, stress_kPa: 1 of 400 readings" in words
    assert "12.3 s" in words


def test_a_load_cell_at_the_end_of_its_range_decides_no_verdict_and_is_told():
    first, second = coupons(np.random.default_rng(3))
    clipped = np.minimum(first["stress_kPa"], 190.0)
    assert np.count_nonzero(clipped == 190.0) > 40
    made = attrs.evolve(first, columns={**first.columns, "stress_kPa": clipped})
    found = verdict(made, second)
    assert found.kind == "none"
    (words,) = found.set_aside
    assert "test 0, stress_kPa" in words
    assert "end of the channel's range" in words


def test_readings_are_clipped_at_an_end_and_nowhere_else():
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 60.0, 0.1)
    wave = 50.0 + 30.0 * np.sin(t / 5.0)
    noisy = wave + 0.3 * rng.normal(size=len(t))
    high, low = np.minimum(noisy, 70.0), np.maximum(noisy, 25.0)
    assert clipped_readings(t, high)[wave > 70.5].all()
    assert not clipped_readings(t, high)[wave < 68.5].any()
    assert clipped_readings(t, low)[wave < 24.5].all()
    held = np.minimum(wave, 70.0)
    for clean in (noisy, np.round(noisy), held, held + 0.3 * rng.normal(size=len(t)), 0.0 * t + 3.0):
        assert not clipped_readings(t, clean).any()


@pytest.mark.parametrize(("factor", "says"), [(1e-3, "1000 times as large"), (-1.0, "sign is wrong")])
def test_a_mistaken_unit_or_sign_is_asked_about_before_any_cause(factor, says):
    made = [
        attrs.evolve(e, columns={**e.columns, "stress_kPa": factor * e["stress_kPa"]})
        for e in coupons(np.random.default_rng(4))
    ]
    with pytest.raises(InputError, match="which no specimen of this kind has") as error:
        verdict(*made)
    assert says in error.value.remedy
    assert "made.csv, column stress_kPa" in error.value.where


def test_gas_is_no_warmer_than_compressing_it_makes_it():
    t = np.arange(0.0, 100.0, 0.5)
    holds = [bench.experiment("pressure_hold", {"time_s": t, "pressure_kPa": np.full(len(t), 40.0)}, "a")]
    simulator = bench_simulators(holds)["pressure_hold"]
    drift = next(e for e in simulator.effects if e.name == "temperature_drift")
    # 296 K (141.325 / 101.325)^(2/7), by hand.
    assert drift.parameters[0].high == pytest.approx(296.0 * 0.09973 + 5.0, abs=0.1)
    assert drift.parameters[0].low == pytest.approx(-5.0)


def softened(noise, seed=6):
    """One coupon stretched three times, that softens by a law of their own: tanh for the library's erf."""
    rng = np.random.default_rng(seed)
    made, farthest = [], 0.0
    for number, most in enumerate((0.4, 0.4, 0.4)):
        t = np.arange(0.0, 40.0, 0.1)
        strain = most * (1 - np.abs((t % 20.0) / 10.0 - 1.0))
        before = np.maximum.accumulate(np.maximum(strain, farthest))
        farthest = max(farthest, most)
        virgin = 1000.0 / 3.0 * ((1 + strain) - (1 + strain) ** -2.0)
        energy, most_so_far = (1000.0 / 6.0 * ((1 + e) ** 2 + 2 / (1 + e) - 3) for e in (strain, before))
        stress = virgin * (1 - 0.25 * np.tanh((most_so_far - energy) / 40.0)) + noise * rng.normal(
            size=len(t)
        )
        columns = {"time_s": t, "strain": strain, "stress_kPa": stress}
        made.append(bench.experiment("coupon", columns, f"test {number}", mode="uniaxial", specimen="A"))
    return made


@pytest.mark.nightly("tests/evidence/test_laws.py::test_two_effects_by_other_laws_are_both_named")
def test_a_mechanism_by_another_law_is_named_with_what_remains():
    found = verdict(*softened(0.02))
    assert found.names == ("mullins_softening",)
    assert found.selection.left, "the library's law is another, and so little noise shows it"
    assert found.share_taken > 0.99
    written = found.as_json()
    assert written["remaining_structure"]["detected"]
    assert written["remaining_structure"]["size"] == found.gain.fit.after
    assert [cause["share"] for cause in written["causes"]] == [found.share_taken]
    headline, words = sentence(found)
    assert headline == "mainly mullins softening"
    assert "% of the misfit" in words
