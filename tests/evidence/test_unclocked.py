"""Readings without a clock that stand alone are a remark; what may show a wrong model is none of them."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.evidence.second_code.judging import judged
from benchmarks.evidence.second_code.sets import Order
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.noise import estimate
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record
from mu_addon.evidence.residual_tests.without_clock import ALTERNATION
from mu_addon.evidence.scatter import FEW, TIMES
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.unclocked import AROUND, IN_A_ROW, MOST, lone, points
from tests.evidence.bench import experiment

SD = 0.02
SEED = 42270001


def curves(kind, many, rows, share=0.0, off=None, seed=0):
    """Curves by strain of a modulus of 40 kPa, with what `off` adds and outliers in a share of readings."""
    rng, found = np.random.default_rng(seed), []
    strain = 0.15 * np.arange(1, rows + 1) / rows
    for i in range(many):
        stress = 40.0 * (strain if kind != "coupon" else (1.0 + strain - (1.0 + strain) ** -2) / 3.0)
        stress = stress + SD * rng.normal(size=rows)
        if off is not None:
            stress = stress + off(np.linspace(0.0, 1.0, rows))
        wrong = rng.choice(np.arange(2, rows - 2), int(share * rows), replace=False)
        sizes = rng.uniform(12.0, 60.0, len(wrong)) * rng.choice([-1.0, 1.0], len(wrong))
        stress[wrong] += SD * sizes
        how = {"mode": "uniaxial"} if kind == "coupon" else {"cells": 3, "axis": "z"}
        how |= {"specimen": f"S{i}", "section_mm": (30.0, 30.0), "length_mm": 30.0}
        found.append(experiment(kind, {"strain": strain, "stress_kPa": stress}, f"{kind} {i}", **how))
    return found


def verdict_on(made):
    return diagnose(made, Composite(bench_simulators(made)))


@pytest.mark.parametrize("kind", ["coupon", "lattice_compression"])
@pytest.mark.parametrize(("many", "rows", "share"), [(3, 30, 0.04), (1, 30, 0.1), (3, 12, 0.1)])
def test_outliers_of_a_curve_by_strain_are_a_remark(kind, many, rows, share):
    found = verdict_on(curves(kind, many, rows, share))
    assert found.kind == "none"
    assert len(found.set_aside) == many
    assert f"{kind} 0, stress_kPa: {int(share * rows)} of {rows} readings stand alone" in found.set_aside[0]
    assert "at strain 0." in found.set_aside[0]


OTHER_SETS = pytest.mark.nightly("test_readings_of_a_turned_unit_of_the_second_code")


@pytest.mark.parametrize(
    ("faults", "noise", "kind"),
    [
        ({}, "white", "none"),
        ({}, "outliers", "none"),
        ({"outside_cable": {"deg": 1.0}}, "outliers", "unexplained"),
        ({"gravity": {"weight": 1.0}}, "outliers", "named"),
        # A display shows one number at many orientations.
        ({}, "quantised", "none"),
        ({"outside_cable": {"deg": 1.0}}, "quantised", "unexplained"),
    ],
)
@pytest.mark.parametrize("number", [0, 1, *(pytest.param(n, marks=OTHER_SETS) for n in range(2, 6))])
def test_readings_of_a_turned_unit_of_the_second_code(faults, noise, kind, number):
    row = judged(Order("single", "unit_pose", faults, noise, 0.003, SEED + number))
    assert row["verdict"] == kind
    assert row["names"] == (["gravity"] if kind == "named" else [])


@pytest.mark.nightly("tests/evidence/test_scatter.py::test_a_wrong_model_is_never_trusted_whatever_its_size")
@given(
    kind=st.sampled_from(["coupon", "lattice_compression"]),
    shape=st.sampled_from(["wave", "end", "bump", "alternating"]),
    rows=st.integers(30, 60),
    many=st.integers(1, 2),
    share=st.sampled_from([0.0, 0.05, 0.1]),
    size=st.floats(0.05, 2.0),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=8, deadline=None)
def test_no_gross_misfit_is_none_for_outliers_beside_it(kind, shape, rows, many, share, size, seed):
    """A misfit beyond the largest noise that readings allow, in a tenth of the curve or in all of it."""
    times = 10.0**size * TIMES * (1.0 + FEW / np.sqrt(rows)) ** 2

    def off(x):
        shapes = {
            "wave": np.sin(4.0 * np.pi * x),
            "end": np.maximum(x - 0.85, 0.0),
            "bump": np.maximum(np.sin(np.pi * (x - 0.4) / 0.12), 0.0) * (np.abs(x - 0.46) < 0.06),
            "alternating": (-1.0) ** np.arange(len(x)),
        }
        return times * SD * shapes[shape] / np.sqrt(np.mean(shapes[shape] ** 2))

    assert verdict_on(curves(kind, many, rows, share, off, seed)).kind != "none"


@pytest.mark.parametrize("kind", ["coupon", "lattice_compression"])
def test_a_misfit_that_alternates_from_reading_to_reading_is_no_noise(kind):
    def off(x):
        return SD * (-1.0) ** np.arange(len(x))

    found = verdict_on(curves(kind, 3, 30, off=off))
    assert found.kind == "unexplained"
    assert ALTERNATION in found.selection.left


def of_curves(made, modulus_kPa=40.0):
    return [points(e, "stress_kPa", modulus_kPa * e["strain"], 0.0) for e in made]


def spoilt(made, at, by=1.0, which=None):
    """The curves with some readings off by so many kPa, in all or in one of them."""
    found = []
    for i, e in enumerate(made):
        stress = e["stress_kPa"].copy()
        if which is None or i == which:
            stress[at] += by
        found.append(attrs.evolve(e, columns={**e.columns, "stress_kPa": stress}))
    return found


@pytest.mark.parametrize(
    ("at", "which", "expected"),
    [
        ([20], 0, [20]),
        ([20, 21], 0, [20, 21]),
        ([20, 21, 22], 0, []),
        ([0], 0, []),
        ([39], 0, []),
        ([6, 12, 18, 24, 30], 0, []),
        # Repeats that agree show a wrong model.
        ([20], None, []),
    ],
)
def test_only_what_stands_alone_between_others_does_not_count(at, which, expected):
    every = of_curves(spoilt(curves("lattice_compression", 2, 40), at, which=which))
    first, second = lone(every)
    assert np.sort(every[0].rows[first]).tolist() == expected
    assert not second.any()


def test_nothing_stands_alone_in_a_steep_misfit():
    """The median of the readings around each is that reading, whatever its noise."""
    every = of_curves(curves("lattice_compression", 2, 40), 0.0)
    assert np.median(np.abs(every[0].away)) == 0.0
    assert not np.concatenate(lone(every)).any()


def test_the_order_is_that_of_the_drive_and_not_of_the_file():
    made = spoilt(curves("lattice_compression", 1, 40), [20])
    mixed = np.random.default_rng(0).permutation(40)
    (e,) = made
    (other,) = [attrs.evolve(e, columns={c: v[mixed] for c, v in e.columns.items()})]
    (own,) = of_curves([other])
    assert own.rows[lone([own])[0]].tolist() == [int(np.flatnonzero(mixed == 20)[0])]


def turned(orientation_deg, pressure_kPa=10.0):
    angle = np.zeros(len(orientation_deg))
    columns = {
        "pressure_kPa": np.full(len(angle), pressure_kPa),
        "orientation_deg": np.asarray(orientation_deg, float),
        "angle_deg": angle + SD * np.random.default_rng(3).normal(size=len(angle)),
    }
    columns["angle_deg"][0] += 1.0
    return experiment("unit_pose", columns, "turn")


def test_a_whole_turn_has_no_end_and_half_of_one_has():
    for orientations, expected in ((np.arange(0.0, 360.0, 20.0), [0]), (np.arange(0.0, 180.0, 10.0), [])):
        own = points(turned(orientations), "angle_deg", np.zeros(len(orientations)), 0.0)
        assert own.closed == bool(expected)
        assert own.rows[lone([own])[0]].tolist() == expected


def test_pressures_that_are_held_come_before_the_angle_that_is_turned():
    """Three readings at the highest pressure, side by side: a unit that touches something there."""
    orientations = np.tile(np.arange(0.0, 360.0, 20.0), 3)
    e = turned(orientations)
    angle = SD * np.random.default_rng(4).normal(size=54)
    angle[[41, 42, 43]] += 1.0
    pressure = np.repeat([5.0, 15.0, 25.0], 18)
    e = attrs.evolve(e, columns={**e.columns, "angle_deg": angle, "pressure_kPa": pressure})
    own = points(e, "angle_deg", np.zeros(54), 0.0)
    assert not lone([own])[0].any()


def test_few_readings_and_a_record_that_is_one_number_are_left_alone():
    (e,) = curves("coupon", 1, AROUND - 1)
    assert points(e, "stress_kPa", e["stress_kPa"], 0.0) is None
    (e,) = curves("coupon", 1, 40)
    known = attrs.evolve(e, columns={**e.columns, "stress_sd_kPa": np.full(40, 0.1)})
    assert points(known, "stress_kPa", known["stress_kPa"], 0.0) is None
    assert IN_A_ROW < MOST * 40 < AROUND


def test_repeats_tell_the_noise_though_a_reading_is_missing():
    """Each strain three times, of a model that is wrong by far more."""
    rng = np.random.default_rng(5)
    strain = np.tile(0.01 * np.arange(1, 13), 3)
    stress = 400.0 * strain**2 + SD * rng.normal(size=36)
    how = {"axis": "z", "specimen": "A", "section_mm": (30.0, 30.0), "length_mm": 30.0, "cells": 3}
    for missing in ([], [7, 20]):
        read = stress.copy()
        read[missing] = np.nan
        made = [experiment("lattice_compression", {"strain": strain, "stress_kPa": read}, "A", **how)]
        data = record(made, Composite(bench_simulators(made)))
        (source,) = estimate(data, data.values, [np.ones((len(data), 1))]).values()
        assert source.white == pytest.approx(SD, rel=0.6)
