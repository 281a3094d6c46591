"""The examples of the pages on Python and on extending run as they stand, and print what is shown."""

import ast
import contextlib
import inspect
import io
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("guide/python.md", "guide/print.md", "engineering/extend.md")
EXAMPLES = [
    example
    for page in PAGES
    for example in re.findall(
        r"```python\n(.*?)```\s*```text\n(.*?)```",
        (ROOT / "docs" / page).read_text(encoding="utf-8"),
        re.DOTALL,
    )
]


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?")


@pytest.fixture
def printed(tmp_path, monkeypatch):
    """What a script prints, run from the repository with the package that is tested here."""
    monkeypatch.chdir(ROOT)

    def output(code):
        script, text = tmp_path / "example.py", io.StringIO()
        script.write_text(code, encoding="utf-8")
        with contextlib.redirect_stdout(text):
            runpy.run_path(str(script))
        return text.getvalue()

    return output


def require_alike(found, shown):
    """Equal words, and numbers within what a mesher without a seed scatters: E[100] by 3.4 % in ten runs."""
    assert NUMBER.sub("#", found).split() == NUMBER.sub("#", shown).split()
    figures = [[float(number) for number in NUMBER.findall(text)] for text in (found, shown)]
    assert figures[0] == pytest.approx(figures[1], rel=0.05)


@pytest.mark.nightly("test_every_example_names_what_there_is")
def test_ten_lines_lead_from_a_preset_to_an_angle(printed):
    require_alike(printed(EXAMPLES[0][0]), EXAMPLES[0][1])


def test_the_first_example_has_ten_lines():
    lines = EXAMPLES[0][0].splitlines()
    assert len([line for line in lines if line and not line.startswith(("import", "from"))]) <= 10


BY_NIGHT = pytest.mark.nightly("test_every_example_names_what_there_is")


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [pytest.param(n, marks=BY_NIGHT) if n in (1, 2, 3) else n for n in range(1, len(EXAMPLES))],
)
def test_the_other_examples_print_what_the_page_shows(number, printed):
    code, shown = EXAMPLES[number]
    require_alike(printed(code), shown)


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_every_example_names_what_there_is(number):
    """Imports, and the keywords of calls of what is imported."""
    tree = ast.parse(EXAMPLES[number][0])
    names = {}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            exec(compile(ast.Module([node], []), "example", "exec"), names)
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and callable(names.get(node.func.id))
        ):
            signature = inspect.signature(names[node.func.id])
            signature.bind_partial(*node.args, **{k.arg: k.value for k in node.keywords if k.arg})
