"""A study's stages: what a change leaves as it is, what a smaller job keeps, what a damaged cache costs."""

import csv
import json
import shutil
from xml.etree import ElementTree

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
from mu_addon.run.kept_results import Results
from mu_addon.run.progress import Progress
from mu_addon.simulate_and_place.expected_seconds import BYTES, BYTES_A_NODE, expected_nodes
from mu_addon.studies.starting import start
from mu_addon.studies.unit_ranking import UnitStudy
from tests.design.kinds import custom, octet

from ..headless.processes import JOB
from . import unit_runs

UNIT = load_preset("mu-1.0x")
MOTION = attrs.evolve(JOB, stages=("design", "simulate"))
THICKER = JOB.unit.evolve(wall_mm=1.0)


def ran(job, folder):
    """Summary of its run."""
    return unit_runs.ran(job, folder)[0]


@pytest.fixture
def copied(finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "copied")
    return folder, json.loads((folder / "summary.json").read_text())


def test_its_motion_is_a_table_over_time(finished):
    """Angle, tip and volume at each instant, and for ParaView what bears the pressure."""
    angles = json.loads((finished / "summary.json").read_text())["angle_deg"]
    rows = np.genfromtxt(finished / "motion.csv", delimiter=",", names=True)
    assert rows["pressure_kPa"].tolist() == JOB.protocol.pressure_kPa.tolist()
    for row in rows:
        assert row["angle_deg"] == pytest.approx(angles[f"{row['pressure_kPa']:g}"], abs=1e-4)
    rest, sucked, _, blown = rows
    # The tip is on the sagittal plane, at its height at rest; air goes out, comes in, and the tip rises.
    assert not rows["tip_x_mm"].any()
    assert rest["tip_z_mm"] == pytest.approx(JOB.unit.dimensions.height)
    assert sucked["tip_z_mm"] < rest["tip_z_mm"] < blown["tip_z_mm"]
    assert sucked["volume_mm3"] < rest["volume_mm3"] < blown["volume_mm3"]
    steps = ElementTree.parse(finished / "model_a.pvd").getroot().findall("Collection/DataSet")
    still, *_, moved = (meshio.read(finished / step.get("file")) for step in steps)
    assert len(steps) == 4
    assert {block.type for block in moved.cells} == {"tetra10"}
    assert np.abs(moved.point_data["displacement_mm"]).max() > 0.1
    assert still.cell_data["largest_stretch"][0] == pytest.approx(1.0)
    assert still.cell_data["von_mises_kPa"][0] == pytest.approx(0.0, abs=1e-6)
    in_wall = moved.cell_data["region"][0] == MEMBRANE
    assert (moved.cell_data["von_mises_kPa"][0][in_wall] > 0.0).all()


def test_it_does_what_it_planned(finished):
    messages = [json.loads(line) for line in (finished / "log.ndjson").read_text().splitlines()]
    (plan,) = (m for m in messages if m["type"] == "plan")
    told = [m for m in messages if m["type"] == "progress"]
    assert {m["stage"] for m in told} <= {name for name, _ in plan["stages"]}
    shares = [m["whole"] for m in told]
    assert shares == sorted(shares)
    assert all(m["whole_seconds_left"] is not None for m in told if not m.get("why"))


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


COSTS = pytest.mark.nightly("test_a_change_costs_only_what_depends_on_it")


@pytest.mark.parametrize(
    ("change", "meshes", "states"),
    [
        ({"times": 2, "protocol": Protocol(np.arange(2.0), np.array([0.0, 1.5]))}, 0, 1),
        # A wall that remembers has no beams.
        pytest.param({"unit": JOB.unit.evolve(law="prony", prony_g1=0.2)}, 1, 0, marks=COSTS),
        ({"unit": THICKER}, 1, 2),
    ],
    ids=["protocol", "memory", "wall"],
)
def test_a_change_costs_only_what_depends_on_it(copied, change, meshes, states):
    """So many further entries of the cache; what was there is not written again."""
    folder, _ = copied
    before = {kind: times(folder, kind) for kind in ("meshed", "states")}
    ran(attrs.evolve(MOTION, **change), folder)
    for kind, count in (("meshed", meshes), ("states", states)):
        after = times(folder, kind)
        assert len(after) == len(before[kind]) + count
        assert before[kind].items() <= after.items()


def test_a_smaller_job_keeps_what_is_still_valid(copied):
    folder, full = copied
    (folder / "report.html").write_text("of the full study")
    before = {kind: times(folder, kind) for kind in ("meshed", "states")}
    # What the smaller jobs were not asked is none of their business.
    other = Protocol(np.arange(2.0), np.array([0.0, 40.0]))
    for study in (attrs.evolve(JOB, stages=("design",), times=13, protocol=other), MOTION):
        summary = ran(study, folder)
        for name, value in full.items():
            if name not in ("seconds", "gates", "warnings", "options"):
                assert summary[name] == value, name
        assert set(full["seconds"]) <= set(summary["seconds"])
        assert set(full["gates"]) >= {"unit.stl"}
        assert (folder / "deviation.csv").is_file()
        assert not (folder / "stale").exists()
        assert UnitStudy.read(folder).stages == JOB.stages
        assert (folder / "report.html").read_text() == "of the full study"
    assert {kind: times(folder, kind) for kind in before} == before


def test_stopped_among_its_candidates_it_keeps_what_it_has(copied, monkeypatch):
    """Pictures take most of a report's time, and somebody waits."""
    folder, _ = copied
    for path in (folder / "cache").glob("candidates-*"):
        path.unlink()
    whole = Results.made

    def stopped(self, task, values):
        if task[0] == "candidates":
            raise KeyboardInterrupt
        return whole(self, task, values)

    monkeypatch.setattr(Results, "made", stopped)
    context, _ = unit_runs.ended(attrs.evolve(JOB, workers=1), folder)
    assert context.status == 130
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "partial"
    assert "Ctrl-C" in summary["reason"]["what"]
    report = (folder / "report.html").read_text()
    assert "This run is partial" in report
    assert "This report has no pictures" in report
    assert "image/png" not in report


def test_a_smaller_job_of_another_unit_sets_all_aside(copied):
    folder, _ = copied
    summary = ran(attrs.evolve(JOB, unit=THICKER, stages=("design",)), folder)
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


def test_damaged_states_are_solved_again_to_the_same_digits(finished, copied):
    folder, _ = copied
    rng, kept = np.random.default_rng(0), [*times(folder, "meshed"), *times(folder, "states")]
    for name, damage in zip(sorted(kept), DAMAGES, strict=False):
        damaged(folder / "cache" / name, damage, rng)
    ran(MOTION, folder)
    assert (folder / "motion.csv").read_bytes() == (finished / "motion.csv").read_bytes()


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


@pytest.mark.slow
def test_a_study_says_where_walls_and_struts_touch(tmp_path):
    """Three chambers whose walls touch by -8.5 kPa."""
    thin = attrs.evolve(
        MOTION,
        unit=UNIT.evolve(count=3, wall_mm=0.5),
        protocol=Protocol(np.arange(3.0), np.array([0.0, -8.5, 0.0])),
        mesh=MeshSettings(refine=0.2),
        times=3,
        self_contact=True,
    )
    ran(thin, tmp_path)
    with (tmp_path / "self_contact.csv").open(newline="", encoding="utf-8") as stream:
        by_pressure = {float(row["pressure_kPa"]): row for row in csv.DictReader(stream)}
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


def test_what_a_study_writes_is_less_than_the_room_it_asks_for(finished):
    written = sum(path.stat().st_size for path in finished.rglob("*") if path.is_file())
    nodes = json.loads((finished / "summary.json").read_text())["mesh"]["nodes"]
    assert written < BYTES["interactive"] + nodes * BYTES_A_NODE["place"] * 3


def test_a_lattice_that_holds_no_waveguide_is_refused_before_anything_is_made(tmp_path):
    mesh = MeshSettings(refine=0.5)
    job = attrs.evolve(JOB, unit=JOB.unit.evolve(**custom(octet()), seats=False), mesh=mesh)
    _, messages = unit_runs.ran(job, tmp_path, status=2)
    assert "no node at the cell's centre" in messages[-1]["what"]
    assert not (tmp_path / "unit.stl").exists()
