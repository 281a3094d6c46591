"""Each nightly test has a quick one that runs by default, and stands in the table of the docs."""

import ast

from tests import nightly


def test_a_quick_test_guards_by_day_where_one_is_run_at_night():
    wrong = []
    for (file, name), (where, quick) in nightly.every().items():
        path = nightly.ROOT / where
        names = {node.name for node in nightly.parsed(path).body if isinstance(node, ast.FunctionDef)}
        if quick not in names - nightly.wholly_marked(path):
            wrong.append(f"{file}::{name}: {where}::{quick} is no test that runs by default")
    assert wrong == []


def test_the_page_lists_every_nightly_test():
    """After a change of the marks: `python -m tests.nightly`."""
    assert set(nightly.dates()) == {f"{file}::{name}" for file, name in nightly.every()}


def test_a_run_at_night_dates_what_passed_and_keeps_other_dates(tmp_path, monkeypatch):
    monkeypatch.setattr(nightly, "PAGE", tmp_path / "nightly.md")
    tests = {("t.py", "test_a"): ("t.py", "test_q"), ("t.py", "test_b"): ("u.py", "test_r")}
    monkeypatch.setattr(nightly, "every", lambda: tests)
    nightly.write({"t.py::test_a"})
    assert nightly.dates()["t.py::test_b"] == ""
    written = nightly.dates()["t.py::test_a"]
    assert written.count("-") == 2
    nightly.write()
    assert nightly.dates()["t.py::test_a"] == written
