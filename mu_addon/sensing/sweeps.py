"""Bending sweeps from recordings and measured data: those to calibrate with, and those held out."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..measured import read_folder
from ..reading import require_rows
from ..run.inputs import digest
from ..table_cells.own_tables import own_lines, own_rows, own_text
from .calibration import Calibration, CalibrationSweep, sweeps_of
from .recording import INDEX, Recording, read_recording
from .session import BACK, SWEEP

# After the mark "angle 30" the sensor is held there for that long.
_HOLD_S = 1.0


@attrs.frozen(eq=False)
class Sweeps:
    """Sweeps to fit, those held out by name, the light's channel, the dark channel or its level in V."""

    fitted: list[CalibrationSweep]
    held: list[tuple[str, CalibrationSweep]]
    channel: str
    dark: str | float

    def hash(self) -> str:
        """SHA-256 of every sweep's times, angles and volts, those fitted and those held out."""
        whole = [("", sweep) for sweep in self.fitted] + self.held
        tables = [(name, np.column_stack([s.time_s, s.angle_deg, s.voltage_V])) for name, s in whole]
        parts = [f"{name} {digest(np.ascontiguousarray(rows).tobytes())}" for name, rows in tables]
        return digest("\n".join([self.channel, str(self.dark), *parts]))


def read_sweeps(
    data: Sequence[Path], channel: str = "", dark: str = "", angles: Path | None = None
) -> Sweeps:
    """Sweeps of folders of measured data or recordings; raises InputError.

    channel: the column of the light, required if there are several; dark: the column of the dark level, or
    volts; angles: CSV of time_s, angle_deg for a recording without marks of angles ("angle 30").
    """
    fitted: list[CalibrationSweep] = []
    held: list[tuple[str, CalibrationSweep]] = []
    level = _level(dark)
    for folder in data:
        # Also for a name that the system refuses, which a Path raises.
        if os.path.exists(folder / INDEX):
            recordings = read_recording(folder)
            if not recordings:
                raise InputError("the recording contains no samples", str(folder), "choose another recording")
            # The last file has the channels that the device has now.
            channel = _channel(recordings[-1], channel, folder)
            fitted += _of_recording(recordings[-1], channel, level, angles, folder)
        else:
            channel = channel or "voltage_V"
            more, others = _of_measured(folder, level)
            fitted += more
            held += others
    return Sweeps(fitted, held, channel, level)


@attrs.frozen
class Check:
    """Accuracy of a calibration on an unseen sweep: error in degrees, shares of its readings within the 95 %
    band, and within the calibrated range.
    """

    name: str
    rms_deg: float
    within: float
    possible: float

    @classmethod
    def of(cls, name: str, sweep: CalibrationSweep, found: Calibration) -> Check:
        """Accuracy of a calibration on a sweep."""
        angle, low, high, possible = found.angle_of(sweep.voltage_V)
        error = angle - sweep.angle_deg
        within = (low <= sweep.angle_deg) & (sweep.angle_deg <= high)
        return cls(name, float(np.sqrt(np.mean(error**2))), float(within.mean()), float(possible.mean()))


def _level(dark: str) -> str | float:
    try:
        return float(dark or 0.0)
    except ValueError:
        return dark


def _channel(recording: Recording, name: str, folder: Path) -> str:
    channels = recording.channels
    if not name and len(channels) == 1:
        return channels[0]
    if name not in channels:
        what = (
            f"unknown channel {name}"
            if name
            else f"{len(channels)} channels are available, and none was chosen"
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
