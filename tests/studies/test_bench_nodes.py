"""The bench in a tree: recorded, calibrated, measured; the angle is the one that bent the sensor."""

import json
import os
import signal
import threading

import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.errors import InputError
from mu_addon.graph import Evaluation, Node, NodeTree, Source
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.runs import FolderRuns
from mu_addon.studies.measure import Measure
from mu_addon.studies.record import Record

from .bent_sensor import recorded, write_angles
from .unit_runs import ended


@pytest.fixture
def bench(tmp_path):
    write_angles(tmp_path / "angles.csv", *recorded(tmp_path / "bending"))
    recorded(tmp_path / "unit", sweeps=2, seed=1, period_s=16.0)
    nodes = {
        "Bending": Node("recording", {"folder": str(tmp_path / "bending")}),
        "Unit": Node("recording", {"folder": str(tmp_path / "unit")}),
        "Calibrate": Node(
            "calibrate",
            {"channel": "light_V", "dark": "dark_V", "angles": str(tmp_path / "angles.csv")},
            {"bending": (Source("Bending", "recording"),)},
        ),
        "Motion": Node(
            "measure",
            {"pressure": "gauge_V", "kPa_per_unit": 20.0, "zero": 0.5, "rate_hz": 5.0},
            {
                "recording": (Source("Unit", "recording"),),
                "calibration": (Source("Calibrate", "calibration"),),
            },
        ),
    }
    return NodeTree("bench", nodes)


def evaluated(tree, out):
    found = Evaluation(tree, definitions(), FolderRuns(out))
    found.run()
    assert [s.error for s in found.states.values() if s.error] == []
    return found


@pytest.mark.slow
def test_a_recording_becomes_measured_data_whose_angles_are_those_that_bent_it(bench, tmp_path):
    found = evaluated(bench, tmp_path / "out")
    (e,) = found.outputs["Motion"]["data"].experiments
    assert (e.kind, e.name, e.specimen) == ("unit_pressure", "bench", "A")
    assert len(e["time_s"]) == 160, "32 s, five rows a second"
    # The gauge and the bend are of one law here: 1.25 degrees a kPa.
    np.testing.assert_allclose(e["angle_deg"], 1.25 * e["pressure_kPa"], atol=1.0)
    strayed = e["angle_deg"] - 1.25 * e["pressure_kPa"]
    assert np.mean(np.abs(strayed) < 2.0 * e["angle_sd_deg"]) > 0.9, "and the band says how far it strays"
    assert found.outputs["Calibrate"]["error"] < 0.5
    again = evaluated(bench, tmp_path / "out")
    assert {n: s.state for n, s in again.states.items()} == {
        "Bending": "computed",
        "Unit": "computed",
        "Calibrate": "cached",
        "Motion": "cached",
    }
    # And by itself, as `resume` does it.
    assert main(["resume", str(found.states["Motion"].folder)]) == 0


def test_what_cannot_be_measured_is_said(bench, tmp_path):
    found = evaluated(NodeTree("b", {k: bench.nodes[k] for k in ("Bending", "Calibrate")}), tmp_path / "out")
    calibration = found.outputs["Calibrate"]["calibration"]
    with pytest.raises(InputError, match="no channel 'pressure_kPa'") as caught:
        Measure(recording=tmp_path / "unit", calibration=calibration).complete()
    assert "gauge_V" in caught.value.remedy
    with pytest.raises(InputError, match="rate_hz = 0 Hz is out of bounds"):
        Measure(recording=tmp_path / "unit", calibration=calibration, rate_hz=0.0)
    with pytest.raises(InputError, match="cannot read the calibration"):
        Measure(
            recording=tmp_path / "unit", calibration=tmp_path / "none.toml", pressure="gauge_V"
        ).complete()
    with pytest.raises(InputError, match="recording is invalid"):
        Measure(recording=tmp_path / "none", calibration=calibration).complete()


def test_a_motion_of_other_samples_is_not_taken_for_the_same(bench, tmp_path):
    found = evaluated(bench, tmp_path / "out")
    folder = found.states["Motion"].folder
    with (tmp_path / "unit" / "recording-000.csv").open("a") as file:
        file.write("40,40,9999,2.4,0.05,0.5\n")
    with pytest.raises(InputError, match="recording or its calibration changed") as caught:
        Measure.read(folder)
    assert str(tmp_path / "unit") in caught.value.where


@pytest.mark.slow
def test_a_recording_is_a_run_of_its_own_take(tmp_path):
    def tree(take):
        return NodeTree("r", {"Record": Node("record", {"simulated": True, "seconds": 0.4, "take": take})})

    first, same, other = (evaluated(tree(k), tmp_path / "out") for k in (1, 1, 2))
    assert [x.states["Record"].state for x in (first, same, other)] == ["computed", "cached", "computed"]
    assert same.outputs["Record"]["recording"] == first.outputs["Record"]["recording"]
    assert other.outputs["Record"]["recording"] != first.outputs["Record"]["recording"]
    assert "samples" in first.states["Record"].remark


def test_a_recording_that_is_stopped_is_none_and_the_next_is_beside_it(tmp_path):
    job = Record(simulated=True, seconds=600.0)
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGTERM)).start()
    assert ended(job, tmp_path / "run", False)[0].status == 143
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "cancelled"
    assert (tmp_path / "run" / "recording-1" / "index.ndjson").is_file()
    assert ended(Record(simulated=True, seconds=0.3), tmp_path / "other", False)[0].status == 0
    assert Record.read(tmp_path / "run").texts() == job.texts()
