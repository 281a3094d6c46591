"""Noise is what readings show of it: no misfit far beyond it is none, whatever else is in the folder."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.evidence.second_code.judging import judged
from benchmarks.evidence.second_code.sets import order
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record, repeats
from mu_addon.evidence.scatter import (
    ACCURACY,
    FEW,
    SCATTERED,
    STATED,
    SURELY,
    TIMES,
    bounded,
    by_repeats,
    excess,
    noise_limit,
    scatter,
    shown_noise,
    stated_noise,
    with_bursts,
    within_accuracy,
    within_scatter,
)
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment

SD = 0.02


def blocks(moduli, rows=120, off=None, seed=0, factor=1.0, sd=SD, specimen=""):
    """Blocks pressed once, each of its modulus in kPa, with what `off` adds; all of it `factor` times."""
    rng, found = np.random.default_rng(seed), []
    t = np.linspace(0.0, 60.0, rows)
    strain = 0.15 * t / 60.0
    for i, modulus in enumerate(moduli):
        stress = modulus * strain + sd * rng.normal(size=rows)
        if off is not None:
            stress = stress + off(t / 60.0)
        found.append(
            experiment(
                "lattice_compression",
                {"time_s": t, "strain": strain, "stress_kPa": factor * stress},
                f"block {i}",
                specimen=specimen or f"S{i}",
                section_mm=(30.0, 30.0),
                length_mm=30.0,
                cells=3,
                axis="z",
            )
        )
    return found


def records(made):
    model = Composite(bench_simulators(made))
    return record(made, model), model


@given(
    rows=st.integers(9, 700),
    many=st.integers(1, 5),
    size=st.floats(-3.0, 4.0),
    times=st.floats(0.0, 6.0),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=60, deadline=None)
def test_no_misfit_beyond_the_stated_factor_is_within_noise(rows, many, size, times, seed):
    """Whatever its size in kPa, the number of readings and of specimens: one series of many suffices.

    The factor: 4, once 1 + 4/sqrt(readings) by intent, and once more as the scatter of few is itself known.
    """
    made, _ = records(blocks([40.0] * many, rows, seed=seed, factor=10.0**size))
    largest = max(float(np.abs(e["stress_kPa"]).max()) for e in made.experiments)
    factor = TIMES * (1.0 + FEW / np.sqrt(rows)) ** 2
    most = max(factor * SD * 10.0**size, ACCURACY * largest)
    left = np.zeros(len(made))
    last = made.series[-1].at
    wave = np.sin(np.linspace(0.0, 2.0 * np.pi, last.stop - last.start, endpoint=False))
    left[last] = 1.01 * 10.0**times * most * np.sqrt(2.0) * wave
    found = excess(made, left)
    assert found is not None
    assert found.times > 1.0
    assert found.where.startswith(f"block {many - 1}")
    # And no noise that is estimated from it is larger than that.
    source = bounded(made, {made.groups[0]: Source(SD, float(np.abs(left).max()), 20.0)})[made.groups[0]]
    assert np.hypot(source.white, source.slow) < 1.01 * most


@pytest.mark.parametrize(
    ("rows", "many", "times"), [(10, 2, 60.0), (30, 1, 10.0), (60, 4, 300.0), (400, 1, 6.0)]
)
def test_a_wrong_model_is_never_trusted_whatever_its_size(rows, many, times):
    """A wave that no law has, `times` the noise: beyond the stated factor."""
    made = blocks([40.0] * many, rows, lambda x: times * SD * np.sqrt(2.0) * np.sin(4.0 * np.pi * x))
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind != "none"


def stating(made, **accuracy):
    return [attrs.evolve(e, accuracy=accuracy) for e in made]


@given(
    rows=st.integers(9, 400),
    many=st.integers(1, 4),
    size=st.floats(-3.0, 4.0),
    times=st.floats(0.0, 6.0),
    stated=st.floats(-2.0, 2.0),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=60, deadline=None)
def test_noise_is_at_most_the_stated_accuracy_or_the_scatter_of_readings(
    rows, many, size, times, stated, seed
):
    factor = 10.0**size
    # Of the load cell, in N: 900 mm2 bear it.
    accuracy = 10.0**stated * SD * factor
    made, _ = records(stating(blocks([40.0] * many, rows, seed=seed, factor=factor), force_N=0.9 * accuracy))
    last = made.series[-1]
    seen = SURELY * scatter(made, last)
    most, by = noise_limit(made, last)
    assert most == pytest.approx(max(accuracy, seen))
    assert by == (STATED if accuracy > seen else SCATTERED)
    left = np.zeros(len(made))
    n = last.at.stop - last.at.start
    left[last.at] = 10.0**times * most * np.sqrt(2.0) * np.sin(np.linspace(0.0, 2.0 * np.pi, n, False))
    assert excess(made, left / 10.0**times / 1.01) is None
    found = excess(made, 1.01 * left)
    assert found is not None
    assert found.by == by
    rough = {made.groups[0]: Source(SD * factor, float(np.abs(left).max()), 20.0)}
    source = within_accuracy(made, rough)[made.groups[0]]
    every = [noise_limit(made, s)[0] for s in made.series]
    assert np.hypot(source.white, source.slow) <= 1.01 * max(every)


@pytest.mark.parametrize("accuracy_kPa", [1e-6, 0.02, 0.3])
@pytest.mark.parametrize("step_kPa", [0.0, 0.1])
def test_a_right_model_stays_right_whatever_accuracy_is_stated(accuracy_kPa, step_kPa):
    """Noise is never below what readings scatter, nor below a display's steps."""
    made = []
    for e in stating(blocks([40.0] * 3, 150), force_N=0.9 * accuracy_kPa):
        stress = e["stress_kPa"]
        read = np.round(stress / step_kPa) * step_kPa if step_kPa else stress
        made.append(attrs.evolve(e, columns={**e.columns, "stress_kPa": read}))
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind == "none"
    (source,) = found.sources.values()
    assert source.white >= max(0.8 * SD, 0.999 * step_kPa / np.sqrt(12.0))


@pytest.mark.parametrize(("accuracy_kPa", "kind"), [(None, "none"), (0.3, "none"), (0.01, "unexplained")])
def test_slow_noise_that_readings_alone_would_allow_is_bounded_by_the_accuracy(accuracy_kPa, kind):
    made = blocks([40.0] * 2, 60, lambda x: 0.05 * np.sin(3.0 * np.pi * x))
    made = stating(made, force_N=0.9 * accuracy_kPa) if accuracy_kPa else made
    assert diagnose(made, Composite(bench_simulators(made))).kind == kind


def test_the_accuracy_of_what_drives_counts_by_the_slope():
    (plain,) = blocks([40.0], 60)
    for accuracy, expected in (
        ({}, np.inf),
        ({"displacement_mm": 0.03}, np.inf),
        ({"force_N": 0.9}, 1.0),
        # 0.03 of 30 mm are a strain of 0.001, and 0.04 kPa.
        ({"force_N": 0.027, "displacement_mm": 0.03}, 0.05),
    ):
        made, _ = records(stating([plain], **accuracy))
        assert stated_noise(made, made.series[0]) == pytest.approx(expected, rel=0.02)


def test_what_repeats_have_in_common_is_no_noise():
    """Three tests of one block, as wrong as a load cell is accurate: slow noise would differ."""
    made = blocks([40.0] * 3, 300, lambda x: 0.03 * np.sin(4.0 * np.pi * x), sd=0.001, specimen="S")
    measured, _ = records(made)
    (first, second, _) = measured.series
    assert repeats(measured, first, second)
    left = measured.values - measured.covariate(lambda e: 40.0 * e["strain"])
    assert shown_noise(measured, first) > 0.011
    assert by_repeats(measured, first, left) < 0.006
    found = excess(measured, left)
    assert found is not None
    assert found.times > 4.0
    # Of readings that wander apart as much, repeats allow it.
    apart = np.concatenate([c * np.sin(np.linspace(0.0, 9.0, 300)) for c in (0.011, -0.011, 0.0)])
    assert excess(measured, apart) is None


def test_another_height_or_drive_is_no_repeat():
    made = blocks([40.0] * 2, 100, specimen="S")
    other = attrs.evolve(made[1], length_mm=37.0)
    slower = attrs.evolve(made[1], columns={**made[1].columns, "strain": 1.2 * made[1]["strain"]})
    for second, expected in ((made[1], True), (other, False), (slower, False)):
        measured, _ = records([made[0], second])
        assert repeats(measured, *measured.series) == expected


def test_noise_of_the_readings_themselves_is_within():
    made, _ = records(blocks([40.0, 40.0]))
    left = made.values - np.concatenate([made.experiments[i]["strain"] * 40.0 for i in (0, 1)])
    assert excess(made, left) is None
    assert within_scatter(made, left)


def test_bursts_and_single_readings_are_noise_of_their_own_blocks():
    made, _ = records(blocks([40.0], 240))
    rng = np.random.default_rng(1)
    left = SD * rng.normal(size=len(made))
    left[100:130] += 20.0 * SD * rng.normal(size=30)
    left[200] += 15.0 * SD
    louder, words = with_bursts(made, left)
    (series,) = louder.series
    assert (series.louder[105:125] > 5.0).all()
    assert series.louder[200] > 5.0
    assert np.median(series.louder) == 1.0
    assert "block 0, stress_kPa" in words[0]
    assert within_scatter(louder, left)
    even, nothing = with_bursts(made, SD * rng.normal(size=len(made)))
    assert not nothing
    assert even is made


def test_readings_between_loud_ones_belong_to_their_burst():
    """A burst of six blocks, of which chance leaves two near the others."""
    made, _ = records(blocks([40.0], 240))
    left = SD * np.random.default_rng(4).normal(size=len(made))
    left[100:106] += SD * np.array([15.0, 3.0, -2.5, 3.0, -3.0, -12.0])
    left[140] += 15.0 * SD
    (series,) = with_bursts(made, left)[0].series
    assert (series.louder[100:106] > 5.0).all()
    assert (series.louder[[98, 99, 106, 107, 139, 141]] < 4.0).all()


def test_a_smooth_error_is_no_burst():
    made, _ = records(blocks([40.0], 240))
    left = SD * np.random.default_rng(2).normal(size=len(made))
    x = np.linspace(0.0, 1.0, len(made))
    same, words = with_bursts(made, left + 50.0 * SD * np.sin(20.0 * x))
    assert same is made
    assert not words


def test_noise_that_grows_with_load_is_a_remark():
    made = blocks([40.0, 40.0, 40.0], 150)
    rng = np.random.default_rng(3)
    grown = [
        attrs.evolve(
            e,
            columns={
                **e.columns,
                "stress_kPa": e["stress_kPa"] + 0.02 * e["stress_kPa"] * rng.normal(size=len(e)),
            },
        )
        for e in made
    ]
    found = diagnose(grown, Composite(bench_simulators(grown)))
    assert found.kind == "none"


def test_what_records_are_off_by_within_their_scatter_is_slow_noise():
    rng, made = np.random.default_rng(0), []
    for off, period in ((1.5, 71.0), (-1.5, 17.0), (0.0, 29.0)):
        t = np.linspace(0.0, 240.0, 120)
        angle = 40.0 + 35.0 * np.sin(2.0 * np.pi * t / period)
        volt = 1.5 * np.exp(-0.009 * angle) + 0.004 * (off + rng.normal(size=120))
        columns = {"time_s": t, "angle_deg": angle, "voltage_V": volt}
        made.append(experiment("waveguide_bending", columns, f"guide {period:g}"))
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind == "none"
    assert "ambient light of experiment guide 71" in found.set_aside[-1]


MISLED = pytest.mark.nightly("test_sets_of_the_second_code_that_had_misled")


@pytest.mark.parametrize(
    ("part", "number", "kind"),
    [
        ("outside", 14, "unexplained"),
        pytest.param("outside", 36, "unexplained", marks=MISLED),
        pytest.param("lab", 39, "unexplained", marks=MISLED),
        ("clean", 75, "none"),
    ],
)
def test_sets_of_the_second_code_that_had_misled(part, number, kind):
    # A room's lamp, of which a zero of one record took a share below the noise; a zero set anew in one block,
    # which was its viscoelasticity; a coarse display at rest, which was a clipped one.
    assert judged(order(part, number, 42261826))["verdict"] == kind
