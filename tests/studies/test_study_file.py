"""study.toml: what it says comes back, further targets stay valid, and hostile ones change nothing."""

import subprocess
import sys

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.folder import keep_inputs
from mu_addon.run.lock import FolderLock, InUseError
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_motion import STAGES
from mu_addon.studies.unit_ranking import UnitStudy

JOB = UnitStudy(
    unit=load_preset("mu-0.75x"),
    protocol=Protocol(np.arange(3.0), np.array([0.0, -10.0, 20.0])),
    mesh=MeshSettings(refine=0.4),
    times=3,
    stations=11,
    mesh_check=False,
    quality="export",
    paths="graph",
    shortest_cells=3.0,
    bend_deg=60.0,
    checks=7,
)


@pytest.mark.parametrize("stages", [STAGES[:1], STAGES[:2], STAGES])
def test_a_study_comes_back_from_its_folder(tmp_path, stages):
    job = attrs.evolve(JOB, stages=stages)
    keep_inputs(tmp_path, job.texts())
    found = UnitStudy.read(tmp_path)
    assert (found.texts(), found.stages) == (job.texts(), job.stages)


def test_a_smaller_study_keeps_the_inputs_of_further_targets(tmp_path):
    keep_inputs(tmp_path, JOB.texts())
    small = attrs.evolve(JOB, stages=STAGES[:1], times=13, protocol=Protocol(np.arange(2.0), np.arange(2.0)))
    texts, further, valid = small.texts_in(tmp_path)
    assert (further, valid) == (STAGES[1:], True)
    (tmp_path / "more").mkdir()
    keep_inputs(tmp_path / "more", texts)
    assert UnitStudy.read(tmp_path / "more").tables == JOB.tables


def test_a_larger_study_adds_its_tables(tmp_path):
    keep_inputs(tmp_path, attrs.evolve(JOB, stages=STAGES[:1]).texts())
    assert JOB.texts_in(tmp_path) == (JOB.texts(), (), True)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: attrs.evolve(JOB, unit=load_preset("mu-1.0x"), stages=STAGES[:1]),
        lambda folder: attrs.evolve(JOB, times=5, stages=STAGES[:2]),
        # The protocol was changed by hand: what was found with the old one holds no more.
        lambda folder: (
            (folder / "protocol.csv").write_text("time_s,pressure_kPa\n0.0,0.0\n1.0,5.0\n"),
            attrs.evolve(JOB, stages=STAGES[:1]),
        )[1],
    ],
    ids=["unit", "times", "protocol.csv"],
)
def test_what_changed_is_not_current(tmp_path, change):
    keep_inputs(tmp_path, JOB.texts())
    job = change(tmp_path)
    assert job.texts_in(tmp_path) == (job.texts(), (), False)


def test_a_study_of_fewer_targets_is_written_with_the_others_and_runs_its_own(tmp_path):
    write_study(JOB, tmp_path)
    assert UnitStudy.read(tmp_path).stages == STAGES
    (tmp_path / "deviation.csv").write_text("kept")
    write_study(attrs.evolve(JOB, stages=STAGES[:2]), tmp_path)
    assert UnitStudy.read(tmp_path).stages == STAGES[:2]
    assert tuple(UnitStudy.read_tables(tmp_path / "study.toml")[0]) == STAGES
    assert (tmp_path / "deviation.csv").read_text() == "kept"
    write_study(attrs.evolve(JOB, unit=load_preset("mu-1.0x")), tmp_path)
    assert not (tmp_path / "deviation.csv").exists()


def test_a_folder_in_use_is_refused(tmp_path):
    lock = FolderLock(tmp_path)
    with pytest.raises(InUseError):
        write_study(JOB, tmp_path)
    lock.release()


GOOD = JOB.texts()["study.toml"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 50_000, "not TOML"),
        ("format = 5\n[design]\n", "format = 5"),
        (GOOD.replace("format = 4", "format = 3"), "format = 3"),
        ("format = true\n[design]\n", "format = True"),
        ("format = 4\n", "are not those of a study"),
        ("format = 4\n[simulate]\n", "are not those of a study"),
        ("format = 4\ndesign = 3\n", "not a table"),
        (GOOD.replace("times = 3", 'times = "__import__(\\"os\\")"'), "study.toml, line .* times"),
        (GOOD.replace("times = 3", "times = 3\nhook = 1"), "unknown key 'hook'"),
        (GOOD.replace("times = 3", "times = 1000000000"), "1000000000"),
        (GOOD.replace("refine = 0.4", 'refine = 0.4\nfidelity = "homogenised"'), "unknown key 'fidelity'"),
        (GOOD.replace("refine = 0.4", "refine = nan"), "refine"),
        (GOOD.replace("mesh_check = false", "mesh_check = []"), "study.toml, line .* mesh_check"),
    ],
)  # fmt: skip
def test_a_hostile_study_is_refused_in_words(tmp_path, text, words):
    keep_inputs(tmp_path, JOB.texts())
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        UnitStudy.read(tmp_path)


@pytest.mark.parametrize("name", ["../../unit.toml", "/etc/passwd", "unit.toml\\u0000"])
def test_a_name_that_leads_elsewhere_is_not_followed(tmp_path, name):
    keep_inputs(tmp_path, JOB.texts())
    (tmp_path / "study.toml").write_text(GOOD.replace('"unit.toml"', f'"{name}"'))
    assert UnitStudy.read(tmp_path).unit == JOB.unit


def test_an_input_that_was_edited_is_noticed(tmp_path):
    keep_inputs(tmp_path, JOB.texts())
    (tmp_path / "unit.toml").write_text(JOB.texts()["unit.toml"].replace("scale = 0.75", "scale = 0.8"))
    with pytest.raises(InputError, match="an input file has changed"):
        UnitStudy.read(tmp_path)


def test_the_device_is_no_part_of_what_decides():
    plain = UnitStudy(unit=load_preset("mu-1.0x"))
    assert attrs.evolve(plain, device="cuda:0").tables == plain.tables
    with pytest.raises(InputError, match="no device 'gpu'"):
        attrs.evolve(plain, device="gpu")


def test_the_inputs_of_a_study_are_made_without_the_solver():
    """Blender's window waits for them: neither Warp nor SciPy is loaded."""
    code = (
        "import sys\n"
        "from mu_addon.design.parameters import load_preset\n"
        "from mu_addon.studies.unit_ranking import UnitStudy\n"
        "UnitStudy(unit=load_preset('mu-1.0x')).texts()\n"
        "print([name for name in ('warp', 'scipy', 'gmsh', 'matplotlib') if name in sys.modules])\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert found.stdout == "[]\n", found.stderr
