"""Cells and numbers: separators, decimal signs, encodings, workbooks."""

import zipfile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.lab_files.blocks import tables
from mu_addon.lab_files.source import read_sheets, sheet_of_text
from mu_addon.table_cells.encoding import decoded
from mu_addon.table_cells.notation import number


@pytest.mark.parametrize(
    ("cell", "decimal", "value"),
    [
        ("1.5", ".", 1.5),
        ("1,5", ",", 1.5),
        ("-0,094", ",", -0.094),
        ("1.234,5", ",", 1234.5),
        ("1,234.5", ".", 1234.5),
        ("1,234", ".", 1234.0),
        ("1,234", ",", 1.234),
        ("12,34,567.5", ".", 1234567.5),
        ("12.34.567,5", ",", None),
        ("1e-3", ".", 1e-3),
        (".5", ".", 0.5),
        ("(10.25)", ".", -10.25),
        ("(1.234,5)", ",", -1234.5),
        ("(1)", ".", None),
        ("\u0661\u066c\u0662\u0663\u0664\u066b\u0665", ".", 1234.5),
        ("\u200f-\u06f3\u060c\u06f5", ",", -3.5),
        ("0,094", ".", None),
        ("1,5", ".", None),
        ("12 N", ".", None),
        ("1_000", ".", None),
        ("inf", ".", None),
    ],
)
def test_a_number_is_read_by_its_decimal_sign(cell, decimal, value):
    assert number(cell, decimal) == value


@given(st.floats(-1e12, 1e12), st.sampled_from([".", ","]))
def test_any_number_is_read_back(value, decimal):
    assert number(repr(value).replace(".", decimal), decimal) == value


@pytest.mark.parametrize("delimiter", ["\t", ";", ","])
@pytest.mark.parametrize("decimal", [".", ","])
def test_separators_are_found(delimiter, decimal):
    quote = '"' if delimiter == decimal else ""
    lines = [
        [f"{quote}{x:.3f}{quote}".replace(".", decimal) for x in (0.5, 1.25, i + 0.125)] for i in range(9)
    ]
    (block,) = tables(sheet_of_text("\n".join(delimiter.join(cells) for cells in lines))).blocks
    assert block.decimal == decimal
    assert not block.unsure
    assert block.values[3].tolist() == [0.5, 1.25, 3.125]


def test_thousands_or_decimals_is_unsure_where_nothing_tells():
    def unsure(text, decimal=None):
        return tables(sheet_of_text(text, decimal)).blocks[0].unsure

    assert unsure("1,234;5,678\n" * 6)
    assert not unsure("1,234;5,678\n" * 6, ",")
    assert not unsure("1,234;5,67\n" * 6)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252", "latin-1"])
def test_usual_encodings_are_read(encoding):
    assert decoded("Pr\u00fcfzeit;\u00b5m\n".encode(encoding), "a.csv") == "Pr\u00fcfzeit;\u00b5m\n"


def test_bytes_that_are_no_text_are_refused():
    with pytest.raises(InputError, match="NUL"):
        decoded(b"\x00\x01", "a.csv")
    with pytest.raises(InputError, match="utf-16"):
        decoded(b"\xff\xfea", "a.csv")


def workbook(path, sheets):
    """A workbook written by another program's library."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)


def test_a_workbook_that_unpacks_to_gigabytes_is_refused(tmp_path):
    with (
        zipfile.ZipFile(tmp_path / "a.xlsx", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("xl/worksheets/sheet1.xml", "w") as member,
    ):
        for _ in range(300):
            member.write(bytes(1 << 20))
    with pytest.raises(InputError, match="unpacks to"):
        read_sheets(tmp_path / "a.xlsx")


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04nothing", b"\xd0\xcf\x11\xe0nothing", bytes(range(256))])
def test_a_broken_workbook_is_refused(tmp_path, data):
    for ending in ("xlsx", "xls", "ods"):
        path = tmp_path / f"a.{ending}"
        path.write_bytes(data)
        with pytest.raises(InputError, match=r"workbook|empty|no text"):
            read_sheets(path)


def test_a_workbook_cut_short_is_refused(tmp_path):
    workbook(tmp_path / "a.xlsx", {"one": [["Time", "Force"], [1, 2]]})
    data = (tmp_path / "a.xlsx").read_bytes()
    (tmp_path / "b.xlsx").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="cut off"):
        read_sheets(tmp_path / "b.xlsx")
