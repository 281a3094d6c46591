"""The page on import: its table of decisions is the code's."""

from importlib import import_module
from pathlib import Path

from mu_addon.lab_files.decisions import DECISIONS

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_guide_has_the_rules_by_which_the_data_decide():
    page = (DOCS / "guide/measure.md").read_text(encoding="utf-8")
    rows = [f"| {of} | {rule} | `{override}` |" for of, (rule, override, _) in DECISIONS.items()]
    assert "\n".join(rows) in page
    for _, _, by in DECISIONS.values():
        module, name = by.split(".")
        assert callable(getattr(import_module(f"mu_addon.lab_files.{module}"), name))
