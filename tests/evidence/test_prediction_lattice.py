"""Lattices between plates: dimensional analysis across scales, directions, seating, and weighing."""

import re
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.offset_fit import fit_offset
from mu_addon.diagnose.words import advice, sentence
from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.lattice_compression import ComputedCell, LatticeStress, Struts
from mu_addon.evidence.record import KNOWN
from mu_addon.evidence.simulator import Composite
from mu_addon.homogenize.offset_response import OffsetResponse
from mu_addon.measured import read_folder

from .bench import experiment

EXAMPLES = Path(__file__).parents[2] / "assets" / "examples"
SCALES = (0.75, 1.0, 1.5)


def block(scale=1.0, name="", **fields):
    size = 37.5 * scale
    strain = np.linspace(0.0, 0.4, 81)
    columns = {"time_s": strain * size / (10 / 60), "strain": strain}
    return experiment(
        "lattice_compression",
        {**columns, **fields.pop("columns", {})},
        name or f"{scale:g}x",
        scale=scale,
        **{"section_mm": (size, size), "length_mm": size, **fields},
    )


def modulus(e, **values):
    found = LatticeStress().predict(e, {k.replace("__", "."): v for k, v in values.items()})[0]
    return found[-1] / e["strain"][-1]


@given(scale=st.floats(0.1, 10.0))
def test_a_lattice_scaled_as_a_whole_keeps_its_modulus(scale):
    assert modulus(block(scale)) == pytest.approx(30.0)


@given(
    scale=st.floats(0.3, 4.0), offset=st.floats(0.0, 0.25), excess=st.floats(0.0, 0.4), by=st.floats(0.5, 2.0)
)
def test_lengths_of_the_printer_scaled_alike_change_nothing(scale, offset, excess, by):
    """Stiffness and mass depend on offset and skin over the scale alone."""
    struts = Struts()
    assert struts.stiffness(by * scale, by * offset, by * excess) == pytest.approx(
        struts.stiffness(scale, offset, excess)
    )
    assert struts.mass(by * scale, by * offset) == pytest.approx(struts.mass(scale, offset))


def test_a_thin_skin_stiffens_a_bent_strut_as_a_tube_around_a_core():
    """(k - 1) (1 - (1 - 2 d/t)^4) of a skin of depth d and modulus k, to first order of d/t."""
    d, k, t = 1e-3, 3.0, 1.5
    exact = 1 + (k - 1) * (1 - (1 - 2 * d / t) ** 4)
    assert Struts().stiffness(1.0, 0.0, (k - 1) * d) - 1 == pytest.approx(exact - 1, rel=4 * d / t)


def test_stiffness_changes_with_a_power_of_strain():
    """1/(1 - a (10 e)^r); at r = 1 the law of cells that close."""
    e = block()
    plain = LatticeStress().predict(e, {})[0]
    found = LatticeStress().predict(e, {"strain_stiffening.at_tenth": -0.2, "strain_stiffening.order": 2.0})[
        0
    ]
    np.testing.assert_allclose(found, plain / (1 + 0.2 * (10 * e["strain"]) ** 2), rtol=1e-9, atol=1e-12)
    first = LatticeStress().predict(e, {"strain_stiffening.at_tenth": 0.1, "strain_stiffening.order": 1.0})[0]
    closing = LatticeStress().predict(e, {"strain_stiffening.closing": 1.0})[0]
    np.testing.assert_allclose(first, closing, rtol=1e-9, atol=1e-12)


def test_a_lattice_without_size_is_not_weighed():
    e = block(columns={"mass_g": np.ones(81)}, section_mm=None)
    assert LatticeStress().channels(e) == ("stress_kPa",)


def test_another_scaling_can_be_given():
    class Stretched(Struts):
        def stiffness(self, scale, offset_mm, excess_mm):
            return (1 + offset_mm / scale) ** 2

        def mass(self, scale, offset_mm):
            return 1.0

    e = block(2.0)
    found = LatticeStress(scalings={e.name: Stretched()}).predict(e, {"overcure.offset_mm": 0.2})[0]
    assert found[-1] / 0.4 == pytest.approx(30.0 * 1.1**2)


def test_the_papers_moduli_refuse_one_modulus_and_leave_the_cause_open():
    made = read_folder(EXAMPLES / "paper-moduli").experiments
    found = diagnose(made, Composite(bench_simulators(made)))
    base = found.selection.base
    assert found.record.groups == (KNOWN,)
    # The weighted mean leaves so much of two degrees.
    assert (len(found.record), base.chi2) == (3, pytest.approx(20.3, abs=0.2))
    assert base.values["lattice_modulus_kPa"] == pytest.approx(21.2, abs=0.1)
    assert found.selection.table_base[0].p_value == pytest.approx(4e-5, rel=0.2)
    assert found.kind == "ambiguous"
    assert {"overcure", "skin_cure"} <= found.ambiguity
    assert "anisotropy" in found.identifiability
    fits = {f.names[0]: f for f in found.selection.singles}
    assert max(fits[name].chi2 for name in ("overcure", "skin_cure")) < 0.2
    # Thicker by 0.18 mm, in all.
    assert 2 * fits["overcure"].values["overcure.offset_mm"] == pytest.approx(0.182, abs=0.003)
    assert fits["overcure"].values["lattice_modulus_kPa"] == pytest.approx(11.9, abs=0.1)
    alike = [attrs.evolve(e, columns={**e.columns, "stress_kPa": 20.0 * e["strain"]}) for e in made]
    assert diagnose(alike, Composite(bench_simulators(alike))).kind == "none"


def test_weighing_would_tell_thicker_struts_from_harder_skin():
    """0.18 mm makes the 0.75x specimen denser by 15 % against the 1.5x one; the skin by nothing."""
    struts = Struts()
    assert struts.mass(0.75, 0.091) / struts.mass(1.5, 0.091) == pytest.approx(1.155, abs=0.005)


def test_a_mass_reaches_the_experiment_through_the_folder(tmp_path):
    folder = EXAMPLES / "paper-moduli"
    for file in folder.iterdir():
        text = file.read_text()
        (tmp_path / file.name).write_text(
            text.replace('axis = "z"', 'axis = "z"\nmass_g = 9.5\nmass_sd_g = 0.05')
        )
    first = read_folder(tmp_path).experiments[0]
    np.testing.assert_array_equal(first["mass_g"], 9.5)
    np.testing.assert_array_equal(first["mass_sd_g"], 0.05)
    assert LatticeStress().channels(first) == ("stress_kPa", "mass_g")
    assert attrs.evolve(first, section_mm=None).mass_g == 9.5


def test_a_negative_spread_is_refused_by_its_row(tmp_path):
    for file in (EXAMPLES / "paper-moduli").iterdir():
        (tmp_path / file.name).write_text(file.read_text().replace("4.3400,0.0700", "4.3400,-0.0700"))
    with pytest.raises(InputError, match="row 5, column stress_sd_kPa"):
        read_folder(tmp_path)


# The paper's lattice, 3 cells a side between plates that hold: kPa, of a resin of 2.5 MPa.
OFFSETS = (-0.05, 0.0, 0.05, 0.1, 0.2)
HELD_kPa = (8.19, 9.75, 11.9, 14.3, 19.9)


def computed():
    # The mass of slender struts, which the moduli do not depend on.
    density = [0.16 * Struts(1.75).mass(1.0, o) for o in OFFSETS]
    return ComputedCell(OffsetResponse(OFFSETS, np.array(HELD_kPa) / 2500.0, density))


def test_a_computed_cell_hands_over_its_virtual_tests():
    cell = computed()
    assert cell.stiffness(1.0, 0.0, 0.0) == cell.mass(1.0, 0.0) == 1.0
    assert cell.stiffness(1.3, 0.0, 0.0) == 1.0
    assert cell.stiffness(1.0, 0.1, 0.0) == pytest.approx(14.3 / 9.75)
    # Twice as large, with twice the offset: the same lattice.
    assert cell.stiffness(2.0, 0.2, 0.0) == pytest.approx(14.3 / 9.75)
    assert cell.mass(2.0, 0.2) == pytest.approx(Struts(1.75).mass(1.0, 0.1), rel=1e-6)
    with pytest.raises(InputError, match="not computed"):
        cell.stiffness(0.75, 0.16, 0.0)


@given(scale=st.floats(0.5, 2.0), excess=st.floats(0.0, 0.2))
def test_a_computed_cell_of_slender_struts_is_the_power_law(scale, excess):
    struts = Struts()
    at = np.linspace(-0.05, 0.2, 26)
    made = OffsetResponse(at, [struts.stiffness(1, o, 0) for o in at], [struts.mass(1, o) for o in at])
    cell = ComputedCell(made)
    for offset in (0.0, 0.08):
        assert cell.stiffness(scale, offset, 0.0) == pytest.approx(
            struts.stiffness(scale, offset, 0.0), rel=1e-5
        )
        assert cell.mass(scale, offset) == pytest.approx(struts.mass(scale, offset), rel=1e-5)
    assert cell.stiffness(scale, 0.0, excess) == pytest.approx(struts.stiffness(scale, 0.0, excess), rel=1e-3)


def test_struts_thinner_than_any_computed_go_on_softening_as_thin_ones_do():
    struts, cell = Struts(), computed()
    at = np.linspace(-0.05, 0.2, 26)
    made = OffsetResponse(at, [struts.stiffness(1, o, 0) for o in at], [struts.mass(1, o) for o in at])
    for scale in (0.75, 1.5):
        thin = ComputedCell(made).stiffness(scale, -0.1 * scale, 0.0)
        assert thin == pytest.approx(struts.stiffness(scale, -0.1 * scale, 0.0), rel=0.05)
        assert ComputedCell(made).mass(scale, -0.1 * scale) == pytest.approx(
            struts.mass(scale, -0.1 * scale), rel=1e-3
        )
    least = cell.response.range_mm[0]
    assert cell.stiffness(1.0, least - 1e-9, 0.0) == pytest.approx(cell.stiffness(1.0, least, 0.0))


def specimens(thicker_mm, weighed):
    """Blocks of slender struts, each printed by so much too thick, by the formulas of bending."""
    rng, found = np.random.default_rng(3), []
    for i, off in enumerate(thicker_mm):
        e = block(name=f"block {i}", specimen=f"S{i}", columns={"mass_g": np.ones(81)} if weighed else {})
        stress = 40.0 * (1.0 + off / 1.5) ** 4 * e["strain"] + 0.05 * rng.normal(size=81)
        columns = {**e.columns, "stress_kPa": stress}
        if weighed:
            mass = 8.0 * (1.0 + off / 1.5) ** 2 + 0.01 * rng.normal()
            columns |= {"mass_g": np.full(81, mass), "mass_sd_g": np.full(81, 0.02)}
        found.append(attrs.evolve(e, columns=columns))
    return found


@pytest.mark.parametrize("weighed", [False, True])
def test_struts_of_each_specimen_stand_beside_its_modulus_until_it_is_weighed(weighed):
    made = specimens((0.15, 0.13, -0.15, -0.12), weighed)
    found = diagnose(made, Composite(bench_simulators(made)))
    cause = found.selection.causes[0]
    every = {cause.effect.title, *cause.rivals}
    assert found.kind in ("named", "ambiguous")
    assert "strut_thickness among specimens" in every
    assert ("batch_variation among specimens" in every) == (not weighed)
    if weighed:
        values = [found.selection.chosen.values[k] for k in cause.effect.keys]
        assert values[0] - values[2] == pytest.approx(0.30, abs=0.04)


def test_struts_drawn_unlike_are_told_by_the_thickness_that_they_act_with():
    drawn, acting = (1.2, 1.2, 0.9, 0.9), (1.25, 1.27, 0.79, 0.81)
    made = [
        attrs.evolve(e, strut_mm=mm)
        for e, mm in zip(
            specimens([1.5 * (a / mm - 1.0) for a, mm in zip(acting, drawn, strict=True)], False),
            drawn,
            strict=True,
        )
    ]
    struts = {e.name: Struts(mm) for e, mm in zip(made, drawn, strict=True)}
    found = diagnose(made, Composite(bench_simulators(made, struts)))
    _, words = sentence(found)
    told = re.search(
        r"those of 1\.2 mm act like (\S+) to (\S+) mm and those of 0\.9 mm like (\S+) to (\S+) mm: beside "
        r"the thickest, the thinnest come out (\S+) mm thinner than drawn",
        words,
    )
    least, most, thin, thicker, less = map(float, told.groups())
    # One modulus is fitted to all: the differences alone are in the data.
    assert (most - least, thicker - thin, less) == pytest.approx((0.02, 0.02, 0.16), abs=0.015)
    assert "microscope" in advice(found)
    alike = [attrs.evolve(e, strut_mm=1.2) for e in made]
    assert "act like" not in sentence(diagnose(alike, Composite(bench_simulators(alike, struts))))[1]


def test_the_papers_moduli_by_the_computed_cell():
    """The same verdict as by the power law, and the offset that the homogenization fits by itself."""
    experiments = read_folder(EXAMPLES / "paper-moduli").experiments
    cell = computed()
    simulators = bench_simulators(experiments, {e.name: cell for e in experiments})
    (overcure,) = (e for e in simulators["lattice_compression"].effects if e.name == "overcure")
    # 0.75x was computed up to there.
    assert overcure.parameters[0].high == pytest.approx(0.15)
    found = diagnose(experiments, Composite(simulators))
    assert found.kind == "ambiguous"
    assert {"overcure", "skin_cure"} <= found.ambiguity
    fits = {f.names[0]: f for f in found.selection.singles}
    alone = fit_offset(cell.response, SCALES, (21.70, 18.34, 16.38), (0.35, 1.86, 1.21))
    offset = fits["overcure"].values["overcure.offset_mm"]
    assert offset == pytest.approx(alone.offset_mm, abs=1e-4)
    assert offset == pytest.approx(0.129, abs=1e-3)
    # Of the resin, in kPa, and so of the lattice as drawn.
    drawn = fits["overcure"].values["lattice_modulus_kPa"]
    assert drawn == pytest.approx(alone.resin_MPa * HELD_kPa[1] / 2500.0, rel=1e-3)
