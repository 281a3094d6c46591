"""A folder's inputs are enough to run any study again: read back, they are the job that wrote them."""

import shutil
from pathlib import Path

import attrs
import pytest
import trimesh

from mu_addon.design.anchors import window
from mu_addon.design.assets import asset_root
from mu_addon.design.gripper import load_gripper
from mu_addon.design.parameters import Chambers, Unit, load_preset
from mu_addon.design.printing.printer import load_printer
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.materials.library import load_material
from mu_addon.measured import read_folder
from mu_addon.measured.kinds import NOISE
from mu_addon.nodes.templates import template
from mu_addon.nodes.tree_study import Graph
from mu_addon.optimization import read_design
from mu_addon.run.context import RunContext
from mu_addon.run.folder import keep_inputs, same_inputs
from mu_addon.run.progress import Progress
from mu_addon.studies import STUDIES, study
from mu_addon.studies.chain import Chain
from mu_addon.studies.check import Check, read_part
from mu_addon.studies.design_experiments import DesignExperiments
from mu_addon.studies.diagnose import Diagnose
from mu_addon.studies.export import Export, TakeOff
from mu_addon.studies.fit_material import FitMaterial
from mu_addon.studies.grip import Grip
from mu_addon.studies.homogenize import Homogenize
from mu_addon.studies.inputs import NodePath, ResinInput
from mu_addon.studies.live import Live
from mu_addon.studies.optimize import Optimize
from mu_addon.studies.parameter_study.plan import parse_plan
from mu_addon.studies.prepare import Prepare
from mu_addon.studies.record import Record
from mu_addon.studies.specimens import Specimens
from mu_addon.studies.starting import kind_of, resume
from mu_addon.studies.sweep import Sweep
from mu_addon.studies.unit_ranking import UnitStudy

DATA = Path(__file__).parent.parent / "data"
UNIT = Unit(name='a "quoted" unit', chambers=Chambers(wall_mm=0.95))


def lattice(unit, resin, **more):
    return Homogenize(unit=unit, resin=ResinInput().made((resin,), {"unit": unit}), **more)


def jobs(folder):
    """A job of every study whose inputs are its own, none with what it has by default."""
    protocol = Protocol([0.0, 1.0, 2.0], [0.0, 0.1 + 0.2, -20.0])
    resin = load_material("elastic-50a-v1")
    part = folder / "part.stl"
    part.write_bytes(trimesh.creation.box((4.0, 4.0, 4.0)).export(file_type="stl"))
    (folder / "more.csv").write_text("time_s,pressure_kPa\n0,0\n1,20\n", encoding="utf-8")
    sweep = """
        format = 1
        preset = "mu-0.75x"
        protocol = "more.csv"
        stages = "place"
        points = 5
        method = "sobol"
        [simulate]
        times = 2
        [simulate.mesh]
        refine = 0.4
        [place]
        stations = 11
        [vary]
        chambers.wall_mm = { low = 0.8, high = 1.2, log = true }
        "simulate.protocol" = { values = ["more.csv"] }
    """
    measured = read_folder(DATA / "treloar")
    paper = read_folder(asset_root() / "examples" / "paper-moduli")
    yield UnitStudy(unit=UNIT, protocol=protocol, times=3, stages=("design", "simulate"), path="alpha4")
    yield Check(
        printer=load_printer(),
        unit=UNIT,
        path=window(UNIT, "alpha4"),
        quality="export",
        direction=(0.1, 0.0, 1 / 3),
    )
    yield Check(printer=load_printer(), stl=read_part(part), layers=(1.0,), repair=True)
    yield Export(
        unit=UNIT,
        resin=resin,
        path=window(UNIT, "alpha2"),
        formats=("stl", "txt"),
        quality="interactive",
        take_off=TakeOff((0.1, 1 / 3), "calipers"),
    )
    bent = NodePath("bent-7", ((0.0, 0.0, 6.25), (0.0, 0.0, 1 / 3)))
    yield Export(unit=UNIT, path=bent, vent_along=(0.0, 0.1, -1.0))
    yield Specimens(unit=UNIT, resin=resin, printer=load_printer())
    yield Specimens(unit=UNIT, resin=None, printer=load_printer())
    yield Prepare(result="solid", of={"path": "alpha1", "quality": "export", "stl": ""}, unit=UNIT)
    yield Live()
    yield lattice(UNIT, "elastic-50a-v1", cells=2, friction="stick", strain=0.25, refine=2 / 3)
    yield lattice(load_preset("mu-1.5x"), None, friction="none")
    hand = load_gripper("gripper")
    yield Grip(gripper=hand, cubes_mm=(10.0,), density_g_per_ml=1 / 3, friction=0.3, refine=0.45, coarse=True)
    yield Diagnose(data=paper).complete()
    yield Diagnose(data=paper, unit=load_preset("mu-1.5x"))
    yield DesignExperiments(data=paper, noise={**NOISE, "angle": 1 / 3})
    yield FitMaterial(data=measured, laws=("yeoh", "neo-hooke"), hold_out=("uniaxial",), weights="relative")
    yield Sweep(plan=attrs.evolve(parse_plan(sweep, folder), counts=(4, 6)), workers=2)
    yield Chain.read_file(asset_root() / "examples/trunk/chain.toml")
    yield Optimize(design=read_design(asset_root() / "examples/graded-finger/design.toml"))
    yield Record(simulated=True, seconds=1 / 3, take=2)
    yield Graph(tree=template("data-to-cause"), wanted=("Diagnose",), node_reports=True)


def test_every_job_is_read_back_from_its_folder(tmp_path):
    seen = set()
    for number, job in enumerate(jobs(tmp_path)):
        folder = tmp_path / f"{number}"
        keep_inputs(folder, job.texts())
        found = kind_of(folder)
        assert found.read(folder).texts() == job.texts()
        assert found.layout().is_of(folder)
        seen.add(found.layout().inputs)
    # These two are made from recordings: tests/studies/test_calibrate.py, test_bench_nodes.py.
    own = {study(name).layout().inputs for name in STUDIES if not study(name).joins}
    assert seen == own - {"calibrate.toml", "measure.toml"}


def test_measured_data_that_are_gone_or_others_are_named(tmp_path):
    data = shutil.copytree(DATA / "treloar", tmp_path / "data")
    keep_inputs(tmp_path / "out", FitMaterial(data=read_folder(data)).texts())
    context = RunContext(Progress())
    moved = data.rename(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="the folder of measured data is not where it was") as caught:
        resume(tmp_path / "out", context)
    assert "[run] data" in caught.value.remedy
    shutil.copytree(moved, data)
    table = next(data.glob("*.csv"))
    table.write_text(table.read_text().rstrip().rpartition("\n")[0] + "\n")
    with pytest.raises(InputError, match="have changed since the run was made") as caught:
        resume(tmp_path / "out", context)
    assert caught.value.where == str(data)
    # The same data somewhere else are the same inputs.
    assert same_inputs(tmp_path / "out", FitMaterial(data=read_folder(moved)).texts())


def test_an_older_diagnosis_says_how_to_go_on(tmp_path):
    keep_inputs(
        tmp_path,
        {"diagnose.toml": f'{Diagnose.layout().header}\nformat = 1\nexperiments_sha256 = "0"\n\n[data]\n'},
    )
    with pytest.raises(InputError, match="does not name the place of the folder of measured data") as caught:
        resume(tmp_path, RunContext(Progress()))
    assert "by its own command, with this folder as --out" in caught.value.remedy


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("cells = 99", "cells = 99 is out of bounds"),
        ("colour = 1", "unknown key 'colour'"),
        ("run = 1", "run is not a table"),
        ("format = 2", "format = 2"),
    ],
)
def test_inputs_that_were_changed_by_hand_are_named(tmp_path, line, what):
    keep_inputs(tmp_path, lattice(UNIT, None).texts())
    path = tmp_path / "homogenize.toml"
    key = line.partition(" ")[0]
    kept = [old for old in path.read_text().splitlines() if not old.startswith(f"{key} =")]
    path.write_text("\n".join([kept[0], line, *kept[1:]]))
    with pytest.raises(InputError) as caught:
        resume(tmp_path, RunContext(Progress()))
    assert what in caught.value.what
    assert "homogenize.toml" in f"{caught.value.where} {caught.value.what}"
