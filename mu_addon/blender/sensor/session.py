"""A session with the real sensor: its process, the samples that have come, and the reading of this moment."""

from __future__ import annotations

import time
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...run.child import RUNNING, Child
from ...sensing.recording import FIXED
from ...usecases.sensor.traces import Traces
from ...usecases.sensor.watch import Watched

BINS = 600
"""Steps of time across the plot."""
MEAN_S = 0.1
"""The twin and the figures follow the mean of that long: noise goes, a bend of 2 Hz stays."""
ANGLES = ("angle_deg", "angle_low_deg", "angle_high_deg")


@attrs.define(eq=False)
class Reading:
    """The sensor's present values: means of the last moment, in V and degrees.

    light_V: without its dark level; possible: whether the calibration can give such a voltage.
    """

    light_V: float
    angle_deg: float = np.nan
    low_deg: float = np.nan
    high_deg: float = np.nan
    possible: bool = True


@attrs.define(eq=False)
class Guide:
    """A guided sweep: angles to hold in their order, how many were, and until when the present one is."""

    angles: list[float]
    held: int = 0
    until: float = 0.0

    @property
    def holding(self) -> bool:
        """Whether an angle is being held now."""
        return time.monotonic() < self.until

    @property
    def finished(self) -> bool:
        """Whether every angle was held."""
        return self.held == len(self.angles) and not self.holding


@attrs.define(eq=False)
class Session:
    """A unit's session, running or ended, and what of it is shown."""

    child: Child
    watched: Watched
    traces: Traces | None = None
    """Channels and angles over the last seconds; None until the channels are known, or to begin anew."""
    frozen: Traces | None = None
    """What the plot shows while it stands still."""
    ranges: dict[str, tuple[float, float]] = attrs.field(factory=dict)
    reading: Reading | None = None
    guide: Guide | None = None
    trouble: str = ""
    """Why the calibration cannot read this stream."""
    _shown: tuple[Any, ...] = ()
    read_at: float = 0.0

    @property
    def running(self) -> bool:
        """Whether its process is."""
        return self.child.state == RUNNING

    @property
    def state(self) -> str:
        """Latest status: connected, searching, waiting, disconnected, paused or ended."""
        return str(self.watched.status.get("state", "starting"))

    @property
    def fresh(self) -> bool:
        """Whether samples are coming."""
        return self.running and self.watched.starved_s < 1.0

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of what the sensor measures."""
        return self.watched.columns[len(FIXED) :]

    def update(self, calibration: Any, seconds: float) -> bool:
        """Take in the samples that have come; returns whether there is a new status. Never waits."""
        was_running = self.running
        self.child.poll()
        news = self.watched.look() or was_running != self.running
        if self.channels and (self.traces is None or self._shown != (self.channels, calibration)):
            self._shown = self.channels, calibration
            self.traces = Traces(len(self.channels) + len(ANGLES), seconds, BINS)
            self.ranges.clear()
            self.watched.rewind()
        rows = self.watched.fresh()
        if len(rows) and self.traces is not None:
            values = rows[:, len(FIXED) :]
            self.traces.add(rows[:, 0], np.column_stack([values, self._angles(values, calibration)]))
        return news

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
        """Take the mean of the last moment as the reading, with a calibration's angle where there is one."""
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
    # Where it is used: it brings scipy, which a Blender without the wheels lacks.
    from ...sensing.calibration import light_of

    return light_of(calibration, channels, values)
