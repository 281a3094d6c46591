"""diagnose from folder to report."""

import csv
import json
import re
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.design.parameters import load_preset
from mu_addon.diagnose import judged_data
from mu_addon.diagnose.words import alternatives, what_to_do
from mu_addon.evidence import unit_fem
from mu_addon.evidence.drive import denoised_drives
from mu_addon.evidence.effect import Parameter, bare
from mu_addon.evidence.effects import DECLARED
from mu_addon.evidence.extended import ExtendedModel, Fitted, load_model
from mu_addon.evidence.prediction.lattice_compression import LatticeStress
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.simulators import simulations_plan
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.measured import read_folder
from mu_addon.nodes.definitions import definitions
from mu_addon.run.folder import keep_inputs
from mu_addon.simulate_and_place.extended_unit import read_extended
from mu_addon.studies import starting
from mu_addon.studies.design_experiments import DesignExperiments
from mu_addon.studies.diagnose import Diagnose
from tests.evidence import analytic

from .diagnosis_data import DRAWN_kPa, bent_unit, weighed_blocks
from .unit_runs import ended

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "assets" / "examples" / "paper-moduli"
OFFSET_mm = 0.09
# Of data in closed form: a printed unit's effects are simulated at few sizes first.
ALL_SIZES = {"settings": UnitSettings(whole=None)}


def run(folder, out, unit=None, report=False, **options):
    return ended(Diagnose(data=read_folder(folder), unit=unit, **options).complete(), out, report)


@pytest.fixture(scope="module")
def overcured(tmp_path_factory):
    folder = weighed_blocks(tmp_path_factory.mktemp("data") / "blocks", OFFSET_mm)
    out = tmp_path_factory.mktemp("diagnosis")
    context, messages = run(folder, out, report=True)
    assert context.status == 0, messages[-1]
    return folder, out, context.summary, messages


def test_the_verdict_names_what_was_put_in(overcured):
    _, out, summary, _ = overcured
    found = json.loads((out / "verdict.json").read_text())
    assert found["verdict"] == "named"
    (cause,) = found["causes"]
    assert cause["effect"] == "overcure"
    offset = cause["parameters"]["offset_mm"]
    assert offset["low95"] < OFFSET_mm < offset["high95"]
    assert offset["value"] == pytest.approx(OFFSET_mm, rel=0.15)
    keys = ("remaining_structure", "gain", "residual_table", "next_experiment", "identifiability")
    assert all(key in found for key in keys)
    assert summary["causes"] == found["causes"]


def test_the_model_predicts_what_was_measured_and_the_table_holds_both(overcured):
    folder, out, _, _ = overcured
    model = load_model(out / "model.toml")
    experiments = read_folder(folder).experiments
    rows = list(csv.DictReader((out / "residuals.csv").open()))
    assert len(rows) == sum(2 * len(e) for e in experiments)
    for e in experiments:
        mine = [r for r in rows if r["experiment"] == e.name and r["channel"] == "stress_kPa"]
        assert [float(r["measured"]) for r in mine] == e["stress_kPa"].tolist()
        assert [int(r["row"]) for r in mine] == e.rows.tolist()
        after = LatticeStress(experiments).predict(e, model.values)[0]
        assert [float(r["extended_model"]) for r in mine] == pytest.approx(after.tolist(), rel=1e-9)
        assert after == pytest.approx(e["stress_kPa"], rel=0.02)
    assert model.nuisances["lattice_modulus_kPa"].value == pytest.approx(DRAWN_kPa, rel=0.1)


def test_the_report_says_it_in_a_sentence(overcured):
    html = (overcured[1] / "report.html").read_text(encoding="utf-8")
    assert "Verdict: <strong>overcure</strong>" in html
    assert "Light cures resin beyond the nominal surface, so every part is thicker; offset 0.0" in html
    assert "Next measurement." in html
    for title in ("Measured and predicted", "Rival explanations", "Error reduction", "Noise"):
        assert f">{title}</h2>" in html
    # A panel a channel of three blocks, rivals, gain, dependence, and what is left against two conditions.
    assert html.count("<figure") >= 6 + 3


def test_nothing_is_named_where_nothing_is_wrong(tmp_path):
    context, _ = run(weighed_blocks(tmp_path / "data", 0.0), tmp_path / "out", report=True)
    assert context.summary["verdict"] == "none"
    assert load_model(tmp_path / "out" / "model.toml").effects == {}
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Verdict: <strong>no model error detected</strong>" in html
    assert ">Error reduction</h2>" not in html


def test_three_moduli_of_the_paper_are_not_enough_to_tell(tmp_path):
    context, _ = run(PAPER, tmp_path)
    assert context.status == 0
    assert context.summary["verdict"] == "ambiguous"
    # Whoever applies it is told what else it may be; the same blocks weighed leave one cause.
    doubt = read_extended(load_preset("mu-1.0x"), tmp_path / "model.toml").doubt
    assert "overcure" in doubt
    assert "skin cure or viscoelasticity" in doubt
    weighed, _ = run(PAPER.parent / "weighed-moduli", tmp_path / "weighed")
    assert weighed.summary["headline"] == "overcure"
    assert read_extended(load_preset("mu-1.0x"), tmp_path / "weighed" / "model.toml").doubt == ""
    assert {"overcure", "skin cure"} <= set(re.split(", | or ", context.summary["headline"]))
    assert "weigh" in context.summary["next"].lower()
    # The extended model gives each unit the modulus that was measured at its scale, to the printed spread.
    for preset, kPa, spread in (
        ("mu-0.75x", 21.70, 0.35),
        ("mu-1.0x", 18.34, 1.86),
        ("mu-1.5x", 16.38, 1.21),
    ):
        extended = read_extended(load_preset(preset), tmp_path / "model.toml").unit
        assert extended.material.lattice_modulus_kPa == pytest.approx(kPa, abs=spread)
    assert load_model(tmp_path / "model.toml").nuisances["lattice_modulus_kPa"].unit == "kPa"
    assert any("3 x 3 x 3 cells between plates that hold" in words for words in context.summary["remarks"])


def test_a_unit_is_judged_by_its_angle_and_markers(clogged):
    """A clogged chamber; the unit's own simulation is stood in for by one that is written down."""
    out, messages = clogged / "study" / "evidence", json.loads((clogged / "said.json").read_text())
    summary = json.loads((out / "summary.json").read_text())
    assert summary["verdict"] == "named"
    assert [c["effect"] for c in summary["causes"]] == ["clogged_chamber"]
    # A first look comes before anything but the base is simulated: a clog is not among what it knows.
    first = summary["first_look"]
    assert "clogged" not in first["headline"]
    stages = [m["stage"] for m in messages if m["type"] == "progress" and m["state"] == "start"]
    assert stages[:3] == ["unit", "first look", "unit with each effect"]
    (finding,) = (m["what"] for m in messages if m["type"] == "finding")
    assert first["headline"] in finding
    assert not any("was averaged" in remark for remark in summary["remarks"])
    gain = summary["gain"]["held_out"]
    assert gain["unit"] == "deg"
    assert gain["rmse_after"] < 0.15 < gain["rmse_before"]
    assert 'name = "mu-1.0x"' in (out / "unit.toml").read_text()
    html = (out / "report.html").read_text(encoding="utf-8")
    assert "fast cycles" in html
    # What it was simulated as stands under the title.
    assert "held out; the unit as printed, walls" in html
    # Of each experiment the angle and the two markers that move most; the rest is in the table.
    assert f"{3 * (len(analytic.CHANNELS) - 3)} more channels are in residuals.csv." in html
    channels = {r["channel"] for r in csv.DictReader((out / "residuals.csv").open())}
    assert channels == set(analytic.CHANNELS)
    after = [
        float(r["measured"]) - float(r["extended_model"])
        for r in csv.DictReader((out / "residuals.csv").open())
        if r["channel"] == "angle_deg" and r["role"] == "held_out"
    ]
    assert np.sqrt(np.mean(np.square(after))) == pytest.approx(gain["rmse_after"], rel=0.3)


@pytest.mark.parametrize("gauge_kPa", [0.0, 0.02])
def test_a_gauge_s_noise_is_averaged_out_and_remarked_on(tmp_path, gauge_kPa):
    """Of what is predicted, which has noise as well, nothing is taken."""
    measured = read_folder(bent_unit(tmp_path, {}, gauge_kPa=gauge_kPa))
    freed, _ = denoised_drives(measured.experiments, analytic.simulator(measured.experiments))
    remarks = judged_data._noisy_gauges(measured.experiments, SimpleNamespace(experiments=freed))
    said = [re.match(r"the noise of pressure_kPa, up to ([0-9.]+), was averaged", r) for r in remarks]
    # The largest of the records' estimates.
    assert [float(m[1]) for m in said] == pytest.approx([gauge_kPa] * (gauge_kPa > 0), rel=0.15)
    changed = {
        c
        for e, own in zip(measured.experiments, freed, strict=True)
        for c in e.columns
        if not np.array_equal(e[c], own[c])
    }
    assert changed == ({"pressure_kPa"} if gauge_kPa else set())


RELAXES = {"viscoelasticity.share": 0.25, "viscoelasticity.time_s": 4.0}


@pytest.fixture
def analytic_unit(monkeypatch):
    """The response of the unit is that of the data's, in closed form."""
    monkeypatch.setattr(unit_fem, "unit_responses", lambda *_, **__: [analytic.response()])


def test_every_face_keeps_walls_apart(tmp_path, monkeypatch):
    folder = ROOT / "assets" / "examples" / "paper-bending"
    measured = read_folder(folder)
    started = [Diagnose(data=measured), DesignExperiments(data=measured)]
    monkeypatch.setattr(starting, "start", lambda job, *_: started.append(job))
    commands = [["diagnose", str(folder)], ["design-experiments", str(folder)]]
    commands += [[command, "--preset", "mu-1.0x"] for command in ("simulate", "place")]
    for words in commands:
        main([*words, "--out", str(tmp_path / "out")])
    assert [job.self_contact for job in started] == [True] * 6
    for words in commands:
        main([*words, "--no-self-contact", "--out", str(tmp_path / "out")])
    assert not any(job.self_contact for job in started[6:])
    node = definitions()["diagnose"]
    assert {s.name: s.description.default for s in node.settings} == {"self_contact": True}


def test_a_unit_of_softer_resin_is_trusted_with_its_own_moduli(tmp_path, analytic_unit):
    context, _ = run(bent_unit(tmp_path / "data", {"modulus_factor": 0.8}), tmp_path / "out", **ALL_SIZES)
    assert context.summary["verdict"] == "none"
    assert "with --model model.toml, whose moduli are 0.8 times the unit's" in context.summary["to_do"]


@pytest.mark.nightly("test_a_diagnosis_goes_on_with_what_it_knew")
def test_what_was_found_before_stays_and_a_new_cause_is_added(tmp_path, analytic_unit):
    first, _ = run(
        bent_unit(tmp_path / "first", RELAXES), tmp_path / "one", load_preset("mu-1.0x"), **ALL_SIZES
    )
    assert [c["effect"] for c in first.summary["causes"]] == ["viscoelasticity"]
    before = load_model(tmp_path / "one/model.toml")
    both = bent_unit(tmp_path / "both", RELAXES | {"pressure_offset.offset_kPa": 2.0}, seed=4)
    second, _ = run(both, tmp_path / "two", load_preset("mu-1.0x"), known=before, **ALL_SIZES)
    (cause,) = second.summary["causes"]
    assert cause["effect"] == "pressure_offset"
    assert cause["parameters"]["offset_kPa"]["value"] == pytest.approx(2.0, abs=0.2)
    after = load_model(tmp_path / "two/model.toml")
    assert list(after.effects) == ["viscoelasticity", "pressure_offset"]
    assert after.effects["viscoelasticity"] == before.effects["viscoelasticity"]
    assert any("known before" in words for words in second.summary["remarks"])
    # Data of the first kind hold nothing new.
    again = bent_unit(tmp_path / "again", RELAXES, seed=5)
    third, _ = run(again, tmp_path / "three", load_preset("mu-1.0x"), known=before, **ALL_SIZES)
    assert third.summary["verdict"] == "none"
    assert list(load_model(tmp_path / "three/model.toml").effects) == ["viscoelasticity"]


def test_a_diagnosis_goes_on_with_what_it_knew(tmp_path, overcured):
    blocks, out, _, _ = overcured
    known = load_model(out / "model.toml")
    assert known.effects
    keep_inputs(tmp_path / "two", Diagnose(data=read_folder(blocks), known=known).texts())
    assert Diagnose.read(tmp_path / "two").known == known


def test_a_softening_is_stated_with_the_pressure_it_is_relative_to():
    """A simulation through other pressures has the same softening, and so has a later diagnosis."""
    size = {"softening": Fitted(0.3, 0.01, 0.28, 0.32), "energy_share": Fitted(0.3, 0.01, 0.28, 0.32)}
    model = ExtendedModel("named", {"mullins_softening": size}, {})
    name, time, pressure, how = analytic.protocols(0.4, 1)[0]
    e = analytic.experiment(name, time, pressure, dict.fromkeys(analytic.CHANNELS, 0.0 * time), **how)
    simulators = {"unit_pressure": UnitPressure([analytic.response()], [e])}
    stated = judged_data.with_reference(model, simulators)
    reference = stated.effects["mullins_softening"]["reference_kPa"].value
    assert reference == np.abs(analytic.response().pressures_kPa).max()
    elsewhere = attrs.evolve(analytic.response(), pressures_kPa=2.0 * analytic.response().pressures_kPa)
    stiffer = {"unit_pressure": UnitPressure([elsewhere], [e])}
    found = Composite(stiffer, known=stated.of_effects)
    assert "mullins_softening" not in [effect.name for effect in found.effects]
    values = {"mullins_softening.reference_kPa": reference, **model.values}
    np.testing.assert_allclose(found.predict(e, {}), stiffer["unit_pressure"].predict(e, values))
    assert not np.allclose(found.predict(e, {}), stiffer["unit_pressure"].predict(e, model.values), rtol=1e-3)


def test_causes_of_one_owner_are_told_together():
    several = ["strut_thickness among specimens", "overcure among specimens"]
    later = "step_change of tests from d 0.9, fast on"
    assert alternatives(several) == "strut thickness or overcure among specimens"
    assert alternatives([*several, later]) == (
        "strut thickness or overcure among specimens; or step change of tests from “d 0.9, fast” on"
    )
    assert alternatives(["anisotropy", "leak of specimen B", "self_heating"]) == (
        "anisotropy or self-heating; or leak of specimen B"
    )
    assert alternatives(["overcure", later]) == "overcure or step change of tests from “d 0.9, fast” on"


def test_a_parameter_of_one_specimen_is_told_without_its_unit():
    size = Parameter("thicker_mm of specimen d_1", "mm", -0.4, 0.6, 0.0, (), "")
    assert bare(size) == "thicker of specimen d_1"


def test_there_is_something_to_do_about_every_cause():
    assert what_to_do(("leak", "leak")).count(".") == 1
    texts = [t for e in DECLARED.values() for t in (e.mechanism, e.reveals, e.remedy, *e.shown_by.values())]
    assert all(text and not text.endswith(".") for text in texts)


def test_the_page_says_first_what_to_do(overcured):
    _, out, summary, _ = overcured
    assert "export --compensate" in summary["to_do"]
    html = (out / "report.html").read_text(encoding="utf-8")
    assert html.index("What to do.") < html.index("Next measurement")


def test_a_printed_diagnosis_takes_longer_with_more_chambers_and_where_walls_touch():
    measured = read_folder(ROOT / "assets" / "examples" / "paper-bending")
    small = load_preset("mu-1.0x")
    small = attrs.evolve(small, chambers=attrs.evolve(small.chambers, count=3))
    pressed = [e for e in measured.experiments if e["pressure_kPa"].min() > 0.0]

    def seconds(unit, experiments):
        return dict(simulations_plan(experiments, unit, UnitSettings()))["unit"]

    every = measured.experiments
    assert seconds(load_preset("mu-1.0x"), every) == pytest.approx(2.0**1.6 * seconds(small, every))
    assert seconds(small, every) == 2.0 * seconds(small, pressed)
