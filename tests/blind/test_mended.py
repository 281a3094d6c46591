"""Data by closed forms of their own on which a verdict was wrong, or said less than it should."""

import attrs
import numpy as np
import pytest

from mu_addon.diagnose.words import sentence
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import experiment


def judged(made):
    return diagnose(made, Composite(bench_simulators(made)))


def blocks(factors, stress=lambda e: 400.0 * e, clock=True, noise=0.05):
    """Blocks, each of its own specimen, pressed and released; factors: of the stress of each."""
    rng, found = np.random.default_rng(0), []
    strain = 0.12 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 120)))
    for i, factor in enumerate(factors):
        columns = {"strain": strain, "stress_kPa": factor * stress(strain) + noise * rng.normal(size=120)}
        columns |= {"time_s": np.linspace(0.0, 80.0, 120)} if clock else {}
        found.append(experiment("lattice_compression", columns, f"block {i + 1}", specimen=f"B{i + 1}"))
    return found


def test_a_dip_that_every_block_repeats_is_no_lone_reading_and_no_burst_of_noise():
    """Struts snap at one strain, in four readings a pass: the verdict was none."""

    def snapping(e):
        return 400.0 * e - 4.8 * np.exp(-(((e - 0.07) / 0.004) ** 2))

    assert judged(blocks([1.0] * 4, snapping)).kind == "unexplained"
    assert judged(blocks([1.0] * 4)).kind == "none"


def test_specimens_stay_rivals_of_a_change_between_tests_under_quieter_noise():
    """Each block is another specimen: that the last three are softer was a named change between tests."""
    found = judged(blocks([1.0] * 3 + [0.88] * 3, clock=False, noise=0.02))
    (cause,) = found.selection.causes
    titles = {cause.effect.title, *cause.rivals}
    assert found.kind == "ambiguous"
    assert {"step_change of tests from block 4 on", "batch_variation among specimens"} <= titles


def test_a_fast_test_in_pounds_is_said_to_be_one_and_not_first_of_all_self_heating():
    rng, made = np.random.default_rng(1), []
    for i, lasts in enumerate((40.0, 320.0, 2.4, 40.0)):
        strain = 0.4 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 150)))
        stretch = 1.0 + strain
        stress = 300.0 * (stretch - stretch**-2) * (0.224809 if i == 2 else 1.0) + 0.2 * rng.normal(size=150)
        columns = {"time_s": np.linspace(0.0, lasts, 150), "strain": strain, "stress_kPa": stress}
        made.append(experiment("coupon", columns, f"test {i + 1}", mode="uniaxial", specimen="A"))
    found = judged(made)
    assert found.selection.causes[0].effect.title == "force_scale of experiment test 3"
    assert "the factor of lbf and N" in sentence(found)[1]


def test_a_unit_that_softens_by_another_law_is_softened_and_nothing_beside_it():
    """By the way below the largest pressure: resin that relaxes from 500 s on had made up for it."""
    rng, made, before = np.random.default_rng(2), [], 0.0
    for i, most in enumerate((15.0, 30.0, 30.0)):
        t = np.linspace(0.0, 60.0, 240)
        p = most * np.abs(np.sin(2.0 * np.pi * t / 60.0))
        peak = np.maximum(np.maximum.accumulate(p), before)
        before = float(peak[-1])
        softer = p / (1.0 - 0.3 * (1.0 - np.exp(-(peak - p) / (0.5 * peak + 1e-9))))
        angle = analytic.channels(softer)[0] + 0.05 * rng.normal(size=240)
        made.append(analytic.experiment(f"run {i}", t, p, {"angle_deg": angle}, specimen="A"))
    found = diagnose(made, analytic.simulator(made))
    assert (found.kind, found.names) == ("named", ("mullins_softening",))
    assert found.selection.chosen.values["mullins_softening.lost"] == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(
    "settled", [np.tanh, lambda x: 1.25 - 1.25 * (1.0 + 0.5 * x) ** -1.5, lambda x: 1.0 - np.exp(-x)]
)
def test_grips_that_settle_on_linear_blocks_are_at_least_a_rival_of_stiffening(settled):
    """In proportion a frame is another modulus: the law that settles was not tried, and stiffening named."""
    made = blocks([1.0] * 4, lambda e: 45.0 * e, noise=0.02)
    for i, e in enumerate(made):
        read = e["strain"] + 0.4 * settled(np.abs(e["stress_kPa"]) / 2.0) / 32.0
        how = {"length_mm": 32.0, "section_mm": (32.0, 32.0), "specimen": "A"}
        made[i] = attrs.evolve(e, columns={**e.columns, "strain": read}, **how)
    found = judged(made)
    assert "frame_compliance" in found.ambiguity
    assert "strain_stiffening" not in found.names
