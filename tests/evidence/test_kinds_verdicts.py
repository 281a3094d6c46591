"""Steps, poses and blocked forces judged: what a bench hides is found, and nothing where it hides none."""

import numpy as np
import pytest
from scipy.linalg import expm

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.blocked_force import BlockedForce
from mu_addon.evidence.prediction.pressure_step import PressureStep
from mu_addon.evidence.prediction.unit_pose import STATIONS, UnitPose
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic, bench
from tests.evidence.test_prediction_kinds import forces, held_response

FINER = 16


def angle(p):
    return analytic.channels(p)[0]


def transient(name, t, p, hertz=0.0, damping=0.1, lag_s=0.0, relaxing=0.0, noise=0.05, seed=1):
    """A step as a bench has it: line, relaxation and inertia one after another, by small steps."""
    fine = np.linspace(t[0], t[-1], FINER * (len(t) - 1) + 1)
    h, gauge = fine[1] - fine[0], np.interp(fine, t, p)
    chamber, slow, x, v = gauge[0], gauge[0], float(angle(gauge[:1])[0]), 0.0
    grid = np.linspace(-12.0, 42.0, 400)
    known, found = angle(grid), []
    w, target = 2.0 * np.pi * hertz, x
    onward = expm(h * np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]))
    tau = 0.8 / (1.0 - relaxing)
    for before, g in zip([gauge[0], *gauge], gauge, strict=False):
        was = chamber
        # By the midpoint: one-sided steps would be a clock that is off.
        chamber = g if not lag_s else was + h * (0.5 * (before + g) - was) / (lag_s + 0.5 * h)
        slow += h * (0.5 * (was + chamber) - slow) / (tau + 0.5 * h)
        still = float(np.interp((1.0 - relaxing) * chamber + relaxing * slow, grid, known))
        if hertz:
            # The oscillator's own solution over the step, toward the middle of what it is driven to.
            x, v = onward @ (x - 0.5 * (target + still), v) + (0.5 * (target + still), 0.0)
        else:
            x = still
        target = still
        found.append(x)
    random = np.random.default_rng(seed)
    read = np.array(found)[::FINER] + noise * random.normal(size=len(t))
    return bench.experiment("pressure_step", {"time_s": t, "pressure_kPa": p, "angle_deg": read}, name)


def steps(**hidden):
    made = []
    for seed, (name, high) in enumerate((("to 15", 15.0), ("to 30", 30.0), ("to 22", 22.0))):
        t = np.arange(0.0, 6.0, 0.02)
        p = np.interp(t, [0.0, 1.0, 1.04, 3.5, 3.54, 6.0], [0.0, 0.0, high, high, 2.0, 2.0])
        made.append(transient(name, t, p, seed=seed, **hidden))
    return made


def judged(kind, simulator, experiments):
    return diagnose(experiments, Composite({kind: simulator}))


def of_steps(**hidden):
    made = steps(**hidden)
    return judged("pressure_step", PressureStep([analytic.response()], made), made)


def test_nothing_is_named_of_clean_steps():
    verdict = of_steps()
    assert verdict.kind in ("none", "unidentifiable")
    assert not verdict.names


STEPS_BY_NIGHT = pytest.mark.nightly("test_inertia_line_and_resin_are_told_apart_by_steps")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "name"),
    [
        ({"hertz": 3.0, "damping": 0.12}, "inertia"),
        pytest.param({"lag_s": 0.25}, "line_lag", marks=STEPS_BY_NIGHT),
        pytest.param({"relaxing": 0.3}, "viscoelasticity", marks=STEPS_BY_NIGHT),
    ],
)
def test_inertia_line_and_resin_are_told_apart_by_steps(hidden, name):
    verdict = of_steps(**hidden)
    assert verdict.names == (name,)
    assert not verdict.selection.causes[0].rivals
    if name == "inertia":
        low, high = verdict.intervals["inertia.period_s"]
        # What the bench's own small steps leave is of the interval's size, a ten thousandth.
        assert 0.5 * (low + high) == pytest.approx(1.0 / 3.0, rel=2e-4)


def poses(density, noise=0.1, first=0):
    made = []
    for seed, p in enumerate((5.0, 15.0, 25.0), first):
        rows = np.arange(0.0, 360.0, 20.0)
        # One run of the written unit for each pose, none of those that the judge has.
        exact = [analytic.channels(np.array([p]), {"gravity": density}, 1.0, a + 0.4)[0, 0] for a in rows]
        read = np.array(exact) + noise * np.random.default_rng(seed).normal(size=len(rows))
        columns = {"pressure_kPa": 0.0 * rows + p, "orientation_deg": rows, "angle_deg": read}
        made.append(bench.experiment("unit_pose", columns, f"{p:g} kPa"))
    return made


def of_poses(made):
    return judged("unit_pose", UnitPose([analytic.response(orientation_deg=s) for s in STATIONS], made), made)


def test_nothing_is_named_of_a_unit_without_weight():
    assert of_poses(poses(0.0)).names == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    "sets",
    [
        3,
        pytest.param(
            10,
            marks=pytest.mark.nightly(
                "test_weight_is_found_by_turning_the_unit_with_an_interval_as_wide_as_its_error"
            ),
        ),
    ],
)
def test_weight_is_found_by_turning_the_unit_with_an_interval_as_wide_as_its_error(sets):
    """Errors over the intervals' standard deviations are about normal, without a bias."""
    density, errors = 1100.0, []
    for first in range(0, 100 * sets, 100):
        verdict = of_poses(poses(density, first=first))
        assert verdict.names == ("gravity",)
        low, high = verdict.intervals["gravity.density_kg_m3"]
        errors.append((0.5 * (low + high) - density) / ((high - low) / 3.92))
    assert np.abs(errors).max() < 3.5
    assert abs(np.mean(errors)) < 3.0 / np.sqrt(sets)
    if sets > 4:
        assert 0.4 < np.std(errors) < 1.8


def presses(gap=0.0, lag_s=0.0, noise=0.004):
    made = []
    for seed, (name, most, period) in enumerate(
        (("slow", 30.0, 20.0), ("fast", 25.0, 4.0), ("again", 20.0, 8.0))
    ):
        t = np.arange(0.0, 2.0 * period, period / 150.0)
        p = most * np.sin(np.pi * t / period) ** 2
        chamber = p
        if lag_s:
            fine = np.linspace(0.0, t[-1], FINER * len(t))
            x, past = 0.0, []
            for g in np.interp(fine, t, p):
                x += (fine[1] - fine[0]) * (g - x) / lag_s
                past.append(x)
            chamber = np.interp(t, fine, past)
        read = np.maximum(forces(chamber, {"seating": gap})[0], 0.0)
        read += noise * np.random.default_rng(seed).normal(size=len(t))
        columns = {"time_s": t, "pressure_kPa": p, "force_N": read}
        made.append(bench.experiment("blocked_force", columns, name))
    return made


def of_presses(**hidden):
    made = presses(**hidden)
    return judged("blocked_force", BlockedForce([held_response(discrepancy=0.04)], made), made)


@pytest.mark.slow
def test_nothing_is_named_of_a_clean_blocked_force():
    assert of_presses().names == ()


@pytest.mark.slow
def test_a_line_that_lags_is_found_by_the_blocked_force():
    assert of_presses(lag_s=0.3).names == ("line_lag",)


@pytest.mark.nightly("test_a_line_that_lags_is_found_by_the_blocked_force")
def test_a_cell_that_stands_off_is_among_what_looks_like_it():
    """A gap takes the force of a pressure away, and so does a gauge's zero: the set must have both."""
    verdict = of_presses(gap=0.8)
    cause = verdict.selection.causes[0]
    assert {"seating", "pressure_offset"} <= {cause.effect.name, *cause.rivals}
    assert verdict.kind == "ambiguous"
