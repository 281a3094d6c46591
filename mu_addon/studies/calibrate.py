"""`calibrate`: from recorded bending to a map from voltage to angle, validated by leave-one-out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import attrs

from .. import report, sensing
from ..run.parts import Chart, Fact, File, Part, Sentence, Table, csv, echo, recorded
from ..run.study import Node, ReadInput, Study, given, intermediate, section, setting, stage
from ..sensing.settings import ANGLES, CHANNEL, DARK
from .inputs import PlaceInput, asked


@attrs.frozen(kw_only=True, eq=False)
class Calibrate(Study):
    """Calibrate a sensor: fit the map from voltage to bending angle to recorded bending sweeps."""

    name = "calibrate"
    example = "calibrate out/bench-1 --channel light_V --dark dark_V --out out/calibration"
    files = {
        "calibration.toml": "the map, for `stream`, `replay` and the bench",
        "calibration.csv": "the map as a table, with its 95 % band",
    }
    node = Node(
        "Bench",
        "the map from voltage to bending angle, by recorded bending",
        (
            ("calibration", "calibration", "the map"),
            ("error", "number", "error in sweeps left out of the fit, in deg"),
        ),
        lambda summary: f"error {summary['error_deg']:.2g} deg",
        read=lambda done, call: {
            "calibration": done.folder / "calibration.toml",
            "error": float(done.summary["error_deg"]),
        },
    )

    data: tuple[Path, ...] = asked(
        PlaceInput,
        "data",
        "recordings, or folders of measured data of the kind waveguide_bending",
        empty=attrs.NOTHING,
        kind="bending",
        what="recording",
        argument="FOLDER",
        many=True,
    )
    channel: str = setting(CHANNEL, metavar="NAME")
    dark: str = setting(DARK, metavar="NAME|V")
    angles: Path | None = given(
        PlaceInput(descriptions=(ANGLES,), metavar="CSV", path="file", what="table of angles", needed=False),
        default=None,
    )
    samples: sensing.Sweeps | None = given(
        ReadInput(of=lambda s: sensing.read_sweeps(s.data, s.channel, s.dark, s.angles), what="samples"),
        default=None,
    )

    @stage("calibrate", 1.0, kept=False)
    def found(self, samples: sensing.Sweeps) -> sensing.Calibration:
        """The map, fitted to all sweeps that are not held out."""
        return sensing.calibrate(samples.fitted, samples.channel, samples.dark)

    @intermediate()
    def checks(self, found: sensing.Calibration, samples: sensing.Sweeps) -> tuple[sensing.Check, ...]:
        """Accuracy on the sweeps that were not fitted."""
        return tuple(sensing.Check.of(name, sweep, found) for name, sweep in samples.held)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the sweeps."""
        assert self.samples is not None
        return "Calibration", f"{self.samples.channel}, {len(self.samples.fitted)} sweeps"

    @section()
    def answer(self, found: sensing.Calibration, checks: tuple[sensing.Check, ...]) -> Iterator[Part]:
        """Range and errors, and where the map cannot resolve the angle."""
        import numpy as np

        low, high = found.range_deg
        drift = f"{100 * found.drift_per_h:.2f} % an hour" if found.drift_per_h else "none detected"
        yield Fact("range", [low, high], f"{low:.1f} to {high:.1f} deg", "range_deg")
        yield Fact("leave-one-out error", found.error_deg, f"{found.error_deg:.2f} deg rms", "error_deg")
        yield Fact("95 % band", found.band_V, f"{1000 * found.band_V:.1f} mV", "band_V")
        yield Fact("drift removed", found.drift_per_h, drift, "drift_per_h")
        yield recorded("voltage_V", found.voltage_of(np.array([low, high])).tolist())
        yield recorded("sweeps", found.sweeps)
        yield recorded("channel", found.channel)
        yield recorded("insensitive_deg", found.insensitive_deg)
        yield recorded("held_out", [attrs.asdict(check) for check in checks])
        lines = [
            f"{found.channel}: {low:.1f} to {high:.1f} deg, {found.sweeps} sweeps, leave-one-out error "
            f"{found.error_deg:.2f} deg rms"
        ]
        lines += [
            f"{c.name}, held out: {c.rms_deg:.2f} deg, {c.within:.0%} within the 95 % band" for c in checks
        ]
        if blind := found.insensitive_deg:
            lines.append(f"low sensitivity between {blind[0]:.0f} and {blind[1]:.0f} deg")
            yield Sentence(
                f"Between {blind[0]:.0f} and {blind[1]:.0f} degrees the voltage is nearly constant: the "
                "sensor cannot resolve the angle there."
            )
        yield from echo(*lines)
        names = ", ".join(p.name for p in self.data)
        words = f"{found.sweeps} sweeps, {low:.1f} to {high:.1f} degrees, from {names}"
        yield File("calibration.toml", lambda path: sensing.write_calibration(path, found, words))

    @section("map", "Calibration curve")
    def curve(self, found: sensing.Calibration, samples: sensing.Sweeps) -> Iterator[Part]:
        """The map beside the readings."""
        import numpy as np

        at = np.linspace(*found.range_deg, 201)
        volts = found.voltage_of(at)
        _, near, far, _ = found.angle_of(volts)
        columns = ("angle_deg", "voltage_V", "angle_low_deg", "angle_high_deg")
        yield csv("calibration.csv", columns, np.column_stack([at, volts, near, far]).tolist())

        yield Chart(
            lambda: report.curve_chart(found, samples.fitted, samples.held),
            "Readings, calibration curve and its 95 % band",
            "voltage against angle",
        )

    @section("held-out", "Held-out sweeps")
    def held(self, checks: tuple[sensing.Check, ...]) -> Iterator[Part]:
        """Accuracy on each held-out sweep."""
        head = [
            "sweep",
            *Table.numbers("error, deg rms", "within the 95 % band", "within the calibrated range"),
        ]
        rows = [(c.name, f"{c.rms_deg:.2f}", f"{c.within:.0%}", f"{c.possible:.0%}") for c in checks]
        if rows:
            yield Table("Error on held-out sweeps", head, rows)
