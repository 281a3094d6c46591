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
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress
from mu_addon.sensing.recording import Recorder
from mu_addon.sensing.samples import Layout, Samples
from mu_addon.studies.measure import Measure
from mu_addon.studies.record import Record
from mu_addon.studies.starting import start


def recorded(folder, sweeps=4, seed=0, period_s=10.0):
    """A sensor that bends by 1.25 degrees a kPa, on a gauge of 20 kPa/V; its light is by Beer's law.

    Returns times in s and angles in degrees.
    """
    noise = np.random.default_rng(seed)
    t = np.arange(0, period_s * sweeps, 0.02)
    kPa = 20.0 - 20.0 * np.cos(2 * np.pi * t / period_s)
    angle = 1.25 * kPa
    dark = 0.05 + 0.001 * noise.normal(size=len(t))
    light = 2.4 * np.exp(-0.006 * angle) + dark + 0.002 * noise.normal(size=len(t))
    recorder = Recorder(folder, {})
    values = np.column_stack([light, dark, 0.5 + kPa / 20.0])
    recorder.write(Samples(Layout(("light", "dark", "gauge"), "V"), t, t, np.arange(len(t)), values), 0.0)
    recorder.close()
    return t, angle


@pytest.fixture
def bench(tmp_path):
    t, angle = recorded(tmp_path / "bending")
    lines = "".join(f"{a},{b}\n" for a, b in zip(t, angle, strict=True))
    (tmp_path / "angles.csv").write_text("time_s,angle_deg\n" + lines)
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
    with run_to_end(Progress([])) as context:
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGTERM)).start()
        start(job, tmp_path / "run", context)
    assert context.status == 143
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "cancelled"
    assert (tmp_path / "run" / "recording-1" / "index.ndjson").is_file()
    with run_to_end(Progress([])) as context:
        start(Record(simulated=True, seconds=0.3), tmp_path / "other", context)
    assert context.status == 0
    assert Record.read(tmp_path / "run").texts() == job.texts()


@pytest.mark.parametrize(
    ("given", "words"),
    [({"seconds": -1.0}, "seconds = -1 s is out of bounds"), ({"baud": 0}, "baud = 0 is out of bounds")],
)
def test_settings_that_cannot_be_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        Record(**given)
