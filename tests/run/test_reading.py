"""Every reader on files nobody should write: a clear error, never a traceback, a hang or a silent yes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mu_addon import reading
from mu_addon.chain import read_pressures
from mu_addon.cli.main import main
from mu_addon.design.gripper import load_gripper, read_gripper
from mu_addon.design.gripper import to_toml as gripper_text
from mu_addon.design.parameters import Unit, read_unit, to_toml
from mu_addon.design.printing.printer import load_printer, printer_text, read_printer
from mu_addon.design.printing.sheets import read_sheet
from mu_addon.errors import InputError
from mu_addon.evidence.extended import load_model
from mu_addon.fem.protocol import read_protocol
from mu_addon.files import read_npz
from mu_addon.grasp import read_phases
from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.lab_files.understood import understand
from mu_addon.materials.library import read_material
from mu_addon.measured import table
from mu_addon.measured.bench import read_bench, read_pressure
from mu_addon.measured.folder import read_folder
from mu_addon.measured.kinds import KINDS
from mu_addon.measured.table import read_table
from mu_addon.reading import MOST_ROWS, file_bytes, file_text, parse_json, parse_toml
from mu_addon.run.folder import FolderLayout, claim
from mu_addon.sensing.calibration import read_calibration
from mu_addon.sensing.recording import read_recording
from mu_addon.studies.chain import Chain
from mu_addon.studies.inputs import path_of
from mu_addon.studies.parameter_study.plan import read_plan

from ..lab_files.exports import BLUEHILL

ASSETS = Path(__file__).parents[2] / "assets"

CALIBRATION = """version = 1
channel = "light_V"
dark = 0.0
knots_deg = [0.0, 0.0, 0.0, 0.0, 10.0, 10.0, 10.0, 10.0]
coefficients_V = [2.0, 1.9, 1.8, 1.7]
band_V = 0.01
drift_per_h = 0.0
gain = 1.0
sweeps = 3
error_deg = 0.5
"""
MODEL = 'verdict = "named"\n[effect.overcure.offset_mm]\nvalue = 0.1\nsd = 0.01\nunit = "mm"\n'
PLAN = 'format = 1\npreset = "mu-1.0x"\n[vary]\n"chambers.wall_mm" = { low = 0.8, high = 1.2 }\n'

# A reader, and text that it takes; None where only bad files are tried.
READERS: dict[str, tuple[Callable[[Path], Any], str | None]] = {
    "unit": (read_unit, to_toml(Unit())),
    "gripper": (read_gripper, gripper_text(load_gripper("gripper"), "mu-1.0x")),
    "printer": (read_printer, printer_text(load_printer())),
    "material": (read_material, (ASSETS / "materials" / "elastic-50a-v1.toml").read_text()),
    "model": (load_model, MODEL),
    "calibration": (read_calibration, CALIBRATION),
    "sweep": (read_plan, PLAN),
    "bench": (read_bench, None),
    "protocol": (read_protocol, "time_s,pressure_kPa\n0,0\n1,5\n"),
    "phases": (read_phases, None),
    "chain": (
        Chain.read_file,
        "format = 1\n[target]\nreach = [0.0, 5.0, 40.0]\n"
        + 2 * '[[unit]]\npreset = "mu-1.0x"\npressure_kPa = [-5.0, 10.0]\n',
    ),
    "chain's protocol": (
        lambda path: read_pressures(path, 2),
        "time_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n1,5,6\n",
    ),
    "pressure": (read_pressure, "time_s,pressure_kPa\n0,0\n1,5\n"),
    "pixels": (read_pixels, None),
    "import": (lambda path: understand([path], {"kind": "coupon"}), BLUEHILL),
    "gauge": (read_sheet, None),
    "paths": (lambda path: path_of(Unit(), str(path.rename(path.with_suffix(".csv")))), None),
    "folder": (lambda path: read_folder(_as(path, "experiments.toml")), None),
    "recording": (lambda path: read_recording(_as(path, "index.ndjson")), None),
}


def _as(path: Path, name: str) -> Path:
    """A folder that holds the file under another name."""
    folder = path.parent / "folder"
    folder.mkdir(exist_ok=True)
    path.replace(folder / name)
    return folder


BAD = {
    "brackets": b"a = " + b"[" * 50_000,
    "braces": b"a = " + b"{b=" * 50_000,
    "dots": b"a" + b".a" * 50_000 + b" = 1",
    "digits": b"format = " + b"9" * 5000,
    "many bits": b"format = " + b"9" * 400,
    "hexadecimal": b"format = 0x" + b"f" * 6000,
    "true": b"format = true\nversion = true\n",
    "not UTF-8": b"format = 1\nname = \"\xff\xfe\"\n",
    "UTF-16": "format = 1\n".encode("utf-16"),
    "NUL": b"format\0 = 1\n",
    "NUL in a table": b"time_s,pressure_kPa\n0,0\n\0,\0\n",
    "a long field": b"time_s,pressure_kPa\n0,0\n1," + b"1" * 200_000 + b"\n",
    "an open quote": b'time_s,pressure_kPa\n0,0\n1,"' + b"x,\n" * 100_000,
    "infinite": b"time_s,pressure_kPa\n0,0\n1e999,1\n",
    "empty": b"",
    "a list": b"[[format]]\n[[effect]]\n[[law]]\n[[values]]\n[[experiment]]\n[[marker]]\n[[vary]]\n",
    "a word": b"effect = 1\nlaw = 1\nvalues = 1\nexperiment = 1\nmarker = 1\nvary = 1\n",
    "escapes": b"\x1b]0;x\x07 = 1",
}  # fmt: skip


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused(name: str, what: str, tmp_path: Path) -> None:
    path = tmp_path / "file.toml"
    path.write_bytes(BAD[what])
    if name == "recording":
        # Lines of an index that are none are passed over.
        assert not READERS[name][0](path)
        return
    with pytest.raises(InputError) as told:
        READERS[name][0](path)
    assert all((told.value.what, told.value.where, told.value.remedy))
    # Names of Python's own are no words for who wrote the file.
    assert not re.search(r"\bsys\.|Error\(|limit \(", told.value.what)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes")
@pytest.mark.parametrize("name", READERS)
def test_a_pipe_is_not_waited_for(name: str, tmp_path: Path) -> None:
    path = tmp_path / "file.toml"
    os.mkfifo(path)
    with pytest.raises(InputError):
        READERS[name][0](path)


@pytest.mark.parametrize("name", READERS)
def test_a_file_of_gigabytes_is_refused_by_its_size(name: str, tmp_path: Path) -> None:
    """Of 3 GB, none of which lies on the disk; before it is read."""
    path = tmp_path / "file.toml"
    path.touch()
    os.truncate(path, 3 << 30)
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as told:
            READERS[name][0](path)
        assert "its 3221 MB are more" in told.value.what
        assert tracemalloc.get_traced_memory()[1] < 3e6
    finally:
        tracemalloc.stop()


LONG = {
    "protocol": (read_protocol, "time_s,pressure_kPa\n", "0,0\n"),
    "pressure": (read_pressure, "time_s,pressure_kPa\n", "0,0\n"),
    "pixels": (read_pixels, "base right_px,base down_px\n", "1,2\n"),
    "measured": (
        lambda path: read_table(path.read_text(), KINDS["unit_pressure"], path),
        "time_s,pressure_kPa,angle_deg\n",
        "0,0,0\n",
    ),
}


AT_NIGHT = pytest.mark.nightly("test_a_table_of_too_many_rows_is_refused")


@pytest.mark.parametrize(
    "name",
    [
        "protocol",
        "pixels",
        pytest.param("pressure", marks=AT_NIGHT),
        pytest.param("measured", marks=AT_NIGHT),
    ],
)
def test_a_table_of_too_many_rows_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Of numbers alone more rows are read, with less memory.
    monkeypatch.setattr(table, "MOST_PLAIN", MOST_ROWS)
    reader, head, row = LONG[name]
    path = tmp_path / "long.csv"
    path.write_text(head + row * (MOST_ROWS + 1))
    with pytest.raises(InputError, match="more than the 1000000 rows that are read"):
        reader(path)


def test_a_document_that_would_fill_the_memory_is_refused() -> None:
    text = "[" + "[]," * 6_000_000 + "[]]"
    for parse in (parse_toml, parse_json):
        with pytest.raises(InputError, match="its 18 MB are more than"):
            parse("a=" + text if parse is parse_toml else text, "x")


def test_toml_and_json() -> None:
    assert parse_toml("a = [1, 2.5]", "x") == {"a": [1, 2.5]}
    with pytest.raises(InputError, match="not TOML"):
        parse_toml("a = = 1", "x")
    with pytest.raises(InputError, match="64 deep"):
        parse_toml("a" + ".a" * 100 + " = 1", "x")
    with pytest.raises(InputError, match="64 bits"):
        parse_json('{"a": ' + "9" * 30 + "}", "x")
    for text in ("[" * 50_000, "9" * 5000, b"\xff", "{"):
        with pytest.raises(InputError, match="not JSON"):
            parse_json(text, "x")


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="folder"):
        file_text(tmp_path)
    with pytest.raises(OSError, match="not a file name"):
        file_text("a\0b")
    (tmp_path / "long").write_text("x" * 100)
    with pytest.raises(OSError, match="more than"):
        file_text(tmp_path / "long", 99)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes")
def test_what_the_system_says_is_empty_is_read_to_its_limit() -> None:
    maps = Path("/proc/self/maps")
    if not maps.exists():
        pytest.skip("no such files here")
    assert len(file_bytes(maps)) > maps.stat().st_size == 0
    with pytest.raises(OSError, match="more than"):
        file_bytes(maps, 10)


def test_a_pipe_that_takes_a_files_place_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "unit.toml"

    def swap(*_: object) -> None:
        os.mkfifo(path)

    monkeypatch.setattr(reading, "require_readable", swap)
    with pytest.raises(OSError, match="not a regular file"):
        file_bytes(path)


def test_a_pipe_in_a_folder_of_results(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "state-x.npz")
    assert read_npz(tmp_path / "state-x.npz") is None
    os.mkfifo(tmp_path / "log.ndjson")
    with pytest.raises(InputError, match="pipe"):
        claim(tmp_path, FolderLayout("study.toml", "format = 1", ()), {"study.toml": "format = 1\n"})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["record", "--simulate", "--seconds", "nan", "--out", "OUT"], "nan is not a number"),
        (["record", "--simulate", "--seconds", "inf", "--out", "OUT"], "not a valid duration"),
        (["record", "--simulate", "--seconds", "-1", "--out", "OUT"], "not a valid duration"),
        (["record", "--port", "x", "--baud", "0", "--out", "OUT"], "baud = 0 is out of bounds"),
        (["design", "--preset", "mu-1.0x", "--out", "OUT\0x"], "NUL"),
        (["design", "--preset", "mu-1.0x", "--out", "OUT\udcff"], "not UTF-8"),
        (["specimens", "--resin", "", "--out", "OUT"], "empty"),
        (["design", "--preset", "mu-1.0x", "--out", ""], "no output folder"),
        (["simulate", "--preset", "mu-1.0x", "--model", "", "--out", "OUT"], "empty"),
        (["design", "--unit", "", "--out", "OUT"], "empty"),
        (["simulate", "--preset", "mu-1.0x", "--model", "EMPTY", "--out", "OUT"], "no verdict"),
        (["simulate", "--preset", "mu-1.0x", "--model", "LATIN", "--out", "OUT"], "UTF-8"),
        (["calibrate", "x" * 5000, "--out", "OUT"], "too long"),
        (["resume", "x" * 5000], "no study"),
    ],
)
def test_options_that_mean_nothing(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "EMPTY").write_text("")
    (tmp_path / "LATIN").write_bytes(b'verdict = "\xe9"')
    given = [str(tmp_path / a) if a.startswith(("OUT", "EMPTY", "LATIN")) else a for a in arguments]
    assert main(given) == 2
    assert words in capsys.readouterr().err


def test_escapes_in_a_file_are_spelt_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "unit.toml"
    path.write_text('format = 1\n"\\u001b]0;owned\\u0007" = 1\n')
    line = ["design", "--unit", str(path), "--out", str(tmp_path / "o")]
    told = subprocess.run(
        [sys.executable, str(ASSETS.parent / "headless/run.py"), *line], capture_output=True, check=False
    )
    assert told.returncode == 2
    assert b"\x1b" not in told.stderr
    assert b"\\x1b" in told.stderr
    with pytest.raises(SystemExit) as end:
        main(["design", "a\x1b[2J"])
    assert end.value.code == 2
    assert "\x1b" not in capsys.readouterr().err
    assert main([*line, "--json"]) == 2
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "owned" in json.loads(said.splitlines()[-1])["what"]
