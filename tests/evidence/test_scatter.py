"""Noise is what readings show of it: no misfit far beyond it is none, whatever else is in the folder."""

import attrs
import numpy as np
import pytest

from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record
from mu_addon.evidence.scatter import ACCURACY, TIMES, bounded, excess, with_bursts, within_scatter
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.verdict import diagnose
from tests.evidence.bench import experiment

SD = 0.02


def blocks(moduli, rows=120, off=None, seed=0):
    """Blocks pressed once, each of its modulus in kPa, with what `off` adds."""
    rng, found = np.random.default_rng(seed), []
    t = np.linspace(0.0, 60.0, rows)
    strain = 0.15 * t / 60.0
    for i, modulus in enumerate(moduli):
        stress = modulus * strain + SD * rng.normal(size=rows)
        if off is not None:
            stress = stress + off(t / 60.0)
        found.append(
            experiment(
                "lattice_compression",
                {"time_s": t, "strain": strain, "stress_kPa": stress},
                f"block {i}",
                specimen=f"S{i}",
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


@pytest.mark.parametrize("rows", [40, 600])
@pytest.mark.parametrize("many", [1, 5])
@pytest.mark.parametrize("times", [3.0, 30.0, 3000.0])
def test_no_misfit_beyond_what_readings_allow_is_within_noise(rows, many, times):
    made, _ = records(blocks([40.0] * many, rows))
    most = max(TIMES * SD, ACCURACY * 6.0)
    left = np.zeros(len(made))
    last = made.series[-1].at
    # One series of many, as smooth as a model's error is.
    left[last] = times * most * np.sqrt(2.0) * np.sin(np.linspace(0.0, 6.283, last.stop - last.start))
    found = excess(made, left)
    assert found is not None
    assert found.times == pytest.approx(times, rel=0.5)
    assert found.where.startswith(f"block {many - 1}")
    # And no noise that is estimated from it is larger than that.
    source = bounded(made, {made.groups[0]: Source(SD, float(np.abs(left).max()), 20.0)})[made.groups[0]]
    assert np.hypot(source.white, source.slow) < 1.5 * most


def test_noise_of_the_readings_themselves_is_within():
    made, _ = records(blocks([40.0, 40.0]))
    left = made.values - np.concatenate([made.experiments[i]["strain"] * 40.0 for i in (0, 1)])
    assert excess(made, left) is None
    assert within_scatter(made, left)


@pytest.mark.parametrize(
    ("moduli", "off"),
    [
        ([120.0, 118.0, 38.0, 36.0], None),
        ([40.0], lambda x: 1.2 * np.sin(6.0 * x)),
        ([40.0, 40.0], lambda x: 0.6 * x * (1.0 - x)),
    ],
)
def test_a_gross_misfit_is_never_none(moduli, off):
    """Thick and thin struts that the model has alike; curves that no law of it has."""
    made = blocks(moduli, 60, off)
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind != "none"


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
