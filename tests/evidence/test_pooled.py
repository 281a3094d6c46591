"""Specimens and sessions that differ: a spread by restricted likelihood, beside the analysis of variance."""

import attrs
import numpy as np
import pytest

from mu_addon.diagnose.words import sentence
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.extended import extended_model
from mu_addon.evidence.pooled import pooled_effects, sizes_of, spread_of
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.test_instruments import judged
from tests.evidence.test_owned import chambers, strips


def groups(spread, owners=6, each=9, seed=0):
    """Readings with unit noise of owners that differ, and their slopes, the common mean taken out."""
    rng = np.random.default_rng(seed)
    own = np.repeat(np.eye(owners), each, axis=0)
    y = own @ (spread * rng.standard_normal(owners)) + rng.standard_normal(owners * each)
    return own - own.mean(axis=0), y - y.mean(), own, each


@pytest.mark.parametrize("seed", range(4))
def test_the_spread_of_balanced_groups_is_that_of_the_analysis_of_variance(seed):
    """1 + n s^2 is the mean square between groups over that of the noise, 1; s is 0 where it is less."""
    slopes, residual, own, each = groups(0.9 if seed else 0.0, seed=seed)
    means = own.T @ residual / each
    between = each * (means**2).sum() / (len(means) - 1)
    expected = max(between - 1.0, 0.0) / each
    found = spread_of(slopes, residual, 10.0)
    assert found.value**2 == pytest.approx(expected, rel=0.03, abs=1e-6)
    assert found.low95 <= found.value <= found.high95
    # Values are the groups' means, drawn to the common one by the share that noise has of their variance.
    shrunk = means * found.value**2 / (found.value**2 + 1.0 / each)
    np.testing.assert_allclose(found.values, shrunk, atol=1e-9)


def test_no_spread_is_found_of_owners_that_do_not_differ_more_often_than_by_chance():
    gains = [spread_of(*groups(0.0, seed=100 + k)[:2], 10.0).gain for k in range(200)]
    # Half of all have none, and 5 % of the others pass the bound of one degree of freedom.
    assert np.mean(np.array(gains) == 0.0) > 0.35
    assert np.mean(np.array(gains) > 3.84) < 0.06


def test_what_is_printed_differs_by_specimen_and_what_measures_by_session():
    made = chambers([0.0, 0.0, 0.0], again=2)
    made = [attrs.evolve(e, session=str(i // 2)) for i, e in enumerate(made)]
    model = Composite(bench_simulators(made))
    titles = {e.title for e in pooled_effects(model.effects, made)}
    assert "pressure_offset among sessions" in titles
    assert "pressure_offset among experiments" in titles
    # A drift has a course that all share. Experiments differ in what was done, too.
    assert {"pressure_drift among sessions", "leak among specimens"} <= titles
    assert not {"leak among experiments", "pressure_drift among experiments"} & titles
    assert not any(t.startswith("pressure_drift among specimens") for t in titles)
    leak = next(e for e in pooled_effects(model.effects, made) if e.title == "leak among specimens")
    assert [k for k, _ in sizes_of(leak)] == [f"leak.loss_per_s of specimen {x}" for x in "ABC"]
    assert leak.keys[-1] == "leak.inertia"
    # Two that differ are one and another.
    assert not pooled_effects(model.effects, made[:4][::2])


def test_a_spread_of_one_sign_is_that_of_values_above_their_null_alone():
    rng = np.random.default_rng(3)
    sizes = np.abs(rng.standard_normal(60)) * 2.0
    own = np.repeat(np.eye(60), 9, axis=0)
    residual = own @ sizes + rng.standard_normal(len(own))
    found = spread_of(own, residual, 20.0, one_sign=True)
    assert found.low95 < 2.0 < found.high95
    assert (found.values >= 0.0).all()
    other = spread_of(own, -residual, 20.0, one_sign=True)
    assert other.gain < 0.1 * found.gain


def test_moduli_that_all_differ_have_a_spread_and_none_of_them_is_named_alone():
    moduli = np.array([1200.0, 1330.0, 1080.0, 1250.0, 1140.0])
    found = judged(strips(moduli))
    titles = {c.effect.title for c in found.selection.causes}
    titles |= {r for c in found.selection.causes for r in c.rivals}
    assert "batch_variation among specimens" in titles
    (cause,) = found.selection.causes
    value, low, high = cause.effect.spread
    relative = moduli / moduli.mean() - 1.0
    assert low < relative.std(ddof=1) < high
    if cause.effect.name == "batch_variation":
        each = [found.selection.chosen.values[k] for k in cause.effect.keys]
        np.testing.assert_allclose(np.array(each) - np.mean(each), relative, atol=0.01)
    written = found.as_json()["causes"][0]["among"]
    assert written["what"] == "specimen"
    assert written["spread"]["value"] == value
    assert "differs from specimen to specimen" in sentence(found)[1] or found.kind == "ambiguous"
    # A simulation is of any specimen.
    assert not extended_model(found).effects


@pytest.mark.nightly("tests/evidence/test_instruments.py::test_a_camera_s_fault_is_told_from_the_unit_s")
def test_a_camera_that_is_set_up_anew_in_each_session_has_a_zero_of_each():
    zeros, made = (0.0, 1.1, -0.8, 0.5), []
    for k, zero in enumerate(zeros):
        for j, high in enumerate((20.0, 30.0)):
            t, p = analytic.triangle(0.2, 10.0, 2, 0.0, high)
            noise = 0.05 * np.random.default_rng(10 * k + j).standard_normal(len(t))
            read = {"angle_deg": analytic.channels(p)[0] + zero + noise}
            made.append(analytic.experiment(f"{k}{j}", t, p, read, session=f"day {k}"))
    verdict = diagnose(made, Composite({"unit_pressure": UnitPressure([analytic.response()], made)}))
    assert verdict.names == ("angle_offset",)
    cause = verdict.selection.causes[0]
    assert cause.effect.among in ("session", "experiment")
    each = np.array([verdict.selection.chosen.values[k] for k in cause.effect.keys])
    each = each.reshape(len(zeros), -1).mean(axis=1)
    np.testing.assert_allclose(each - each.mean(), np.array(zeros) - np.mean(zeros), atol=0.05)


@pytest.mark.nightly("tests/evidence/test_owned.py::test_the_one_chamber_that_leaks_is_named")
def test_leaks_of_several_chambers_are_each_their_own():
    losses = np.array([4e-3, 1e-3, 0.0, 2e-3, 0.0])
    verdict = judged(chambers(losses))
    assert (verdict.kind, verdict.names) == ("named", ("leak",))
    (cause,) = verdict.selection.causes
    assert cause.effect.among == "specimen"
    keys = [key for key, _ in sizes_of(cause.effect)]
    each = np.array([verdict.selection.chosen.values[k] for k in keys])
    np.testing.assert_allclose(each, losses, rtol=0.05, atol=1e-5)
    # Of the tight ones the interval begins at none.
    assert [verdict.intervals[k][0] > 0.0 for k in keys] == [True, True, False, True, False]


@pytest.mark.nightly("tests/evidence/test_owned.py::test_the_one_chamber_that_leaks_is_named")
def test_a_small_leak_beside_a_large_one_is_no_slow_noise():
    """A gauge's slow noise would be in the tight chambers' records, too."""
    found = judged(chambers([0.0, 1e-3, 0.0, 3e-4]))
    assert (found.kind, found.names) == ("named", ("leak", "leak"))
    owners = [c.effect.whose for c in found.selection.causes]
    assert owners == ["specimen B", "specimen D"]
    value = found.selection.chosen.values["leak.loss_per_s of specimen D"]
    assert value == pytest.approx(3e-4, rel=0.05)
    assert sentence(found)[0] == "leak of specimen B and leak of specimen D"


@pytest.mark.nightly("tests/evidence/test_owned.py::test_the_one_chamber_that_leaks_is_named")
def test_leaks_that_differ_are_not_one_with_valves_shut_late():
    losses = [5e-4, 1e-3, 1.5e-3]
    found = judged(chambers(losses))
    assert (found.kind, found.names) == ("named", ("leak",))
    (cause,) = found.selection.causes
    assert cause.effect.among == "specimen"
    each = [found.selection.chosen.values[key] for key, _ in sizes_of(cause.effect)]
    np.testing.assert_allclose(each, losses, rtol=0.1)
