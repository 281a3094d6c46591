"""`calibrate` on recordings and measured data, and its map applied to a stream, all as a user would."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.sweeps import _marked

from .bent_sensor import recorded, write_angles


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def test_a_sweep_that_failed_does_not_poison_the_next_one_of_the_recording(tmp_path: Path) -> None:
    """Marks before the last "sweep" no longer count, nor does the angle that a mark "back" takes back."""
    time_s = np.arange(0.0, 10.0, 0.1)

    class Kept:
        messages = (
            {"event": "mark", "time_s": 0.0, "text": "angle 30"},
            {"event": "mark", "time_s": 4.0, "text": "sweep"},
            {"event": "mark", "time_s": 5.0, "text": "angle 0"},
            {"event": "mark", "time_s": 6.5, "text": "angle 15"},
            {"event": "mark", "time_s": 7.0, "text": "back"},
            {"event": "mark", "time_s": 8.0, "text": "angle 15"},
        )

    angle = _marked(Kept, time_s)
    assert np.isnan(angle[time_s < 4.9]).all()
    assert 0.0 in angle
    assert 8.0 <= time_s[angle == 15.0].min() < 8.2
    assert np.isnan(angle[(time_s > 6.4) & (time_s < 7.9)]).all()


@pytest.mark.parametrize("marked", [False, True])
def test_a_recording_is_calibrated(tmp_path: Path, marked: bool, capsys: pytest.CaptureFixture[str]) -> None:
    t, angle = recorded(tmp_path / "bench", marked=marked)
    write_angles(tmp_path / "angles.csv", t, angle)
    more = [] if marked else ["--angles", tmp_path / "angles.csv"]
    out = tmp_path / "out"
    status = run(
        "calibrate", tmp_path / "bench", "--channel", "light_V", "--dark", "dark_V", "--out", out, *more
    )
    assert status == 0
    assert "4 sweeps" in capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["error_deg"] < 1.0
    assert "<svg" in (out / "report.html").read_text() or "image/svg" in (out / "report.html").read_text()

    # The map, applied while the recording plays again: shown, not recorded.
    again = tmp_path / "again"
    assert run("replay", tmp_path / "bench", "--speed", 0, "--calibration", out / "calibration.toml",
               "--out", again) == 0  # fmt: skip
    state = json.loads((again / "status.json").read_text())
    assert state["columns"][-4:] == ["angle_deg", "angle_low_deg", "angle_high_deg", "in_range"]
    assert state["latest"][-4] == pytest.approx(angle[-1], abs=2)
    (recording,) = read_recording(again)
    assert recording.channels == ("light_V", "dark_V", "gauge_V")


def test_a_recording_that_goes_on_is_the_same_and_other_samples_are_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path / "bench", marked=True)
    out = tmp_path / "out"
    assert run("calibrate", tmp_path / "bench", "--channel", "light_V", "--out", out) == 0
    recording = tmp_path / "bench" / "recording-000.csv"
    rows = recording.read_text().splitlines(keepends=True)
    later = rows[-1].split(",")
    recording.write_text("".join(rows) + ",".join([str(float(later[0]) + 60.0), *later[1:]]))
    assert run("resume", out) == 0, capsys.readouterr().err
    recording.write_text("".join(rows).replace("0.5", "0.6"))
    capsys.readouterr()
    assert run("resume", out) == 2
    assert "what to do" in capsys.readouterr().err


def test_measured_data_with_a_sweep_held_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    generator = np.random.default_rng(1)
    blocks = []
    for k in range(5):
        t = np.arange(0, 10, 0.05)
        angle = 25 - 25 * np.cos(2 * np.pi * t / 10)
        volts = 2.4 * np.exp(-0.006 * angle) + 0.01 * generator.normal(size=len(t))
        rows = "".join(f"{a},{b},{c}\n" for a, b, c in zip(t, angle, volts, strict=True))
        (tmp_path / f"s{k}.csv").write_text("time_s,angle_deg,voltage_V\n" + rows)
        role = "held_out" if k == 4 else "fit"
        blocks.append(
            f'[[experiment]]\nname = "sweep {k}"\nkind = "waveguide_bending"\nfile = "s{k}.csv"\n'
            f'role = "{role}"\nspecimen = "A"\n'
        )
    (tmp_path / "experiments.toml").write_text("\n".join(blocks))
    assert run("calibrate", tmp_path, "--out", tmp_path / "out") == 0
    assert "sweep 4, held out" in capsys.readouterr().out
    (check,) = json.loads((tmp_path / "out" / "summary.json").read_text())["held_out"]
    assert check["rms_deg"] < 1.5
    assert 0.9 < check["within"] <= 1.0
