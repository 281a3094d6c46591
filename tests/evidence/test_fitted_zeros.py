"""Zeros of a load cell that were fitted are told where an error would be seen without them."""

import numpy as np
import pytest

from mu_addon.diagnose.words import sentence, to_do
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment


def judged(zeros_kPa, white=0.15):
    """Pulled strips of a Neo-Hookean resin, each after its load cell was set to zero wrongly."""
    tests = []
    for number, zero in enumerate(zeros_kPa):
        rng = np.random.default_rng(number)
        t = np.arange(0.0, 60.0, 0.3)
        strain = 0.2 * (1.0 - np.abs(t / 30.0 - 1.0))
        stretch = 1.0 + strain
        read = 300.0 * (stretch - stretch**-2) + zero + white * rng.normal(size=len(t))
        columns = {"time_s": t, "strain": strain, "stress_kPa": read}
        more = {"mode": "uniaxial", "specimen": "A", "section_mm": (4.0, 2.0), "length_mm": 33.0}
        tests.append(experiment("coupon", columns, f"test {number + 1}", **more))
    return diagnose(tests, Composite(bench_simulators(tests)))


def test_zeros_that_hide_an_error_are_told():
    found = judged([1.5, -1.2, 0.8, -0.5])
    assert found.kind == "none"
    assert (found.zeros.low, found.zeros.high) == pytest.approx((-1.2, 1.5), abs=0.2)
    assert found.zeros.error_without > 5.0 * found.zeros.error
    assert "zero fitted to each test" in sentence(found)[1]
    assert to_do(found).endswith("set the load cell to zero before each test.")


def test_zeros_within_the_noise_are_not():
    found = judged([0.0] * 4)
    assert found.kind == "none"
    assert found.zeros is None
    assert "zero" not in sentence(found)[1] + to_do(found)
