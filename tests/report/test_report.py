"""The report answers first, hides nothing, and asks nothing of any server."""

import re
from html.parser import HTMLParser

import attrs
import numpy as np
import pytest

from mu_addon.errors import OutputError
from mu_addon.report.results import Gate, Parameter, Picture, ReportData
from mu_addon.usecases.simulate_and_place.report import report_html, write_html

from .report_data import png, results

VOID = {"meta", "link", "img", "br", "hr"}


def brief(**changes):
    """A run without charts, for what does not need them."""
    none = np.zeros(0)
    charts = {
        "ranking": None,
        "pictures": (),
        "view": None,
        "angle_deg": none,
        "protocol_s": none,
        "seconds": {},
    }
    return results(**{**charts, **changes})


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


@pytest.fixture(scope="module")
def html():
    return report_html(results())


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_sections_in_the_order_a_designer_reads(page):
    assert page.headings == [
        "Ranking of the paths",
        "Motion of the unit",
        "Deviation of each path over length and time",
        "Mean deviation along the unit and over time",
        "Solid, mesh and solver",
        "Assumptions",
        "All parameters",
        "Computing time of each stage",
        "Files of this run",
        "Versions",
    ]


def test_the_answer_comes_first(page):
    answer = page.words.index("Put the sensor along α₄, anchors P4 to P6")
    assert answer < page.words.index("Ranking of the paths")
    assert "of 10 candidates it has the smallest mean deviation, 0.048" in page.words
    assert "tied with α₁" in page.words


def test_captions_are_set_in_type():
    html = report_html(brief(pictures=(Picture(png(), "alpha4 at -20 kPa: -0.0°", "a picture"),)))
    assert "α₄ at −20 kPa: 0.0°" in html


def test_asks_nothing_of_any_server(html, page):
    assert not page.all("script")
    for image in page.all("img"):
        assert image["src"].startswith(("data:image/svg+xml;base64,", "data:image/png;base64,"))
        assert len(image["alt"]) > 5
    assert [link["href"] for link in page.all("link")] == ["data:,"]
    assert all(link["href"].startswith("#") for link in page.all("a"))
    assert not re.search(r"https?://|@import|url\(", re.sub(r"base64,[A-Za-z0-9+/=]+", "", html))


def test_every_picture_is_there(page):
    view, pictures, rankings, motion, seconds, heatmaps, scales, marginals = 1, 4, 1, 2, 1, 10, 1, 2
    expected = view + pictures + rankings + motion + seconds + heatmaps + scales + marginals
    assert len(page.all("img")) == expected


def test_every_path_is_in_the_table(page):
    for value in results().ranking.j_hat:
        assert f"{value:.4f}" in page.words


def test_assumptions_are_told_with_their_reason(page):
    section = page.words[page.words.index("The paper does not give these values") :]
    assert "chambers.wall_mm0.8mmthe thinnest wall that this printer holds" in section


def test_partial_says_so_at_the_top(page):
    words = Page(report_html(brief(status="partial", reason="Stopped by Ctrl-C in stage paths."))).words
    assert words.index("This run is partial.") < words.index("Solid, mesh and solver")
    assert "Stopped by Ctrl-C in stage paths." in words
    assert "This run is partial" not in page.words


def test_a_run_that_stopped_early_shows_what_it_has():
    page = Page(report_html(ReportData("t", "u", status="partial", seconds={"solid": 1.0})))
    assert page.headings == ["Computing time of each stage"]
    page = Page(report_html(results(status="partial", ranking=None)))
    assert len(page.all("img")) == 1 + 4 + 2 + 1
    assert "Put the sensor" not in page.words
    assert "Ranking of the paths" not in page.headings
    assert "Motion of the unit" in page.headings


def test_text_cannot_become_markup():
    evil = '<img src="http://x/">&"'
    page = Page(
        report_html(
            brief(
                title=evil,
                unit=evil,
                warnings=(evil,),
                status="partial",
                reason=evil,
                parameters=(Parameter(evil, evil, evil, evil, True),),
                gates=(Gate(evil, evil, evil, True),),
                files={evil: evil},
                versions={evil: evil},
                mesh={evil: evil},
            )
        )
    )
    assert all(image["src"].startswith("data:") for image in page.all("img"))
    assert page.words.count(evil) >= 15


def test_a_failed_gate_stands_out():
    page = Page(report_html(brief(gates=(Gate("components", 2, "1", False),))))
    assert "FAILED" in page.words
    assert {"class": "fail"} in page.all("td")


def test_equal_results_make_equal_bytes(html):
    assert report_html(results()) == html


def test_no_ties():
    alone = attrs.evolve(results().ranking, uncertainty_mm=None, tied=())
    words = Page(report_html(results(ranking=alone))).words
    assert "tied" not in words
    assert "0.048" in words


def test_numbers_of_all_kinds():
    words = Page(
        report_html(brief(mesh={"a": np.int64(1234567), "b": np.float32(0.5), "c": True, "d": -3.0}))
    ).words
    assert "a1\u202f234\u202f567b0.5cyesd−3" in words.replace("\n", "")


def test_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        write_html(tmp_path / "file" / "report.html", brief())


def test_instants_that_are_not_compared_stay_empty():
    """Where one path has no equilibrium no map has a row, and no figure a NaN."""
    found = results()
    delta = found.ranking.delta.copy()
    delta[:, 3:9] = np.nan
    html = report_html(results(ranking=attrs.evolve(found.ranking, delta=delta)))
    assert "Empty rows are not compared." in html
    assert not re.search(r"\bnan\b", html, re.IGNORECASE)


def test_a_path_that_cannot_win_shows_its_bound_and_no_rank():
    whole = results().ranking
    kept = [k for k, path in enumerate(results().paths) if path.name not in ("alpha8", "alpha10")]
    bound = float(np.sort(whole.j_hat)[5] + 1e-4)
    order = np.argsort(np.argsort(whole.j_hat[kept])) + 1
    found = attrs.evolve(
        whole,
        delta=whole.delta[kept],
        j_hat=whole.j_hat[kept],
        j_cont=whole.j_cont[kept],
        rank=order.tolist(),
        at_least_mm={"alpha8": bound, "alpha10": bound},
    )
    page = Page(report_html(results(ranking=found, pictures=())))
    assert page.words.count(f"≥ {bound:.4f}") == 2
    assert "2 others" in page.words
    assert "certainly exceeded" in page.words


def test_a_run_that_stopped_before_any_path_shows_estimates():
    page = Page(report_html(brief(status="partial", estimated_mm={"alpha4": 0.31, "alpha1": 0.47})))
    assert "Ranking of the paths" in page.headings
    assert "Estimated mean deviation, least first." in page.words
    assert "0.47" in page.words
