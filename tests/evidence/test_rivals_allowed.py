"""No cause wins because its rivals were not allowed to: bounds, noise, laws and pairs that excluded them."""

import numpy as np
import pytest

from mu_addon.diagnose.words import advice, sentence, to_do
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.drive import denoised_drives
from mu_addon.evidence.found_causes import RIVAL_DELTA_CHI2, not_distinguished
from mu_addon.evidence.parameter import Parameter
from mu_addon.evidence.prediction import coupon
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import acted, experiment
from tests.evidence.test_coinciding import titles

SECTION, LENGTH = (6.0, 2.0), 40.0
AREA = SECTION[0] * SECTION[1]


def judged(made):
    return diagnose(made, Composite(bench_simulators(made)))


def pulled(name, modulus=1000.0, largest=0.3, rate=0.01, rows=160, noise=4e-3, times=1.0, grips=None, **more):
    """A neo-Hookean coupon pulled and released; grips: displacement in mm that they take at forces in N."""
    half = np.linspace(0.0, largest, rows // 2)
    strain = np.concatenate([half, half[::-1]])
    stretch = 1.0 + strain
    force = AREA * 1e-3 * modulus / 3.0 * (stretch - stretch**-2)
    # The machine's own strain follows from the specimen's: no equation is solved.
    read = strain + (grips(force) / LENGTH if grips else 0.0)
    seed = sum(map(ord, name))
    force = times * (force + noise * force.max() * np.random.default_rng(seed).normal(size=len(force)))
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(read)) + 1e-9)]) / rate
    columns = {"time_s": time, "strain": read, "stress_kPa": 1e3 * force / AREA}
    return experiment("coupon", columns, name, section_mm=SECTION, length_mm=LENGTH, **more)


def test_the_only_fast_test_in_another_unit_is_no_self_heating():
    """lbf under N, 0.2248: heating could be -80 %, a scale of force not, so that heating was named."""
    made = [
        pulled(f"test {i}", specimen="A", rate=0.2 if i == 4 else 0.01, times=0.224809 if i == 4 else 1.0)
        for i in range(5)
    ]
    found = judged(made)
    assert found.kind == "ambiguous"
    assert "force_scale of experiment test 4" in titles(found)
    assert found.names != ("self_heating",)
    assert "the factor of lbf and N" in sentence(found)[1]


def test_a_rigid_coupon_has_no_error(monkeypatch):
    made = [pulled(f"nylon {i}", 1.8e6, 0.015, rate=1e-3, specimen="A") for i in range(3)]
    assert judged(made).kind == "none"
    # Where the bound is below its modulus, the error is the bound's, and no effect explains it.
    low = coupon.MODULUS
    monkeypatch.setattr(coupon, "MODULUS", low.narrowed(low.low, 1e6))
    found = judged(made)
    assert found.kind == "unexplained"
    assert "is at its bound" in sentence(found)[0]


@pytest.mark.parametrize("moduli", [(1050, 1034, 985, 1202, 1174, 1237)])
def test_blocks_of_other_moduli_are_no_change_between_two_tests(moduli):
    """Without a clock what a step left was white noise, and specimens were no rivals of it."""
    rng = np.random.default_rng(3)
    strain = np.linspace(0.0, 0.05, 38)
    made = [
        experiment(
            "lattice_compression",
            {"strain": strain, "stress_kPa": m * strain + rng.normal(0.0, 0.07, 38)},
            f"block {i}",
            specimen=f"S{i}",
            axis="z",
            section_mm=(60.0, 60.0),
            length_mm=60.0,
        )
        for i, m in enumerate(moduli)
    ]
    found = judged(made)
    assert found.kind == "ambiguous"
    assert {"batch_variation among specimens", "strut_thickness among specimens"} <= titles(found)
    # As many names are not a headline.
    assert advice(found)


def test_a_supply_gives_no_more_and_no_faster():
    t = np.array([0.0, 1.0, 2.0, 4.0, 5.0])
    p = np.array([0.0, 10.0, 30.0, 30.0, -30.0])

    def given(values):
        return acted("unit_pressure", p, values, "supply", time_s=t, largest=30.0)

    limited = given({"supply_limit.short_kPa": 6.0})
    np.testing.assert_allclose(limited, [0.0, 10.0, 24.0, 24.0, -24.0])
    slow = given({"supply_rate_limit.slowness_s_kPa": 0.1})
    np.testing.assert_allclose(slow, [0.0, 10.0, 20.0, 30.0, 20.0])
    assert given({"supply_limit.short_kPa": 0.0}) is p


def test_a_supply_that_ends_below_its_command_is_no_softening():
    rng = np.random.default_rng(5)
    made = []
    for name, t, p, more in analytic.protocols(0.25, 4):
        got = analytic.channels(np.minimum(p, 25.0)) + rng.normal(0.0, 0.15, (7, len(t)))
        observed = dict(zip(analytic.CHANNELS[:1], got, strict=False))
        made.append(analytic.experiment(name, t, p, observed, **more))
    found = diagnose(made, analytic.simulator(made))
    assert found.names == ("supply_limit",)
    assert found.selection.chosen.values["supply_limit.short_kPa"] == pytest.approx(15.0, abs=0.5)


def test_grips_that_settle_are_no_curve_of_the_load_cell_alone():
    made = [
        pulled(f"test {i}", 800.0 + 5.0 * i, grips=lambda f: 0.6 * np.tanh(f / 0.5) + 0.02 * f, specimen="A")
        for i in range(4)
    ]
    found = judged(made)
    assert found.kind != "named" or found.names in (("frame_compliance",), ("seating",))
    if found.kind == "ambiguous":
        assert {"frame_compliance", "seating"} & found.ambiguity
    assert "simulation is not at fault" not in to_do(found)


def test_corners_of_a_few_rows_are_no_noise_of_the_drive():
    t = np.arange(15.0)
    strain = 0.05 * np.abs((t / 3.5) % 2 - 1)
    few = experiment("coupon", {"time_s": t, "strain": strain, "stress_kPa": 1e3 * strain}, "few")
    many = np.arange(60.0)
    wave = 0.05 * np.abs(many % 4 - 2)
    fast = experiment("coupon", {"time_s": many, "strain": wave, "stress_kPa": 1e3 * wave}, "fast")
    simulator = Composite(bench_simulators([few, fast]))
    (one, other), again = denoised_drives([few, fast], simulator)
    np.testing.assert_array_equal(one["strain"], strain)
    np.testing.assert_array_equal(other["strain"], wave)
    assert again is None


@pytest.mark.nightly(
    "tests/evidence/test_laws.py::test_two_effects_that_pass_for_slow_noise_one_by_one_are_found_together"
)
def test_two_causes_of_which_one_alternates_by_test_are_both_found():
    """Neither predicts a test left out alone: the search ended at the first."""
    rng = np.random.default_rng(8)
    made = []
    for i, (name, t, p, _) in enumerate(analytic.protocols(0.25, 4)):
        warm = bool(i % 2)
        relaxed, x = np.empty(len(p)), p[0]
        for k, v in enumerate(p):
            x += (1.0 - np.exp(-0.25 / 6.0)) * (v - x) if k else 0.0
            relaxed[k] = 0.86 * v + 0.14 * x
        kelvin = 12.0 if warm else -3.0
        got = analytic.channels(relaxed / (1.0 - 0.007 * kelvin))[:1] + rng.normal(0.0, 0.2, (1, len(t)))
        made.append(analytic.experiment(name, t, p, {"angle_deg": got[0]}, temperature_C=23.0 + kelvin))
    found = diagnose(made, analytic.simulator(made))
    assert {"viscoelasticity", "temperature_drift"} <= found.ambiguity


def test_margins_grow_with_what_no_law_explains():
    assert not_distinguished(980.0, 982) == RIVAL_DELTA_CHI2
    assert not_distinguished(1450.0, 982) > 33.0


def test_a_rival_that_only_its_bound_excludes_keeps_the_verdict_open():
    """Warm tests are softer by an eighth a kelvin, where a resin is believed to lose a twentieth at most."""

    def found(warm_C):
        warm = {2: {"temperature_C": warm_C, "times": 0.75}, 3: {"temperature_C": warm_C, "times": 0.75}}
        return judged([pulled(f"test {i}", specimen="A", **warm.get(i, {})) for i in range(4)])

    near = found(25.0)
    assert near.kind == "ambiguous"
    assert "temperature_drift beyond its bound" in titles(near)
    assert "temperature drift beyond its bound" in " ".join(sentence(near))
    assert "temperature_drift" in near.ambiguity
    # Half of the modulus a kelvin is no resin's at all.
    assert "temperature_drift beyond its bound" not in titles(found(23.5))


@pytest.mark.parametrize(
    ("parameter", "low", "high"),
    [
        (Parameter("kPa", "kPa", -2.0, 4.0, 1.0), -8.0, 12.0),
        (Parameter("time_s", "s", 0.02, 1e3, 1.0), 0.02 / 3.0, 3e3),
        (Parameter("share", "", 0.0, 0.6, 0.0), 0.0, 0.99),
        (Parameter("damping", "", 0.005, 0.999, 0.1), 0.005 / 3.0, 0.999),
        (Parameter("excess", "", -0.9, 9.0, 0.0), -0.99, 27.0),
    ],
)
def test_a_parameter_keeps_its_meaning_beyond_its_bounds(parameter, low, high):
    assert (parameter.farther(parameter.low), parameter.farther(parameter.high)) == pytest.approx((low, high))
