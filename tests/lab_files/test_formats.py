"""The pages on import: the table of decisions is the code's, the example of a format reads a file."""

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from mu_addon.lab_files import formats, source
from mu_addon.lab_files.decisions import DECISIONS
from mu_addon.lab_files.understood import understand

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_guide_has_the_rules_by_which_the_data_decide():
    page = (DOCS / "guide/measure.md").read_text(encoding="utf-8")
    rows = [f"| {one.of} | {one.rule} | `{one.override}` |" for one in DECISIONS.values()]
    assert "\n".join(rows) in page
    for one in DECISIONS.values():
        module, name = one.by.split(".")
        assert callable(getattr(import_module(f"mu_addon.lab_files.{module}"), name))


def test_a_format_is_one_module_as_the_page_shows(tmp_path, monkeypatch):
    from scipy.io import savemat

    page = (DOCS / "engineering/extend.md").read_text(encoding="utf-8")
    module = {"__package__": formats.__name__}
    exec(re.search(r"`matlab\.py`:\n\n```\n(.*?)```", page, re.DOTALL)[1], module)
    monkeypatch.setattr(source, "FORMATS", (module["read"], *formats.FORMATS))
    pull = 0.1 * np.arange(30)
    savemat(tmp_path / "pull.mat", {"displacement_mm": pull, "force_N": 2.0 * pull})
    answers = {"kind": "coupon", "mode": "uniaxial", "section_mm": "12.5x3", "length_mm": "40"}
    (proposal,) = understand([tmp_path / "pull.mat"], answers).proposals
    assert proposal.columns["force_N"] == pytest.approx(2.0 * pull)
