"""A report is one page of a study's parts that asks nothing of any server; a ranking's parts answer first."""

import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from mu_addon.design.parameters import assumed
from mu_addon.report.results import Picture
from mu_addon.run.parts import Beside, Chart, Fact, Pictures, Sentence, Table, Warn, flat
from mu_addon.run.study import Section

from ..coarse_pictures import coarse_pictures  # noqa: F401 - for every test here
from . import report_data
from .report_data import J_HAT, PATHS, SOLID, STUDY, ranking

VOID = {"meta", "link", "img", "br", "hr"}
SVG = '<svg xmlns="http://www.w3.org/2000/svg"/>'


class Page(HTMLParser):
    """Tags checked for balance, with the text and the attributes that tests ask for."""

    def __init__(self, html):
        super().__init__()
        self.open, self.tags, self.words, self.headings = [], [], "", []
        self.feed(html)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "title"):
            self.words += data
            if self.open[-1] == "h2":
                self.headings.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def html_of(folder, parts, title="Section", summary=None, **more):
    """The report of parts, first without a section and then in one; title: of all that has one."""
    (folder / "any.csv").touch()
    study = SimpleNamespace(heading=lambda: (title, title), texts=dict, files={"any.csv": title})
    shown = [(Section("", "", None), parts), (Section("own", title, None), parts)]
    return report_data.page(study, shown, folder, summary or {}, **more)


def test_text_cannot_become_markup(tmp_path):
    evil = '<img src="http://x/">&"'
    parts = [
        Sentence(evil, answer=True, strong=evil),
        Sentence(evil, note=True),
        Fact(evil, 1.0, evil),
        Beside([Table(evil, [(evil, ""), (evil, "n")], [[evil, evil]], groups=[(evil, 2)])]),
        Chart(lambda: SVG, evil, evil),
        Pictures(lambda: [("", Picture(b"", evil, evil))], scale=Chart(lambda: SVG, evil)),
    ]
    summary = {"warnings": [evil], "model": {"applied": [evil]}, "seconds": {evil: 1.0}}
    page = Page(html_of(tmp_path, parts, evil, summary=summary, stopped=evil))
    assert all(image["src"].startswith("data:") for image in page.all("img"))
    assert {image["alt"] for image in page.all("img")} == {evil, "Bar chart of seconds per stage."}
    # Twice eleven texts of the parts, notes of both, the title twice, the section's name twice, file and why.
    assert page.words.count(evil) >= 30


def test_what_its_words_and_numbers_look_like(tmp_path):
    cells = ["a", 1234567, np.int64(-1234), np.float32(0.5), True, -3.0, "FAILED"]
    parts = [
        Table("", [("", "")] * len(cells), [cells]),
        Pictures(lambda: [("", Picture(b"", "alpha4 at -20 kPa: -0.0°", "a picture"))]),
        Fact("angle", -12.5, "-12.5°"),
    ]
    page = Page(html_of(tmp_path, parts))
    assert "a1\u202f234\u202f567-1\u202f2340.5yes−3FAILED" in page.words
    assert "α₄ at −20 kPa: 0.0°" in page.words
    assert "angle−12.5°" in page.words
    assert {"class": "fail"} in page.all("td")


def test_a_stopped_run_says_so_first_and_draws_nothing(tmp_path):
    parts = [Sentence("A finding.", answer=True), Chart(lambda: pytest.fail("takes long"), "c"), Warn("told")]
    page = Page(html_of(tmp_path, parts, stopped="stopped by Ctrl-C", hurried=True))
    assert page.words.index("This run is partial: stopped by Ctrl-C.") < page.words.index("A finding.")
    assert page.headings == ["Section", "Files of this run", "Versions"]
    assert not page.all("img")


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    return report_data.report(tmp_path_factory.mktemp("report"), ranking())


def test_asks_nothing_of_any_server(html):
    page = Page(html)
    assert not page.all("script")
    view, bars, maps, scales, marginals, seconds = 2, 1, 10, 1, 2, 1
    assert len(page.all("img")) == view + bars + maps + scales + marginals + seconds
    for image in page.all("img"):
        assert image["src"].startswith(("data:image/svg+xml;base64,", "data:image/png;base64,"))
        assert len(image["alt"]) > 5
    assert [link["href"] for link in page.all("link")] == ["data:,"]
    assert all(link["href"].startswith("#") for link in page.all("a"))
    assert not re.search(r"https?://|@import|url\(", re.sub(r"base64,[A-Za-z0-9+/=]+", "", html))


def test_the_answer_comes_first(html):
    page = Page(html)
    assert page.headings[:4] == [
        "Ranking of the paths",
        "Deviation of each path over length and time",
        "Mean deviation along the unit and over time",
        "Assumptions",
    ]
    answer = page.words.index("Put the sensor along α₄, anchors P4 to P6")
    assert answer < page.words.index("Ranking of the paths")
    section = page.words[page.words.index("The paper does not give these values") :]
    wall = next(a for a in assumed(STUDY.unit) if a.path == "chambers.wall_mm")
    assert f"{wall.path}{STUDY.unit.chambers.wall_mm:g}mm{wall.reason}" in section


def texts(parts):
    """Sentences, captions and cells of parts, and the charts that are no pictures of the unit."""
    found = []
    for part in flat([*parts]):
        found += [part.text] if isinstance(part, Sentence | Warn) else []
        found += [part.caption] if isinstance(part, Chart | Table) else []
        found += [cell for row in part.rows for cell in row] if isinstance(part, Table) else []
        found += [part.name, part.shown] if isinstance(part, Fact) and part.shown else []
    return found


def test_a_ranking_tells_every_path_and_ties_where_there_are_any():
    told = texts(STUDY.answer(SOLID, ranking()))
    assert any("of 10 candidates it has the smallest mean deviation, 0.048 mm." in text for text in told)
    assert "best path: alpha4, J_hat 0.0481 mm, tied with alpha1" in told
    assert any("tied with α₁; they differ by less than the uncertainty (0.030 mm)" in text for text in told)
    J_hat = {f"{value:.4f}" for value in ranking().J_hat_mm.values()}
    assert J_hat <= {*texts(STUDY.ranks(None, ranking()))}
    alone = ranking(uncertainty_mm=None)
    assert not any("tied" in text for text in texts([*STUDY.answer(SOLID, alone), *STUDY.ranks(None, alone)]))


def test_instants_that_are_not_compared_stay_empty():
    """Where one path has no equilibrium no map has a row, and no figure a NaN."""
    one = ranking(missed=slice(3, 9), not_reached=("from 1 s on",))
    parts = [*STUDY.ranks(None, one), *STUDY.maps(one), *STUDY.marginals(one)]
    told = texts(parts)
    assert any(text.endswith("Empty rows are not compared.") for text in told)
    assert "Paths are not compared from 1 s on." in told
    charts = [part.make() for part in flat(parts) if isinstance(part, Chart)]
    assert not [text for text in (*told, *charts) if re.search(r"\bnan\b", text, re.IGNORECASE)]


def test_a_path_that_cannot_win_shows_its_bound_and_no_rank():
    bound = float(np.sort(0.31 * J_HAT)[5] + 1e-4)
    others = {"alpha8": bound, "alpha10": bound}
    one = ranking(without=others, at_least_mm=others)
    (table,) = (part for part in flat([*STUDY.ranks(None, one)]) if isinstance(part, Table))
    of_others = [row[2:4] for row, path in zip(table.rows, PATHS, strict=True) if path.name in others]
    assert of_others == [["", f"≥ {bound:.4f}"]] * 2
    told = texts([*STUDY.answer(SOLID, one), *STUDY.ranks(None, one)])
    assert "2 others" in told
    assert any("certainly exceeded" in text for text in told)


def test_estimates_are_shown_as_long_as_no_path_is_ranked():
    estimates = {"estimate": {"alpha4": 0.31, "alpha1": 0.47}}
    early, late = (texts(STUDY.estimated(estimates, found)) for found in (None, ranking()))
    assert "Estimated mean deviation, least first." in early
    assert {"0.31", "0.47"} <= {*early}
    assert late == ["estimated mean deviation [mm]: alpha4 0.31, alpha1 0.47"]
