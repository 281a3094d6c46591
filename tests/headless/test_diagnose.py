"""`diagnose` and `--model` as their users run them."""

import json
from pathlib import Path

import pytest

from tests.usecases.diagnosis_data import weighed_blocks

from .processes import here

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
