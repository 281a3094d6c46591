"""Tables that this program asks for, as a European spreadsheet program saves them."""

import codecs

import numpy as np
import pytest

from mu_addon.design.printing.sheets import measured_limits
from mu_addon.errors import InputError
from mu_addon.fem.protocol import read_protocol
from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.measured.kinds import KINDS
from mu_addon.measured.table import read_table
from mu_addon.sensing.sweeps import _joined_angles
from mu_addon.table_cells.own_tables import own_lines, own_rows, own_text

PIXELS = (
    "cl right_px,cl down_px,cr right_px,cr down_px\n400.00,100.00,600.25,100.00\n401.05,100.52,600.25,1.5\n"
)


def european(text):
    return text.replace(",", ";").replace(".", ",").replace("\n", "\r\n")


def written(tmp_path, text, encoding="utf-8-sig"):
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_a_protocol(tmp_path, encoding):
    text = european("time_s,pressure_kPa\n0,0\n0.5,5.25\n1,\u22121.5\n".replace("\u2212", "-"))
    read = read_protocol(written(tmp_path, text, encoding))
    assert read.time_s.tolist() == [0.0, 0.5, 1.0]
    assert read.pressure_kPa.tolist() == [0.0, 5.25, -1.5]
    emptied = written(tmp_path, text.replace("\r\n0,5", "\r\n;\r\n0,5") + ";\r\n", encoding)
    assert read_protocol(emptied).pressure_kPa.tolist() == [0.0, 5.25, -1.5]
    other = read_protocol(written(tmp_path, "time_min,pressure_bar\n0,0\n0.5,0.2\n"))
    assert (other.time_s[1], other.pressure_kPa[1]) == (30.0, 20.0)
    sep = read_protocol(written(tmp_path, "sep=;\r\n" + european("time_s,pressure_kPa\n0,0\n1,1.234\n")))
    assert sep.pressure_kPa.tolist() == [0.0, 1.234]


def test_decimal_points_between_semicolons_and_commas_in_quotes():
    def cells(text):
        return [row for _, row in own_rows(own_lines(text))]

    assert cells("a;b\n1.234;2\n")[1] == ["1.234", "2"]
    assert cells('a,b\n"1,5",2\n')[1] == ["1.5", "2"]
    assert cells("a\tb\n1,5\t2\n")[1] == ["1.5", "2"]
    assert cells("a,b\n1,x\n")[1] == ["1", "x"]


def test_limits(tmp_path):
    sheet = (
        "limit;meaning;best;sizes;measured\r\n"
        "strut_mm;thinnest strut;smallest;0,4 0,55 0,7 0,85 1 1,2 1,5;0,55\r\n"
        "cup_ml;largest volume sealed against the film;largest;0,04 0,055 0,07;\r\n"
    )
    found = measured_limits(written(tmp_path, sheet))
    assert {name: limit.value for name, limit in found.items()} == {"strut_mm": 0.55}


def test_pixels_and_their_own_time(tmp_path):
    plain = read_pixels(written(tmp_path, PIXELS))
    assert np.array_equal(plain.pixels, read_pixels(written(tmp_path, european(PIXELS))).pixels)
    assert plain.time_s is None
    first, *rows = PIXELS.splitlines()
    timed = "\n".join([f"time_s,{first}", *(f"{t},{row}" for t, row in zip((0, 0.0333), rows, strict=True))])
    for text in (timed + "\n", european(timed + "\n")):
        assert read_pixels(written(tmp_path, text)).time_s.tolist() == [0.0, 0.0333]
    with pytest.raises(InputError, match="does not increase") as caught:
        read_pixels(written(tmp_path, timed.replace("0.0333", "0")))
    assert "row 3" in caught.value.where


def test_angles_and_measured_data(tmp_path):
    path = written(tmp_path, european("time_s,angle_deg\n0,0\n1,2.5\n2,5.5\n"))
    assert _joined_angles(path, np.array([0.5, 1.5])).tolist() == [1.25, 4.0]
    table = read_table(european("time_us,pressure_bar\n0,0.1\n500000,0.25\n"), KINDS["pressure_hold"], path)
    assert table.columns["time_s"].tolist() == [0.0, 0.5]
    assert table.columns["pressure_kPa"] == pytest.approx([10.0, 25.0])


def test_what_is_no_text_is_none(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"a\x01\xff")
    with pytest.raises(UnicodeDecodeError):
        own_text(path)
    path.write_bytes(codecs.BOM_UTF16_LE + "a\r\nb".encode("utf-16-le"))
    assert own_text(path) == "a\nb"
