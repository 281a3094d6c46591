"""`diagnose` and `--model` as their users run them."""

import json
from pathlib import Path

import pytest

from mu_addon.design.assets import asset_root
from mu_addon.design.parameters import read_unit
from tests.usecases.diagnosis_data import weighed_blocks

from .processes import assert_clear_failure, here

REAL = Path(__file__).resolve().parents[1] / "data" / "real"


@pytest.fixture(scope="module")
def overcured(tmp_path_factory):
    root = tmp_path_factory.mktemp("diagnose")
    done = here("diagnose", weighed_blocks(root / "data", 0.09), "--out", root / "why")
    assert done.returncode == 0, done.stderr
    return root / "why", done


def test_it_leaves_verdict_model_and_report(overcured):
    out, done = overcured
    assert "verdict: named: overcure" in done.stdout
    assert "effects: done" in done.stderr
    assert json.loads((out / "summary.json").read_text())["status"] == "complete"
    for name in ("verdict.json", "model.toml", "residuals.csv", "report.html"):
        assert (out / name).stat().st_size > 100


def test_json_ends_with_the_result(tmp_path):
    done = here("diagnose", REAL / "silicone_beam", "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    assert last["type"] == "result"
    assert last["summary"]["verdict"] in ("none", "named", "ambiguous", "unidentifiable", "unexplained")


@pytest.mark.nightly(
    "tests/usecases/test_named_effects.py::test_the_command_line_simulates_what_a_diagnosis_found"
)
def test_homogenize_takes_the_model(overcured, tmp_path):
    model = overcured[0] / "model.toml"
    stiff = {}
    for name, more in (("drawn", ()), ("printed", ("--model", model))):
        out = tmp_path / name
        words = (
            "--preset",
            "mu-1.0x",
            "--friction",
            "none",
            "--refine",
            "0.5",
            "--no-report",
            "--out",
            out,
            *more,
        )
        done = here("homogenize", *words)
        assert (f"applied from {model}: " in done.stdout) == bool(more)
        assert done.returncode == 0, done.stderr
        stiff[name] = json.loads((out / "summary.json").read_text())["moduli_kPa"]["E100"]
    assert read_unit(tmp_path / "printed" / "unit.toml").print.offset_xy_mm == pytest.approx(0.09, rel=0.2)
    summary = json.loads((tmp_path / "printed" / "summary.json").read_text())
    assert "every printed surface moves outward" in summary["model"]["applied"][0]
    # Struts 10 % thicker that bend: nearly half as stiff again.
    assert 1.3 < stiff["printed"] / stiff["drawn"] < 1.8


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[effect.magic.size]\nvalue = 1.0\n", ("magic", "[effect.magic]")),
        ("[effect.wall_thickness.factor]\nvalue = 40.0\n", ("wall_thickness.factor", "model.toml")),
        ("[effect.overcure.offset_mm]\nvalue = 'thick'\n", ("effect.overcure.offset_mm", "no value")),
    ],
)
def test_a_model_that_cannot_be_used_is_named(tmp_path, text, words):
    model = tmp_path / "model.toml"
    model.write_text(f'verdict = "named"\n{text}')
    done = here("simulate", "--preset", "mu-1.0x", "--model", model, "--out", tmp_path / "out")
    assert_clear_failure(done, 2, *words)


def test_bad_data_are_named_by_file_and_row(tmp_path):
    folder = weighed_blocks(tmp_path / "data", 0.0)
    (folder / "block_1.csv").write_text("strain,stress_kPa\n0,0\n0.1,much\n")
    done = here("diagnose", folder, "--out", tmp_path / "out")
    assert_clear_failure(done, 2, "block_1.csv", "row 3", "much")
    assert not (tmp_path / "out").exists()


def test_unknown_dimensions_of_a_unit_need_experiments_on_one(tmp_path):
    examples = asset_root() / "examples"
    unknown = examples / "paper-bending" / "unknown.toml"
    done = here("diagnose", examples / "paper-moduli", "--unknown", unknown, "--out", tmp_path / "out")
    assert_clear_failure(done, 2, "no experiment bends a unit", "leave --unknown out")


def test_no_folder_is_named(tmp_path):
    assert_clear_failure(
        here("diagnose", tmp_path / "nowhere", "--out", tmp_path / "out"), 2, "experiments.toml"
    )


def test_design_experiments_says_what_would_be_seen(tmp_path):
    folder = weighed_blocks(tmp_path / "data", 0.0)
    done = here("design-experiments", folder, "--noise", "stress=0.2", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "overcure: detectable from offset 0.0" in done.stdout
    done = here("design-experiments", folder, "--noise", "stress=little", "--out", tmp_path / "other")
    assert_clear_failure(done, 2, "stress=little", "--noise")
