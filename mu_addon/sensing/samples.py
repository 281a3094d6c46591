"""Samples of a serial line: a layout of channels, numbered on across gaps and restarts, and timed."""

from __future__ import annotations

import math
from collections import deque

import attrs
import numpy as np

from ..arrays import Array
from .byte_accounts import Accounts, Reject
from .clock import HostTime
from .numbering import Numbered, Numbering, Row

# Least step of the host's time from sample to sample: more than the last digit of a recording (1e-6 s), since
# steps of exactly that, counted from any start, are written as one value now and then.
_TICK_S = 2e-6


@attrs.frozen
class Layout:
    """Layout of a sample: names of its channels, the unit of their values (or none), size of a count.

    per_count: in `unit`; raw counts of frames are multiplied by it.
    """

    channels: tuple[str, ...]
    unit: str = ""
    per_count: float = 1.0


@attrs.frozen(eq=False)
class Samples:
    """n samples of one layout with c channels, in the order they came.

    host_s (n,): seconds on the host's clock, rising; device_s (n,): the device's time in s, without wraps, or
    nan; sequence (n,): running number without wraps, counted here if the device sends none; values (n, c) in
    the layout's unit.
    """

    layout: Layout
    host_s: Array
    device_s: Array
    sequence: Array
    values: Array

    def __len__(self) -> int:
        return len(self.host_s)


class Timeline:
    """Rows of values in order of arrival, to groups of samples; rows left out go to the accounts."""

    def __init__(self, accounts: Accounts) -> None:
        self.numbering = Numbering()
        self._accounts = accounts
        self._layouts: deque[Layout] = deque()
        self._out: list[tuple[Layout, Numbered]] = []
        self._host = HostTime()
        self._last_host_s = -math.inf

    def take(self, layout: Layout, row: Row) -> None:
        """Add a row of a layout's values."""
        self._layouts.append(layout)
        self._settle(self.numbering.take(row))

    def finish(self) -> None:
        """Settle rows whose number is in doubt, at the end of input."""
        self._settle(self.numbering.finish())

    def restart(self) -> None:
        """Restart numbers and clock, for another format."""
        self._settle(self.numbering.forget())
        self._host.restart()

    def _settle(self, settled: list[Numbered]) -> None:
        for row in self.numbering.left_out:
            self._layouts.pop()
            self._accounts.rejects.append(Reject("repeated", row.raw))
        self.numbering.left_out.clear()
        self._out += [(self._layouts.popleft(), numbered) for numbered in settled]

    def groups(self) -> list[Samples]:
        """Samples settled since the last call, a group for each run with one layout."""
        out, self._out = self._out, []
        groups: list[tuple[Layout, list[Numbered]]] = []
        for layout, numbered in out:
            if not groups or groups[-1][0] != layout:
                groups.append((layout, []))
            groups[-1][1].append(numbered)
        tally = self.numbering.tally
        counted = self._accounts.counters
        counted.lost, counted.repeated, counted.restarts = tally.lost, tally.repeated, tally.restarts
        counted.misnumbered = tally.misnumbered
        return [self._timed(layout, rows) for layout, rows in groups]

    def _timed(self, layout: Layout, rows: list[Numbered]) -> Samples:
        """Numbered samples with the device's clock converted to the host's."""
        self._accounts.counters.samples += len(rows)
        if any(numbered.clock_restarted for numbered in rows):
            self._host.restart()
        sequence = np.array([numbered.sequence for numbered in rows], dtype=np.int64)
        device = np.array([numbered.device_s for numbered in rows])
        host = np.array([numbered.row.at for numbered in rows])
        timed = np.isfinite(device)
        if timed.any():
            self._host.learn(float(device[timed][-1]), float(host[timed][-1]))
            host[timed] = self._host.of(device[timed])
        # A mapping that has learned better may be a little behind what was told before.
        rising = _TICK_S * np.arange(len(rows))
        host = np.maximum.accumulate(np.maximum(host - rising, self._last_host_s)) + rising
        self._last_host_s = float(host[-1]) + _TICK_S
        table = np.array([numbered.row.values for numbered in rows], dtype=float)
        return Samples(layout, host, device, sequence, table.reshape(len(rows), len(layout.channels)))
