"""study.toml: what it says comes back, and hostile ones change nothing."""

import subprocess
import sys

import attrs
import numpy as np
import pytest
from mu_addon.usecases.simulate_and_place.study_file import compose, parse, read

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.graph import Limits
from mu_addon.run.folder import keep_inputs
from mu_addon.studies.unit_inputs import grasp
from mu_addon.studies.unit_ranking import UnitStudy
from mu_addon.usecases.simulate_and_place.settings import STAGES

JOB = UnitStudy(
    unit=load_preset("mu-0.75x"),
    protocol=Protocol(np.arange(3.0), np.array([0.0, -10.0, 20.0])),
    mesh=MeshSettings(refine=0.4),
    times=3,
    stations=11,
    mesh_check=False,
    quality="export",
    paths="graph",
    limits=Limits(3.0, np.inf, 60.0),
    most_checks=7,
)


def same(one, other):
    """Whether two jobs ask for the same, to the last digit."""
    return one.texts() == other.texts() and one.stages == other.stages


@pytest.mark.parametrize("stages", [STAGES[:1], STAGES[:2], STAGES])
def test_a_job_comes_back_from_its_folder(tmp_path, stages):
    job = attrs.evolve(JOB, stages=stages)
    keep_inputs(tmp_path, job.texts())
    found = UnitStudy.read(tmp_path)
    assert same(found, job)
    if stages == STAGES:
        assert attrs.evolve(found, protocol=job.protocol, workers=job.workers) == job


def test_a_smaller_job_keeps_the_inputs_of_further_stages(tmp_path):
    keep_inputs(tmp_path, JOB.texts())
    small = attrs.evolve(JOB, stages=STAGES[:1], times=13, protocol=Protocol(np.arange(2.0), np.arange(2.0)))
    texts, current = small.texts_in(tmp_path)
    assert current
    assert texts == JOB.texts()


def test_a_larger_job_adds_its_stages(tmp_path):
    keep_inputs(tmp_path, attrs.evolve(JOB, stages=STAGES[:1]).texts())
    texts, current = JOB.texts_in(tmp_path)
    assert current
    assert texts == JOB.texts()


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: attrs.evolve(JOB, unit=load_preset("mu-1.0x"), stages=STAGES[:1]),
        lambda folder: attrs.evolve(JOB, times=5, stages=STAGES[:2]),
        lambda folder: attrs.evolve(JOB, stations=12),
        # The protocol was changed by hand: what was found with the old one holds no more.
        lambda folder: (
            (folder / "protocol.csv").write_text("time_s,pressure_kPa\n0.0,0.0\n1.0,5.0\n"),
            attrs.evolve(JOB, stages=STAGES[:1]),
        )[1],
    ],
    ids=["unit", "times", "stations", "protocol.csv"],
)
def test_what_changed_is_not_current(tmp_path, change):
    keep_inputs(tmp_path, JOB.texts())
    job = change(tmp_path)
    texts, current = job.texts_in(tmp_path)
    assert not current
    assert texts == job.texts()


GOOD = compose(JOB.tables())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 100_000, "too long for a study|not TOML"),
        ("a = " + "[" * 50_000, "not TOML"),
        ("# x\n" * 100_000, "100000 characters"),
        ("format = 4\n[design]\n", "newer version"),
        (GOOD.replace("format = 3", "format = 2"), "run its unit again in another folder"),
        ("format = 1\n[design]\n", "format 1, and this version reads 3"),
        ("format = true\n[design]\n", "format True"),
        ("format = 3\n", "are not those of a study"),
        ("format = 3\n[simulate]\n", "are not those of a study"),
        ("format = 3\ndesign = 3\n", "not a table"),
        ('format = 3\n[design]\nunit = "../../unit.toml"\n', "not in the folder"),
        (GOOD.replace('"unit.toml"', '"/etc/passwd"'), "not in the folder"),
        (GOOD.replace('"protocol.csv"', '"protocol.csv\\u0000"'), "not in the folder"),
        (GOOD.replace("times = 3", 'times = "__import__(\\"os\\")"'), "study.toml, .*times"),
        (GOOD.replace("times = 3", "times = 3\nhook = 1"), "unknown key 'hook'"),
        (GOOD.replace("times = 3", "times = 1000000000"), "1000000000"),
        (GOOD.replace("refine = 0.4", 'refine = 0.4\nfidelity = "homogenised"'), "unknown key 'fidelity'"),
        (GOOD.replace("refine = 0.4", "refine = nan"), "refine"),
        (GOOD.replace("refine = 0.4", "refine = 0.4\nhook = 1"), "hook"),
        (GOOD.replace("mesh_check = false", "mesh_check = []"), "study.toml, .*mesh_check"),
    ],
)  # fmt: skip
def test_a_hostile_study_is_refused_in_words(tmp_path, text, words):
    keep_inputs(tmp_path, JOB.texts())
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        UnitStudy.read(tmp_path)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "study.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        read(tmp_path)


def test_a_folder_without_a_study_is_none(tmp_path):
    assert read(tmp_path) is None
    with pytest.raises(InputError, match="this folder contains no study"):
        UnitStudy.read(tmp_path)


def test_what_is_composed_is_parsed(tmp_path):
    tables = JOB.tables()
    assert parse(compose(tables), tmp_path) == tables


def test_the_device_is_no_part_of_a_studys_inputs():
    plain = UnitStudy(unit=load_preset("mu-1.0x"), protocol=grasp())
    assert attrs.evolve(plain, device="cuda:0").text() == plain.text()
    with pytest.raises(InputError, match="no device 'gpu'"):
        attrs.evolve(plain, device="gpu")


def test_the_inputs_of_a_study_are_made_without_the_solver():
    """Blender's window waits for them: neither Warp nor SciPy is loaded."""
    code = (
        "import sys, numpy\n"
        "from mu_addon.design.parameters import load_preset\n"
        "from mu_addon.fem.protocol import Protocol\n"
        "from mu_addon.usecases.simulate_and_place.job import Job\n"
        "UnitStudy(load_preset('mu-1.0x'), Protocol(numpy.array([0.0, 1.0]), numpy.array([0.0, 20.0]))).texts()\n"
        "print([name for name in ('warp', 'scipy', 'gmsh', 'matplotlib') if name in sys.modules])\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert found.stdout == "[]\n", found.stderr
