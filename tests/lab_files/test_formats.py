"""The page on import: its table of decisions is the code's."""

from importlib import import_module
from pathlib import Path

from mu_addon.lab_files.decisions import DECISIONS

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_guide_has_the_rules_by_which_the_data_decide():
    page = (DOCS / "guide/measure.md").read_text(encoding="utf-8")
    rows = [f"| {one.of} | {one.rule} | `{one.override}` |" for one in DECISIONS.values()]
    assert "\n".join(rows) in page
    for one in DECISIONS.values():
        module, name = one.by.split(".")
        assert callable(getattr(import_module(f"mu_addon.lab_files.{module}"), name))
