"""Faults of gauges, load cells and cameras are rivals of physics: made by other formulas, then judged."""

import math

import attrs
import numpy as np
import pytest

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.coupon import CouponStress
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import experiment, read_by_camera

CLOCK = np.arange(0.0, 400.0, 1.0)


def noise(rng, white, n):
    """White noise, and as much that wanders within ten samples."""
    slow = np.zeros(n)
    for i in range(1, n):
        slow[i] = 0.9 * slow[i - 1] + math.sqrt(1.0 - 0.81) * rng.normal()
    return white * (rng.normal(size=n) + slow)


def holds(fault, pressures=(300.0, 30.0), white=0.03, seed=0):
    """Tight, rigid chambers at constant temperature, as a gauge with a fault reads them."""
    rng = np.random.default_rng(seed)
    return [
        experiment(
            "pressure_hold",
            {"time_s": CLOCK, "pressure_kPa": p + fault(CLOCK) + noise(rng, white, len(CLOCK))},
            f"{p:g} kPa",
        )
        for p in pressures
    ]


def judged(experiments):
    return diagnose(experiments, Composite(bench_simulators(experiments)))


LAWS = {
    "linear": lambda t: -0.003 * t,
    "logarithmic": lambda t: -0.5 * np.log(1.0 + t / 20.0),
    "settling": lambda t: 1.0 * (1.0 - np.exp(-t / 60.0)),
    "by the root of time": lambda t: -0.05 * np.sqrt(t),
}


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(
            law,
            marks=()
            if law in ("linear", "settling")
            else pytest.mark.nightly("test_a_gauge_that_drifts_is_told_by_holds_at_two_pressures"),
        )
        for law in LAWS
    ],
)
def test_a_gauge_that_drifts_is_told_by_holds_at_two_pressures(law):
    """What gas does goes with the pressure, so that at a tenth of it the drift could not be the same."""
    found = judged(holds(LAWS[law]))
    assert (found.kind, found.names) == ("named", ("pressure_drift",))


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(
            law,
            marks=()
            if law in ("logarithmic",)
            else pytest.mark.nightly("test_a_gauge_that_drifts_is_at_least_a_rival_where_pressures_are_near"),
        )
        for law in LAWS
    ],
)
def test_a_gauge_that_drifts_is_at_least_a_rival_where_pressures_are_near(law):
    found = judged(holds(LAWS[law], pressures=(52.0, 48.0)))
    assert found.kind in ("named", "ambiguous")
    assert "pressure_drift" in found.ambiguity


@pytest.mark.parametrize(
    "seeds",
    [range(1), pytest.param(range(1, 4), marks=pytest.mark.nightly("test_gauges_without_drift_have_none"))],
)
def test_gauges_without_drift_have_none(seeds):
    for seed in seeds:
        assert judged(holds(lambda t: 0.0 * t, seed=seed)).kind == "none"


@pytest.mark.nightly("test_a_gauge_that_drifts_is_told_by_holds_at_two_pressures")
def test_a_leak_is_no_drift_of_the_gauge():
    """Laminar: dp/dt = -k ((p + P0)^2 - P0^2)/(2 P0), stepped through."""

    def leaking(p):
        found = [p]
        for _ in range(len(CLOCK) * 100 - 100):
            p -= 0.01 * 2e-5 * p * (p + 202.65) / 202.65
            found.append(p)
        return np.array(found)[::100]

    rng = np.random.default_rng(5)
    made = [
        attrs.evolve(
            e, columns=e.columns | {"pressure_kPa": leaking(p) + noise(rng, 0.03, len(CLOCK))}, sha256=e.name
        )
        for p, e in zip((300.0, 30.0), holds(lambda t: 0.0 * t), strict=True)
    ]
    found = judged(made)
    assert "leak" in found.ambiguity
    assert "pressure_drift" not in found.ambiguity


CREEP = pytest.mark.nightly("test_creep_is_at_least_a_rival_of_a_drift")


@pytest.mark.parametrize(
    "course",
    [np.sqrt(CLOCK / 20.0), pytest.param(np.log(1.0 + CLOCK / 20.0), marks=CREEP)],
    ids=["root", "log"],
)
def test_creep_is_at_least_a_rival_of_a_drift(course):
    """Gas of a constant amount in a chamber that grows in time."""
    grown = 1.0 + 3e-3 * course
    parts = [
        holds(lambda t, p=p: (p + 101.325) * (1.0 / grown - 1.0), (p,), seed=seed)
        for p, seed in ((52.0, 0), (48.0, 9))
    ]
    found = judged([e for part in parts for e in part])
    assert found.names != ("pressure_drift",) or found.kind == "ambiguous"


def test_the_fit_of_large_creep_by_a_power_of_time_ends_at_it():
    """From a small size alone it ended in another minimum, and a cooling of the gas was named."""
    t, rng = np.linspace(0.0, 322.5, 300), np.random.default_rng(1)
    made = []
    for number, level in enumerate((65.0, 308.0, 166.0)):
        grown = 1.0 + 0.17e-3 * level * (np.maximum(t - 2.0, 0.0) / 100.0) ** 0.23
        p = (level + 101.325) / grown - 101.325 + rng.normal(0.0, 0.33, len(t))
        made.append(experiment("pressure_hold", {"time_s": t, "pressure_kPa": p}, f"hold {number}"))
    simulator = Composite(bench_simulators(made))
    measured = record(made, simulator)
    fitter = Fitter(measured, simulator, {g: Source(0.33, 2.75, 322.5) for g in measured.groups})
    base = fitter.fit()
    (law,) = (e for e in simulator.refinements if e.name == "viscoelasticity")
    found = fitter.best([law], [{**base.values, **start} for start in law.starts()])
    assert found.chi2 < 1.2 * len(measured)
    assert found.values[law.keys[1]] == pytest.approx(0.23, abs=0.03)


NIGHTLY = pytest.mark.nightly("test_creep_is_at_least_a_rival_of_a_drift")


@pytest.mark.parametrize(
    "course",
    [
        pytest.param(lambda since: (1.0 + since / 2.0) ** -0.05, marks=NIGHTLY),
        pytest.param(lambda since: 1.0 - 0.04 * np.log(1.0 + since / 2.0), marks=NIGHTLY),
        pytest.param(
            lambda since: 1.0 - 0.06 * (1 - np.exp(-since / 5.0)) - 0.08 * (1 - np.exp(-since / 80.0)),
            marks=NIGHTLY,
        ),
    ],
    ids=["a power of time", "its logarithm", "two times"],
)
def test_stress_that_relaxes_by_another_law_is_no_drift_of_the_load_cell(course):
    """One ramp and one hold, as in a test of relaxation."""
    t = np.concatenate([np.linspace(0.0, 2.0, 21)[:-1], np.arange(2.0, 400.0, 1.0)])
    strain = np.minimum(t / 2.0, 1.0) * 0.3
    stretch = 1.0 + strain
    rng = np.random.default_rng(3)
    made = []
    for i in range(2):
        elastic = 400.0 * (stretch - stretch**-2.0)
        stress = elastic * course(np.maximum(t - 1.0, 0.0)) + noise(rng, 0.2, len(t))
        columns = {"time_s": t, "strain": strain, "stress_kPa": stress}
        how = {"section_mm": (10.0, 4.0), "length_mm": 30.0, "mode": "uniaxial"}
        made.append(experiment("coupon", columns, f"relaxation {i}", specimen="AB"[i], **how))
    found = judged(made)
    assert not (found.kind == "named" and "force_drift" in found.names)


def coupons(fault, seed=0):
    """Neo-Hookean strips, loaded and held at two rates; the load cell's fault comes on top, in N."""
    rng = np.random.default_rng(seed)
    found = []
    for i, (lasts, high, section) in enumerate(
        (
            (200.0, 0.5, (10.0, 4.0)),
            (50.0, 0.5, (10.0, 4.0)),
            (200.0, 0.3, (6.0, 2.0)),
            (50.0, 0.3, (6.0, 2.0)),
        )
    ):
        t = np.arange(0.0, lasts, lasts / 400.0)
        strain = np.interp(t / lasts, [0.0, 0.1, 0.4, 0.5, 0.9, 1.0], [0.0, high, high, 0.0, 0.2, 0.0])
        stretch = 1.0 + strain
        area = math.prod(section)
        force = 1e-3 * area * 400.0 * (stretch - stretch**-2.0)
        force = fault(t, force) + 1e-3 * area * noise(rng, 0.2, len(t))
        columns = {"time_s": t, "strain": strain, "stress_kPa": 1e3 * force / area}
        how = {"section_mm": section, "length_mm": 30.0, "mode": "uniaxial", "specimen": "A"}
        found.append(experiment("coupon", columns, f"test {i}", **how))
    return found


def filtered(t, force, time_s=0.4):
    """A first-order filter, stepped through a hundred times a sample."""
    fine = np.linspace(t[0], t[-1], 100 * (len(t) - 1) + 1)
    drive, out, h = np.interp(fine, t, force), [force[0]], (fine[1] - fine[0]) / time_s
    for v in drive[1:]:
        out.append(out[-1] + h * (v - out[-1]))
    return np.array(out)[::100]


ANOTHER_FAULT = pytest.mark.nightly("test_a_load_cell_s_fault_is_told_or_a_rival")


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (lambda t, force: force, None),
        (lambda t, force: force + 5e-4 * t, "force_drift"),
        pytest.param(
            lambda t, force: force - 0.02 * np.log(1.0 + t / 10.0), "force_drift", marks=ANOTHER_FAULT
        ),
        pytest.param(filtered, "force_lag", marks=ANOTHER_FAULT),
        (lambda t, force: force * (1.1 - 0.1 * force / 17.0), "force_nonlinearity"),
    ],
    ids=[
        "without a fault",
        "a zero that drifts",
        "a zero that settles",
        "a slow filter",
        "a cell off straight",
    ],
)
def test_a_load_cell_s_fault_is_told_or_a_rival(fault, name):
    found = judged(coupons(fault))
    if name is None:
        assert found.kind == "none"
    else:
        assert found.kind in ("named", "ambiguous")
        assert name in found.ambiguity


def by_camera(y, scale=1.0, tilt=0.0, lens=0.0):
    """Channels of the written unit as a camera reads them: markers as points of a picture."""
    y = np.array(y)
    for m in (1, 2, 3):
        row = analytic.CHANNELS.index(f"marker{m}_y_mm")
        place = np.stack([y[row] * math.cos(tilt), y[row + 1] - 37.5])
        place = scale * place * (1.0 + lens * np.sum(place**2, axis=0) / 37.5**2)
        y[row], y[row + 1] = place[0], place[1] + 37.5
    # A line at that angle, from the tip's marker on, drawn into the same picture.
    angle = np.radians(y[0])
    y[0] = np.degrees(np.arctan2(np.sin(angle) * math.cos(tilt), np.cos(angle)))
    return y


CAMERA = pytest.mark.nightly("test_a_camera_s_fault_is_told_from_the_unit_s")


@pytest.mark.parametrize(
    ("camera", "name"),
    [
        ({}, None),
        pytest.param({"scale": 1.03}, "camera_scale", marks=CAMERA),
        ({"tilt": 0.25}, "camera_tilt"),
        pytest.param({"lens": 0.02}, "lens_distortion", marks=CAMERA),
    ],
    ids=["without a fault", "scale", "tilt", "lens"],
)
def test_a_camera_s_fault_is_told_from_the_unit_s(camera, name):
    rng = np.random.default_rng(2)
    truth = {"modulus_factor": 1.05}
    bare = analytic.simulator(analytic.measured(rng, truth, dt=0.5, count=4))
    made = analytic.measured(
        rng, truth, dt=0.5, count=4, predict=lambda e: by_camera(bare.predict(e, truth), **camera)
    )
    found = diagnose(made, analytic.simulator(made))
    if name is None:
        assert found.kind == "none"
    else:
        assert found.kind in ("named", "ambiguous")
        assert name in found.ambiguity


def test_a_lens_turns_the_angle_as_it_moves_two_points_of_the_tip():
    """Of an arc drawn point by point, distorted, and measured at its end."""
    lens, length = 0.03, 75.0
    for degrees in (-80.0, 5.0, 60.0):
        s = np.linspace(0.0, 1.0, 20001)
        angle = np.radians(degrees) * s
        y, z = (np.cumsum(f(angle)) * length / len(s) for f in (np.sin, np.cos))
        z = z - length / 2
        far = 1.0 + lens * (y**2 + z**2) / (length / 2) ** 2
        y, z = y * far, z * far
        expected = math.degrees(math.atan2(y[-1] - y[-3], z[-1] - z[-3]))
        seen = read_by_camera(
            ("angle_deg",), np.array([[degrees]]), np.zeros(1), 1.0, {"lens_distortion.at_tip": lens}
        )
        assert seen[0, 0] == pytest.approx(expected, abs=0.01)


def test_a_camera_that_turns_moves_angle_and_markers_as_one_body():
    y = np.array([[20.0, 20.0], [10.0, 10.0], [60.0, 60.0]])
    channels = ("angle_deg", "marker1_y_mm", "marker1_z_mm")
    seen = read_by_camera(channels, y, np.array([0.0, 3600.0]), 1.0, {"angle_drift.per_hour": 2.0})
    np.testing.assert_array_equal(seen[:, 0], y[:, 0])
    assert seen[0, 1] == pytest.approx(22.0)
    about = np.array([10.0, 60.0 - 37.5])
    assert math.hypot(seen[1, 1], seen[2, 1] - 37.5) == pytest.approx(math.hypot(*about))
    turned = math.degrees(math.atan2(seen[1, 1], seen[2, 1] - 37.5) - math.atan2(*about))
    assert turned == pytest.approx(2.0)


def test_a_load_cell_whose_gain_was_another_one_day_is_told():
    """Six tests of one coupon on two days: on the second the cell reads 6 % too much."""
    rng, made = np.random.default_rng(3), []
    t = np.linspace(0.0, 60.0, 240)
    strain = 0.15 * (1.0 - np.abs(1.0 - 2.0 * (t / 20.0 % 1.0)))
    for number in range(6):
        e = experiment(
            "coupon",
            {"time_s": t, "strain": strain, "stress_kPa": 0.0 * t},
            name=f"test {number}",
            specimen="A",
            session="Monday" if number < 3 else "Tuesday",
        )
        stress = CouponStress([e]).predict(e, {"coupon_modulus_kPa": 900.0})[0]
        read = stress * (1.06 if number > 2 else 1.0) + rng.normal(0.0, 0.3, len(t))
        made.append(attrs.evolve(e, columns={**e.columns, "stress_kPa": read}))
    found = diagnose(made, Composite(dict(bench_simulators(made))))
    # A last session is like something that was changed before it, or in the cell, or clamped otherwise.
    (cause,) = found.selection.causes
    titles = {cause.effect.title, *cause.rivals}
    assert found.kind == "ambiguous"
    assert "step_change of tests from test 3 on" in titles
    assert any(title.startswith("force_scale") for title in titles)
