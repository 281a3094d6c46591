"""What holds for the effects of every kind that a bench measures."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.effects import DECLARED
from mu_addon.evidence.prediction.beam_deadweight import BeamSag
from mu_addon.evidence.prediction.coupon import CouponStress
from mu_addon.evidence.prediction.lattice_compression import LatticeStress
from mu_addon.evidence.prediction.pressure_hold import ChamberPressure
from mu_addon.evidence.prediction.waveguide_bending import WaveguideVoltage
from mu_addon.measured.kinds import KINDS

from .bench import experiment, parameters

TIME = np.linspace(0.0, 60.0, 61)
STRAIN = 0.2 * np.abs(np.sin(TIME / 12.0))
BLOCK = {"section_mm": (30.0, 30.0), "length_mm": 30.0, "temperature_C": 33.0}
COUPONS = [
    experiment(
        "coupon",
        {"time_s": TIME, "strain": STRAIN - 0.05},
        name,
        mode="uniaxial",
        axis="x",
        specimen="A",
        **BLOCK,
    )
    for name in ("first", "again")
]
LATTICE = [
    experiment(
        "lattice_compression",
        {"time_s": TIME, "strain": STRAIN, "mass_g": np.ones(61)},
        name,
        axis="x",
        specimen="A",
        scale=0.75,
        **BLOCK,
    )
    for name in ("first", "again")
]
HOLD = experiment("pressure_hold", {"time_s": TIME, "pressure_kPa": np.full(61, 300.0)})
BEAM = experiment(
    "beam_deadweight", {"added_mass_g": np.array([0.0, 20.0, 50.0])}, section_mm=(30.0, 30.0), length_mm=100.0
)
GUIDE = experiment("waveguide_bending", {"time_s": TIME, "angle_deg": 60 * np.sin(TIME / 9.0)})

CASES = {
    "coupon": (CouponStress(COUPONS), COUPONS[1]),
    "lattice": (LatticeStress(LATTICE), LATTICE[1]),
    "hold": (ChamberPressure([HOLD]), HOLD),
    "beam": (BeamSag(), BEAM),
    "waveguide": (WaveguideVoltage(), GUIDE),
}
EFFECTS = [(kind, e) for kind, (simulator, _) in CASES.items() for e in simulator.effects]


@pytest.mark.parametrize("kind", CASES)
def test_prediction_has_a_row_a_channel(kind):
    simulator, e = CASES[kind]
    found = simulator.predict(e, {})
    assert found.shape == (len(simulator.channels(e)), len(e))
    assert np.isfinite(found).all()


@pytest.mark.parametrize("kind", CASES)
def test_nulls_of_everything_are_the_base(kind):
    simulator, e = CASES[kind]
    nulls = {k: p.null for k, p in parameters(simulator).items()}
    np.testing.assert_array_equal(simulator.predict(e, nulls), simulator.predict(e, {}))


@pytest.mark.parametrize(("kind", "effect"), EFFECTS, ids=[f"{k}-{e.name}" for k, e in EFFECTS])
def test_a_size_at_null_switches_the_effect_off_whatever_its_shape(kind, effect):
    simulator, e = CASES[kind]
    base = simulator.predict(e, {})
    for shape in effect.shapes():
        np.testing.assert_array_equal(simulator.predict(e, shape), base)


@pytest.mark.parametrize(("kind", "effect"), EFFECTS, ids=[f"{k}-{e.name}" for k, e in EFFECTS])
def test_an_effect_comes_in_smoothly_and_changes_something(kind, effect):
    """Half the step of a derivative makes half the change: no jump at the null."""
    simulator, e = CASES[kind]
    base = simulator.predict(e, {})
    size = effect.parameters[0]
    changes = []
    for shape in effect.starts():
        whole = simulator.predict(e, {**shape, effect.keys[0]: size.null + size.step}) - base
        half = simulator.predict(e, {**shape, effect.keys[0]: size.null + size.step / 2}) - base
        changes.append(np.abs(whole).max())
        np.testing.assert_allclose(2 * half, whole, atol=0.03 * changes[-1])
    assert max(changes) > 0


@pytest.mark.parametrize(("kind", "effect"), EFFECTS, ids=[f"{k}-{e.name}" for k, e in EFFECTS])
def test_parameters_are_described(kind, effect):
    assert effect.mechanism
    assert effect.reveals
    for p in effect.parameters:
        assert p.source
        assert p.unit or p.name.isidentifier()
    assert effect.parameters[0].starts


@settings(max_examples=60)
@given(data=st.data())
def test_predictions_are_finite_within_all_bounds(data):
    kind = data.draw(st.sampled_from(sorted(CASES)))
    simulator, e = CASES[kind]
    effect = data.draw(st.sampled_from(simulator.effects))
    values = {
        k: data.draw(st.floats(p.low, p.high), label=k)
        for k, p in zip(effect.keys, effect.parameters, strict=True)
    }
    found = simulator.predict(e, values)
    assert np.isfinite(found).all(), {k: v for k, v in values.items() if math.isfinite(v)}


def test_no_advice_asks_for_what_a_kind_cannot_do():
    """A hold's valve is shut already, and a unit takes no added mass."""
    assert {kind for e in DECLARED.values() for kind in e.shown_by} <= set(KINDS)

    def shown(name, *kinds):
        return Effect(name, (Parameter("size", "", 0.0, 1.0, 0.0),), kinds).reveals

    assert "valve" not in shown("leak", "pressure_hold")
    assert "mass" not in shown("gravity", "unit_pressure")
    # A column of temperatures is not read, and a rigid block has no modulus that a specimen can have.
    assert "recorded" not in shown("temperature_drift", "pressure_hold")
    assert "rigid" not in shown("frame_compliance", "coupon")
    assert shown("gravity", "unit_pressure", "beam_deadweight").count("; or ") == 1
    # Both laws of one mechanism ask for the same experiment.
    block = LatticeStress([experiment("lattice_compression", {"time_s": TIME, "strain": STRAIN}, **BLOCK)])
    relaxing = {e.reveals for e in block.effects if e.name == "viscoelasticity"}
    assert relaxing == {DECLARED["viscoelasticity"].shown_by["lattice_compression"]}
