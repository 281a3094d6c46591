"""A session with the real sensor: its process, its samples, and the present reading."""

from __future__ import annotations

import time
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...run.child import RUNNING, Child
from ...sensing.recording import FIXED
from ...sensing.traces import Traces
from ...sensing.watch import Watched

BINS = 600
"""Number of time steps across the plot."""
MEAN_S = 0.1
"""Averaging time of the twin and the figures: it removes noise and keeps bends of 2 Hz."""
CLOSE = 0.1
"""Share of the light's range by which a sweep's angles may stand in the wrong order."""
ANGLES = ("angle_deg", "angle_low_deg", "angle_high_deg")


@attrs.define(eq=False)
class Reading:
    """Present values of the sensor: means of the last moment, in V and degrees.

    light_V: without its dark level; possible: True if the calibration can give such a voltage.
    """

    light_V: float
    angle_deg: float = np.nan
    low_deg: float = np.nan
    high_deg: float = np.nan
    possible: bool = True


@attrs.define(eq=False)
class Guide:
    """A guided sweep: angles in their order, the number already held, and the end of the present one.

    light_V: the light at each angle that was held.
    """

    angles: list[float]
    held: int = 0
    until: float = 0.0
    light_V: list[float] = attrs.field(factory=list)

    @property
    def holding(self) -> bool:
        """True if an angle is being held now."""
        return time.monotonic() < self.until

    @property
    def finished(self) -> bool:
        """True if every angle was held."""
        return self.held == len(self.angles) and not self.holding

    @property
    def odd(self) -> int | None:
        """Number, from 0, of the held angle that breaks the order of the light, the latest if several do.

        The light falls or rises with the angle. The odd one contradicts most others; of a pair that differs
        by less than a share CLOSE of the light's range, which a sensor with hysteresis may do, neither does.
        """
        light, angle = np.array(self.light_V), np.array(self.angles[: len(self.light_V)])
        if len(light) < 3 or np.isnan(light).any():
            return None
        rise = np.subtract.outer(light, light) * np.sign(np.subtract.outer(angle, angle))
        wrong = rise * np.sign(np.median(rise[rise != 0.0])) < -CLOSE * np.ptp(light)
        count = wrong.sum(axis=1)[::-1]
        return len(light) - 1 - int(count.argmax()) if count.any() else None


@attrs.define(eq=False)
class Session:
    """A unit's session, running or ended, and its display."""

    child: Child
    watched: Watched
    traces: Traces | None = None
    """Channels and angles over the last seconds; None until the channels are known, or to restart."""
    frozen: Traces | None = None
    """Content of the frozen plot."""
    ranges: dict[str, tuple[float, float]] = attrs.field(factory=dict)
    reading: Reading | None = None
    guide: Guide | None = None
    trouble: str = ""
    """Reason why the calibration cannot read this stream."""
    _shown: tuple[Any, ...] = ()
    _stood: tuple[bool, bool] = (False, False)
    read_at: float = 0.0

    @property
    def running(self) -> bool:
        """True if its process is running."""
        return self.child.state == RUNNING

    @property
    def state(self) -> str:
        """Latest status: connected, searching, waiting, disconnected, paused or ended."""
        return str(self.watched.status.get("state", "starting"))

    @property
    def fresh(self) -> bool:
        """True if samples are arriving."""
        return self.running and self.watched.starved_s < 1.0

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the sensor's channels."""
        return self.watched.columns[len(FIXED) :]

    def update(self, calibration: Any, seconds: float) -> bool:
        """Process new samples; return True if there is a new status, or samples begin or end. Never waits."""
        self.child.poll()
        news = self.watched.look()
        if self.channels and (self.traces is None or self._shown != (self.channels, calibration)):
            self._shown = self.channels, calibration
            self.traces = Traces(len(self.channels) + len(ANGLES), seconds, BINS)
            self.ranges.clear()
            self.watched.rewind()
        rows = self.watched.fresh()
        if len(rows) and self.traces is not None:
            values = rows[:, len(FIXED) :]
            self.traces.add(rows[:, 0], np.column_stack([values, self._angles(values, calibration)]))
        # Buttons that need samples are greyed as soon as none come.
        stood, self._stood = self._stood, (self.running, self.fresh)
        return news or stood != self._stood

    def _angles(self, values: Any, calibration: Any) -> Any:
        """Angle and its band (n, 3) in degrees, nan without a calibration that reads these channels."""
        self.trouble = ""
        if calibration is not None:
            try:
                return np.column_stack(calibration.angle_of(_light(calibration, self.channels, values))[:3])
            except InputError as error:
                self.trouble = str(error)
        return np.full((len(values), len(ANGLES)), np.nan)

    def read(self, calibration: Any, channel: str, dark: str | float) -> None:
        """Set the reading to the mean of the last moment, with a calibration's angle if there is one."""
        rate = float(self.watched.status.get("rate_hz") or 0.0)
        rows = self.watched.latest(max(1, int(MEAN_S * rate)))
        self.reading = None
        if not len(rows) or channel not in self.channels:
            return
        mean = rows[:, len(FIXED) :].mean(axis=0, keepdims=True)
        if calibration is None or self.trouble:
            level = mean[0, self.channels.index(dark)] if dark in self.channels else dark
            self.reading = Reading(float(mean[0, self.channels.index(channel)]) - float(level))
            return
        light = _light(calibration, self.channels, mean)
        angle, low, high, possible = (float(part[0]) for part in calibration.angle_of(light))
        self.reading = Reading(float(light[0]), angle, low, high, bool(possible))


def _light(calibration: Any, channels: tuple[str, ...], values: Any) -> Any:
    # Imported late: it needs scipy, which a Blender without the wheels lacks.
    from ...sensing.calibration import light_of

    return light_of(calibration, channels, values)
