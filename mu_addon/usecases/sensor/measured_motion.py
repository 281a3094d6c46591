"""Measured data from a recording and a calibration: the angle by the sensor against the pressure.

Rows are means over equal spans of time. The angle's standard deviation is half the calibration's 95 %
interval over 1.96: the error of the map, which averaging does not reduce.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...files import write_text
from ...measured import read_folder
from ...measured.folder import FILE
from ...measured.writing import csv_text, file_stem, tried
from ...run.context import RunContext
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, digest, named_path, read_inputs, structured
from ...run.usecase import UseCase
from ...sensing.calibration import light_of, read_calibration
from ...sensing.recording import Recording, read_recording
from ...toml_writer import toml_text

Array = np.ndarray[Any, Any]

LAYOUT = FolderLayout(
    "motion.toml",
    "# The inputs of this measured motion; its recording and calibration are known by their SHA-256.",
    results=(FILE, "*.csv"),
)
_SIGMAS_OF_95 = 1.959964


@attrs.frozen
class Job:
    """Inputs of a measured motion, read on construction. Raises InputError.

    recording: its folder; calibration: its file; pressure: channel of the gauge; kPa = (reading - `zero`) *
    `kPa_per_unit`; rate_hz: rows a second.
    """

    recording: Path
    calibration: Path
    pressure: str
    kPa_per_unit: float = 1.0
    zero: float = 0.0
    rate_hz: float = 10.0
    name: str = "bench"
    specimen: str = "A"
    columns: dict[str, Array] = attrs.field(init=False, eq=False, repr=False)

    @columns.default
    def _read(self) -> dict[str, Array]:
        return _columns(self)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name."""
        values = {
            "format": FORMAT,
            **{name: getattr(self, name) for name in _WRITTEN},
            "data_sha256": digest(csv_text(self.columns)),
            "run": {
                "recording": str(self.recording.resolve()),
                "calibration": str(self.calibration.resolve()),
            },
        }
        return {LAYOUT.inputs: toml_text(values, LAYOUT.header)}


_WRITTEN = ("pressure", "kPa_per_unit", "zero", "rate_hz", "name", "specimen")


def _columns(job: Job) -> dict[str, Array]:
    """Columns of the experiment, (n,) each, from the recording's latest file."""
    recordings = read_recording(job.recording)
    if not recordings:
        raise InputError("the recording contains no samples", str(job.recording), "choose another recording")
    recording = recordings[-1]
    if not 0.0 < job.rate_hz < float("inf"):
        raise InputError(
            f"rate_hz = {job.rate_hz:g} is not a rate", "rate_hz", "give rows a second, such as 10"
        )
    if job.pressure not in recording.columns:
        raise InputError(
            f"the recording has no channel {job.pressure!r} of the pressure",
            str(job.recording),
            f"one of: {', '.join(recording.channels)}",
        )
    calibration = read_calibration(job.calibration)
    means = _means(recording, job.rate_hz)
    names = tuple(means)
    volts = light_of(calibration, names, np.column_stack([means[name] for name in names]))
    angle, low, high, possible = calibration.angle_of(volts)
    if not possible.any():
        raise InputError(
            "the calibration gives no angle for any of the voltages",
            str(job.calibration),
            "calibrate this sensor, or set its zero again",
        )
    return {
        "time_s": means["time_s"],
        "pressure_kPa": (means[job.pressure] - job.zero) * job.kPa_per_unit,
        "angle_deg": np.where(possible, angle, np.nan),
        "angle_sd_deg": np.where(possible, (high - low) / (2.0 * _SIGMAS_OF_95), np.nan),
    }


def _means(recording: Recording, rate_hz: float) -> dict[str, Array]:
    """Means of every column over spans of 1 / rate_hz, (n,) each; spans without a sample are left out."""
    time_s = recording.columns["time_s"]
    span = np.floor((time_s - time_s[0]) * rate_hz).astype(int)
    _, which, count = np.unique(span, return_inverse=True, return_counts=True)
    return {
        name: np.bincount(which, weights=values) / count
        for name, values in recording.columns.items()
        if name not in ("device_s", "sequence")
    }


def read_job(folder: Path) -> Job:
    """The job that a folder of a measured motion describes; raises InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    recording = named_path(path, run, "recording", "recording")
    calibration = named_path(path, run, "calibration", "calibration")
    before = values.pop("data_sha256", None)
    job = structured(Job, values, str(path), recording=recording, calibration=calibration)
    if before != digest(csv_text(job.columns)):
        raise InputError(
            "recording or calibration has changed since this was made",
            f"{recording}, {calibration}",
            "restore them, or use a separate folder for these",
        )
    return job


def measure(job: Job, folder: Path, context: RunContext) -> Path:
    """Write experiments.toml and its CSV file of the kind unit_pressure into the folder; returns that.

    Raises InputError where the reader of measured data refuses them, and OutputError.
    """
    table = f"{file_stem(job.name)}.csv"
    keys = {"name": job.name, "kind": "unit_pressure", "file": table, "role": "fit", "specimen": job.specimen}
    block, text = "[[experiment]]\n" + toml_text(keys), csv_text(job.columns)
    with context.progress.stage("measure", expected_s=1.0):
        remarks = tried(block, table, text)
        write_text(folder / table, text)
        write_text(folder / FILE, block)
    for remark in remarks:
        context.progress.warning(remark.what, remark.where, remark.remedy)
    angle = job.columns["angle_deg"]
    context.summary |= {
        "rows": len(angle),
        "out_of_range": int(np.isnan(angle).sum()),
        "pressure_kPa": [float(f(job.columns["pressure_kPa"])) for f in (np.min, np.max)],
        "angle_deg": [float(f(angle)) for f in (np.nanmin, np.nanmax)],
    }
    read_folder(folder)
    return folder


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a measured motion's `summary`."""
    (p, q), (a, b) = summary["pressure_kPa"], summary["angle_deg"]
    lines = [f"{summary['rows']} rows, {p:.3g} to {q:.3g} kPa, {a:.1f} to {b:.1f} deg"]
    out = summary["out_of_range"]
    return [*lines, f"{out} rows are beyond the calibration, and have no angle"] if out else lines


USE_CASE = UseCase[Any]("measure", LAYOUT, read_job, measure, console_summary)
