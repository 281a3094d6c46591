"""The report in a real browser: nothing asked of a server, nothing complained about, every picture there."""

import pytest

from ..coarse_pictures import coarse_pictures  # noqa: F401 - for every test here
from . import report_data
from .browser import EXECUTABLE, Browser, complaints, requests

pytestmark = pytest.mark.skipif(EXECUTABLE is None, reason="no chromium here")


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_data.report(path.parent, report_data.ranking()), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser():
    with Browser() as browser:
        yield browser


@pytest.mark.parametrize(("width", "phone"), [(390, True), (1280, False)], ids=["phone", "desktop"])
def test_whole_and_quiet(browser, report, width, phone):
    browser.screen(width, 844, phone)
    browser.open(report)
    images = browser.evaluate(
        "[...document.images].map(i => [i.complete, i.naturalWidth, i.clientWidth, i.alt])"
    )
    assert len(images) == 17
    assert all(complete and natural > 0 for complete, natural, _, _ in images)
    assert all(100 < shown <= width for _, _, shown, _ in images)
    assert complaints(browser) == []
    assert requests(browser) == []
    # Wide tables scroll by themselves; the page does not.
    assert browser.evaluate("document.documentElement.scrollWidth") <= width


def test_these_checks_can_fail(browser, report, tmp_path):
    bad = tmp_path / "bad.html"
    html = report.read_text(encoding="utf-8")
    extra = (
        "<img src='data:image/png;base64,AAAA' alt='broken'>"
        "<script>console.error('x')</script><script src='no.js'></script>"
    )
    bad.write_text(html.replace("</body>", extra + "</body>"), encoding="utf-8")
    browser.open(bad)
    widths = browser.evaluate("[...document.images].map(i => i.naturalWidth)")
    assert widths[-1] == 0
    assert complaints(browser)
    assert any(url.endswith("no.js") for url in requests(browser))


def test_text_can_be_read_on_a_phone(browser, report):
    browser.screen(390, 844, True)
    browser.open(report)
    small = browser.evaluate(
        "[...document.querySelectorAll('p, td, th, dt, dd, figcaption, a')]"
        ".filter(e => e.clientHeight && parseFloat(getComputedStyle(e).fontSize) < 13)"
        ".map(e => e.textContent)"
    )
    assert small == []


def test_prints_on_a_few_pages(browser, report):
    browser.open(report)
    pdf = browser.pdf()
    assert pdf.startswith(b"%PDF")
    assert 3 <= pdf.count(b"/Type /Page\n") + pdf.count(b"/Type /Page ") <= 10
