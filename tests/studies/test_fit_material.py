"""fit-material from folder to report."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from mu_addon.materials.coupon import incompressible
from mu_addon.materials.law_forms import FORMS
from mu_addon.materials.library import read_material
from mu_addon.measured import read_folder
from mu_addon.studies.fit_material import FitMaterial

from .unit_runs import ended

DATA = Path(__file__).parent.parent / "data"


def run(folder, out, **options):
    context, messages = ended(FitMaterial(data=read_folder(folder), **options), out)
    assert context.status == 0, messages[-1]
    return context


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    out = tmp_path_factory.mktemp("fit")
    context = run(DATA / "treloar", out, laws=("neo-hooke", "yeoh", "ogden-1"), hold_out=("equibiaxial",))
    return out, context.summary, context.console_summary({})


def test_a_fit_leaves_a_material_that_gives_the_stresses_of_its_table(fitted):
    out, summary, _ = fitted
    material = read_material(out / "material.toml")
    assert material.law.name == "Yeoh"
    assert (summary["chosen"], summary["chosen_by"]) == ("yeoh", "held out")
    assert material.fails == tuple(summary["laws"]["yeoh"]["fails"])
    assert material.low95["c1_MPa"] < material.parameters[0] < material.high95["c1_MPa"]
    material.require_stable()
    rows = list(csv.DictReader((out / "fit.csv").open()))
    assert len(rows) == 24 + 16 + 13
    assert {r["role"] for r in rows if r["mode"] == "equibiaxial"} == {"held_out"}
    for mode in ("uniaxial", "equibiaxial", "pure_shear"):
        mine = [r for r in rows if r["mode"] == mode]
        stretch = np.array([float(r["stretch"]) for r in mine])
        stress = incompressible(material.law, material.parameters, mode, stretch)
        assert stress == pytest.approx([float(r["yeoh_MPa"]) for r in mine], rel=1e-12)


def test_the_tables_say_what_the_summary_says(fitted):
    out, summary, _ = fitted
    assert json.loads((out / "summary.json").read_text())["status"] == "complete"
    for row in csv.DictReader((out / "parameters.csv").open()):
        p = summary["laws"][row["law"]]["parameters"][row["parameter"]]
        assert float(row["value"]) == p["value"]
    errors = list(csv.DictReader((out / "errors.csv").open()))
    assert len(errors) == 3 * 3
    neo = next(e for e in errors if (e["law"], e["mode"]) == ("neo-hooke", "uniaxial"))
    assert float(neo["share"]) > 0.1
    assert "uniaxial" in summary["laws"]["neo-hooke"]["fails"]
    # Two modes were fitted, so each can be predicted from the other.
    assert set(summary["laws"]["yeoh"]["unseen"]) == {"uniaxial", "pure_shear"}


def test_the_terminal_is_told_in_a_few_lines(fitted):
    lines = fitted[2]
    assert lines[0].startswith("law: yeoh, c1_MPa 0.")
    assert "in equibiaxial" in lines[1]
    assert lines[2] == "error on equibiaxial exceeds 10%"


def test_the_report_answers_and_warns(fitted):
    html = (fitted[0] / "report.html").read_text(encoding="utf-8")
    assert "Recommended law: <strong>Yeoh</strong>" in html
    assert "but it does not fit equibiaxial" in html
    assert "Yeoh has an error on equibiaxial" in html
    assert html.count("<figure>") == 6


def test_one_mode_alone_brings_a_warning_of_the_others(tmp_path):
    """A resin's datasheet gives little more than this: stress at some strains, pulled one way."""
    folder = tmp_path / "data"
    folder.mkdir()
    rng = np.random.default_rng(2)
    stretch = np.linspace(1, 2.5, 40)[1:]
    stress = incompressible(FORMS["yeoh"].law, [0.5, 0.02, 0.004, 1], "uniaxial", stretch)
    rows = "".join(
        f"{s:.5f},{1e3 * p:.3f}\n"
        for s, p in zip(stretch - 1, stress * (1 + 0.01 * rng.normal(size=39)), strict=True)
    )
    (folder / "pull.csv").write_text("strain,stress_kPa\n" + rows)
    (folder / "experiments.toml").write_text(
        '[[experiment]]\nname = "pull"\nkind = "coupon"\nfile = "pull.csv"\nrole = "fit"\nmode = "uniaxial"\n'
    )
    context = run(folder, tmp_path / "out", laws=("yeoh", "ogden-1", "ogden-2"), weights="relative")
    assert set(context.summary["untested"]) == {"equibiaxial", "pure_shear"}
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Equibiaxial was not tested. There, laws that fit the other modes differ by a factor of" in html
    assert "relative" in (tmp_path / "out" / "fit-material.toml").read_text()
