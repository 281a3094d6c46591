"""Tables in exports of the makers' layouts, and what their columns hold."""

import numpy as np
import pytest

from mu_addon.lab_files import blocks
from mu_addon.lab_files.columns import column
from mu_addon.lab_files.source import sheet_of_text
from mu_addon.lab_files.units import unit_of

from . import exports


def tables(text):
    return blocks.tables(sheet_of_text(text)).blocks


def test_mts_goes_on_with_one_record_after_each_header():
    (block,) = tables(exports.MTS)
    assert len(block.values) == exports.ROWS
    assert np.all(np.diff(block.values[:, 0]) > 0)
    assert block.columns[2].factor == 1000.0


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
