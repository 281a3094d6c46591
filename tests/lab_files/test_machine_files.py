"""Files as laboratories really have them: no row vanishes, and what is not read is told with line and reason.

Each file is written here; the right values are known because the readings are those of `rows`.
"""

import math
import os
import random
import re

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.lab_files.blocks import tables
from mu_addon.lab_files.source import read_sheets, sheet_of_text
from mu_addon.lab_files.understood import understand
from mu_addon.studies.import_ import terminal_lines

from .test_cells import workbook

COUPON = {"kind": "coupon", "mode": "uniaxial", "section_mm": "10x1", "length_mm": "100"}
TITLES = "Time (s),Load (N),Extension (mm)"
COUNT = int(os.environ.get("MUTANTS", "15"))
SEED = os.environ.get("MUTANTS_SEED", "")


def rows(count=100, separator=","):
    """Readings each 0.1 s: 5 N/s, 1 mm/s."""
    return [separator.join((f"{0.1 * i:.1f}", f"{0.5 * i:.2f}", f"{0.1 * i:.2f}")) for i in range(count)]


def understood(tmp_path, text, answers=COUPON, name="a.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return understand([path], answers)


def one(tmp_path, text, answers=COUPON, **keys):
    found = understood(tmp_path, text, answers, **keys)
    assert found.open == ()
    (p,) = found.proposals
    return p, [*found.left_out, *(u.words for u in p.unread)]


def lines(*parts):
    return "\n".join(parts) + "\n"


def many(row, *head, count=60):
    """Text of lines above `count` rows."""
    return lines(*head, *map(row, range(count)))


def table(row, *head, count=100):
    """The readings of `rows`, each in a line made by `row`, with `head` above them."""
    return lines(*head, *map(row, rows(count), range(count)))


def changed(k, line):
    """The readings of `rows` with another line k."""
    body = rows()
    body[k] = line
    return lines(TITLES, *body)


PRESSED, HOLD = {"kind": "unit_pressure"}, {"kind": "pressure_hold"}
BEAM = {"kind": "beam_deadweight", "section_mm": "3x3", "length_mm": "40"}
CLOCKED = PRESSED | {"column.2": "pressure", "column.3": "angle", "unit.2": "kPa", "unit.3": "deg"}
HELD = {"kind": "pressure_hold", "interval_s": "0.5", "column.1": "pressure", "unit.1": "kPa"}
LABELLED = {"unit.t": "s", "unit.Pressure": "bar", "unit.Angle": "deg"}
UNITS = {"unit.time": "s", "unit.load": "N", "unit.travel": "mm"}
WRAP = 2**32
g_N = 9.80665e-3
LOST = {"rows": 99}
READ = {"rows": 100, "time_s": 9.9, "force_N": 49.5, "displacement_mm": 9.9}
LOAD = "column 'Load (N)'"

# Text of a file, answers beside those of a coupon, last values and number of rows, and what must be listed as
# unread or, behind a >, as concluded.
FILES = {
    "clock beside time": (
        table(lambda row, i: f"10:00:{i // 10:02d},{row}", "Clock time," + TITLES),
        {}, READ, ["column 'Clock time' [clock]: another time: column 'Time (s)' is read"],
    ),
    "words": (
        table(lambda row, i: f"{row},PASS", TITLES + ",Status"), {}, READ,
        ["column 'Status': 'PASS' in every row"],
    ),
    "remark": (
        table(lambda row, i: row + (",break" if i >= 60 else ""), TITLES), {}, READ,
        ["column 4, which has no title: words, such as 'break'"],
    ),
    "overload": (
        changed(60, "6.0,OVERLOAD,6.00"), {}, READ | LOST, [f"line 62: 'OVERLOAD' in {LOAD} is not a number"],
    ),
    "formula": (
        changed(60, "6.0,#DIV/0!,6.00"), {}, READ | LOST, [f"line 62: '#DIV/0!' in {LOAD} is not a number"],
    ),
    "empty cell": (changed(60, "6.0,,6.00"), {}, READ | LOST, [f"line 62: no number in {LOAD}"]),
    "event": (
        changed(60, "* open *"), {}, READ | LOST,
        ["line 62: '* open *': no row of numbers, within the table"],
    ),
    "no pair": (
        changed(60, "6.0,OVER,OVER"), {}, READ | LOST,
        ["line 62: '6.0 OVER OVER': no row of numbers, within the table"],
    ),
    "blank": (changed(60, ""), {}, READ | LOST, []),
    "decimal comma": (
        changed(60, '6.0,"30,00",6.00'), {}, READ | LOST,
        [f"line 62: '30,00' in {LOAD} has a decimal comma, the others have a decimal point"],
    ),
    "typographic minus": (
        many(lambda i: f"{i},{i - 60},{i}".replace("-", "\u2212"), TITLES), {"sign": "as_read"},
        {"force_N": -1}, [],
    ),
    "titles of two lines": (
        table(lambda row, i: row, 'Time (s),"Load\n(N)","Extension\n(mm)"'), {}, READ, [],
    ),
    "open quote": (
        table(lambda row, i: row + (',"crack' if i == 50 else ""), TITLES), {}, READ,
        ["column 4, which has no title: words, such as 'crack'"],
    ),
    "stray quote": (
        table(lambda row, i: row, 'Time (s),",Extension (mm)'), {"column.2": "force", "unit.2": "N"}, READ,
        [],
    ),
    **{
        f"units {row}": (
            table(lambda cells, i: f"{cells},23.{i}", "Time,Load,Extension,Temperature", row), {}, READ,
            ["column 'Temperature'"],
        )
        for row in ("(s),(N),(mm),(\u00b0C)", "s,N,mm,\u00b0C", "[s],[N],[mm],[mm/min]")
    },
    **{
        f"time in {unit}": (
            many(lambda i: f"{i},{20000 * i},{50 * i},{35 * i}", f"no,time({unit}),position(um),force(mN)"),
            {}, {"time_s": 1180000 * factor, "displacement_mm": 2.95, "force_N": 2.065}, ["column 'no'"],
        )
        for unit, factor in (("us", 1e-6), ("\u00b5s", 1e-6), ("\u03bcs", 1e-6), ("ms", 1e-3), ("min", 60.0))
    },
    "units behind numbers": (
        many(lambda i: f"{i} ms;{2 * i} N;0.{i:02d} mm", "Time;Load;Extension"), {},
        {"time_s": 0.059, "force_N": 118, "displacement_mm": 0.59}, [],
    ),
    "unit that changes": (
        many(lambda i: f"{i}, {f'{100 * i} mN' if i < 40 else f'{10 * i} cN'}, {i} mm", "Time (s),Load,Ext"),
        {}, {"force_N": 5.9}, [">column 'Load': its unit changes from 'mN' to 'cN' at line 42"],
    ),
    "cells as formulas": (
        table(lambda row, i: '="' + row.replace(",", '",="') + '"', '="Time (s)",="Load (N)",="Ext (mm)"'),
        {}, READ, [],
    ),
    "cells as formulas in quotes": (
        table(lambda row, i: '"=""' + row.replace(",", '""","=""') + '"""', TITLES), {}, READ, [],
    ),
    "fixed width": (
        table(lambda row, i: row.replace(",", " " * 9), " Time  Load  Ext", " (s)  (N)  (mm)"), {}, READ, [],
    ),
    "extension and travel": (
        many(
            lambda i: f"{i / 10};{-700 + 0.2 * i:.2f};{0.1 * i:.2f};{i}",
            "Test time;Absolute crosshead travel;Strain;Standard force",
            "s;mm;mm;N",
        ),
        {}, {"displacement_mm": 5.9}, ["another position: column 'Strain' [mm] is read"],
    ),
    "settings above titles": (
        many(
            lambda i: f"   {0.1 * i:.3f}\t   {2 * i:.3f}\t   {0.3 * i:.3f}",
            *("walk", "rows 60", "columns 3", "range 0.0 2.9", "endheader", "time\tload\ttravel"),
        ),
        UNITS, {"force_N": 118}, [],
    ),
    "two columns of a title": (
        table(lambda row, i: row, "Time (s),tip,tip"),
        {"column.2": "force", "unit.2": "N", "column.3": "displacement", "unit.3": "mm"}, READ, [],
    ),
    "remark beside titles": (
        table(lambda row, i: row + ",,", "Time,Load,Extension,,10 mm/min", "(s),(N),(mm),,20 N preload"), {},
        READ, ["10 mm/min"],
    ),
    "a remark between titles and units": (
        table(lambda row, i: "," + row, "Data:,Time,Load,Extension", ",,mean,", ",s,N,mm"), {}, READ,
        [],
    ),
    "titles in a comment": (
        table(lambda row, i: row.replace(",", " "), "# time_s force_N displacement_mm"), {}, READ, [],
    ),
    "titles apart": (
        table(lambda row, i: row.replace(",", "   "), "Time (s)  Load (N)  Extension (mm)"), {}, READ, [],
    ),
    "unknown title": (
        table(lambda row, i: row, "Tid,Qwx,Kraft", "s,mm,N"), {"column.Qwx": "displacement"},
        {"rows": 100, "displacement_mm": 49.5}, [],
    ),
    "load in g": (
        many(lambda i: f"{i},{i}", "Load (g),Extension (mm)"), {}, {"force_N": 59 * g_N}, [">the weight of"],
    ),
    "force in kg": (many(lambda i: f"{i},{i}", "Kraft [kg],Weg [mm]"), {}, {"force_N": 59e3 * g_N}, []),
    "weight in g": (many(lambda i: f"{i},{i}", "Weight (g),Extension (mm)"), {}, {"force_N": 59 * g_N}, []),
    "g beside N": (
        many(lambda i: f"{9 * i},{i},{i}", "Load (g),Force (N),Weg (mm)"),
        {}, {"force_N": 59}, ["another force", ">weight"],
    ),
    "answered g": (
        many(lambda i: f"{i},{i}", "W,Weg (mm)"), {"column.W": "force", "unit.W": "g"}, {"force_N": 59 * g_N},
        [],
    ),
    "mass on a beam": (
        many(lambda i: f"{i},{i}", "Load (g),Tip deflection (mm)"), BEAM,
        {"added_mass_g": 59}, [],
    ),
    "unit over unit": (
        many(lambda i: f"{i},{i}", "Load (N),Weg (mm)"), {"unit.Load (N)": "kN"}, {"force_N": 59e3}, [],
    ),
    "stretch": (many(lambda i: f"1.{i:02d},{i}", "Stretch,Stress (kPa)"), {}, {"strain": 0.59}, [">less 1"]),
    "lambda": (many(lambda i: f"1.{i:02d},{i}", "lambda [-],Stress [kPa]"), {}, {"strain": 0.59}, []),
    "stretch of 100 %": (
        many(lambda i: f"1{i:02d},{i}", "Stretch [%],Stress [kPa]"), {}, {"strain": 0.59}, [],
    ),
    "stretch from 0 %": (
        many(lambda i: f"{i},{i}", "Stretch [%],Stress [kPa]"), {}, {"strain": 0.59}, [">begins at 0"],
    ),
    "stretch in mm": (many(lambda i: f"{i},{i}", "Stretch (mm),Force (N)"), {}, {"displacement_mm": 59}, []),
    "strain of 1": (
        many(lambda i: f"1.{i:02d},{i}", "Strain [-],Stress [kPa]"), {"column.1": "strain"}, {"strain": 1.59},
        [">begins at 1, as a stretch does"],
    ),
    "a gap without a time": (
        many(lambda i: f"{i},{i},{'' if i == 7 else i}", "No,Weg (mm),Kraft (N)"),
        {}, {"rows": 59, "force_N": 59}, ["column 'No'", "line 9: no number in column 'Kraft (N)'"],
    ),
    "strain and force": (
        many(lambda i: f"{i / 100},{1000 * i}", "strain [-],force [mN]"), {}, {"force_N": 59}, [],
    ),
    "travel and stress": (
        many(lambda i: f"{i / 100},{i}", "Weg (mm),Spannung (MPa)"), {}, {"stress_kPa": 59e3}, [],
    ),
    "arrow": (
        many(lambda i: f"14:02:{i / 10 + 1:06.3f} -> {i},{2 * i}"), CLOCKED,
        {"time_s": 5.9, "angle_deg": 118}, [],
    ),
    "clock in brackets": (
        many(lambda i: f"[2024-03-01 14:02:{i:02d}.5] {i} {2 * i}"), CLOCKED, {"time_s": 59}, [],
    ),
    "arrow and titles": (
        many(lambda i: f"1:02:{i:02d} -> {i}\t{i}", "1:01:59 -> Pressure (kPa)\tAngle (deg)"), PRESSED,
        {"angle_deg": 59}, [],
    ),
    "arrow and labels": (
        many(lambda i: f"23:59:{i:02d} -> Pressure: {i}.5 kPa, Angle: {i}"), {"unit.Angle": "deg"} | PRESSED,
        {"pressure_kPa": 59.5}, [],
    ),
    "labels": (
        many(lambda i: f"t:{i}\tPressure={i}.5\tAngle=-{i}", "boot"), LABELLED | PRESSED,
        {"pressure_kPa": 5950}, [],
    ),
    "clock and labels": (
        many(lambda i: f"2026-03-02 10:22:{i:02d}.5 Pressure: {i} kPa Angle: {2 * i} deg"), PRESSED,
        {"time_s": 59, "pressure_kPa": 59, "angle_deg": 118}, [],
    ),
    "clock and >": (many(lambda i: f"10:22:{i:02d}.5 > {i},{2 * i}"), CLOCKED, {"angle_deg": 118}, []),
    "tuples": (
        many(lambda i: f"({20 * i}, {i}.5, {i})"), CLOCKED | {"column.1": "time", "unit.1": "ms"},
        {"time_s": 1.18, "pressure_kPa": 59.5}, [],
    ),
    "JSON objects": (
        many(lambda i: f'{{"t_ms": {100 * i}, "pressure_kPa": {i}, "angle_deg": -{i}.5}}'), PRESSED,
        {"time_s": 5.9, "pressure_kPa": 59, "angle_deg": -59.5}, [],
    ),
    "set point before the reading": (
        many(lambda i: f"{i};{2 * i};{i};{i}", "Zeit [s];Solldruck [bar];Istdruck [bar];Winkel [deg]"),
        PRESSED, {"pressure_kPa": 5900}, ["another pressure: column 'Istdruck [bar]' is read"],
    ),
    "true before nominal": (
        many(lambda i: f"{2 * i},{i},0.{i:02d}", "True stress (kPa),Stress (kPa),Strain [-]"), {},
        {"stress_kPa": 59}, ["another stress"],
    ),
    "a letter that is no unit": (
        many(lambda i: f"{i},{i},{i},0.{i}", "Time/min,Distance (mm),Force (N),D [d]"), {},
        {"time_s": 3540, "displacement_mm": 59}, ["column 'D [d]'"],
    ),
    "one column": (
        many(lambda i: f"{20 - 0.01 * i:.2f}", "# kPa"), HELD, {"time_s": 29.5, "pressure_kPa": 19.41}, [],
    ),
    "one column of commas": (
        many(lambda i: f"{20 - i // 50},{99 - i % 50}"), HELD, {"pressure_kPa": 19.9}, [],
    ),
    "one column with units": (
        many(lambda i: f"{2000 - i} Pa"), HELD | {"unit.1": "Pa"}, {"pressure_kPa": 1.941}, [],
    ),
    "one label": (many(lambda i: f"Pressure: {i} kPa"), {"interval_s": "1"} | HOLD, {"pressure_kPa": 59}, []),
    "one titled column": (
        many(lambda i: f"{2000 - i}", "Pressure (Pa)"), {"kind": "pressure_hold", "interval_s": "0.5"},
        {"pressure_kPa": 1.941}, [],
    ),
    "counter of 16 bits": (
        many(lambda i: f"{(65000 + 20 * i) % 65536},{14.7 + i / 10:.1f},{i}", "t_ms,P (psia),Angle (deg)"),
        PRESSED, {"time_s": 1.18}, [">begins again at 2^16 in line 29", ">pressure = absolute"],
    ),
    "counter of 32 bits": (
        many(lambda i: f"{(WRAP - 3000 + 1000 * i) % WRAP},{i},{i}", "t_us,Pressure (mmH2O),Angle (deg)"),
        PRESSED, {"time_s": 0.059, "pressure_kPa": 59 * g_N}, [">2^32 in line 5"],
    ),
    "counter in seconds": (
        many(lambda i: f"{(WRAP - 3000 + 1000 * i) % WRAP / 1e6},{i},{i}", "t_s,Pressure (kPa),Angle (deg)"),
        PRESSED, {"time_s": 0.059}, [],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_what_comes_out_of_a_file(tmp_path, name):
    text, answers, last, listed = FILES[name]
    answers = answers if answers.get("kind", "coupon") != "coupon" else COUPON | answers
    p, unread = one(tmp_path, text, answers)
    last = {"rows": 60} | last
    found = {name: len(p.lines) if name == "rows" else p.columns[name][-1] for name in last}
    assert found == pytest.approx(last)
    for words in listed:
        of = p.concluded if words[0] == ">" else unread
        assert any(words.removeprefix(">") in one_ for one_ in of), (words, of)
    assert len(unread) == sum(words[0] != ">" for words in listed) or name in ("labels", "arrow and titles")


ASKED = {
    "a curve of x and y": (many(lambda i: f"{i},{i * i}", "x,y"), {}, [("column.x", ""), ("column.y", "")]),
    "three axes of no place": (
        many(lambda i: f"{i},{i % 7},{i % 5},{i % 3}", "Time (s),Gyro X,Gyro Y,Gyro Z"),
        {}, [(f"column.Gyro {axis}", "") for axis in "XYZ"],
    ),
    "unknown title": (
        table(lambda row, i: row, "Tid,Qwx,Kraft", "s,mm,N"), COUPON, [("column.Qwx", "displacement")],
    ),
    "two columns of a title": (
        table(lambda row, i: row, "Time (s),tip,tip"), {}, [("column.2", ""), ("column.3", "")],
    ),
    "title above an empty cell": (
        many(
            lambda i: f"{i + 1}\t{0.01 * i:.2f}\t{i}\t{2 * i}\t0.5\t{3 * i}\t{i}\t0.1",
            *("Frame#\tTime\tknee\t\t\theel\t\t", "\t\tA1\tB1\tC1\tA2\tB2\tC2"),
        ),
        {}, [("unit.Time", "s"), *((f"column.{axis}{k}", "") for k in (1, 2) for axis in "ABC")],
    ),
    "strain from 1": (
        many(lambda i: f"1.{i:02d},{i}", "Strain [-],Stress [kPa]"), COUPON,
        [("column.Strain [-]", "stretch")],
    ),
    "a stretch answered as strain": (
        many(lambda i: f"{1 + i / 50},{i}", "Stretch,Stress [kPa]"), COUPON | {"column.Stretch": "strain"},
        [("unit.Stretch", "1")],
    ),
    "a minimum": (
        many(lambda i: f"{i},{i},4{i:02d}", "Reading,Force (N),Signal(Min)"), {},
        [("unit.Signal(Min)", ""), ("column.Reading", "")],
    ),
    "only stress is left": (
        many(lambda i: f"1.{i:02d},{i}", "lambda [-],P [kPa]"), COUPON, [("column.P [kPa]", "stress")],
    ),
    "no load": (
        many(lambda i: f"{i},{i},{5 * i}", "Time (s),Rotation (deg),Torsion"), COUPON,
        [("column.Torsion", "")],
    ),
    "no section": (
        many(lambda i: f"{i},{i}", "strain [-],force [N]"), {"kind": "coupon", "mode": "uniaxial"},
        [("section_mm", "")],
    ),
    "a kind whose columns are asked for": (
        many(lambda i: f"{i},{i},{i}", "Time (s),A,B"), PRESSED, [("column.A", ""), ("column.B", "")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ASKED)
def test_what_is_asked(tmp_path, name):
    text, answers, questions = ASKED[name]
    found = understood(tmp_path, text, answers)
    assert [(q.key, q.proposed) for _, q in found.asked] == questions
    assert not any("negative" in words for p in found.proposals for words in p.concluded)


REFUSED = {
    "one strain": (many(lambda i: f"0.1,{80 - i}", "Strain (%),Stress (kPa)"), "0.001 in every row"),
    "rotation": (
        many(lambda i: f"{i},{i},{i},{i}", "Time (s),Stress (Pa),Strain (%),Shear rate (1/s)"),
        "test in shear",
    ),
    "torque": (many(lambda i: f"{i},{i}", "Rotation (deg),Torque (Nm)"), "no column is left"),
    "shear": (many(lambda i: f"{i},{i}", "Shear strain [%],Shear stress [Pa]"), "is of shear"),
    "true stress": (many(lambda i: f"0.{i:02d},{i}", "Strain [-],True stress (kPa)"), "true, not nominal"),
    "columns and decimals by commas": (
        many(lambda i: f"{i},5,{2 * i},5,0,{i:02d}", "Time,Load,Extension"),
        "commas separate columns as well.*line 2",
    ),
    "a column that is nowhere": (
        many(lambda i: f"{i},{i}", "Time (s),Load (N)"), r"needs .*'Time \(s\)'.*'Load \(N\)'",
    ),
    "vectors within tabs": (
        many(lambda i: f"{i}\t{0.2 * i:.1f},0,0", "time\tball"), "no table of measured data.*'ball'",
    ),
    "tracked markers": (
        many(lambda i: f"{i},{100 + i},50,{200 + i},50", "Time (ms),a X,a Y,b X,b Y"),
        "tracked markers: a, b.*`track a.csv",
    ),
    "motion capture": (
        many(lambda i: f"{i},0,{100 + i},{200 + i},{i}", "Trajectories", "Frame,Sub,X,Y,Z", ",,mm,mm,mm"),
        "tracked markers: column 'X' is in mm.*bending plane",
    ),
    "Kinovea's text": (
        many(lambda i: f"0.{i:02d} {100 + i} {i}", "#Kinovea Trajectory data export", "#T X Y"),
        "tracked markers: path 1",
    ),
    "a workbook's pixels": (
        many(lambda i: f"{i},{100 + i},{i}", "Key images", "Name,X (px),Y (px)"), "positions of tracked",
    ),
    "a capture's own rows": (
        many(lambda i: f"frame,{i},0.1,2,{i}", 'comment,"OptiTrack Export Data"'),
        "an export of motion capture",
    ),
    "DeepLabCut": (
        many(lambda i: f"{i},{i},90,0.9", "scorer,n,n,n", "bodyparts,a,a,a", "coords,x,y,likelihood"),
        "tracked markers: a",
    ),
    "formulas": (
        many(lambda i: f"{i},=B{i}*2,{i}", "Time (s),Load,Extension (mm)"),
        "'Load': formulas without stored values",
    ),
    "one column": (many(lambda i: f"{i}.5"), "lines 1 to 60 have one column of numbers.*time.*interval_s="),
    "no columns": (lines("a 1 2", "b c 3 4", "5 d e f 6"), "line 1 is 'a 1 2'"),
    "time that falls": (many(lambda i: f"{60 - i},{i},{i}", TITLES), "time runs backward.*line 3"),
    "time that begins anew": (
        many(lambda i: f"{20 * (i % 30)},{i},{i}", TITLES), "time runs backward.*line 32",
    ),
    **{
        f"signs that alternate, {written}": (
            many(
                lambda i, w=written: f"{i};{w.format(i=10 + i).replace(',', ',.'[i % 2])};{i}",
                "Time (s);Load (N);Extension (mm)",
            ),
            r"decimal points and commas alternate.*'\d+\.\d+' in line \d+.*line \d",
        )
        for written in ("{i},5", "{i},125", "0,{i:03d}")
    },
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_says_why(tmp_path, name):
    text, words = REFUSED[name]
    with pytest.raises(InputError) as caught:
        understood(tmp_path, text)
    assert re.search(words, str(caught.value), re.DOTALL), caught.value
    assert caught.value.remedy


@pytest.mark.parametrize(
    "clock",
    [
        lambda s: f"2026-03-01 10:00:{s:06.3f}",
        lambda s: f"2026-03-01T10:00:{s:06.3f}Z",
        lambda s: f"01.03.2026 10:00:{s:06.3f}".replace(".000", ",000"),
        lambda s: f"3/1/2026 10:00:{s:06.3f} PM",
        lambda s: (
            f"3/1/2026 {11 if s < 5 else 12}:{59 if s < 5 else 0:02d}:{(55 + s) % 60:06.3f} {'AP'[s >= 5]}M"
        ),
        lambda s: f"10:00:{s:06.3f}",
        lambda s: f"{23 if s < 5 else 0}:{59 if s < 5 else 0:02d}:{(55 + s) % 60:06.3f}",
        lambda s: f"00:{s:06.3f}",
    ],
)
def test_a_clock_is_a_time(tmp_path, clock):
    body = [f"{clock(0.5 * i)};{0.5 * i:.2f};{0.1 * i:.2f}" for i in range(100)]
    p, _ = one(tmp_path, lines("Timestamp;Load (N);Extension (mm)", *body))
    assert p.columns["time_s"] == pytest.approx(0.5 * np.arange(100), abs=1e-6)
    assert p.columns["force_N"][-1] == 49.5


def test_hours_and_minutes_or_minutes_and_seconds_is_asked(tmp_path):
    text = lines(TITLES.replace(" (s)", ""), *(f"10:{i:02d},{i},{i}" for i in range(40)))
    assert [q.key for _, q in understood(tmp_path, text).asked] == ["unit.Time"]
    p, _ = one(tmp_path, text, COUPON | {"unit.Time": "min:s"})
    assert p.columns["time_s"][-1] == pytest.approx(39.0)


def test_one_sign_for_decimals_and_thousands(tmp_path):
    mm = [7.003 * i for i in range(200)]
    body = [f"{0.02 * i:.10g};{x:.10g};{0.001 + 0.17 * i:.10g}" for i, x in enumerate(mm)]
    body = [row.replace(".", ",") for row in body]
    body = [row if x < 1000 else row.replace(";1", ";1,", 1) for row, x in zip(body, mm, strict=True)]
    assert body[143].split(";")[1] == "1,001,429"
    p, _ = one(tmp_path, lines("Time;Displacement;Force", "(s);(mm);(N)", *body))
    assert p.columns["displacement_mm"] == pytest.approx(mm, abs=1e-3)
    assert any("line 146" in words for words in p.concluded)


GROUPED = lines(
    "Time [ms];Supply [V];Pressure [bar];Angle [deg]",
    *(
        f"{f'{t:.3f}' if t < 1000 else f'{t // 1000}.{t % 1000:03d}.000'};3.900;{t / 5000:.3f};{t / 200:.3f}"
        for t in range(0, 3000, 100)
    ),
)


def test_a_decimal_sign_that_is_answered_wrongly_is_refused_with_the_line(tmp_path):
    p, _ = one(tmp_path, GROUPED, {"decimal": ".", "kind": "unit_pressure"})
    assert [values[-1] for values in p.columns.values()] == pytest.approx([2.9, 58.0, 14.5])
    with pytest.raises(InputError, match=r"'0\.000' is not a number") as caught:
        understood(tmp_path, GROUPED, {"decimal": ",", "kind": "unit_pressure"})
    assert caught.value.where.endswith("line 2")


@pytest.mark.parametrize("sign", ["'", "\u2019", " ", "\u00a0", "\u202f"])
def test_thousands_as_countries_write_them(tmp_path, sign):
    def written(value):
        whole, _, part = f"{value:.1f}".partition(".")
        return (whole if len(whole) < 4 else f"{whole[:-3]}{sign}{whole[-3:]}") + "," + part

    body = [f"{written(0.1 * i)};{written(20.5 * i)};{written(0.1 * i)}" for i in range(80)]
    p, unread = one(tmp_path, lines("Zeit;Kraft;Weg", "s;N;mm", *body))
    assert p.columns["force_N"] == pytest.approx(20.5 * np.arange(80))
    assert unread == []


HTML = "<html><table><tr><th>Time (s)</th><th>Load<br>(N)<th>Extension (mm)</th></tr>" + "".join(
    "<tr>" + "".join(f"<td>{cell}</td>" for cell in row.split(",")) + "</tr>\n" for row in rows()
)
XML = '<?xml version="1.0"?><Workbook xmlns:ss="x"><Worksheet ss:Name="a"><Table>' + "".join(
    "<Row>"
    + "".join(f'<Cell><Data ss:Type="Number">{cell}</Data></Cell>' for cell in row.split(","))
    + "</Row>"
    for row in [TITLES, *rows()]
)


@pytest.mark.parametrize(
    "text", [lines(TITLES, *rows()).replace(",", "\t"), HTML, XML], ids=["tabs", "html", "xml"]
)
def test_the_content_tells_the_type(tmp_path, text):
    p, _ = one(tmp_path, text, name="a.xls")
    assert len(p.lines) == 100
    assert p.columns["force_N"][-1] == 49.5


@pytest.mark.parametrize(
    "begin", [b"%PDF-1.7\n", b"\x1f\x8b\x08", b"TDSm\0\0", b"MATLAB 5.0 MAT-file", b"\x89HDF"]
)
def test_what_is_no_table_is_refused_by_what_it_is(tmp_path, begin):
    with pytest.raises(InputError, match="the file is "):
        understood(tmp_path, begin + bytes(range(256)))
    with pytest.raises(InputError, match="HTML or XML without a table"):
        understood(tmp_path, "<html><p>moved</p></html>", name="a.xls")


def test_a_title_of_another_quantity_goes_by_its_unit(tmp_path):
    text = lines("Pr\u00fcfzeit;Dehnung;Standardkraft", "s;mm;N", *(f"{i};0,{i:02d};{i}" for i in range(60)))
    for encoding in ("utf-8", "cp1252", "utf-16", "utf-16-le"):
        p, _ = one(tmp_path, text, encoding=encoding)
        assert p.columns["displacement_mm"][-1] == pytest.approx(0.59)
        assert any("'Dehnung' [mm] is read as displacement" in words for words in p.concluded)


@pytest.mark.parametrize(
    ("titles", "encoding"),
    [
        (
            "\u0412\u0440\u0435\u043c\u044f;\u0421\u0438\u043b\u0430;\u041f\u0435\u0440\u0435\u043c\u0435\u0449\u0435\u043d\u0438\u0435",
            "cp1251",
        ),
        ("\u65f6\u95f4;\u529b;\u4f4d\u79fb", "gb18030"),
        ("\u6642\u9593;\u8377\u91cd;\u5909\u4f4d", "cp932"),
        ("\u6642\u9593;\u8a66\u9a13\u529b;\u30b9\u30c8\u30ed\u30fc\u30af", "cp932"),
        ("\uc2dc\uac04;\ud558\uc911;\ubcc0\uc704", "cp949"),
        ("\u6642\u9593;\u8377\u91cd;\u4f4d\u79fb", "cp950"),
        ("Time;Load;Disp.", "ascii"),
        ("Czas;Si\u0142a;Przemieszczenie", "cp1250"),
        ("S\u00fcre;Kuvvet;Uzama", "cp1254"),
        ("Tijd;Kracht;Verplaatsing", "ascii"),
        ("Tempo;For\u00e7a;Deslocamento", "cp1252"),
        ("Aika;Voima;Siirtym\u00e4", "cp850"),
    ],
)
def test_titles_in_other_languages_and_encodings(tmp_path, titles, encoding):
    p, _ = one(tmp_path, lines(titles, "s;N;mm", *rows(40, ";")), encoding=encoding)
    assert p.columns["force_N"][-1] == pytest.approx(19.5)
    assert p.columns["displacement_mm"][-1] == pytest.approx(3.9)


def test_untitled_columns_are_answered_one_by_one(tmp_path):
    text = "".join(f"{100 * i},{0.02 * i:.3f},{0.5 * i:.2f}\r\n" for i in range(60))
    kind = {"kind": "unit_pressure"}
    assert [q.key for _, q in understood(tmp_path, text, kind).asked] == ["column.1", "column.2", "column.3"]
    named = kind | {"column.1": "time", "column.2": "pressure", "column.3": "angle"}
    asked = understood(tmp_path, text, named).asked
    assert [(q.key, q.proposed) for _, q in asked] == [("unit.1", "ms"), ("unit.2", "")]
    assert "the unit of column 1 (0 to 5900)" in asked[0][1].words
    p, _ = one(tmp_path, text, named | {"unit.1": "ms", "unit.2": "bar"})
    assert len(p.lines) == 60
    assert [values[-1] for values in p.columns.values()] == pytest.approx([5.9, 118.0, 29.5])


@pytest.mark.parametrize(("title", "unit"), [("Date/Time", "d"), ("Time", "s")])
def test_a_date_that_a_spreadsheet_wrote_as_a_number_is_no_second(tmp_path, title, unit):
    body = [f"{45000 + 0.1 * i / 86400:.10f},{row.split(',', 1)[1]}" for i, row in enumerate(rows())]
    text = lines(TITLES.replace("Time (s)", title), *body)
    ((_, question),) = understood(tmp_path, text).asked
    assert (question.key, question.proposed) == (f"unit.{title}", unit)
    p, _ = one(tmp_path, text, COUPON | {question.key: "d"})
    assert (p.columns["time_s"][0], p.columns["time_s"][-1]) == pytest.approx((0.0, 9.9), abs=1e-4)
    assert any("of a calendar" in words for words in p.concluded)


@pytest.mark.parametrize(
    ("name", "begin"), [("Extension", 753.0), ("Extension", -753.0), ("Extension", 1.0), ("Strain", 5.0)]
)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_change_of_a_place_tells_its_sign(tmp_path, name, begin, way):
    readings = (f"{0.1 * i:.1f},{0.5 * i:.2f},{begin + way * 0.1 * i:.2f}" for i in range(100))
    p, _ = one(tmp_path, lines(f"Time (s),Load (N),{name} (mm)", *readings))
    assert p.columns["displacement_mm"] == pytest.approx(0.1 * np.arange(100))
    assert p.columns["force_N"] == pytest.approx(0.5 * np.arange(100))


def labview(readings, titles, columns="One", decimal=".", step="0.5"):
    """Text of a file of LabVIEW with two channels."""
    return "\n".join(
        (
            "LabVIEW Measurement\t",
            f"Writer_Version\t2\nSeparator\tTab\nDecimal_Separator\t{decimal}\nX_Columns\t{columns}",
            f"Date\t2026/03/01\nTime\t10:00:00{decimal}5\n***End_of_Header***\t\n\t",
            "Channels\t2\t\t\nSamples\t9\t9\t\nDate\t2026/03/01\t2026/03/01\t",
            f"Time\t10:00:00{decimal}5\t10:00:00{decimal}5\t",
            "Y_Unit_Label\tNewtons\tmm\t\nX_Dimension\tTime\tTime\t",
            f"X0\t0{decimal}25\t0{decimal}25\t\nDelta_X\t{step}\t{step}\t\n***End_of_Header***\t\t\t",
            titles,
            *readings,
            "",
        )
    )


@pytest.mark.parametrize(("columns", "decimal"), [("No", ","), ("No", "."), ("One", "."), ("One", ",")])
def test_a_file_of_labview_has_its_times_and_units(tmp_path, columns, decimal):
    """The headers have numbers, the times may be given by their step alone."""
    times = [f"{0.25 + 0.5 * i:.2f}" if columns == "One" else "" for i in range(9)]
    readings = [f"{t}\t{1.5 * i:.1f}\t{0.2 * i:.1f}".replace(".", decimal) for i, t in enumerate(times)]
    titles = "X_Value\tRam\tGauge\tComment"
    text = labview(readings, titles, columns, decimal, f"0{decimal}5")
    p, told = one(tmp_path, text, COUPON | {"column.Gauge [mm]": "displacement"}, name="a.lvm")
    assert p.columns["time_s"] == pytest.approx(0.25 + 0.5 * np.arange(9))
    assert p.columns["force_N"] == pytest.approx(1.5 * np.arange(9))
    assert p.columns["displacement_mm"] == pytest.approx(0.2 * np.arange(9))
    assert told == ["column 'Comment': no cell in it"]
    computed = "column 'X_Value [s]': computed from X0 = 0.25 and Delta_X = 0.5, as no row has it"
    assert [words for words in p.concluded if "computed" in words] == ([computed] if columns == "No" else [])


def test_the_terminal_shows_what_was_understood(tmp_path):
    body = rows()
    body[60] = "6.0,OVERLOAD,6.00"
    shown = terminal_lines(understood(tmp_path, lines(TITLES, *body)))
    assert shown[0] == "a: coupon, 99 rows, a.csv, lines 2 to 101"
    assert any(line.split()[:1] == ["force_N"] and "49.5" in line and "\u2588" in line for line in shown)
    assert "  not read: line 62: 'OVERLOAD' in column 'Load (N)' is not a number" in shown


REMARKS = [
    "OVERLOAD", "#DIV/0!", "", "nan", "1'000", "1,000.5", "\u22125.0", "12:00", "x", "1e999", "\u00a0", '"',
    "1\u202f000,5", "5.00 N", "=B2*2", "2026-03-01 10:00:00", "\u00b5m", "(12)", "\x00", "\ufeff",
]  # fmt: skip
ENDS = ("\n", "\r\n", "\r")


def _mutated(random_, body, separator):
    """Rows of a sound file with damaged cells, further cells, and lines of other things between them."""
    body = list(body)
    for _ in range(random_.randrange(1, 9)):
        k = random_.randrange(len(body))
        cells = body[k].split(separator)
        what = random_.randrange(8)
        if what < 2:
            cells[random_.randrange(len(cells))] = random_.choice(REMARKS)
        elif what == 2:
            cells.append(random_.choice(REMARKS))
        elif what == 3:
            cells.pop()
        elif what == 4:
            cells = [random_.choice(["*** event ***", "# remark", "Zyklus 2", "  ", "Max;3", "a,b,c"])]
        elif what == 5:
            cells = [f'"{cell}"' for cell in cells]
        elif what == 6:
            # A logger that was switched off and on again writes its titles, or a part of a line.
            cells = random_.choice([TITLES.split(","), [cells[0][:1]]])
        else:
            cells = [cell.replace(".", ",") for cell in cells]
        body[k] = separator.join(cells)
    return body


def _named(words):
    """Lines of a file that words name, such as "lines 3 to 7, 9: ...\"."""
    found = set()
    for spans in re.findall(r"lines? (\d[\d, to]*)", words):
        for span in spans.replace(" ", "").strip(",").split(","):
            first, _, last = span.partition("to")
            found |= set(range(int(first), int(last or first) + 1))
    return found


def _is_number(cell):
    try:
        return math.isfinite(float(cell.strip('"').replace(",", ".")))
    except ValueError:
        return False


@pytest.mark.parametrize("number", range(COUNT))
def test_every_row_of_a_damaged_file_is_read_or_listed(tmp_path, number):
    random_ = random.Random(f"rows {SEED}{number}")
    separator = random_.choice([",", ";", "\t"])
    titles = random_.choice([[TITLES], ["Time,Load,Extension", "(s),(N),(mm)"], ["Title,report", TITLES]])
    head = [line.replace(",", separator) for line in titles]
    body = _mutated(random_, rows(random_.randrange(12, 60), separator), separator)
    path = tmp_path / "a.csv"
    end = random_.choice(ENDS)
    path.write_bytes(
        lines(*head, *body).replace("\n", end).encode(random_.choice(["utf-8", "utf-8-sig", "utf-16"]))
    )
    data = {len(head) + 1 + k for k, line in enumerate(body) if line.strip(' "\u00a0' + separator)}
    try:
        found = understand([path], COUPON | {"zero": "as_read"})
    except InputError as error:
        found, refused = None, error
    if found is None:
        # Refused whole: with a line, or with what is there.
        assert all((refused.what, refused.where, refused.remedy))
        return
    (sheet,) = read_sheets(path)
    read = {int(line) for p in found.proposals for line in p.lines}
    words = " ".join([*found.left_out, *(u.words for p in found.proposals for u in p.unread)])
    # Titles that come again, and the lines above them, are the next record's.
    further = {line for line in tables(sheet).head if line > len(head)}
    further = {k for k in further if not any(map(_is_number, body[k - len(head) - 1].split(separator)))}
    assert not data - read - _named(words) - further
    # What is read is what stands there.
    for p in found.proposals:
        for i, line in enumerate(p.lines):
            cells = body[line - len(head) - 1].split(separator)
            if "displacement_mm" in p.columns and len(cells) > 2 and cells[2].replace(".", "", 1).isdigit():
                assert abs(p.columns["displacement_mm"][i]) == pytest.approx(float(cells[2]))


def test_a_table_of_a_long_file_is_quick():
    text = lines(TITLES, *rows(20000))
    (block,) = tables(sheet_of_text(text)).blocks
    assert block.values.shape == (20000, 3)


@pytest.mark.parametrize("cut", ["\u00b5m;3,50", "Max;3"])
def test_what_is_left_of_a_reading_above_the_next_titles_is_listed(tmp_path, cut):
    titles = TITLES.replace(",", ";")
    body = rows(4, ";")
    (tmp_path / "a.csv").write_text(lines(titles, *body, cut, titles, *body), encoding="utf-8")
    found = understand([tmp_path / "a.csv"], COUPON)
    assert [len(p.lines) for p in found.proposals] == [4, 4]
    assert any("line 6" in words for words in found.left_out)


RAMP = np.arange(120.0)
SLIPPED = np.where(RAMP < 50, RAMP, -157.0 - 0.05 * RAMP)
SPIKED = np.where(RAMP == 60, -9000.0, RAMP)
CYCLE = 100.0 * np.sin(RAMP / 119 * 4 * np.pi)


@pytest.mark.parametrize(
    ("kind", "mm", "newton", "signs", "named"),
    [
        ("coupon", SLIPPED, RAMP, (1, 1), ("displacement_mm", 52)),
        ("coupon", RAMP, SPIKED, (1, 1), ("force_N", 62)),
        ("coupon", RAMP, -SPIKED, (1, -1), ("force_N", 62)),
        ("coupon", -SPIKED, -RAMP, (1, 1), ("displacement_mm", 62)),
        ("coupon", RAMP, RAMP - 110, (1, 1), None),
        ("coupon", CYCLE, -2 * CYCLE, (-1, 1), None),
        ("coupon", CYCLE, np.where(CYCLE < 0, 3, 1) * CYCLE, (1, 1), None),
        ("coupon", np.minimum(RAMP, 60), np.minimum(RAMP, 60) - 100 * (RAMP > 60), (1, 1), ("force_N", 63)),
        ("coupon", RAMP, np.where(RAMP < 12, RAMP, -157.0 - 0.05 * RAMP), (1, 1), ("force_N", 14)),
        ("coupon", RAMP, np.where(RAMP == 2, -9000.0, RAMP), (1, 1), ("force_N", 4)),
        ("coupon", 90.0 * (RAMP > 5), 80 * (RAMP > 5) * np.exp(-RAMP / 30), (1, 1), None),
        ("coupon", 0 * RAMP + 90, 80 * (RAMP > 5) * np.exp(-RAMP / 30), (1, 1), ("force_N", 8)),
        ("lattice_compression", -RAMP, SPIKED, (-1, 1), ("force_N", 62)),
        ("lattice_compression", -np.where(RAMP < 3, 0, 100), -np.where(RAMP < 3, 0, 90), (-1, -1), None),
    ],
)
def test_the_sign_of_a_column_is_that_of_its_course_not_of_one_reading(
    tmp_path, kind, mm, newton, signs, named
):
    body = [
        f"{0.1 * i:.1f},{0.1 * f:.3f},{0.01 * x:.4f}" for i, (x, f) in enumerate(zip(mm, newton, strict=True))
    ]
    keys = COUPON | {"kind": kind}
    p, _ = one(tmp_path, lines(TITLES, *body), keys | {"zero": "as_read"})
    assert p.columns["displacement_mm"] == pytest.approx(signs[0] * 0.01 * mm, abs=1e-4)
    assert p.columns["force_N"] == pytest.approx(signs[1] * 0.1 * newton, abs=1e-3)
    told = [words for words in p.concluded if "jumps" in words]
    assert not told if named is None else told[0].startswith(named[0]) and f"line {named[1]} " in told[0]
    kept, _ = one(tmp_path, lines(TITLES, *body), keys | {"zero": "as_read", "sign": "as_read"})
    assert kept.columns["force_N"] == pytest.approx(0.1 * newton, abs=1e-3)


@pytest.mark.parametrize(
    "titles",
    [
        "Frequency,Temperature,Oscillation strain,Oscillation stress,Storage modulus",
        "Zeit,Temp,Dehnung,Spannung,Speichermodul E'",
        "Freq,Temp,Strain,Stress,Tan(delta)",
        "t,T,Strain,Stress,G''",
    ],
)
def test_amplitudes_of_an_oscillation_are_no_curve(tmp_path, titles):
    text = lines(
        titles, "Hz,\u00b0C,%,kPa,kPa", *(f"1,{25 + i},0.{i:02d}1,{80 - i},{80 - i}" for i in range(40))
    )
    for answers in ({}, COUPON):
        with pytest.raises(InputError, match="oscillation"):
            understood(tmp_path, text, answers)
    said = {f"column.{titles.split(',')[k]}": "none" for k in (0, 4)}
    if "Oscillation" in titles:
        said |= {"column.Oscillation strain": "strain", "column.Oscillation stress": "stress"}
    assert len(understood(tmp_path, text, COUPON | said).proposals[0].lines) == 40


@pytest.mark.parametrize(
    ("head", "length", "section"),
    [
        ('Strain : Tensile strain (Displacement) gauge length,"80.00000",mm', 80.0, None),
        ("Gauge length;80;mm\nWidth;10;mm\nThickness;2;mm", 80.0, [10.0, 2.0]),
        ("Gauge length (cm),8.05\nWidth mm,10\nThickness mm,2.5", 80.5, [10.0, 2.5]),
        ("Gauge length [mm]: 80\nWidth [mm]: 10\nThickness [mm]: 2", 80.0, [10.0, 2.0]),
        ("Width,mm,10\nThickness,mm,2\nGauge length,cm,8", 80.0, [10.0, 2.0]),
        ("Specimen of width 10 mm, thickness 2 mm and gauge length 80 mm", 80.0, [10.0, 2.0]),
        ("Cross section: 10 x 2 mm", None, [10.0, 2.0]),
        ("Area (mm2);20", None, [20.0**0.5, 20.0**0.5]),
        ("width and thickness were 10 mm and 2 mm", None, None),
    ],
)
def test_dimensions_in_the_head_of_a_file(tmp_path, head, length, section):
    found = understood(tmp_path, lines(head, "", TITLES, *rows()), {"kind": "coupon", "mode": "uniaxial"})
    keys = found.proposals[0].keys
    assert keys.get("length_mm") == length
    assert keys.get("section_mm") == (section and pytest.approx(section, abs=1e-5))


@pytest.mark.parametrize(
    ("titles", "first", "reference", "asked"),
    [
        ("Pressure (kPa abs)", 101.3, "absolute", []),
        ("Pressure (psia)", 14.7, "absolute", []),
        ("Absolutdruck [kPa]", 101.3, "absolute", []),
        ("Pressure (barg)", 1.0, "gauge", []),
        ("Pressure (kPa)", 101.3, None, [("pressure", "absolute")]),
        ("Pressure (kPa)", 0.0, None, []),
    ],
)
def test_absolute_pressures_are_known_by_their_unit_or_asked_for(tmp_path, titles, first, reference, asked):
    text = lines(f"Time (s),{titles},Angle (deg)", *(f"{i},{first + 0.1 * i:.2f},{i}" for i in range(60)))
    found = understood(tmp_path, text, {"column." + titles: "pressure"})
    assert [(q.key, q.proposed) for _, q in found.open] == asked
    assert found.proposals[0].keys.get("pressure") == reference


def test_formulas_of_a_workbook_without_stored_values_are_named(tmp_path):
    rows = [["Time (s)", "Load (N)", "Extension (mm)"], *([i, f"=A{i + 2}*2", i] for i in range(20))]
    workbook(tmp_path / "a.xlsx", {"b & c": rows})
    with pytest.raises(InputError, match=r"'Load \(N\)': formulas without stored values, such as '=A"):
        understand([tmp_path / "a.xlsx"], COUPON)
