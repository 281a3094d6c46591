"""Charts are self-contained SVG, the same every time, and say what they show."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from mu_addon.report import heatmaps, plots
from mu_addon.report.results import Path
from mu_addon.simulate_and_place.shown_ranking import result_of

from .report_data import ANGLE, PATHS, PRESSURE, SECONDS, TIME, VIEW, ranking

RANKING = result_of(ranking())
CHARTS = {
    "unit": lambda: plots.unit_with_paths(VIEW, PATHS, "alpha4", [f"{j:.3f}" for j in RANKING.j_hat]),
    "angle": lambda: plots.angle_against_pressure(PRESSURE, ANGLE),
    "protocol": lambda: plots.protocol(TIME, PRESSURE),
    "heatmap": lambda: heatmaps.heatmap(RANKING.delta[0], 1.0, True),
    "bar": lambda: heatmaps.color_bar(1.0),
    "marginal": lambda: plots.marginal(RANKING.delta.mean(axis=1), PATHS, "alpha4", "length"),
    "ranking": lambda: plots.ranking(RANKING, PATHS),
    "seconds": lambda: plots.seconds(SECONDS),
}


@pytest.mark.parametrize("name", CHARTS)
def test_svg_asks_for_nothing_and_is_repeatable(name):
    svg = CHARTS[name]()
    root = ET.fromstring(svg)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    links = re.findall(r'(?:href|src)="([^"]*)"', svg) + re.findall(r"url\(([^)]*)\)", svg)
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in links)
    assert "<!DOCTYPE" not in svg
    assert "<script" not in svg
    assert svg == CHARTS[name]()


def test_ten_windows_look_different():
    looks = {(s["color"], s["linestyle"]) for s in map(plots.line_style, PATHS)}
    assert len(looks) == len(PATHS)
    assert plots.CHOSEN not in {color for color, _ in looks}


def test_ranking_puts_the_best_on_top_in_colour():
    svg = plots.ranking(RANKING, PATHS)
    bars = re.findall(r'd="M ([^"]*?)\sz\s*"[^>]*?style="fill: (#[0-9a-f]{6})', svg)
    colored = [points for points, fill in bars if fill == plots.CHOSEN.lower()]
    assert len(colored) == 1
    top = min(float(p.split()[1]) for p, fill in bars if fill in (plots.CHOSEN.lower(), "#b9c3cf"))
    assert float(colored[0].split()[1]) == top


def test_the_chosen_path_alone_is_thick():
    svg = plots.marginal(RANKING.delta.mean(axis=1), PATHS, "alpha4", "length")
    assert svg.count(f"stroke: {plots.CHOSEN.lower()}; stroke-width: 3") == 2  # the line, and its key


def test_any_number_of_paths():
    many = [Path(f"free{i}", 1 + i % 7, 3 + i % 9) for i in range(23)]
    assert plots.marginal(np.ones((23, 5)), many, "free3", "time")


def test_words():
    assert plots.label("alpha10") == "α₁₀"
    assert plots.label("free path") == "free path"
    assert plots.signed("-0.0° at 0 kPa, -0, -0.05 mm") == "0.0° at 0 kPa, 0, −0.05 mm"
    assert plots.signed("-42.0° at -20 kPa, 1e-09, mu-1.0x") == "−42.0° at −20 kPa, 1e-09, mu-1.0x"
