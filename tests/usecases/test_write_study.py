"""A study's inputs written for another process: which stages it runs, and what of an earlier one stays."""

import attrs
import pytest
from mu_addon.usecases.simulate_and_place.study_file import read

from mu_addon.design.parameters import load_preset
from mu_addon.run.lock import FolderLock, InUseError
from mu_addon.studies.unit_inputs import grasp
from mu_addon.studies.unit_ranking import UnitStudy
from mu_addon.studies.use_case import write_study


@pytest.fixture(scope="module")
def job():
    return UnitStudy(load_preset("mu-0.75x"), grasp())


def test_a_job_of_fewer_stages_runs_those_and_keeps_the_inputs_of_the_others(job, tmp_path):
    write_study(job, tmp_path)
    assert UnitStudy.read(tmp_path).stages == ("design", "simulate", "place")
    (tmp_path / "deviation.csv").write_text("kept")
    write_study(attrs.evolve(job, stages=("design", "simulate")), tmp_path)
    assert UnitStudy.read(tmp_path).stages == ("design", "simulate")
    assert set(read(tmp_path)) == {"design", "simulate", "place"}
    assert (tmp_path / "deviation.csv").read_text() == "kept"


def test_other_inputs_set_the_results_aside(job, tmp_path):
    write_study(job, tmp_path)
    (tmp_path / "deviation.csv").write_text("old")
    write_study(attrs.evolve(job, unit=load_preset("mu-1.0x")), tmp_path)
    assert not (tmp_path / "deviation.csv").exists()
    assert UnitStudy.read(tmp_path).unit.name == "mu-1.0x"


def test_a_folder_in_use_is_refused(job, tmp_path):
    lock = FolderLock(tmp_path)
    with pytest.raises(InUseError):
        write_study(job, tmp_path)
    lock.release()
