"""The pages' tables are those of the CSV files that benchmarks write, and pages keep short."""

import sys
from pathlib import Path

import pytest

from benchmarks import figures

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PRINTED = """2026-11-25; CPU, 2 cores, load 0.1 at the start; commit abc

### Sphere

| mesh | value |
| --- | --- |
| coarse | 1 |
| fine | 2 |

### Tube

| mesh | value |
| --- | --- |
| coarse | 3 |
"""


@pytest.mark.parametrize("page", sorted((DOCS / "engineering").glob("*.md")), ids=lambda page: page.stem)
def test_a_page_shows_the_figures_of_its_files(page):
    text = page.read_text(encoding="utf-8")
    assert figures.filled(text) == text, "run `python -m benchmarks.figures fill`"


def test_a_figure_that_no_page_shows_is_none():
    shown = {
        m[2] for page in (DOCS / "engineering").glob("*.md") for m in figures.MARK.finditer(page.read_text())
    }
    assert shown == {path.stem for path in figures.FIGURES.glob("*.csv")}


def test_what_a_benchmark_prints_becomes_a_table(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "FIGURES", tmp_path)
    path = figures.record("toy", [sys.executable, "-c", f"print({PRINTED!r})"])
    assert path.read_text().splitlines()[1:4] == [
        "# 2026-11-25; CPU, 2 cores, load 0.1 at the start; commit abc",
        "case,mesh,value",
        "Sphere,coarse,1",
    ]
    page = figures.filled("<!-- figures/toy.csv -->\n| old |\n\n*old*\nrest", tmp_path)
    assert "| Tube | coarse | 3 |\n\n*`" in page
    assert page.endswith("commit abc*\nrest")
    assert figures.filled(page, tmp_path) == page
    with pytest.raises(ValueError, match="no table"):
        figures.record("toy", [sys.executable, "-c", "print(1)"])


def test_the_last_row_of_each_pair_can_be_kept(tmp_path):
    (tmp_path / "toy.csv").write_text("# c\n# m\ncase,element,cells\na,P1,2\na,P1,4\na,P2,2\n")
    assert figures.table(tmp_path / "toy.csv", last=True)[0].splitlines()[2:] == [
        "| a | P1 | 4 |",
        "| a | P2 | 2 |",
    ]


def test_pages_keep_short():
    words = {page: len(page.read_text(encoding="utf-8").split()) for page in DOCS.rglob("*.md")}
    assert sum(words.values()) <= 35_000
    # The table of parameters is made for searching.
    guide = [page for page in words if page.parent.name == "guide" and page.stem != "parameters"]
    assert [page.name for page in guide if words[page] >= 1500] == []
