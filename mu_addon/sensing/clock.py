"""Clocks: counters unwrapped, and a device's time converted to the host's."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..arrays import Array


class UnwrappedCounter:
    """Readings of a counter that restarts at `modulus` (None: never), as one that does not restart.

    A reading less than half the modulus ahead of the last one is later. Any other came out of order, or the
    counter was set back. last: the last accepted reading, set by the caller.
    """

    def __init__(self, modulus: int | None) -> None:
        self.modulus = modulus
        self.last: float | None = None

    def ahead(self, reading: float, expected: float = 0.0) -> float:
        """Counts from the last reading to this one, negative if behind; 0 where there is no last one.

        expected: how many counts should have passed since, by another clock; only whole turns are taken from
        it.
        """
        if self.last is None:
            return 0.0
        if self.modulus is None:
            return reading - self.last
        turn = self.modulus
        diff = (reading - self.last) % turn
        if expected > turn / 2:
            return float(diff + turn * max(0, round((expected - diff) / turn)))
        return float(diff if diff < turn / 2 else diff - turn)


class HostTime:
    """Conversion of a device's time to the host's, in s, by the messages with the least delay.

    A message is never early: host minus device time at its arrival is their offset plus a delay. The least
    value of each second is near the offset, which drifts linearly because the oscillators differ. A line is
    fitted to the last half minute and lowered until no message is early.
    """

    bin_s = 1.0
    bins = 30

    def __init__(self) -> None:
        self._least: deque[tuple[float, float]] = deque(maxlen=self.bins)
        self._slope, self._offset, self._origin = 0.0, 0.0, 0.0

    def learn(self, device_s: float, host_s: float) -> None:
        """Add one arrival: device time of the newest sample of a message, and host time, both in s."""
        delta = host_s - device_s
        if self._least and device_s - self._least[-1][0] < self.bin_s:
            if delta >= self._least[-1][1]:
                return
            self._least[-1] = (self._least[-1][0], delta)
        else:
            self._least.append((device_s, delta))
        t, d = np.array(self._least).T
        self._origin = float(t[-1])
        self._slope = 0.0
        if len(t) >= 5:
            self._slope = float(np.polyfit(t - t[-1], d, 1)[0])
        self._offset = float((d - self._slope * (t - self._origin)).min())

    def of(self, device_s: Array) -> Array:
        """Host times (n,) in s of device times (n,) in s."""
        return device_s + self._offset + self._slope * (device_s - self._origin)

    def restart(self) -> None:
        """Drop all arrivals: the device's clock was set back."""
        self._least.clear()
