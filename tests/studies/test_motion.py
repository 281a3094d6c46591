"""The motion that a study keeps to be looked at: surfaces, states, sensor paths, point caches, pictures."""

import io

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from scipy.spatial import KDTree

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.errors import InputError
from mu_addon.fem.kinematics import probe
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import whole_body
from mu_addon.fem.unit_materials import materials_of
from mu_addon.files import write_npz
from mu_addon.meshing.mesh import mirror
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import Candidate, candidate_paths
from mu_addon.report.motion_files import (
    FIELDS,
    MODEL_A,
    REGIONS,
    SENSITIVITY,
    SurfaceFields,
    read_motion,
    surface_of,
    write_model_a,
    write_path,
    write_sensitivity,
)
from mu_addon.report.pc2 import read_pc2, write_pc2
from mu_addon.simulate_and_place.charts import angle_picture, delta_picture
from mu_addon.simulate_and_place.compared_pressures import solved
from mu_addon.simulate_and_place.path_motion import PathMotions
from mu_addon.studies.unit_ranking import UnitStudy

from . import made_up
from .made_up import UNIT, Waveguides

PRESSURES = np.array([0.0, -10.0, 0.0, 10.0, 20.0])
TIMES = np.arange(5.0)
ANCHORS = anchor_points(UNIT)
PATHS = candidate_paths(ANCHORS, windows(4))


def test_states_can_be_looked_at_before_the_motion_is_whole(tmp_path, monkeypatch):
    seen, solved_state = [], made_up.state

    def watched(mesh, pressure_MPa, more=1.0):
        seen.extend([read_motion(tmp_path)] if (tmp_path / "motion").is_dir() else [])
        return solved_state(mesh, pressure_MPa, more)

    monkeypatch.setattr(made_up, "state", watched)
    monkeypatch.setattr("mu_addon.run.execution.KEEP_EVERY_S", 0.0)
    job = UnitStudy(
        unit=UNIT, mesh=MeshSettings(refine=0.2), times=7, self_contact=True, stages=("design", "simulate")
    )
    made_up.place(tmp_path, job)
    whole = read_motion(tmp_path)
    assert whole.pressure_kPa.tolist() == [0.0, -20.0, 0.0, 20.0, 40.0, 20.0, 0.0]
    assert [one.so_far for one in (*seen, whole)] == [
        "2 of 4 pressures so far",
        "3 of 4 pressures so far",
        "",
    ]
    assert [one.is_reached(7.0) for one in seen] == [False, True], "between 20 and 40 kPa"
    assert not any(one.is_reached(time) for one in seen for time in (1.0, 2.0, 3.9))
    for one in (*seen, whole):
        at = one.reached
        assert one.fields["membrane"].keys() == whole.fields["membrane"].keys()
        for own, every in ((one.model_a, whole.model_a), *((one.fields[r][f], whole.fields[r][f])
                           for r in REGIONS for f in whole.fields[r])):  # fmt: skip
            np.testing.assert_array_equal(own[one.state][at], every[whole.state][at])


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A folder with a coarse unit's motion, its mesh and trajectory, and what its paths were solved at."""
    folder = tmp_path_factory.mktemp("study")
    mesh = made_up.mesh()
    trajectory = made_up.motion(mesh, TIMES, PRESSURES)
    write_model_a(folder, mesh, materials_of(UNIT, mesh), trajectory)
    write_sensitivity(folder, mesh, mesh.nodes[mesh.corners].mean(axis=1)[:, 2])
    return folder, mesh, trajectory, shown(folder, mesh, trajectory, PATHS)


def shown(folder, own, trajectory, paths, sensors=Waveguides):
    """Write the motion of some paths that are solved on a trajectory's mesh; return their solutions."""
    states = {round(s.pressure_kPa, 9): s for s in trajectory.solved}
    painter = PathMotions(UnitStudy(unit=UNIT).mechanics, own, trajectory.mesh, states)
    found = []
    for number, path in enumerate(paths):
        one = solved(sensors(UNIT, trajectory.mesh, (), ANCHORS), number, [-10.0, 10.0, 20.0], states, 21)
        moved = painter.of(dict(zip(one.pressure_kPa, one.difference_mm, strict=True)))
        write_path(folder, path.name, moved.pressure_kPa, moved.difference_mm, **moved.fields)
        found.append(one)
    return found


@pytest.fixture(scope="module")
def motion(study):
    return read_motion(study[0])


def volume(vertices, triangles):
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_model_a_comes_back(study, motion):
    _, mesh, trajectory, *_ = study
    assert motion.mesh.hash() == mesh.hash()
    assert np.array_equal(motion.pressure_kPa, PRESSURES)
    assert np.allclose(motion.displacement(MODEL_A), [s.u for s in trajectory.solved], atol=1e-5)
    for region in REGIONS:
        at_rest = motion.fields[region]["von_mises_kPa"][motion.state_kPa == 0.0]
        assert np.allclose(at_rest, 0.0, atol=1e-3)
        assert set(motion.fields[region]) == set(FIELDS)
        assert (motion.fields[region]["von_mises_kPa"] >= 0.0).all()
        assert (motion.fields[region]["largest_stretch"] >= motion.fields[region]["smallest_stretch"]).all()


@pytest.mark.parametrize("cut", [True, False])
def test_the_walls_surface_is_closed_and_faces_outward(study, motion, cut):
    _, mesh, *_ = study
    skin = motion.skin("membrane", cut)
    vertices = skin.of_nodes(mesh.nodes)
    ends = np.sort(skin.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(ends, axis=0, return_counts=True)[1] % 2 == 0).all()
    body = mesh if cut else mirror(mesh, "x")
    exact = element_volumes(body)[body.region == REGIONS["membrane"]].sum()
    # Four flat triangles stand for a curved face.
    assert volume(vertices, skin.triangles) == pytest.approx(exact, rel=0.03)
    assert vertices[:, 0].min() < -1.0
    # Cut open it shows the side behind the plane to whoever looks along -x.
    assert (vertices[:, 0].max() <= 0.0) == cut


def test_a_whole_mesh_cannot_be_cut_open(study, tmp_path):
    _, mesh, trajectory, *_ = study
    whole = mirror(mesh, "x")
    rest = attrs.evolve(trajectory.solved[0], u=np.zeros_like(whole.nodes))
    states = tuple(attrs.evolve(rest, pressure_MPa=s.pressure_MPa) for s in trajectory.solved)
    write_model_a(tmp_path, whole, materials_of(UNIT, whole), attrs.evolve(trajectory, solved=states))
    found = read_motion(tmp_path)
    assert not found.halved
    assert np.array_equal(found.skin("membrane", True).triangles, found.skin("membrane", False).triangles)


def test_a_paths_motion_is_what_its_deviation_was_found_from(study, motion):
    _, mesh, trajectory, found = study
    assert motion.paths == tuple(c.name for c in PATHS)
    monitor, name, own = probe(mesh, ANCHORS), motion.paths[-1], found[-1]
    moved = motion.displacement(name)
    for kPa, anchors in zip(own.pressure_kPa, own.anchors, strict=True):
        number = [round(s.pressure_kPa, 9) for s in trajectory.solved].index(kPa)
        assert np.allclose(ANCHORS + monitor.displacement(moved[number]), anchors, atol=1e-5)
        apart = np.linalg.norm(moved[number] - motion.model_a[number], axis=1)
        assert apart.max() > 1e-3
    with pytest.raises(InputError, match="no motion of alpha99"):
        motion.displacement("alpha99")


def test_elements_and_nodes_have_one_stress_where_it_is_uniform(study):
    """A wall drawn out by a fifth and let narrow: stretches as they were given, one stress a material."""
    _, mesh, *_ = study
    nodes = {region: surface_of(mesh, number).node for region, number in REGIONS.items()}
    u, elements = mesh.nodes * [-0.08, -0.08, 0.2], []
    found = SurfaceFields(mesh, nodes).of_states([u], materials_of(UNIT, mesh), of_elements=elements)
    wall = mesh.region == REGIONS["membrane"]
    np.testing.assert_allclose(elements[0]["largest_stretch"][wall], 1.2, rtol=1e-6)
    np.testing.assert_allclose(elements[0]["smallest_stretch"][wall], 0.92, rtol=1e-6)
    for field in FIELDS:
        np.testing.assert_allclose(elements[0][field][wall], found[f"membrane_{field}"][0, 0], rtol=1e-4)


class OneSided(Waveguides):
    """A candidate holds back one side of the body."""

    def states(self, number, way):
        (s,) = super().states(number, way)
        return [State(s.pressure_MPa, s.u * (1.0 - 0.01 * self.mesh.nodes[:, :1]))]


def test_a_path_off_the_mirror_plane_moves_both_sides_apart(study, tmp_path):
    """Solved on the whole body, shown by its half and the half's image: both are where the whole body is."""
    _, mesh, trajectory, *_ = study
    whole, there = whole_body(mesh, trajectory)
    aside = Candidate("aside", 0, ANCHORS[:4] + np.array([0.9 * UNIT.dimensions.cell, 0.0, 0.0]))
    write_model_a(tmp_path, mesh, materials_of(UNIT, mesh), trajectory)
    (one,) = shown(tmp_path, mesh, there, [aside], OneSided)
    found = read_motion(tmp_path)
    number = int(np.argmax(np.abs(one.pressure_kPa)))
    difference_mm = one.difference_mm
    state = int(np.flatnonzero(found.state_kPa == one.pressure_kPa[number])[0])
    moved = whole.nodes + there.solved[state].u + difference_mm[number]
    skin = found.skin("lattice", False)
    at = skin.of_nodes(mesh.nodes) + skin.of_nodes(*found.sides("aside"))[state]
    _, nearest = KDTree(whole.nodes).query(skin.of_nodes(mesh.nodes))
    assert np.allclose(at, moved[nearest], atol=1e-4)
    own, image = found.sides("aside")
    assert np.abs(own[state] - image[state]).max() > 1e-3, "not a mirror image of itself"
    stress = found.field("aside", "lattice", "von_mises_kPa", skin)[state]
    sided = [stress[skin.mirror == side].max() for side in (1, -1)]
    assert abs(sided[0] / sided[1] - 1) > 0.05, "the sensor is on one side"
    # An embedded body goes with its own side.
    # Edges of struts' elements are straight.
    struts, middle = (
        whole.tets[whole.region == REGIONS["lattice"]][::50],
        np.array([-1 / 8] * 4 + [1 / 4] * 6),
    )
    inside, moves = (
        np.einsum("n,mnd->md", middle, values[struts])
        for values in (whole.nodes, there.solved[state].u + difference_mm[number])
    )
    carried = found.embedding(inside)
    assert np.allclose(found.carried("aside", carried)[state], moves, atol=1e-4)


def test_states_between_the_samples(motion):
    assert motion.at(-1.0)[2] == 0.0
    first, second, share = motion.at(3.25)
    assert (motion.state_kPa[first], motion.state_kPa[second], share) == (10.0, 20.0, 0.25)
    first, second, share = motion.at(99.0)
    assert (motion.state_kPa[second], share) == (20.0, 1.0)


def test_an_embedding_is_kept(study, motion):
    _, mesh, *_ = study
    points = np.random.default_rng(0).uniform(mesh.nodes.min(axis=0), mesh.nodes.max(axis=0), (50, 3))
    first = motion.embedding(points)
    (file,) = (motion.folder / "played").glob("embedding-*.npz")
    before = file.stat().st_mtime_ns
    again = motion.embedding(points)
    u = motion.model_a[-1]
    assert np.array_equal(first.displacement(u), again.displacement(u))
    assert file.stat().st_mtime_ns == before
    motion.embedding(points + 1.0)
    assert len(list((motion.folder / "played").glob("embedding-*.npz"))) == 2


def test_a_map_of_elements_becomes_one_of_nodes(motion):
    # The map was the height of each element's middle.
    for region, surface in motion.surfaces.items():
        height = motion.mesh.nodes[surface.node, 2]
        assert np.corrcoef(motion.sensitivity[region], height)[0, 1] > 0.98
    assert SENSITIVITY.endswith("mm_per_MPa")


def test_what_is_missing_is_said(study, tmp_path):
    with pytest.raises(InputError, match="contains no motion"):
        read_motion(tmp_path)
    (tmp_path / "motion").mkdir()
    for name in ("mesh.npz", "model_a.npz"):
        (tmp_path / "motion" / name).write_bytes((study[0] / "motion" / name).read_bytes())
    assert read_motion(tmp_path).paths == ()
    assert read_motion(tmp_path).sensitivity == {}
    stored = dict(np.load(tmp_path / "motion" / "model_a.npz"))
    for name, wrong in (
        ("displacement_mm", stored["displacement_mm"][:, :-1]),
        ("state", stored["state"] + 9),
    ):
        write_npz(tmp_path / "motion" / "model_a.npz", stored | {name: wrong})
        with pytest.raises(InputError, match="are inconsistent"):
            read_motion(tmp_path)
    write_npz(tmp_path / "motion" / "model_a.npz", {n: a for n, a in stored.items() if n != "state_kPa"})
    with pytest.raises(InputError, match="lacks 'state_kPa'"):
        read_motion(tmp_path)
    damaged = (tmp_path / "motion" / "model_a.npz").read_bytes()
    (tmp_path / "motion" / "model_a.npz").write_bytes(damaged[: len(damaged) // 2])
    with pytest.raises(InputError, match="contains no motion"):
        read_motion(tmp_path)


@given(arrays(np.float32, (3, 4, 3), elements=st.floats(-1e3, 1e3, width=32)))
def test_point_caches_come_back(tmp_path_factory, positions):
    path = tmp_path_factory.mktemp("pc2") / "cache.pc2"
    write_pc2(path, positions, 0.5, 0.25)
    found, start, step = read_pc2(path)
    assert np.array_equal(found, positions)
    assert (start, step) == (0.5, 0.25)
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(InputError, match="not a complete point cache"):
        read_pc2(path)


def test_pictures_for_a_panel_are_small_and_square():
    angle = angle_picture(np.unique(PRESSURES), np.array([-3.0, 0.0, 2.0, 5.0]))
    delta = np.outer(np.abs(PRESSURES), np.linspace(0.0, 0.05, 21))
    for picture in (angle, delta_picture("alpha3", delta, TIMES, delta.max())):
        with Image.open(io.BytesIO(picture.png)) as image:
            assert image.size[0] == image.size[1] <= 600
            assert len(image.convert("RGB").getcolors(10**6)) > 50
        assert len(picture.png) < 100_000
