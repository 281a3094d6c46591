"""Tests that run at night: left out by default, each with a quick one that guards against the same fault.

`@pytest.mark.nightly("NAME")` names the quick one, in the same file or as `tests/...py::NAME`.
`python -m pytest -m nightly` runs them and writes the date of those that passed into the page PAGE;
`python -m tests.nightly` writes the table anew without a run, after a change of the marks.
"""

import ast
import datetime
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "engineering" / "nightly.md"
HEAD = """# Tests that run at night

`.venv/bin/python -m pytest -m nightly` runs these and dates those that pass. Beside each stands its guard by
day; without one, its other parameters guard.

test|guard by day|passed
---|---|---
"""


@cache
def parsed(file):
    """The syntax tree of a file."""
    return ast.parse(file.read_text(encoding="utf-8"))


def marked(file):
    """Nightly tests of a file: name -> test that guards by day."""
    found = {}
    tree = parsed(file)
    assigned = [n for n in tree.body if isinstance(n, ast.Assign)]
    of_all = _quick_test(filter(_is_pytestmark, assigned))
    constants = {t.id: n.value for n in assigned for t in n.targets if isinstance(t, ast.Name)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            named = [n.id for d in node.decorator_list for n in ast.walk(d) if isinstance(n, ast.Name)]
            marks = [constants[name] for name in named if name in constants]
            quick = _quick_test([*node.decorator_list, *marks]) or of_all
            if quick:
                found[node.name] = quick
    return found


def wholly_marked(file):
    """Nightly tests of a file of which no set of parameters runs by default."""
    tree = parsed(file)
    if any(isinstance(n, ast.Assign) and _is_pytestmark(n) and _quick_test([n]) for n in tree.body):
        return set(marked(file))
    direct = {
        node.name: [d for d in node.decorator_list if isinstance(d, ast.Call) and _is_nightly(d)]
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
    }
    return {name for name, marks in direct.items() if marks}


def _is_pytestmark(node):
    return any(isinstance(target, ast.Name) and target.id == "pytestmark" for target in node.targets)


def _is_nightly(node):
    return isinstance(node.func, ast.Attribute) and node.func.attr == "nightly"


def _quick_test(nodes):
    calls = [n for node in nodes for n in ast.walk(node) if isinstance(n, ast.Call) and _is_nightly(n)]
    return calls[0].args[0].value if calls else None


def every():
    """All nightly tests: (file, name) -> (file, name) of the test that guards by day."""
    found = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        file = path.relative_to(ROOT).as_posix()
        for name, quick in marked(path).items():
            where, _, what = quick.rpartition("::")
            found[file, name] = where or file, what
    return found


def dates():
    """Date on which each test of the page last passed, by `FILE::NAME`."""
    if not PAGE.exists():
        return {}
    rows = [line.split("|") for line in PAGE.read_text(encoding="utf-8").splitlines()]
    return {row[0].strip("` "): "".join(row[2:]).strip() for row in rows if "::" in row[0]}


def write(passed=()):
    """The page, with today's date for the tests that passed."""
    known, today = dates(), datetime.date.today().isoformat()
    rows = []
    for (file, name), (where, quick) in every().items():
        test = f"{file}::{name}"
        guard = f"`{quick}`" if where == file else f"`{where}::{quick}`"
        date = today if test in passed else known.get(test, "")
        cells = [f"`{test}`", "" if (where, quick) == (file, name) else guard, date]
        rows.append("|".join(cells).rstrip("|") + "\n")
    PAGE.write_text(HEAD + "".join(rows), encoding="utf-8")


class Night:
    """Collects what passes and what does not in a run of the nightly tests; writes the page at its end."""

    def __init__(self):
        self.outcomes = {}

    def pytest_runtest_logreport(self, report):
        if "nightly" in report.keywords and (report.when == "call" or not report.passed):
            self.outcomes.setdefault(report.nodeid.partition("[")[0], []).append(report.passed)

    def pytest_unconfigure(self):
        if self.outcomes:
            write({test for test, passed in self.outcomes.items() if all(passed)})


if __name__ == "__main__":
    write()
