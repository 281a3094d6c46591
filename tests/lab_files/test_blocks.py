"""Tables in exports of the makers' layouts, and what their columns hold."""

import numpy as np
import pytest

from mu_addon.lab_files import blocks
from mu_addon.lab_files.columns import column, unit_of
from mu_addon.lab_files.source import sheet_of_text

from . import exports


def tables(text):
    return blocks.tables(sheet_of_text(text)).blocks


def test_bluehill():
    (block,) = tables(exports.BLUEHILL)
    assert [c.quantity for c in block.columns] == ["time", "displacement", "force"]
    assert [c.unit for c in block.columns] == ["s", "mm", "N"]
    assert block.facts["gauge length"] == ("40.0", "mm")
    assert block.lines[[0, -1]].tolist() == [9, 8 + exports.ROWS]


def test_testxpert_in_german_with_decimal_commas():
    (block,) = tables(exports.TESTXPERT)
    assert [c.quantity for c in block.columns] == ["time", "displacement", "force"]
    assert block.values[:, 2] == pytest.approx(exports.N, abs=1e-5)
    assert block.facts["probendicke a0"] == ("3,0", "mm")


def test_trapezium_has_specimens_side_by_side():
    one, two = tables(exports.TRAPEZIUM)
    assert [one.label, two.label] == ["1 _ 1", "1 _ 2"]
    assert two.values[:, 1] == pytest.approx(2 * one.values[:, 1], abs=1e-5)


def test_mts_goes_on_with_one_record_after_each_header():
    (block,) = tables(exports.MTS)
    assert len(block.values) == exports.ROWS
    assert np.all(np.diff(block.values[:, 0]) > 0)
    assert block.columns[2].factor == 1000.0


def test_horizon_has_specimens_one_below_the_other():
    assert [block.label for block in tables(exports.HORIZON)] == ["Specimen 1", "Specimen 2"]


def test_results_of_two_rows_are_no_record():
    assert tables('"Maximum load","Modulus"\n"(N)","(MPa)"\n12.5,2.5\n13.0,2.6\n') == ()


@pytest.mark.parametrize(
    ("title", "unit", "quantity", "factor"),
    [
        ("Load", "(kN)", "force", 1e3),
        ("Druckspannung", "MPa", "stress", 1e3),
        ("Druck", "mbar", "pressure", 0.1),
        ("Spannung", "V", "voltage", 1.0),
        ("Spannung", "MPa", "stress", 1e3),
        ("Dehnung", "%", "strain", 1e-2),
        ("Tensile strain (Extension)", "(mm/mm)", "strain", 1.0),
        ("Compressive extension (mm)", "", "displacement", 1.0),
        ("Stress / N/mm\u00b2", "", "stress", 1e3),
        ("Time, s", "", "time", 1.0),
        ("Si\u0142a", "N", "force", 1.0),
        ("Fuerza", "kgf", "force", 9.80665),
        ("Winkel / \u00b0", "", "angle", 1.0),
        ("force_N", "", "force", 1.0),
        ("Ch 1", "N", "force", 1.0),
        ("Weg", "", "displacement", None),
        ("Strain", "", "strain", None),
        ("Load", "furlongs", "force", None),
        ("Ch 1", "", "", None),
    ],
)
def test_quantities_by_title_and_unit(title, unit, quantity, factor):
    found = column(title, unit)
    assert (found.quantity, found.factor) == (quantity, factor)


def test_units_that_differ_by_case_alone():
    assert unit_of("mN") == ("N", 1e-3)
    assert unit_of("MN") == ("N", 1e6)
    assert unit_of("mPa") == ("kPa", 1e-6)
    assert unit_of("S") is None
