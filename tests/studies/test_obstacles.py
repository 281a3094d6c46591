"""--obstacle: a study beside rigid bodies keeps them, follows the contact through time, and tells of it."""

import csv
import json

import attrs
import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.design import shapes
from mu_addon.design.body import body_of
from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.design.rigid_body import RigidBody, mirrored, read_rigid_bodies, to_obj
from mu_addon.design.settings import FRICTION
from mu_addon.design.surface import stl_bytes
from mu_addon.errors import InputError
from mu_addon.report.unit_pictures import _behind
from mu_addon.simulate_and_place.contact_history import DEPTH_mm
from mu_addon.studies.unit_ranking import UnitStudy


def block(low, high, name="block.stl"):
    mesh = shapes.box(low, high).to_mesh64()
    return body_of(np.array(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(int), name)


WALL = block((-40, 31.5, 15), (40, 60, 50), "wall.stl")


@pytest.fixture
def files(tmp_path):
    """A short unit's TOML, a protocol, and a wall beside the unit."""
    unit = to_toml(load_preset("mu-1.0x")).replace("count = 6", "count = 3")
    (tmp_path / "unit.toml").write_text(unit)
    (tmp_path / "up.csv").write_text("time_s,pressure_kPa\n0,0\n2,8\n")
    (tmp_path / "wall.stl").write_bytes(stl_bytes(WALL.vertices, WALL.triangles))
    return tmp_path


def simulate(files, *more):
    line = ["simulate", "--unit", files / "unit.toml", "--protocol", files / "up.csv", "--times", 3]
    line += ["--no-self-contact", "--refine", 0.2, "--out", files / "out", "--json", *more]
    return main([str(word) for word in line]), files / "out"


def test_bodies_survive_their_file(tmp_path):
    given = (RigidBody(WALL, 0.25), RigidBody(block((1, 40, 0), (2, 41, 3), "a b.stl")))
    (tmp_path / "o.obj").write_text(to_obj(given))
    found = read_rigid_bodies(tmp_path / "o.obj", [0.25, FRICTION.default])
    assert [f.friction for f in found] == [0.25, FRICTION.default]
    assert [f.name for f in found] == ["wall.stl", "a b.stl"]
    assert [f.body.hash for f in found] == [g.body.hash for g in given]
    assert mirrored(given[:1])
    assert not mirrored(given)
    with pytest.raises(InputError, match="not one coefficient per obstacle"):
        read_rigid_bodies(tmp_path / "o.obj", [0.25])
    (tmp_path / "o.obj").write_text("o 1 x\nv 0 0 zero\n")
    with pytest.raises(InputError, match="cannot be read"):
        read_rigid_bodies(tmp_path / "o.obj", [0.25])
    with pytest.raises(InputError, match="friction = 7 is out of bounds"):
        RigidBody(WALL, 7.0)


def test_one_off_the_middle_plane_asks_for_the_whole_unit():
    job = UnitStudy(unit=load_preset("mu-1.0x"), stages=("design", "simulate"))
    assert job.meshed_as == job.mesh
    beside = attrs.evolve(job, obstacles=[RigidBody(WALL)])
    assert beside.meshed_as.fraction == "half"
    off = attrs.evolve(job, obstacles=[RigidBody(block((1, 40, 0), (20, 50, 30)))])
    assert off.meshed_as.fraction == "full"
    with pytest.raises(InputError, match="does not support obstacles"):
        attrs.evolve(beside, stages=("design", "simulate", "place"), paths="graph")


def test_pictures_show_what_stands_behind_the_cut():
    (part,) = _behind([RigidBody(WALL), RigidBody(block((1, 40, 0), (20, 50, 30)))])
    assert part.vertices[:, 0].min() == -40
    assert part.vertices[:, 0].max() == 0


@pytest.mark.nightly("test_a_unit_that_meets_a_wall")
def test_paths_are_ranked_beside_a_wall(files, capsys):
    """Each along its whole motion: another answer than that of the free unit, which shortcuts find."""
    (files / "up.csv").write_text("time_s,pressure_kPa\n0,0\n2,8\n4,0\n")
    line = ["place", "--unit", files / "unit.toml", "--protocol", files / "up.csv", "--times", 5]
    line += ["--no-self-contact", "--refine", 0.2, "--no-mesh-check", "--workers", 1]
    line += ["--out", files / "out", "--json", "--no-report", "--obstacle", files / "wall.stl"]
    assert main([str(word) for word in line]) == 0, capsys.readouterr().out
    summary = json.loads((files / "out" / "summary.json").read_text())
    assert summary["contact"]["1 wall.stl"]["largest_force_N"] > 0
    delta = np.load(files / "out" / "delta.npz")["delta_mm"]
    # At 4 kPa on the way there and back the unit and its candidate stand elsewhere.
    assert delta.shape[1] == 5
    assert delta[0, 2].mean() > delta[0, 0].mean() == 0.0
    assert np.abs(delta[0, 3] - delta[0, 1]).max() > 1e-6


def test_a_unit_that_meets_a_wall(files, capsys):
    status, out = simulate(files, "--obstacle", files / "wall.stl", "--friction", 0.3)
    assert status == 0, capsys.readouterr().out
    job = UnitStudy.read(out)
    assert [(o.friction, o.body.hash) for o in job.obstacles] == [(0.3, WALL.hash)]

    def rows(folder, name):
        return list(csv.DictReader((folder / name).open()))

    contact = rows(out, "contact.csv")
    normal, rubbing, force_y, error = (
        np.array([float(r[c]) for r in contact])
        for c in ("normal_N", "friction_N", "force_y_N", "gap_error_mm")
    )
    assert [float(r["pressure_kPa"]) for r in contact] == [0, 4, 8]
    assert normal[0] == 0.0
    assert normal[2] > 0.01
    assert normal[2] == normal.max()
    np.testing.assert_allclose(force_y, normal, rtol=1e-6)
    assert (rubbing <= 0.3 * normal * (1 + 1e-3)).all()
    assert rubbing[2] > 0.2 * normal[2]
    # Where it presses with less than PRESSURE_MPa the gap is off by less than DEPTH_mm.
    assert 0 < error.max() < 2 * DEPTH_mm
    angle = [float(r["angle_deg"]) for r in rows(out, "motion.csv")]
    # The wall holds the unit back.
    assert angle[2] < 2 * angle[1]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["contact"]["1 wall.stl"]["friction"] == 0.3
    assert summary["contact"]["1 wall.stl"]["at_kPa"] == 8
    assert "Contact with obstacles" in (out / "report.html").read_text()

    # Again from the cache: the same to the last digit, also where the last instant is missing.
    before = (out / "contact.csv").read_text()
    newest = max((out / "cache").glob("instant-*"), key=lambda p: p.stat().st_mtime)
    newest.unlink()
    assert main(["resume", str(out), "--json", "--no-report"]) == 0
    assert (out / "contact.csv").read_text() == before
