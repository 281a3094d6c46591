"""Calibration: the map comes back, its band holds on sweeps it never saw, and bad input is named."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.sensing.calibration import (
    CalibrationSweep,
    calibrate,
    deriver,
    read_calibration,
    sweeps_of,
    write_calibration,
)


def light(angle: np.ndarray) -> np.ndarray:
    """A waveguide that says little below 15 degrees, as the paper's large unit does."""
    return 2.4 * np.exp(-0.009 * np.log1p(np.exp((angle - 15) / 4)) * 4)


def sweep(
    generator: np.random.Generator,
    start_s: float = 0.0,
    noise: float = 0.01,
    whole: float = 0.0,
    hysteresis: float = 0.0,
    drift_per_h: float = 0.0,
    n: int = 120,
) -> CalibrationSweep:
    phase = np.linspace(0, 2 * np.pi, n)
    angle = 25 * (1 - np.cos(phase))
    slow = np.empty(n)
    slow[0] = generator.normal()
    for k in range(1, n):
        slow[k] = 0.8 * slow[k - 1] + 0.6 * generator.normal()
    time_s = start_s + np.linspace(0, 10, n)
    volts = light(angle) * (1 + drift_per_h * time_s / 3600) * (1 + whole * generator.normal())
    return CalibrationSweep(time_s, angle, volts + noise * slow + hysteresis * np.sin(phase))


def test_an_exact_curve_comes_back() -> None:
    angle = np.linspace(0, 50, 200)
    sweeps = [CalibrationSweep(angle, angle, 2 + 0.03 * angle)] * 2
    found = calibrate(sweeps, "light_V")
    back, low, high, possible = found.angle_of(2 + 0.03 * angle)
    np.testing.assert_allclose(back, angle, atol=1e-6)
    assert possible.all()
    assert (low <= back + 1e-9).all()
    assert (back <= high + 1e-9).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_rising_and_falling(sign: int) -> None:
    generator = np.random.default_rng(0)
    sweeps = [sweep(generator) for _ in range(3)]
    sweeps = [attrs.evolve(s, voltage_V=3 * (sign < 0) + sign * s.voltage_V) for s in sweeps]
    found = calibrate(sweeps, "light_V")
    steps = np.diff(found.coefficients)
    assert (sign * steps <= 1e-12).all()
    middle = np.linspace(25, 45, 20)
    np.testing.assert_allclose(found.angle_of(found.voltage_of(middle))[0], middle, atol=0.1)


BY_NIGHT = pytest.mark.nightly("test_the_band_holds_what_it_promises")


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param({}, marks=BY_NIGHT),
        pytest.param({"whole": 0.01}, marks=BY_NIGHT),
        pytest.param({"hysteresis": 0.02}, marks=BY_NIGHT),
        {"whole": 0.01, "hysteresis": 0.015},
    ],
)
def test_the_band_holds_what_it_promises(wrong: dict[str, float]) -> None:
    """Over many units, 95 % of the readings of a new sweep lie within the band; not many fewer, nor all."""
    shares, widths, given_by_bending = [], [], []
    for seed in range(25):
        generator = np.random.default_rng(seed)
        found = calibrate([sweep(generator, 60 * k, **wrong) for k in range(5)], "light_V")
        new = sweep(generator, 400, **wrong)
        _, low, high, possible = found.angle_of(new.voltage_V)
        shares.append(np.mean((low <= new.angle_deg) & (new.angle_deg <= high)))
        widths.append(found.band_V)
        given_by_bending.append(possible.mean())
    assert np.mean(given_by_bending) > 0.95
    # Sweeps that are off as a whole are in or out as a whole, which 25 of them tell to a few percent.
    error = np.std(shares) / np.sqrt(len(shares))
    assert 0.95 - 3 * error - 0.01 < np.mean(shares) < 0.985
    # The noise alone is 0.01 V.
    assert np.median(widths) < 2.2 * (0.01 + 2.5 * wrong.get("whole", 0) + wrong.get("hysteresis", 0))


def test_two_sweeps_apart_as_a_whole_have_the_band_of_one_degree_of_freedom() -> None:
    angle = np.linspace(0, 50, 200)
    apart = 0.002
    found = calibrate(
        [CalibrationSweep(angle, angle, 2 + 0.03 * angle + off) for off in (0.0, apart)], "light_V"
    )
    # Student's t of one degree of freedom at 97.5 %.
    assert found.band_V == pytest.approx(12.7062 * apart, rel=1e-4)
    assert found.insensitive_deg == [], "the interval of 1.7 degrees is less than a fifth of 50"


def test_hysteresis_without_noise_has_no_wider_band_than_with_noise() -> None:
    """Of one smooth wave a sweep, two sweeps tell its size as three or four readings would."""
    generator = np.random.default_rng(6)
    found = calibrate([sweep(generator, 60 * k, noise=0.0, hysteresis=0.02) for k in range(2)], "light_V")
    assert 2.5 < found.band_V / (0.02 / np.sqrt(2)) < 3.5


def test_where_the_sensor_says_nothing_the_interval_is_wide() -> None:
    generator = np.random.default_rng(1)
    found = calibrate([sweep(generator) for _ in range(4)], "light_V")
    _, low, high, _ = found.angle_of(light(np.array([3.0, 40.0])))
    assert high[0] - low[0] > 3 * (high[1] - low[1])
    assert found.insensitive_deg == pytest.approx([0.0, 16.0], abs=4.0)
    assert low[0] <= 3.0 <= high[0]


def test_a_drift_is_seen_and_taken_out() -> None:
    generator = np.random.default_rng(2)
    sweeps = [sweep(generator, 600 * k, drift_per_h=-0.2) for k in range(6)]
    found = calibrate(sweeps, "light_V")
    # The map is that of the middle, 1500 s on, where the light has lost a twelfth.
    assert found.drift_per_h == pytest.approx(-0.2 / (1 - 0.2 * 1505 / 3600), abs=0.02)
    steady = calibrate([sweep(generator, 600 * k) for k in range(6)], "light_V")
    assert steady.drift_per_h == 0
    assert found.band_V < 1.5 * steady.band_V


def test_zeroing_follows_a_weaker_light() -> None:
    generator = np.random.default_rng(3)
    found = calibrate([sweep(generator) for _ in range(4)], "light_V")
    new = sweep(generator)
    weak = found.zeroed(0.8 * float(light(np.zeros(1))[0]))
    assert weak.gain == pytest.approx(0.8, abs=0.01)
    back, *_ = weak.angle_of(0.8 * new.voltage_V)
    bent = new.angle_deg > 30
    assert np.abs(back - new.angle_deg)[bent].max() < 3
    with pytest.raises(InputError, match="where the calibration has"):
        found.zeroed(0.0)


def test_voltages_that_no_bending_gives() -> None:
    found = calibrate([sweep(np.random.default_rng(4)) for _ in range(3)], "light_V")
    *_, possible = found.angle_of(np.array([light(np.array([40.0]))[0], 3.2, 0.1]))
    assert possible.tolist() == [True, False, False]


def test_one_record_is_cut_into_sweeps() -> None:
    t = np.linspace(0, 40, 2000)
    angle = 20 - 20 * np.cos(2 * np.pi * t / 10) + 0.3 * np.random.default_rng(0).normal(size=2000)
    found = sweeps_of(t, angle, angle)
    assert [len(s.time_s) for s in found] == pytest.approx([500] * 4, abs=20)
    assert sum(len(s.time_s) for s in found) == 2000
    with pytest.raises(InputError, match="1 sweep"):
        sweeps_of(t[:500], angle[:500], angle[:500])
    with pytest.raises(InputError, match="1 sweep"):
        sweeps_of(t, np.zeros(2000), angle)


def test_too_little_or_nothing_to_see_is_refused() -> None:
    generator = np.random.default_rng(5)
    with pytest.raises(InputError, match="1 sweep"):
        calibrate([sweep(generator)], "light_V")
    with pytest.raises(InputError, match="scatters"):
        calibrate(
            [attrs.evolve(sweep(generator), voltage_V=generator.normal(size=120)) for _ in range(3)], "x"
        )
    with pytest.raises(InputError, match="sweep 2 has"):
        calibrate([sweep(generator), sweep(generator, n=4)], "light_V")


@given(st.floats(0.1, 10))
@settings(max_examples=20)
def test_volts_in_other_units_give_the_same_angles(scale: float) -> None:
    sweeps = [sweep(np.random.default_rng(k)) for k in range(3)]
    other = [attrs.evolve(s, voltage_V=scale * s.voltage_V) for s in sweeps]
    a, b = calibrate(sweeps, "x"), calibrate(other, "x")
    volts = light(np.array([25.0, 35.0, 45.0]))
    np.testing.assert_allclose(a.angle_of(volts)[0], b.angle_of(scale * volts)[0], atol=1e-3)


def test_there_and_back_through_a_file(tmp_path: Path) -> None:
    found = calibrate([sweep(np.random.default_rng(k)) for k in range(3)], 'light "A"_V', "dark_V")
    path = tmp_path / "calibration.toml"
    write_calibration(path, found, "unit mu-1.0x")
    again = read_calibration(path)
    np.testing.assert_array_equal(again.coefficients, found.coefficients)
    assert (again.channel, again.dark, again.band_V) == (found.channel, found.dark, found.band_V)
    columns = ('light "A"_V', "dark_V")
    names, table = deriver(again)(columns, np.column_stack([light(np.full(3, 40.0)) + 0.1, np.full(3, 0.1)]))
    assert names[0] == "angle_deg"
    assert table[:, 0] == pytest.approx(40, abs=1)
    with pytest.raises(InputError, match="no channel dark_V"):
        deriver(again)(columns[:1], np.zeros((3, 1)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("version = 1", "version = 9", "version 9"),
        ("channel", "chanel", "channel"),
        ("coefficients_V = [", "coefficients_V = [9.0, -9.0, ", "monotonic"),
        ("band_V = ", "band_V = x", "not TOML"),
        ("gain = 1.0", "gain = -1.0", "numbers are inconsistent"),
    ],
)
def test_a_damaged_file_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "calibration.toml"
    write_calibration(path, calibrate([sweep(np.random.default_rng(k)) for k in range(2)], "light_V"))
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        read_calibration(path)


def test_angles_held_say_nothing_of_those_between():
    """Four angles, held: a spline with more freedom would go in steps that no left-out sweep can see."""
    random = np.random.default_rng(1)
    angle = np.repeat([0.0, 15.0, 30.0, 45.0, 30.0, 15.0, 0.0], 40)
    sweeps = [
        CalibrationSweep(np.arange(280) / 40 + 10 * k, angle, volts(angle) + 0.002 * random.normal(size=280))
        for k in range(2)
    ]
    found = calibrate(sweeps, "light_V")
    between = np.linspace(0.0, 45.0, 91)
    asked, low, high, _ = found.angle_of(volts(between))
    assert np.abs(asked - between).max() < 0.5
    assert (high - low).max() < 3.0


def volts(angle_deg):
    return 2.0 * np.exp(-0.01 * angle_deg)
