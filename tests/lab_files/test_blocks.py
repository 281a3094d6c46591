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


def test_titles_over_two_rows_below_the_names_of_specimens():
    """A name may stand above any of its specimen's columns."""
    numbers = "".join(f"{t};{3.5 * t};{t};{2.5 * t}\n" for t in range(4))
    head = ";A1;;B1\nTime;Force;Time;Force\ntotal;primary;total;primary\n(s);(N);(s);(N)\n"
    one, two = tables(head + numbers)
    for block, label, slope in ((one, "A1", 3.5), (two, "B1", 2.5)):
        assert block.label == label
        assert [(c.title, c.quantity) for c in block.columns] == [
            ("Time total", "time"),
            ("Force primary", "force"),
        ]
        assert (block.values[:, 1] == slope * block.values[:, 0]).all()


def test_remarks_between_titles_and_numbers_do_not_hide_the_titles():
    remarks = "start of the test\nzero set by hand\nroom 23\n"
    text = "Time (s);Force (N)\n" + remarks + "".join(f"{t};{2 * t}\n" for t in range(5))
    found = blocks.tables(sheet_of_text(text))
    assert [c.quantity for c in found.blocks[0].columns] == ["time", "force"]
    assert [one.lines for one in found.unread] == [(2,), (3,), (4,)]


def test_a_record_whose_time_falls_back_by_more_than_half_is_another_one():
    first, second, on = ("".join(f"{t};{2 * t}\n" for t in range(*span)) for span in ((11,), (3, 9), (6, 12)))
    assert [len(b.values) for b in tables(f"Time (s);Force (N)\n{first}paused\n{second}")] == [11, 6]
    assert [len(b.values) for b in tables(f"Time (s);Force (N)\n{first}paused\n{on}")] == [17]


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
