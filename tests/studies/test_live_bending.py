"""Shapes of a unit while it is designed: those of a new mesh, from the design before."""

import json
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import attrs
import numpy as np
import pytest
from scipy.spatial import KDTree

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.assets import asset_root
from mu_addon.design.parameters import Unit, load_preset, preset_names
from mu_addon.design.rigid_body import RigidBody
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.fem.state import rest
from mu_addon.fem.trajectory import Trajectory
from mu_addon.fem.unit_materials import materials_of
from mu_addon.live_bending import known, requests, run
from mu_addon.live_bending.run import LiveBending
from mu_addon.meshing.settings import MeshSettings
from mu_addon.report.motion_files import read_motion, write_model_a
from mu_addon.studies.unit_ranking import UnitStudy
from tests.design.kinds import cross, custom

from .test_obstacles import WALL

UNIT = Unit().evolve(count=3)
PROTOCOL = Protocol([0.0, 1.0], [0.0, 8.0])


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(run, "LEVELS", requests.LEVELS[:1])
    monkeypatch.setattr(run, "RUNGS", 2)


def answered(bending, number, unit, kPa=8.0, shapes=None):
    """Pairs of kPa and degrees that answer a request, and its motion."""
    requests.ask(bending.folder, number, UnitStudy(unit=unit, protocol=PROTOCOL), kPa, shapes=shapes)
    assert bending.step()
    found = json.loads((bending.folder / requests.BENT).read_text())
    assert found["number"] == number
    assert not found["trouble"]
    return dict(found["states"]), read_motion(bending.folder / found["folder"])


def test_a_wall_from_the_design_before_bends_as_one_meshed_anew(tmp_path):
    warm, anew = LiveBending(tmp_path / "warm"), LiveBending(tmp_path / "anew")
    shapes = tmp_path / "shapes"
    first, motion = answered(warm, 1, UNIT, shapes=shapes)
    assert set(first) == {0.0, 4.0, 8.0}
    assert 0.0 == first[0.0] < first[4.0] < first[8.0]
    assert motion.state_kPa.tolist() == [0.0, 4.0, 8.0]
    thicker = UNIT.evolve(wall_mm=1.1)
    # Beyond the protocol's pressures.
    second, moved = answered(warm, 2, thicker, 12.0)
    assert (moved.mesh.nodes != motion.mesh.nodes).any(), "the mesh was moved"
    wanted, _ = answered(anew, 1, thicker, 12.0)
    assert set(second) == set(wanted) == {0.0, 6.0, 12.0}
    assert second[6.0] < np.interp(6.0, list(first), list(first.values()))
    for kPa in (6.0, 12.0):
        assert second[kPa] == pytest.approx(wanted[kPa], rel=5e-3)
    assert not warm.step(), "nothing more was asked for"

    # Its shape is found again, at its own size and stiffness and at others, and for a unit like it.
    for scale, stiffer in ((1.0, 1.0), (1.5, 2.0)):
        asked = UNIT.evolve(scale=scale, membrane_modulus_kPa=2500.0 * stiffer)
        kept = known.nearest(asked, tmp_path / "none", shapes)
        assert kept.same
        assert kept.answer["states"] == [[stiffer * kPa, angle] for kPa, angle in first.items()]
        for region in motion.surfaces:
            skins = kept.motion.skin(region, False), motion.skin(region, False)
            assert (skins[0].triangles == skins[1].triangles).all()
            of = (
                (m.mesh.nodes + m.model_a[-1])[s.node]
                for m, s in zip((kept.motion, motion), skins, strict=True)
            )
            assert next(of) == pytest.approx(scale * next(of), abs=5e-3)
    assert not known.nearest(thicker, shapes).same
    assert not known.nearest(UNIT.evolve(count=4), shapes).same


@pytest.mark.parametrize("count", [3, 5, 8])
def test_chambers_that_a_kept_shape_lacks_or_has_too_many_bend_as_its_own(tmp_path, count):
    """Of a unit whose axis becomes a circle: with more chambers it is more of the same circle."""
    unit, radius = load_preset("mu-1.0x").evolve(count=5), 60.0

    def bent(nodes):
        angle = nodes[..., 2] / radius
        y = (radius + nodes[..., 1]) * np.cos(angle) - radius
        return np.stack([nodes[..., 0], y, (radius + nodes[..., 1]) * np.sin(angle)], axis=-1)

    def shaped(unit):
        mesh = mesh_printed(unit, MeshSettings(refine=0.2))
        states = (rest(mesh), attrs.evolve(rest(mesh), pressure_MPa=0.04, u=bent(mesh.nodes) - mesh.nodes))
        motion = Trajectory(np.arange(2.0), np.array([0.0, 40.0]), states, np.arange(2), mesh)
        write_model_a(tmp_path / "motion", mesh, materials_of(unit, mesh), motion)
        return read_motion(tmp_path / "motion")

    had, wanted = shaped(unit), unit.evolve(count=count)
    known.keep(had, {"states": [[0.0, 0.0], [40.0, 60.0]]}, unit, tmp_path / "shapes")
    # Twice as stiff, it needs twice the pressure and has twice the stress.
    found = known.nearest(wanted.evolve(membrane_modulus_kPa=5000.0), tmp_path / "shapes")
    assert found.same == (count == 5)
    assert found.answer["states"][1] == [80.0, pytest.approx(60.0 * count / 5)]
    assert (found.motion.pressure_kPa.tolist(), found.motion.state_kPa.tolist()) == ([0.0, 80.0],) * 2
    truth = shaped(wanted)
    for region, surface in truth.surfaces.items():
        own, nodes = found.motion.surfaces[region], found.motion.mesh.nodes
        assert len(own.triangles) == len(surface.triangles) == len(own.cut)
        for name, values in found.motion.fields[region].items():
            assert values.shape == (2, len(own.node))
            most = (2.0 if name.endswith("_kPa") else 1.0) * had.fields[region][name].max()
            assert values.max() == pytest.approx(most, rel=0.1), name
        places = nodes[own.node]
        distance, _ = KDTree(places).query(truth.mesh.nodes[surface.node])
        assert distance.max() < 0.01, "the same surface at rest"
        moved = places + found.motion.model_a[1, own.node]
        assert np.abs(moved - bent(places)).max() < 0.2, "on the same circle"


@pytest.mark.nightly("test_a_wall_from_the_design_before_bends_as_one_meshed_anew")
def test_a_lattice_of_another_kind_bends_too(tmp_path):
    """Its cell is meshed once: a thicker wall moves the mesh."""
    bending, unit = LiveBending(tmp_path), UNIT.evolve(**custom(cross()), seats=False)
    first, motion = answered(bending, 1, unit, 10.0)
    assert len(motion.mesh.beams) > 0
    cells = sorted((tmp_path / requests.CELLS).iterdir())
    second, moved = answered(bending, 2, unit.evolve(wall_mm=1.1), 10.0)
    assert 0.0 < second[10.0] < first[10.0]
    assert (moved.mesh.tets == motion.mesh.tets).all()
    assert sorted((tmp_path / requests.CELLS).iterdir()) == cells != []


@pytest.mark.nightly("test_a_wall_from_the_design_before_bends_as_one_meshed_anew")
def test_other_struts_are_meshed_anew_and_begin_at_the_states_of_the_design_before(tmp_path, monkeypatch):
    """Other struts have other ties."""
    warm = LiveBending(tmp_path / "warm")
    _, moved = answered(warm, 1, UNIT)
    thin = UNIT.evolve(junction_diameter_mm=1.3)
    monkeypatch.setattr(run.Equilibrium, "reach", None)
    third, own = answered(warm, 2, thin)
    monkeypatch.undo()
    monkeypatch.setattr(run, "LEVELS", requests.LEVELS[:1])
    assert own.mesh.nodes.shape != moved.mesh.nodes.shape
    wanted, _ = answered(LiveBending(tmp_path / "thin"), 1, thin)
    assert third[8.0] == pytest.approx(wanted[8.0], rel=1e-4)
    settings = MeshSettings(refine=requests.LEVELS[0][0])
    assert (own.mesh.tied_weights == mesh_printed(thin, settings).tied_weights).all()
    assert 0.0 < third[4.0] < third[8.0]


def test_stretch_and_stress_come_after_the_shape_where_they_are_asked_for(tmp_path, monkeypatch):
    told, bending = [], LiveBending(tmp_path)
    write = LiveBending._tell

    def tell(self, found, error, finished):
        write(self, found, error, finished)
        answer = json.loads((tmp_path / requests.BENT).read_text())
        motion = read_motion(tmp_path / answer["folder"])
        told.append((len(motion.state_kPa), bool(motion.fields["lattice"])))

    monkeypatch.setattr(LiveBending, "_tell", tell)
    requests.ask(tmp_path, 1, UnitStudy(unit=UNIT, protocol=PROTOCOL), 8.0, fields=True)
    assert bending.step()
    assert told == [(2, False), (2, True), (3, True)]
    motion = read_motion(tmp_path / json.loads((tmp_path / requests.BENT).read_text())["folder"])
    stretch = motion.fields["lattice"]["largest_stretch"]
    assert stretch[0] == pytest.approx(1.0)
    assert 1.0 < stretch[1].max() < stretch[2].max() < 1.5


def test_a_newer_request_ends_the_one_before(tmp_path, monkeypatch):
    bending, told = LiveBending(tmp_path), []
    write = LiveBending._tell

    def tell(self, found, error, finished):
        write(self, found, error, finished)
        told.append(self._number)
        if len(told) == 1:
            requests.ask(tmp_path, 2, UnitStudy(unit=UNIT, protocol=PROTOCOL), 4.0)

    monkeypatch.setattr(LiveBending, "_tell", tell)
    requests.ask(tmp_path, 1, UnitStudy(unit=UNIT, protocol=PROTOCOL), 8.0)
    assert bending.step()
    assert told == [1], "one state, and no more"
    assert bending.step()
    assert set(told[1:]) == {2}


@pytest.mark.parametrize(
    ("study", "words"),
    [
        (UnitStudy(unit=UNIT, protocol=PROTOCOL, obstacles=[RigidBody(WALL)]), "obstacles"),
        (UnitStudy(unit=UNIT.evolve(law="prony"), protocol=PROTOCOL), "memory"),
    ],
)
def test_what_is_not_bent_live_is_refused(tmp_path, study, words):
    with pytest.raises(InputError, match=words):
        requests.ask(tmp_path, 1, study, 8.0)
    assert not LiveBending(tmp_path).step()


def test_a_unit_without_a_shape_is_told(tmp_path):
    requests.ask(tmp_path, 1, UnitStudy(unit=UNIT, protocol=PROTOCOL), 8.0)
    (tmp_path / requests.ASKED / "1" / "unit.toml").write_text("format = 1\nscale = -1.0\n")
    assert LiveBending(tmp_path).step()
    found = json.loads((tmp_path / requests.BENT).read_text())
    assert found["number"] == 1
    assert found["trouble"]


class Once(LiveBending):
    """Bends a unit coarsely, and no finer."""

    def _rest(self):
        raise run._Superseded


def shipped(folder):
    """The shape of the presets that comes with the extension, made anew: they bend alike."""
    bending, unit = Once(folder), load_preset("mu-1.0x")
    requests.ask(folder, 1, UnitStudy(unit=unit), 40.0, shapes=folder / "bent")
    assert bending.step()
    return folder / "bent"


@pytest.mark.nightly("test_a_wall_from_the_design_before_bends_as_one_meshed_anew")
def test_the_shipped_shape_is_that_of_the_presets(tmp_path, monkeypatch):
    monkeypatch.undo()
    made = shipped(tmp_path)
    for name in preset_names():
        mine, theirs = (known.nearest(load_preset(name), at) for at in (made, asset_root() / "bent"))
        assert mine.same
        assert theirs.same
        assert (theirs.answer["error"], theirs.answer["finished"]) == (requests.LEVELS[0][1], False)
        assert np.allclose(mine.answer["states"], theirs.answer["states"], rtol=1e-4)
        assert np.allclose(mine.motion.model_a, theirs.motion.model_a, atol=0.02)


if __name__ == "__main__":
    # python -m tests.studies.test_live_bending: assets/bent made anew.
    shutil.rmtree(asset_root() / "bent", ignore_errors=True)
    with TemporaryDirectory() as scratch:
        (shape,) = shipped(Path(scratch)).iterdir()
        shutil.copytree(shape, asset_root() / "bent" / "mu-1.0x")
