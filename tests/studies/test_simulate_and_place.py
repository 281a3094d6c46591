"""A study's stages: what a change leaves as it is, what a smaller job keeps, what a damaged cache costs."""

import csv
import json
import shutil

import attrs
import meshio
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.files import plain, write_npz
from mu_addon.meshing.mesh import MEMBRANE
from mu_addon.meshing.settings import MeshSettings
from mu_addon.report.motion_files import read_motion
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.simulate_and_place.expected import BYTES, BYTES_A_NODE, expected_nodes
from mu_addon.studies.starting import start
from mu_addon.studies.unit_ranking import UnitStudy
from tests.design.kinds import custom, octet

from . import unit_runs

UNIT = load_preset("mu-1.0x")
# Three chambers, one path: as many stages as six and ten have.
JOB = UnitStudy(
    unit=UNIT.evolve(count=3),
    protocol=Protocol(np.arange(3.0), np.array([0.0, -1.0, 2.0])),
    mesh=MeshSettings(refine=0.35),
    times=3,
    stations=11,
    mesh_check=False,
    workers=1,
)


def ran(job, folder):
    """Summary of its run."""
    return unit_runs.ran(job, folder)[0]


def read_rows(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def placed(tmp_path_factory, with_light):
    folder = with_light(tmp_path_factory.mktemp("study") / "placed")
    return folder, ran(JOB, folder)


@pytest.fixture
def copied(placed, tmp_path):
    folder, summary = placed
    return shutil.copytree(folder, tmp_path / "copied"), summary


def test_its_motion_is_a_table_over_time(placed):
    """Angle, tip and volume at each instant, and for ParaView what bears the pressure."""
    folder, summary = placed
    rows = np.genfromtxt(folder / "motion.csv", delimiter=",", names=True)
    assert rows["pressure_kPa"].tolist() == JOB.protocol.pressure_kPa.tolist()
    for row in rows:
        assert row["angle_deg"] == pytest.approx(summary["angle_deg"][f"{row['pressure_kPa']:g}"], abs=1e-4)
    rest, sucked, blown = rows
    # The tip is on the sagittal plane, at its height at rest; air goes out, comes in, and the tip rises.
    assert rows["tip_x_mm"].tolist() == [0.0, 0.0, 0.0]
    assert rest["tip_z_mm"] == pytest.approx(JOB.unit.dimensions.height)
    assert sucked["tip_z_mm"] < rest["tip_z_mm"] < blown["tip_z_mm"]
    assert sucked["volume_mm3"] < rest["volume_mm3"] < blown["volume_mm3"]
    still, _, moved = (meshio.read(folder / "model_a" / f"000{k}.vtu") for k in range(3))
    assert still.cell_data["largest_stretch"][0] == pytest.approx(1.0)
    assert still.cell_data["von_mises_kPa"][0] == pytest.approx(0.0, abs=1e-6)
    in_wall = moved.cell_data["region"][0] == MEMBRANE
    assert (moved.cell_data["von_mises_kPa"][0][in_wall] > 0.0).all()


def test_its_solid_is_said_in_mm_ml_and_g(tmp_path):
    context = RunContext(Progress([]))
    work = start(attrs.evolve(JOB, stages=("design",)), tmp_path, context)
    found = json.loads(json.dumps(plain(context.summary["solid"])))
    context.unlock()
    assert found["size_mm"][2] == pytest.approx(JOB.unit.dimensions.height, abs=10.0)
    assert found["g"] == pytest.approx(1.01 * found["ml"])
    (line,) = work.lines
    assert line.startswith("solid: ")
    assert line.endswith(f"{found['ml']:.1f} ml, {found['g']:.1f} g of Elastic 50A V1")


def times(folder, kind):
    """When each entry of the cache of a kind was written, by name."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "cache").glob(f"{kind}-*")}


def with_wall(job, wall_mm):
    return attrs.evolve(
        job, unit=attrs.evolve(job.unit, chambers=attrs.evolve(job.unit.chambers, wall_mm=wall_mm))
    )


def with_resin(job, **changes):
    return attrs.evolve(job, unit=job.unit.evolve(**changes))


COSTS = pytest.mark.nightly("test_a_change_costs_only_what_depends_on_it")


@pytest.mark.parametrize(
    ("change", "mesh", "states"),
    [
        (lambda job: job, 1, 2),
        pytest.param(lambda job: attrs.evolve(job, stations=12), 1, 2, marks=COSTS),
        (lambda job: attrs.evolve(job, protocol=Protocol(np.arange(2.0), np.array([0.0, 1.5]))), 1, 4),
        pytest.param(lambda job: with_resin(job, membrane_modulus_kPa=2000.0), 1, 4, marks=COSTS),
        # A wall that remembers has no beams.
        pytest.param(lambda job: with_resin(job, law="prony", prony_g1=0.2), 2, 2, marks=COSTS),
        (lambda job: with_wall(job, 1.0), 2, 4),
        pytest.param(lambda job: attrs.evolve(job, mesh=MeshSettings(refine=0.5)), 2, 4, marks=COSTS),
    ],
    ids=["nothing", "stations", "protocol", "resin", "memory", "wall", "mesh"],
)
def test_a_change_costs_only_what_depends_on_it(copied, change, mesh, states):
    """So many entries of the cache afterwards, two states a motion; what was there is not written again."""
    folder, _ = copied
    before = {kind: times(folder, kind) for kind in ("meshed", "states")}
    job = attrs.evolve(change(JOB), stages=("design", "simulate"))
    ran(job, folder)
    for kind, count in (("meshed", mesh), ("states", states)):
        after = times(folder, kind)
        assert len(after) == count
        assert before[kind].items() <= after.items()


@pytest.mark.parametrize("stages", [("design",), ("design", "simulate")])
def test_a_smaller_job_keeps_what_is_still_valid(copied, stages):
    folder, full = copied
    (folder / "report.html").write_text("of the full study")
    study = attrs.evolve(JOB, stages=stages)
    if stages == ("design",):
        # What the smaller job was not asked is none of its business.
        study = attrs.evolve(study, times=13, protocol=Protocol(np.arange(2.0), np.array([0.0, 40.0])))
    summary = ran(study, folder)
    for name, value in full.items():
        if name not in ("seconds", "gates", "warnings"):
            assert summary[name] == value, name
    assert set(full["seconds"]) <= set(summary["seconds"])
    assert set(full["gates"]) >= {"unit.stl"}
    assert (folder / "deviation.csv").is_file()
    assert not (folder / "stale").exists()
    assert UnitStudy.read(folder).stages == JOB.stages
    assert (folder / "report.html").read_text() == "of the full study"


def test_a_smaller_job_of_another_unit_sets_all_aside(copied):
    folder, _ = copied
    summary = ran(attrs.evolve(with_wall(JOB, 1.0), stages=("design",)), folder)
    assert "chosen" not in summary
    assert not (folder / "deviation.csv").exists()
    assert (folder / "stale" / "deviation.csv").is_file()
    assert (folder / "stale" / "protocol.csv").is_file()
    assert UnitStudy.read(folder).stages == ("design",)


def test_figures_of_another_version_are_not_kept(copied):
    folder, full = copied
    (folder / "summary.json").write_text(json.dumps(full | {"versions": {"mu_addon": "0.0.1"}}))
    assert "chosen" not in ran(attrs.evolve(JOB, stages=("design",)), folder)


def damaged(path, damage, rng):
    """Damage an entry of the cache in one of several ways."""
    whole = bytearray(path.read_bytes())
    if damage == "truncated":
        path.write_bytes(whole[: int(rng.integers(len(whole)))])
    elif damage == "flipped":
        whole[int(rng.integers(100, len(whole) - 200))] ^= 1 << int(rng.integers(8))
        path.write_bytes(whole)
    elif damage == "emptied":
        path.write_bytes(b"")
    elif damage == "other names":
        write_npz(path, {"spam": np.zeros(3)})
    else:
        with np.load(path) as stored:
            arrays = {name: np.zeros((1, 1)) for name in stored.files}
        write_npz(path, arrays)


DAMAGES = ("truncated", "flipped", "emptied", "other names", "other shapes")


def test_damaged_states_are_solved_again_to_the_same_digits(placed, copied):
    folder, _ = copied
    rng, kept = np.random.default_rng(0), [*times(folder, "meshed"), *times(folder, "states")]
    for number, name in enumerate(sorted(kept)):
        damaged(folder / "cache" / name, DAMAGES[number], rng)
    ran(attrs.evolve(JOB, stages=("design", "simulate")), folder)
    assert (folder / "motion.csv").read_bytes() == (placed[0] / "motion.csv").read_bytes()


def test_too_little_room_is_told_before_any_work(tmp_path, monkeypatch):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=20_000_000))
    _, messages = unit_runs.ran(JOB, tmp_path / "out", status=5)
    assert "20 MB are free" in messages[-1]["what"]
    assert "free some space" in messages[-1]["what_to_do"]
    assert not (tmp_path / "out" / "unit.stl").exists()


def test_room_is_asked_for_as_the_study_grows():
    job = attrs.evolve(JOB, unit=UNIT)
    coarse, fine = (attrs.evolve(job, mesh=MeshSettings(refine=r)) for r in (0.4, 1.8))
    assert expected_nodes(coarse) < expected_nodes(fine)
    # Known meshes of mu-1.0x.
    for refine, nodes in ((0.35, 53_733), (1.0, 80_939), (1.4, 128_165)):
        expected = expected_nodes(attrs.evolve(job, mesh=MeshSettings(refine=refine)))
        assert 0.9 * nodes < expected < 1.1 * nodes


def test_what_a_study_writes_is_less_than_the_room_it_asks_for(placed):
    folder, summary = placed
    written = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    nodes, pressures = summary["mesh"]["nodes"], 3
    asked = BYTES["interactive"] + nodes * BYTES_A_NODE["place"] * pressures
    assert written < asked


def of_thin_walls(**given):
    """Three chambers whose walls touch by -8.5 kPa."""
    unit = load_preset("mu-1.0x")
    return UnitStudy(
        unit=attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3, wall_mm=0.5)),
        protocol=Protocol(np.arange(3.0), np.array([0.0, -8.5, 0.0])),
        mesh=MeshSettings(refine=0.2),
        times=3,
        stages=("design", "simulate"),
        self_contact=True,
        workers=1,
        **given,
    )


@pytest.mark.slow
def test_a_study_says_where_walls_and_struts_touch(tmp_path):
    ran(of_thin_walls(), tmp_path)
    rows = read_rows(tmp_path / "self_contact.csv")
    by_pressure = {float(row["pressure_kPa"]): row for row in rows}
    assert sorted(by_pressure) == [-8.5, 0.0]
    assert float(by_pressure[-8.5]["force_N"]) > 0.01
    assert 0.0 < float(by_pressure[-8.5]["least_gap_mm"]) < 0.5 / 9
    assert float(by_pressure[0.0]["force_N"]) == 0.0
    assert by_pressure[0.0]["least_gap_mm"] == ""
    motion = read_motion(tmp_path)
    k = int(motion.state_kPa.argmin())
    pressed = max(values["contact_pressure_kPa"][k].max() for values in motion.fields.values())
    assert pressed > 0.0
    assert pressed <= float(by_pressure[-8.5]["largest_contact_pressure_kPa"]) * 1.001


@pytest.mark.parametrize(
    ("changed", "where"),
    [
        ({"self_friction": -0.1}, "self_friction"),
        ({"self_friction": True}, "self_friction"),
        ({"self_friction": "0.3"}, "self_friction"),
        ({"self_friction": 0.3, "self_contact": False}, "--self-friction"),
        ({"self_friction": 0.3, "stages": ("design", "simulate", "place"), "paths": "graph"}, "graph"),
    ],
)
def test_friction_of_walls_that_cannot_slide_is_refused(changed, where):
    mesh = MeshSettings()
    given = {"self_contact": True, "stages": ("design", "simulate"), **changed}
    with pytest.raises(InputError) as refused:
        UnitStudy(unit=load_preset("mu-1.0x"), protocol=JOB.protocol, mesh=mesh, **given)
    assert where in str(refused.value)


@pytest.mark.nightly("test_a_study_says_where_walls_and_struts_touch")
def test_walls_that_slide_dissipate_and_a_second_run_says_the_same(tmp_path):
    job = of_thin_walls(self_friction=0.3)
    ran(job, tmp_path)
    assert UnitStudy.read(tmp_path).self_friction == 0.3
    first = {name: (tmp_path / name).read_bytes() for name in ("motion.csv", "self_contact.csv")}
    lost = json.loads((tmp_path / "summary.json").read_text())["self_friction"]["lost_mJ"]
    assert lost > 0
    ran(job, tmp_path)
    assert first == {name: (tmp_path / name).read_bytes() for name in first}
    assert json.loads((tmp_path / "summary.json").read_text())["self_friction"]["lost_mJ"] == lost


@pytest.mark.nightly(
    "tests/body/test_waveguide.py::test_a_candidate_is_found_from_model_a_s_state_as_along_its_own_path"
)
def test_a_printed_candidate_that_is_lost_is_solved_alone(tmp_path):
    """Each printed waveguide is kept as soon as it is solved: a killed run loses no other's."""
    unit = load_preset("mu-1.0x")
    job = UnitStudy(
        unit=attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=4)),
        protocol=Protocol(np.arange(2.0), np.array([0.0, 1.0])),
        mesh=MeshSettings(refine=0.4),
        times=2,
        mesh_check=False,
        workers=1,
    )
    found = ran(job, tmp_path)["J_hat_mm"]
    kept = sorted((tmp_path / "cache").glob("candidates-*"))
    assert len(kept) == len(found) == 3
    kept[1].unlink()
    before = {path.name: path.stat().st_mtime_ns for path in kept[::2]}
    assert ran(job, tmp_path)["J_hat_mm"] == found
    assert kept[1].exists()
    assert {path.name: path.stat().st_mtime_ns for path in kept[::2]} == before


def test_a_lattice_that_holds_no_waveguide_is_refused_before_anything_is_made(tmp_path):
    mesh = MeshSettings(refine=0.5)
    job = attrs.evolve(JOB, unit=JOB.unit.evolve(**custom(octet()), seats=False), mesh=mesh)
    _, messages = unit_runs.ran(job, tmp_path, status=2)
    assert "no node at the cell's centre" in messages[-1]["what"]
    assert not (tmp_path / "unit.stl").exists()
