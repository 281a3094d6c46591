"""An extended model in a unit's parameters."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.parameters import Unit, load_preset
from mu_addon.errors import InputError
from mu_addon.evidence.extended import ExtendedModel, Fitted
from mu_addon.evidence.prediction.lattice_compression import LatticeStress
from mu_addon.homogenize.offset_response import OffsetResponse
from mu_addon.measured import Experiment
from mu_addon.simulate_and_place.extended_unit import extend, read_extended


def model(verdict="named", **values):
    """A model of values by effect__parameter, or by a nuisance's name."""
    effects, nuisances = {}, {}
    for key, value in values.items():
        effect, _, parameter = key.rpartition("__")
        fitted = Fitted(value, 0.01, value - 0.02, value + 0.02)
        if effect:
            effects.setdefault(effect, {})[parameter] = fitted
        else:
            nuisances[parameter] = fitted
    return ExtendedModel(verdict, effects, nuisances)


def test_a_model_without_effects_leaves_the_unit_as_it_is():
    unit = load_preset("mu-0.75x")
    found = extend(unit, model("none"))
    assert found.unit == unit
    assert found.applied == found.left_out == ()


def test_overcure_moves_every_surface_by_a_true_length():
    unit = load_preset("mu-0.75x")
    found = extend(unit, model(overcure__offset_mm=0.09))
    assert (found.unit.print.offset_xy_mm, found.unit.print.offset_z_mm) == (0.09, 0.09)
    # Twice the offset at any scale, and the files to print stay as drawn.
    assert found.unit.printed.wall - unit.printed.wall == pytest.approx(0.18, abs=0.003)
    assert found.unit.dimensions == unit.dimensions


@given(st.floats(0.5, 2.0), st.floats(0.0, 0.25), st.floats(0.0, 0.4), st.floats(5.0, 50.0))
@settings(max_examples=25)
def test_the_lattice_gets_the_modulus_that_the_evidence_predicts_at_its_scale(scale, offset, excess, drawn):
    values = {
        "lattice_modulus_kPa": drawn,
        "overcure.offset_mm": offset,
        "skin_cure.excess_mm": excess,
    }
    known = model(lattice_modulus_kPa=drawn, overcure__offset_mm=offset, skin_cure__excess_mm=excess)
    found = extend(attrs.evolve(Unit(), scale=scale), known)
    block = Experiment(
        name="block",
        kind="lattice_compression",
        role="fit",
        file="block.csv",
        columns={"strain": [0.0, 0.1], "stress_kPa": [0.0, 1.0]},
        rows=np.array([2, 3]),
        sha256="",
        scale=scale,
    )
    stress = LatticeStress([block]).predict(block, values)[0]
    assert found.unit.material.lattice_modulus_kPa == pytest.approx(stress[1] / 0.1, rel=1e-12)


def test_a_skin_has_the_depth_times_excess_that_was_fitted():
    p = extend(Unit(), model(skin_cure__excess_mm=0.14)).unit.print
    assert p.skin_depth_mm * (p.skin_factor - 1) == pytest.approx(0.14)


def test_walls_and_moduli_are_multiplied():
    unit = load_preset("mu-1.5x")
    found = extend(unit, model(wall_thickness__factor=1.1, modulus_factor=0.8)).unit
    assert found.chambers.wall_mm == pytest.approx(1.1 * unit.chambers.wall_mm)
    for name in ("lattice_modulus_kPa", "membrane_modulus_kPa"):
        assert getattr(found.material, name) == pytest.approx(0.8 * getattr(unit.material, name))


def test_what_a_unit_has_no_parameter_for_is_said():
    known = model(
        pressure_gain__gain=0.1,
        viscoelasticity__creep_per_MPa=0.2,
        viscoelasticity__onset_s=5,
        viscoelasticity__growth_per_MPa=0.0,
        viscoelasticity__begins_s=30.0,
        angle_zero_deg=0.4,
    )
    found = extend(Unit(), known)
    assert found.unit == Unit()
    names = [words.split(" (")[0] for words in found.left_out]
    assert names == ["pressure gain", "viscoelasticity", "angle zero deg"]
    # Creep of a chamber, not of a unit that bends.
    assert "onset_s 5" in found.left_out[1]
    assert "another kind of experiment" in found.left_out[1]


def test_what_acts_in_time_is_for_the_simulation():
    known = model(
        leak__conductance_ratio=0.1,
        viscoelasticity__share=0.2,
        viscoelasticity__time_s=5,
        line_lag__time_s=0.3,
    )
    found = extend(Unit(), known)
    assert found.left_out == ()
    assert found.effects.in_time
    assert list(found.effects.values) == ["line_lag", "leak", "viscoelasticity"]
    assert "all moduli relax by 20.0%, with a time constant of 5 s" in found.applied


@pytest.mark.parametrize("verdict", ["ambiguous", "unexplained"])
def test_a_verdict_that_is_not_sure_is_said(verdict):
    found = extend(Unit(), model(verdict, modulus_factor=1.2))
    assert verdict in found.doubt
    assert found.left_out == ()


def test_a_unit_that_breaks_a_rule_with_it_is_refused_by_the_models_name():
    with pytest.raises(InputError, match=r"wall_thickness.factor = 40") as caught:
        extend(Unit(), model(wall_thickness__factor=40.0), "there/model.toml")
    assert caught.value.where == "there/model.toml"


def test_a_computed_block_hands_its_stiffness_to_the_unit():
    """By its own response, not by slender struts; and the unit's print has the offset too."""
    response = OffsetResponse([0.0, 0.1, 0.2, 0.3], [0.004, 0.006, 0.008, 0.01], [0.1, 0.12, 0.14, 0.16])
    known = model(lattice_modulus_kPa=10.0, overcure__offset_mm=0.15)
    found = extend(load_preset("mu-0.75x"), attrs.evolve(known, lattice=response)).unit
    # 0.15 mm at 0.75x is 0.2 mm at 1.0x: twice as stiff as drawn.
    assert found.material.lattice_modulus_kPa == pytest.approx(20.0, rel=1e-9)
    assert found.print.offset_xy_mm == 0.15


def test_a_model_is_the_same_from_its_file(tmp_path):
    response = OffsetResponse([0.0, 0.1, 0.2, 0.3], [0.004, 0.006, 0.008, 0.01], [0.1, 0.12, 0.14, 0.16])
    known = attrs.evolve(
        model("ambiguous", overcure__offset_mm=0.05, modulus_factor=1.2, lattice_modulus_kPa=12.0),
        lattice=response,
        rivals=("skin_cure",),
    )
    known.save(tmp_path / "model.toml")
    assert read_extended(Unit(), tmp_path / "model.toml") == extend(Unit(), known)
    with pytest.raises(InputError, match="cannot read"):
        read_extended(Unit(), tmp_path / "none.toml")
