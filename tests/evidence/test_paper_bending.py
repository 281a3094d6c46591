"""The six ends of the bending ranges that the paper prints, against the unit as the presets have it."""

from pathlib import Path

import pytest

from mu_addon.measured import read_folder

PAPER = Path(__file__).parents[2] / "assets" / "examples" / "paper-bending"
PRINTED = {0.75: (-50.0, 45.0), 1.0: (-65.0, 50.0), 1.5: (-65.0, 55.0)}


@pytest.fixture(scope="module")
def ends():
    return read_folder(PAPER).experiments


def test_the_folder_holds_the_printed_ends(ends):
    found = {}
    for e in ends:
        found.setdefault(e.scale, []).append(float(e["angle_deg"].mean()))
        assert set(e["pressure_kPa"]) in ({-20.0}, {50.0})
    assert {s: tuple(v) for s, v in found.items()} == PRINTED
