"""`check` from the command line: its files, its report and its exit status."""

import base64
import json
import re

import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.design import shapes
from mu_addon.design.parameters import Chambers, Unit
from mu_addon.design.printing.orientation import direction_name
from mu_addon.design.printing.printer import MEANING, load_printer, printer_text, read_printer
from mu_addon.design.solid import build_solid, printable
from mu_addon.design.surface import bad_edges, genus, stl_bytes, stl_surface, volume
from mu_addon.errors import InputError
from mu_addon.studies.check import Check, PartFile, part_in


def bottle(bore):
    """A closed box of 14 mm with a chamber of 10 mm, and a bore to the bottom."""
    body = shapes.box([-7, -7, 0], [7, 7, 14]) - shapes.box([-5, -5, 2], [5, 5, 12])
    return printable(body - shapes.cylinder(bore / 2.0, -1.0, 3.0, 32))


def run(tmp_path, surface, *options):
    (tmp_path / "part.stl").write_bytes(stl_bytes(*surface))
    out = tmp_path / "out"
    status = main(["check", "--stl", str(tmp_path / "part.stl"), "--out", str(out), *options])
    return status, out


def test_a_part_that_can_be_printed(tmp_path):
    status, out = run(tmp_path, bottle(4.0))
    assert status == 0
    found = json.loads((out / "check.json").read_text())
    by_name = {f["check"]: f for f in found["findings"]}
    assert by_name["drain"]["value"] == pytest.approx(4.0, abs=0.1)
    assert by_name["chamber wall"]["value"] == pytest.approx(2.0, abs=1e-3)
    assert found["figures"]["chamber_ml"] == pytest.approx(1.0, rel=0.05)
    assert found["figures"]["volume_ml"] == pytest.approx((14**3 - 1000 - 8 * np.pi) / 1e3, rel=1e-3)
    # With its opening toward the platform the chamber is no cup; turned over it is one of its volume.
    ways = {tuple(np.round(b["direction"], 3)): b for b in found["orientation"]}
    assert ways[0, 0, 1]["cup_ml"] == 0.0
    assert ways[0, 0, -1]["cup_ml"] == pytest.approx(1.0, rel=0.1)
    assert found["orientation"][0]["cup_ml"] < 0.25
    report = (out / "report.html").read_text()
    assert "<strong>Printable" in report


def test_a_limit_that_was_measured_decides(tmp_path, capsys):
    sheet = tmp_path / "limits.csv"
    sheet.write_text("limit,sizes,measured\ndrain_diameter_mm,2 5,4.5\n")
    status, out = run(tmp_path, bottle(4.0), "--limits", str(sheet))
    assert status == 0
    found = {f["check"]: f for f in json.loads((out / "check.json").read_text())["findings"]}
    assert found["drain"]["severity"] == "warning"
    assert found["drain"]["limit"] == 4.5
    assert not found["drain"]["assumed"]
    assert "Measured: narrowest opening that drains a chamber." in (out / "report.html").read_text()
    for name in ("check.json", "summary.json"):
        limits = json.loads((out / name).read_text())["limits"]
        assert limits["measured"] == ["drain_diameter_mm"]
        assert sum(map(len, limits.values())) == len(MEANING)
    words = capsys.readouterr().out
    assert "measured limits: drain_diameter_mm" in words
    # Terminal and report count the same.
    share = f"{len(limits['assumed'])} of {len(MEANING)}"
    assert f"assumed limits: {share}, see report.html" in words
    assert f"{share} limits are assumed" in (out / "report.html").read_text()
    assert read_printer(out / "printer.toml").limits["drain_diameter_mm"].measured


def test_the_report_draws_the_layers_that_are_asked_for(tmp_path):
    status, out = run(tmp_path, bottle(4.0), "--layers", "1", "7")
    assert status == 0
    charts = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", (out / "report.html").read_text())
    words = b" ".join(base64.b64decode(chart) for chart in charts).decode()
    assert "1.0 mm, 13 mm²" in words
    assert "7.0 mm, 100 mm²" in words
    assert run(tmp_path, bottle(4.0), "--layers", "99")[0] == 0, "above the part"


@pytest.mark.parametrize(("how", "fault"), [("open", "open edges"), ("flipped", "1 triangle is flipped")])
def test_a_part_that_must_not_be_printed_ends_with_status_6(tmp_path, how, fault):
    vertices, triangles = bottle(4.0)
    triangles = triangles[5:] if how == "open" else np.vstack([triangles[:1, ::-1], triangles[1:]])
    status, out = run(tmp_path, (vertices, triangles))
    assert status == 6
    summary = json.loads((out / "summary.json").read_text())
    assert summary["verdict"] == "error"
    assert fault in summary["reason"]["what"]
    # What was found is told all the same.
    report = (out / "report.html").read_text()
    assert "Not printable" in report
    assert "it has no layers" in report


@pytest.mark.parametrize(("extent", "turned"), [((30, 150, 20), True), ((150, 30, 20), False)])
def test_it_is_said_that_a_part_must_be_turned_to_fit(tmp_path, capsys, extent, turned):
    """As long as the platform is wide, and longer than it is deep: 200 x 125 mm."""
    (tmp_path / "part.stl").write_bytes(stl_bytes(*printable(shapes.box([0, 0, 0], list(extent)))))
    words = ["--stl", str(tmp_path / "part.stl"), "--out", str(tmp_path / "out"), "--no-report"]
    assert main(["check", *words]) == 0
    assert ("only if it is turned by 90 degrees" in capsys.readouterr().out) == turned


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (stl_bytes(np.zeros((0, 3)), np.zeros((0, 3), int)), "holds no triangles"),
        (stl_bytes(1e30 * CORNERS, np.array([[0, 1, 2]])), "beyond 1e\\+06 mm"),
        # Before they are read.
        (stl_bytes(CORNERS, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])), "holds 4 triangles"),
        (b"solid part\n" + 4 * (b"facet\n" + 3 * b"vertex 0 0 x\n" + b"endfacet\n"), "holds 4 triangles"),
    ],
)
def test_a_file_that_is_no_part_is_refused(content, words, monkeypatch):
    monkeypatch.setattr("mu_addon.studies.check.MOST_TRIANGLES", 3)
    with pytest.raises(InputError, match=words):
        part_in(content, "part.stl")


def test_the_shipped_printer_names_a_source_for_every_limit(tmp_path):
    printer = load_printer("form-4")
    assert set(printer.limits) == set(MEANING)
    assert all(limit.source for limit in printer.limits.values())
    assert [printer[f"build_{axis}_mm"] for axis in "xyz"] == [200.0, 125.0, 210.0]
    # Nobody has published what Elastic 50A needs of walls: that is said.
    assert printer.limits["wall_mm"].assumed
    (tmp_path / "mine.toml").write_text(printer_text(printer))
    assert read_printer(tmp_path / "mine.toml") == printer


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("value = 0.6", "value = -0.6", "value = -0.6 is out of bounds"),
        ("[wall_mm]", "[walls_mm]", "did you mean 'wall_mm'"),
        ("assumed = true", "assumed = 1", "is not true or false"),
        ("format = 1", "format = 2", "format = 2 is not known"),
    ],
)
def test_a_printers_file_with_a_mistake_is_refused(tmp_path, old, new, words):
    text = printer_text(load_printer())
    assert old in text
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        read_printer(tmp_path / "mine.toml")


def test_directions_are_named_as_they_are_spoken_of():
    assert direction_name((0, 0, 2)) == "+z"
    assert direction_name((1, -1, 0)) == "+x−y"
    lean = np.radians(20)
    assert direction_name((-np.sin(lean), 0, np.cos(lean))) == "20° from +z toward −x"


def test_a_file_is_compared_with_its_unit(tmp_path):
    unit, printer = Unit(chambers=Chambers(count=3)), load_printer()
    solid = build_solid(unit)
    stl = PartFile(tmp_path / "part.stl", stl_bytes(solid.vertices, solid.triangles))

    def nominal(**given):
        one = Check(printer=printer, **given)
        return one.nominal(one.unit, one.stl, one.path, one.quality)

    found = nominal(unit=unit, stl=stl)
    assert genus(found.vertices, found.triangles) == genus(solid.vertices, solid.triangles)
    assert nominal(unit=unit) is None
    assert nominal(stl=stl) is None


def test_a_file_is_repaired_where_there_is_one_way_to_and_the_report_says_how(tmp_path, capsys):
    vertices, triangles = bottle(4.0)
    broken = np.concatenate([triangles[:9, ::-1], triangles[9:], triangles[20:22]])
    status, out = run(tmp_path, (vertices, broken), "--repair")
    assert status == 0
    found = json.loads((out / "check.json").read_text())
    done = " ".join(change["what"] for change in found["repair"]["changes"])
    assert "flipped" in done
    assert "doubled" in done
    assert found["repair"]["volume_after_mm3"] == pytest.approx(volume(vertices, triangles), rel=1e-6)
    assert {f["severity"] for f in found["findings"] if "faces" in f["check"]} == {"pass"}
    assert bad_edges(stl_surface((out / "part.stl").read_bytes())[1]) == 0
    assert "doubled triangles were removed" in (out / "report.html").read_text()
    assert "repaired: " in capsys.readouterr().err
    # A hole may be closed in several ways: nothing is written, and what remains is said.
    status, out = run(tmp_path / "out", (vertices, triangles[30:]), "--repair")
    assert status == 6
    assert "open edges" in json.loads((out / "summary.json").read_text())["reason"]["what"]
    assert not (out / "part.stl").exists()
