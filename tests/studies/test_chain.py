"""The use case of units in series: its inputs read and written, its files, its resumption, its target."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from mu_addon.chain import read_pressures
from mu_addon.chain.unit_between_plates import PlateBody
from mu_addon.cli.main import main
from mu_addon.errors import InputError
from mu_addon.studies.chain import Chain

from ..evidence.hollow_finger import finger

ROOT = Path(__file__).resolve().parents[2]
CHAIN = """
format = 1
protocol = "protocol.csv"
tip_mass_g = 10
times = 3
mesh = { refine = 0.25 }
[joint]
pressure_step_kPa = 50.0
loaded = false
[[unit]]
preset = "mu-1.0x"
pressure_kPa = [0, 20]
[[unit]]
preset = "mu-1.0x"
turn_deg = 90
pressure_kPa = [0, 20]
"""
PROTOCOL = "# two lines\ntime_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n1,10,0\n2,10,20\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "chain.toml").write_text(CHAIN)
    (tmp_path / "protocol.csv").write_text(PROTOCOL)
    return tmp_path


def test_equal_units_share_the_range_of_their_pressures(folder):
    (folder / "chain.toml").write_text(CHAIN.replace("pressure_kPa = [0, 20]", "pressure_kPa = [-5, 5]", 1))
    ((_, unit, *span),) = Chain.read(folder).joints_of
    assert (unit.name, span) == ("mu-1.0x", [-5.0, 20.0])


def test_options_replace_values_of_the_file(folder):
    """A point to reach takes the protocol's place."""
    found = Chain.read_file(folder / "chain.toml", replaced={"reach": (0.0, 5.0, 150.0), "tip_mass_g": 3.0})
    assert (found.reach, found.protocol, found.tip_mass_g) == ((0.0, 5.0, 150.0), None, 3.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('protocol = "protocol.csv"', "", "neither a protocol nor a target"),
        ("times = 3", "times = 1", "times = 1"),
        ("tip_mass_g = 10", "tip_mass_g = -1", "tip_mass_g = -1"),
        ("tip_mass_g = 10", 'tip_mass_g = "heavy"', "is not a number"),
        ("refine = 0.25", 'fraction = "half"', "fraction"),
        ('preset = "mu-1.0x"', 'preset = "mu-1.0x"\nfile = "a.toml"', "by preset or by file"),
        ("turn_deg = 90", "turn = 90", "unknown key 'turn'"),
        ("pressure_kPa = [0, 20]", "pressure_kPa = [20, 0]", "pressure_kPa"),
        ("pressure_step_kPa = 50.0", "bend_deg = 90.0", "bend_deg"),
        ("[[unit]]", "[target]\nreach = [0, 0, 1]\n[[unit]]", "both a protocol and a target"),
    ],
)
def test_wrong_inputs_are_named(folder, old, new, words):
    (folder / "chain.toml").write_text(CHAIN.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        Chain.read(folder)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "columns"),
        ("time_s,pressure_1_kPa\n0,0\n1,1\n", "of 2 units"),
        (PROTOCOL + "1,0,0\n", "time does not increase"),
        (PROTOCOL + "3,0,nan\n", "not finite"),
        (PROTOCOL + "3,0,99999999999999999999\n", "a pressure of 1e\\+20 kPa"),
        (PROTOCOL + "3,0\n", "missing or not a number"),
        ("time_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n", "fewer than two rows"),
    ],
)
def test_wrong_protocols_are_named_with_their_line(tmp_path, text, words):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_pressures(path, 2)


def rows_of(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.slow
def test_a_chain_from_the_command_line_leaves_its_files_and_resumes(folder, monkeypatch):
    """Of hollow fingers: printed units between plates are those of `test_joint_learning`."""
    monkeypatch.setattr("mu_addon.body.mesh_printed", finger)
    unit = "format = 1\n[chambers]\ncount = 3\n[material]\nmembrane_modulus_kPa = 400\n"
    (folder / "short.toml").write_text(unit)
    (folder / "chain.toml").write_text(CHAIN.replace('preset = "mu-1.0x"', 'file = "short.toml"'))
    out = folder / "out"
    assert main(["chain", str(folder / "chain.toml"), "--out", str(out)]) == 0
    rows = rows_of(out / "tip.csv")
    assert [float(row["pressure_2_kPa"]) for row in rows] == [0.0, 0.0, 20.0]
    # The second unit, turned a quarter, bends across the first one's plane.
    assert abs(float(rows[-1]["x_mm"]) - float(rows[0]["x_mm"])) > 0.3
    assert all(float(row["y_error95_mm"]) > 0 for row in rows)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert summary["chain"]["units"] == 2
    assert (out / "chain.pvd").is_file()
    assert (out / "report.html").read_text().count("<img") >= 4
    assert len(list((out / "chain").glob("*.vtu"))) == 3
    before = (out / "tip.csv").read_bytes()
    monkeypatch.setattr(PlateBody, "free", lambda *_: pytest.fail("solved again"))
    assert main(["resume", str(out), "--no-report"]) == 0
    assert (out / "tip.csv").read_bytes() == before
    # The same joints serve a target, since they are kept by what they were learned from.
    tip = [float(rows[-1][f"{axis}_mm"]) for axis in "xyz"]
    words = ["chain", str(folder / "chain.toml"), "--out", str(out), "--no-report", "--reach", *map(str, tip)]
    assert main(words) == 0
    target = json.loads((out / "summary.json").read_text())["target"]
    assert target["miss_mm"] < 0.05
    np.testing.assert_allclose(
        [float(row["pressure_kPa"]) for row in rows_of(out / "target.csv")], [10, 20], atol=1.0
    )
