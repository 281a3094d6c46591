"""Calibrate a sensor from recorded bending, validated by leave-one-out, in one folder."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...files import write_csv, write_text
from ...measured import read_folder
from ...reading import require_rows
from ...report.html import cards, figure, note, page, table
from ...report.plots import canvas
from ...run.context import RunContext
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, digest, named_path, read_inputs, structured
from ...run.usecase import UseCase
from ...sensing.calibration import Calibration, CalibrationSweep, calibrate, sweeps_of, write_calibration
from ...sensing.recording import INDEX, Recording, read_recording
from ...sensing.session import BACK, SWEEP
from ...table_cells.own_tables import own_lines, own_rows, own_text
from ...toml_writer import toml_text

Array = np.ndarray[Any, Any]

LAYOUT = FolderLayout(
    "calibrate.toml",
    "# The inputs of this calibration; its samples, angles and volts, are known by their SHA-256.",
    results=("calibration.toml", "calibration.csv", "report.html"),
)
# After the mark "angle 30" the sensor is held there for that long.
_HOLD_S = 1.0


@attrs.frozen(eq=False)
class Check:
    """Accuracy of the calibration on an unseen sweep: error in degrees, share within its 95 % band."""

    name: str
    rms_deg: float
    within: float
    possible: float


@attrs.frozen(eq=False)
class Sweeps:
    """Sweeps to fit, those held out by name, the light's channel, the dark channel or its level in V."""

    fitted: list[CalibrationSweep]
    held: list[tuple[str, CalibrationSweep]]
    channel: str
    dark: str | float

    def digest(self) -> str:
        """SHA-256 of every sweep's times, angles and volts, those fitted and those held out."""
        whole = [("", sweep) for sweep in self.fitted] + self.held
        tables = [(name, np.column_stack([s.time_s, s.angle_deg, s.voltage_V])) for name, s in whole]
        parts = [f"{name} {digest(np.ascontiguousarray(rows).tobytes())}" for name, rows in tables]
        return digest("\n".join(parts))


@attrs.frozen
class Job:
    """Inputs of a calibration, read and checked on construction. Raises InputError.

    data: folders of measured data or recordings; channel: the column of the light, required if there are
    several; dark: the column of the dark level, or volts; angles: CSV of time_s, angle_deg for a recording
    without marks of angles ("angle 30").
    """

    data: tuple[Path, ...]
    channel: str | None = None
    dark: str | None = None
    angles: Path | None = None
    sweeps: Sweeps = attrs.field(init=False, eq=False, repr=False)

    @sweeps.default
    def _read(self) -> Sweeps:
        return _sweeps(self)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name."""
        return input_texts(self.data, self.channel, self.dark, self.angles, self.sweeps.digest())


def input_texts(
    data: Sequence[Path],
    channel: str | None = None,
    dark: str | None = None,
    angles: Path | None = None,
    samples: str | None = None,
) -> dict[str, str]:
    """Text of every file of inputs of a `Job`, by name.

    samples: SHA-256 of the samples (`Sweeps.digest`); without it a run by `resume` takes those present then,
    as of a recording in progress.
    """
    run = {
        "data": [str(folder.resolve()) for folder in data],
        "angles": None if angles is None else str(angles.resolve()),
    }
    values = {"format": FORMAT, "channel": channel, "dark": dark, "samples": samples, "run": run}
    return {LAYOUT.inputs: toml_text(values, LAYOUT.header)}


def read_job(folder: Path) -> Job:
    """The job that a folder of `calibrate` describes, its data at their original path; raises InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    places = run.get("data")
    data = [
        named_path(path, {"data": place}, "data", "recording")
        for place in (places if isinstance(places, list) and places else [None])
    ]
    angles = named_path(path, run, "angles", "table of angles") if "angles" in run else None
    asked = {key: values[key] for key in ("channel", "dark") if key in values}
    job = structured(Job, asked, str(path), data=tuple(data), angles=angles)
    if values.get("samples", job.sweeps.digest()) != job.sweeps.digest():
        raise InputError(
            "these samples are not those of the earlier calibration",
            ", ".join(map(str, data)),
            "restore those, or calibrate these in a separate folder",
        )
    return job


def calibrate_sensor(job: Job, folder: Path, context: RunContext) -> Calibration:
    """Fit a calibration to recorded bending; writes calibration.toml and calibration.csv.

    Held-out experiments are not fitted but checked. Raises InputError and OutputError.
    """
    fitted, held = job.sweeps.fitted, job.sweeps.held
    with context.progress.stage("calibrate", expected_s=1.0):
        found = calibrate(fitted, job.sweeps.channel, job.sweeps.dark)
    checks = [_check(words, sweep, found) for words, sweep in held]
    low, high = found.range_deg
    write_calibration(
        folder / "calibration.toml",
        found,
        f"{len(fitted)} sweeps, {low:.1f} to {high:.1f} degrees, from {', '.join(p.name for p in job.data)}",
    )
    at = np.linspace(low, high, 201)
    volts = found.voltage_of(at)
    _, near, far, _ = found.angle_of(volts)
    rows = np.column_stack([at, volts, near, far]).tolist()
    write_csv(folder / "calibration.csv", ("angle_deg", "voltage_V", "angle_low_deg", "angle_high_deg"), rows)
    context.summary |= summary(found, checks)
    context.report = lambda stopped: write_text(
        folder / "report.html", _report(found, fitted, held, checks, stopped)
    )
    return found


def _sweeps(job: Job) -> Sweeps:
    fitted: list[CalibrationSweep] = []
    held: list[tuple[str, CalibrationSweep]] = []
    name, level = job.channel, _level(job.dark)
    for folder in job.data:
        # Also for a name that the system refuses, which a Path raises.
        if os.path.exists(folder / INDEX):
            recordings = read_recording(folder)
            if not recordings:
                raise InputError("the recording contains no samples", str(folder), "choose another recording")
            # The last file has the channels that the device has now.
            name = _channel(recordings[-1], name, folder)
            fitted += _of_recording(recordings[-1], name, level, job.angles, folder)
        else:
            name = name or "voltage_V"
            more, others = _of_measured(folder, level)
            fitted += more
            held += others
    return Sweeps(fitted, held, str(name), level)


def summary(found: Calibration, checks: Sequence[Check]) -> dict[str, Any]:
    """Figures of a calibration for summary.json."""
    low, high = found.range_deg
    volts = found.voltage_of(np.array([low, high]))
    return {
        "range_deg": [low, high],
        "voltage_V": volts.tolist(),
        "band_V": found.band_V,
        "error_deg": found.error_deg,
        "drift_per_h": found.drift_per_h,
        "sweeps": found.sweeps,
        "channel": found.channel,
        "insensitive_deg": _insensitive(found),
        "held_out": [attrs.asdict(check) for check in checks],
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a calibration's `summary`."""
    low, high = summary["range_deg"]
    lines = [
        f"{summary['channel']}: {low:.1f} to {high:.1f} deg, {summary['sweeps']} sweeps, leave-one-out "
        f"error {summary['error_deg']:.2f} deg rms"
    ]
    lines += [
        f"{c['name']}, held out: {c['rms_deg']:.2f} deg, {c['within']:.0%} within the 95 % band"
        for c in summary["held_out"]
    ]
    blind = summary["insensitive_deg"]
    return [*lines, *([f"low sensitivity between {blind[0]:.0f} and {blind[1]:.0f} deg"] if blind else [])]


def _insensitive(found: Calibration) -> list[float]:
    """The widest interval in degrees that the band cannot resolve, if it is a fifth of the range or more."""
    low, high = found.range_deg
    at = np.linspace(low, high, 401)
    _, near, far, _ = found.angle_of(found.voltage_of(at))
    widest = int(np.argmax(far - near))
    return [float(near[widest]), float(far[widest])] if far[widest] - near[widest] > (high - low) / 5 else []


def _level(dark: str | None) -> str | float:
    try:
        return 0.0 if dark is None else float(dark)
    except ValueError:
        return str(dark)


def _channel(recording: Recording, name: str | None, folder: Path) -> str:
    channels = recording.channels
    if name is None and len(channels) == 1:
        return channels[0]
    if name is None or name not in channels:
        what = (
            f"{len(channels)} channels are available, and none was chosen"
            if name is None
            else f"unknown channel {name}"
        )
        raise InputError(what, str(folder), f"--channel one of: {', '.join(channels)}")
    return name


def _of_recording(
    recording: Recording, channel: str, dark: str | float, angles: Path | None, folder: Path
) -> list[CalibrationSweep]:
    time_s, volts = recording.columns["time_s"], recording.columns[channel]
    if isinstance(dark, str):
        if dark not in recording.columns:
            raise InputError(
                f"unknown channel {dark}", str(folder), f"--dark one of: {', '.join(recording.channels)}"
            )
        dark = recording.columns[dark]  # type: ignore[assignment]
    volts = volts - dark
    angle = _marked(recording, time_s) if angles is None else _joined_angles(angles, time_s)
    if not np.isfinite(angle).any():
        raise InputError(
            "the recording has no reference angles",
            str(folder),
            'leave marks such as "angle 30" while recording, or give --angles FILE (time_s,angle_deg)',
        )
    return sweeps_of(time_s, angle, volts)


def _marked(recording: Recording, time_s: Array) -> Array:
    """Angles (n,) in degrees held after marks that state them, nan elsewhere.

    Only those after the last mark "sweep", which starts a guided sweep: earlier, failed sweeps are left out,
    and angles that a mark "back" takes back.
    """
    angle = np.full(len(time_s), math.nan)
    marks = [m for m in recording.messages if m.get("event") == "mark"]
    begun = [k for k, mark in enumerate(marks) if mark.get("text") == SWEEP]
    marks = marks[begun[-1] if begun else 0 :]
    kept: list[tuple[float, float, float]] = []
    for k, mark in enumerate(marks):
        word, _, value = str(mark.get("text", "")).partition(" ")
        if word == BACK and kept:
            kept.pop()
        try:
            held = float(value)
        except ValueError:
            continue
        if word != "angle":
            continue
        start = float(mark["time_s"])
        end = min(start + _HOLD_S, float(marks[k + 1]["time_s"]) if k + 1 < len(marks) else math.inf)
        kept.append((start, end, held))
    for start, end, held in kept:
        angle[(time_s >= start) & (time_s < end)] = held
    return angle


def _joined_angles(path: Path, time_s: Array) -> Array:
    """Angles (n,) in degrees at given times, interpolated in a CSV file, nan beyond its ends."""
    try:
        lines = own_lines(own_text(path))
        require_rows(len(lines) - 1, str(path))
        (_, names), *rows = own_rows(lines)
        places = [names.index("time_s"), names.index("angle_deg")]
        t, a = np.array([[float(cells[k]) for k in places] for _, cells in rows]).T
    except OSError as error:
        raise InputError(f"cannot read {path.name}: {error.strerror}", str(path), "check its name") from None
    except (csv.Error, IndexError, ValueError):
        raise InputError(
            "the file is not a table of time_s,angle_deg", str(path), "give numbers in these two columns"
        ) from None
    if (np.diff(t) <= 0).any():
        raise InputError("time_s does not increase", str(path), "sort the rows by time_s")
    return np.asarray(np.interp(time_s, t, a, left=math.nan, right=math.nan))


def _of_measured(
    folder: Path, dark: str | float
) -> tuple[list[CalibrationSweep], list[tuple[str, CalibrationSweep]]]:
    experiments = read_folder(folder).of("waveguide_bending")
    if not experiments:
        raise InputError(
            "the folder has no experiment of the kind waveguide_bending",
            str(folder),
            'kind = "waveguide_bending"',
        )
    if isinstance(dark, str):
        raise InputError("measured data contain no dark-level channel", "--dark", "give the dark level in V")
    fitted: list[CalibrationSweep] = []
    held: list[tuple[str, CalibrationSweep]] = []
    for experiment in experiments:
        time_s, angle, volts = (experiment[name] for name in ("time_s", "angle_deg", "voltage_V"))
        if experiment.role == "held_out":
            seen = np.isfinite(angle) & np.isfinite(volts)
            held.append((experiment.name, CalibrationSweep(time_s[seen], angle[seen], volts[seen] - dark)))
        else:
            fitted += sweeps_of(time_s, angle, volts - dark, fewest=1)
    return fitted, held


def _check(name: str, sweep: CalibrationSweep, found: Calibration) -> Check:
    angle, low, high, possible = found.angle_of(sweep.voltage_V)
    error = angle - sweep.angle_deg
    within = (low <= sweep.angle_deg) & (sweep.angle_deg <= high)
    return Check(name, float(np.sqrt(np.mean(error**2))), float(within.mean()), float(possible.mean()))


def _report(
    found: Calibration,
    fitted: Sequence[CalibrationSweep],
    held: Sequence[tuple[str, CalibrationSweep]],
    checks: Sequence[Check],
    stopped: str,
) -> str:
    low, high = found.range_deg
    facts = [
        ("range", f"{low:.1f} to {high:.1f} deg"),
        ("leave-one-out error", f"{found.error_deg:.2f} deg rms"),
        ("95 % band", f"{1000 * found.band_V:.1f} mV"),
        (
            "drift removed",
            f"{100 * found.drift_per_h:.2f} % an hour" if found.drift_per_h else "none detected",
        ),
    ]
    blind = _insensitive(found)
    words = (
        f"<p>Between {blind[0]:.0f} and {blind[1]:.0f} degrees the voltage is nearly constant: the sensor "
        "cannot resolve the angle there.</p>"
        if blind
        else ""
    )
    head = [
        ("sweep", ""),
        ("error, deg rms", "n"),
        ("within the 95 % band", "n"),
        ("within the calibrated range", "n"),
    ]
    rows = [([c.name, f"{c.rms_deg:.2f}", f"{c.within:.0%}", f"{c.possible:.0%}"], False) for c in checks]
    checked = table("Error on held-out sweeps", head, rows) if rows else ""
    chart = figure(
        _chart(found, fitted, held), "Readings, calibration curve and its 95 % band", "voltage against angle"
    )
    return page(
        "Calibration",
        f"{escape(found.channel)}, {found.sweeps} sweeps",
        note([], stopped),
        cards(facts) + words,
        [("map", "Calibration curve", chart), ("held-out", "Held-out sweeps", checked)],
    )


def _chart(
    found: Calibration, fitted: Sequence[CalibrationSweep], held: Sequence[tuple[str, CalibrationSweep]]
) -> str:
    with canvas(6.4, 3.6) as (drawing, svg):
        axes = drawing.add_axes((0.11, 0.15, 0.86, 0.82))
        at = np.linspace(*found.range_deg, 201)
        volts = found.voltage_of(at)
        axes.fill_between(at, volts - found.band_V, volts + found.band_V, color="0.85", label="95 % band")
        for k, sweep in enumerate(fitted):
            few = slice(None, None, max(1, len(sweep.angle_deg) // 400))
            axes.plot(
                sweep.angle_deg[few], sweep.voltage_V[few], ".", ms=2, color="C0", label="" if k else "fitted"
            )
        for k, (_, sweep) in enumerate(held):
            few = slice(None, None, max(1, len(sweep.angle_deg) // 400))
            axes.plot(
                sweep.angle_deg[few],
                sweep.voltage_V[few],
                ".",
                ms=2,
                color="C1",
                label="" if k else "held out",
            )
        axes.plot(at, volts, color="black", lw=1, label="map")
        axes.set_xlabel("bending angle, deg")
        axes.set_ylabel("voltage, V")
        axes.legend(frameon=False, fontsize=8)
    return svg()


USE_CASE = UseCase("calibrate", LAYOUT, read_job, calibrate_sensor, console_summary)
