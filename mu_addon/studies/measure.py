"""`measure`, a node: measured data from a recording and a calibration, the angle against the pressure.

Rows are means over equal spans of time. The angle's standard deviation is half the calibration's 95 %
interval over 1.96: the error of the map, which averaging does not reduce.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs

from .. import measured, sensing
from ..design.quantity import described
from ..errors import InputError
from ..run.inputs import digest
from ..run.parts import Fact, Part, Sentence, Warn, echo, recorded
from ..run.study import Node, ReadInput, Study, derived, given, section, setting, stage
from ..toml_writer import toml_text
from .inputs import PlaceInput

_SIGMAS_OF_95 = 1.959964


@attrs.frozen(eq=False)
class Motion:
    """Columns of the experiment, (n,) each, by name."""

    columns: dict[str, Any]

    def text(self) -> str:
        """Its CSV file."""
        return measured.csv_text(self.columns)

    def hash(self) -> str:
        """Hash of that."""
        return digest(self.text())


@attrs.frozen(kw_only=True, eq=False)
class Measure(Study):
    """Write a recording as measured data: the bending angle by a calibration against the pressure."""

    name = "measure"
    files = {"experiments.toml": "the experiment, as `diagnose` reads it", "*.csv": "its data"}
    node = Node(
        "Bench",
        "a recording as measured data: the angle by the calibration against the pressure",
        (("data", "data", "an experiment of a unit under pressure"),),
        lambda summary: "{:.3g} to {:.3g} deg".format(*summary["angle_deg"]),
        label="Measured Motion",
        read=lambda done, call: {"data": measured.read_folder(done.folder)},
    )

    recording: Path = given(PlaceInput(kind="recording", what="recording"))
    calibration: Path = given(PlaceInput(kind="calibration", what="calibration"))
    pressure: str = setting(described("pressure", "pressure_kPa", "channel of the gauge"))
    kPa_per_unit: float = setting(described("kPa_per_unit", 1.0, "factor on the channel", low=-1e6, high=1e6))
    zero: float = setting(
        described("zero", 0.0, "reading of the channel without pressure", low=-1e9, high=1e9)
    )
    rate_hz: float = setting(described("rate_hz", 10.0, "rows a second", unit="Hz", low=1e-3, high=1e5))
    experiment: str = setting(described("experiment", "bench", "name of the experiment"))
    specimen: str = setting(described("specimen", "A", "which specimen"))
    data: Motion | None = given(
        ReadInput(of=lambda study: study.motion(), what="recording or its calibration"), default=None
    )

    def motion(self) -> Motion:
        """The experiment's columns, from the recording's latest file; raises InputError."""
        import numpy as np

        recordings = sensing.read_recording(self.recording)
        if not recordings:
            what, remedy = "the recording contains no samples", "choose another recording"
            raise InputError(what, str(self.recording), remedy)
        recording = recordings[-1]
        if self.pressure not in recording.columns:
            raise InputError(
                f"the recording has no channel {self.pressure!r} of the pressure",
                str(self.recording),
                f"one of: {', '.join(recording.channels)}",
            )
        calibration = sensing.read_calibration(self.calibration)
        means = _means(recording, self.rate_hz)
        names = tuple(means)
        volts = sensing.light_of(calibration, names, np.column_stack([means[name] for name in names]))
        angle, low, high, possible = calibration.angle_of(volts)
        if not possible.any():
            raise InputError(
                "the calibration gives no angle for any of the voltages",
                str(self.calibration),
                "calibrate this sensor, or set its zero again",
            )
        columns = {
            "time_s": means["time_s"],
            "pressure_kPa": (means[self.pressure] - self.zero) * self.kPa_per_unit,
            "angle_deg": np.where(possible, angle, np.nan),
            "angle_sd_deg": np.where(possible, (high - low) / (2.0 * _SIGMAS_OF_95), np.nan),
        }
        return Motion(columns)

    @derived
    def entry(self, experiment: str, specimen: str, data: Motion) -> measured.Entry:
        """The experiment, as the folder has it."""
        file = f"{measured.file_stem(experiment)}.csv"
        keys = {"name": experiment, "kind": "unit_pressure", "file": file, "role": "fit"}
        block = "[[experiment]]\n" + toml_text({**keys, "specimen": specimen})
        return measured.Entry(experiment, block, file, data.text())

    @stage("measure", 1.0, kept=False)
    def remarks(self, entry: measured.Entry) -> tuple[measured.Remark, ...]:
        """Remarks of the reader of measured data, before anything is written; raises its InputError."""
        return entry.tried()

    def heading(self) -> tuple[str, str]:
        """Title of the report."""
        return f"Measured motion: {self.experiment}", ""

    @section()
    def answer(
        self, remarks: tuple[measured.Remark, ...], entry: measured.Entry, data: Motion
    ) -> Iterator[Part]:
        """The experiment, and the range of its readings."""
        import numpy as np

        for remark in remarks:
            yield Warn(remark.what, remark.where, remark.remedy, repeated=False)
        yield from measured.added([entry])
        kPa, angle = data.columns["pressure_kPa"], data.columns["angle_deg"]
        low, high = float(np.min(kPa)), float(np.max(kPa))
        least, most = float(np.nanmin(angle)), float(np.nanmax(angle))
        out = int(np.isnan(angle).sum())
        yield Fact("rows", len(angle), str(len(angle)), "rows")
        yield Fact("pressure", [low, high], f"{low:.3g} to {high:.3g} kPa", "pressure_kPa")
        yield Fact("angle", [least, most], f"{least:.1f} to {most:.1f} deg", "angle_deg")
        yield recorded("out_of_range", out)
        words = f"{len(angle)} rows, {low:.3g} to {high:.3g} kPa, {least:.1f} to {most:.1f} deg"
        yield from echo(words)
        if out:
            yield Sentence(f"{out} rows are beyond the calibration, and have no angle", terminal=True)


def _means(recording: sensing.Recording, rate_hz: float) -> dict[str, Any]:
    """Means of every column over spans of 1 / rate_hz, (n,) each; spans without a sample are left out."""
    import numpy as np

    time_s = recording.columns["time_s"]
    span = np.floor((time_s - time_s[0]) * rate_hz).astype(int)
    _, which, count = np.unique(span, return_inverse=True, return_counts=True)
    return {
        name: np.bincount(which, weights=values) / count
        for name, values in recording.columns.items()
        if name not in ("device_s", "sequence")
    }
