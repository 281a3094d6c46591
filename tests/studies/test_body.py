"""--body: a study takes a body of the user's own, keeps it with its inputs, and knows when it changed."""

import json
import shutil

import pytest

from mu_addon.cli.main import main
from mu_addon.design.body import envelope
from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.design.surface import stl_bytes
from mu_addon.studies.unit_ranking import UnitStudy

from ..design.bodies import cylinder


@pytest.fixture
def files(tmp_path):
    """A short unit's TOML and a body around it, longer than it is."""
    unit = to_toml(load_preset("mu-1.0x")).replace("count = 6", "count = 3")
    (tmp_path / "unit.toml").write_text(unit)
    body = cylinder(18.75, 25.0, 6.25, -2.0, 40.0)
    (tmp_path / "body.stl").write_bytes(stl_bytes(body.vertices, body.triangles))
    return tmp_path


def design(files, *more):
    out = files / "out"
    line = ["design", "--unit", files / "unit.toml", "--out", out, "--json", "--no-report", *more]
    return main([str(word) for word in line]), out


def test_design_in_a_body(files, capsys):
    status, out = design(files, "--body", files / "body.stl", "--path", "alpha1")
    assert status == 0, capsys.readouterr()
    summary = json.loads((out / "summary.json").read_text())
    assert summary["body"]["low_mm"][2] == 0.0
    assert summary["body"]["high_mm"][2] == 37.5
    assert summary["gates"]["unit_alpha1.stl"]["components"] == 1
    job = UnitStudy.read(out)
    assert job.body is not None
    assert job.body.hash == envelope(job.body, job.unit.dimensions).hash
    # The study keeps the body it was made with: the file may go.
    shutil.move(files / "body.stl", files / "gone.stl")
    assert UnitStudy.read(out).body.hash == job.body.hash
    # Without the body it is another study: what belonged to the body is not current any more.
    status, out = design(files)
    assert status == 0
    assert UnitStudy.read(out).body is None
    assert not (out / "unit_alpha1.stl").exists()


def test_a_search_of_the_whole_lattice_takes_no_body(files, capsys):
    line = ["place", "--unit", files / "unit.toml", "--out", files / "out", "--json", "--paths", "graph"]
    assert main([str(word) for word in [*line, "--body", files / "body.stl"]]) == 2
    assert "supports only the default box of the lattice" in capsys.readouterr().out
