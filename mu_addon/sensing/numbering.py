"""Running numbers and device clocks unwrapped: gaps, repeats, wraps, resets and glitches distinguished.

A number one above the last is accepted at once. Any other is judged with the next sample's: the count
continues from it after a gap, a wrap or a restart, but not after a glitch. The only sample left out is one
equal in number, clock and values to one shortly before.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import attrs

from .clock import UnwrappedCounter


class Row(NamedTuple):
    """A sample as it was read: number and clock as sent (None if absent), values, arrival time, bytes."""

    number: float | None
    """Running number, finite."""
    ticks: float | None
    """Device's clock, finite."""
    values: list[float]
    at: float
    """Host time of its arrival in s."""
    raw: bytes = b""


class Numbered(NamedTuple):
    """A sample with its running number and device time in s (or nan), both without wraps.

    clock_restarted: True if the device's clock restarted at this sample.
    """

    row: Row
    sequence: int
    device_s: float
    clock_restarted: bool = False


@attrs.define
class Tally:
    """Counts by the samples' numbers: missing, repeated and misnumbered samples, and restarts."""

    lost: int = 0
    repeated: int = 0
    restarts: int = 0
    misnumbered: int = 0


# A repeat comes within so many samples, and no more than so many at once; else it is a new run.
_RECENT, _MOST_REPEATS = 32, 20
# A jump of more samples than this must be followed by a number this near, or by several as odd.
_FAR, _NEAR, _ODD = 1000, 16, 3
# No gap is longer, in samples.
_LONGEST_GAP = 1 << 32
# The device's clock may be ahead of the host's by what lay in buffers.
_BUFFERED_S = 2.0
_MODULI = sorted([1 << k for k in range(4, 17)] + [1 << 24, 1 << 31, 1 << 32] + [10**k for k in range(1, 10)])

_ON, _GLITCH, _RUN = "on", "glitch", "run"


class Numbering:
    """Numbers rows in the order they came; holds one back while its number or clock is in doubt.

    tick_s: seconds of one tick of the device's clock. left_out: repeated rows. tally: counts of faults.
    """

    def __init__(self) -> None:
        self.tally = Tally()
        self.tick_s = 1.0
        self.clock = UnwrappedCounter(None)
        self.numbers = UnwrappedCounter(None)
        self.left_out: list[Row] = []
        """Repeats, for the caller to keep and to clear."""
        self._sequence: int | None = None
        self._device_s = 0.0
        self._at = math.inf
        self._held: Row | None = None
        self._odd = 0
        self._repeats = 0
        self._recent: deque[tuple[float | None, float | None, list[float]]] = deque(maxlen=_RECENT)

    def take(self, row: Row) -> list[Numbered]:
        """Accept a sample; return the settled ones: none, itself, or also one that was held back."""
        settled = []
        if self._repeat(row):
            self._repeats += 1
            self.tally.repeated += 1
            self.left_out.append(row)
            return []
        if self._held is not None:
            settled.append(self._settle(self._held, row))
            self._held = None
        if self._fits(row):
            settled.append(self._accept(row, self._ahead(row), self._later(row)))
        else:
            self._held = row
        return settled

    def finish(self) -> list[Numbered]:
        """The sample that was held back, if any, judged without one that follows it."""
        held, self._held = self._held, None
        return [] if held is None else [self._settle(held, None)]

    def forget(self) -> list[Numbered]:
        """Settle the sample that was held back and reset numbers and clock: another format begins."""
        settled = self.finish()
        self.numbers, self.clock = UnwrappedCounter(None), UnwrappedCounter(None)
        self._odd = 0
        self._recent.clear()
        return settled

    def _ahead(self, row: Row) -> float | None:
        """Samples from the last number to this one's, negative if behind; None where one has no number."""
        if row.number is None or self.numbers.last is None:
            return None
        if self.numbers.modulus is not None and not 0 <= row.number < self.numbers.modulus:
            self.numbers.modulus = None
        return self.numbers.ahead(row.number)

    def _later(self, row: Row) -> float | None:
        """Ticks from the last clock reading to this one, negative if behind."""
        if row.ticks is None or self.clock.last is None:
            return None
        return self.clock.ahead(row.ticks, self._passed_s(row) / self.tick_s)

    def _passed_s(self, row: Row) -> float:
        return max(0.0, row.at - self._at) if math.isfinite(self._at) else 0.0

    def _fits(self, row: Row) -> bool:
        ahead, later = self._ahead(row), self._later(row)
        return (ahead is None or ahead in (1.0, 1.0 + self._odd)) and self._clock_fits(row, later)

    def _clock_fits(self, row: Row, later: float | None) -> bool:
        return later is None or 0.0 <= later * self.tick_s <= self._passed_s(row) + _BUFFERED_S

    def _repeat(self, row: Row) -> bool:
        if self._repeats >= _MOST_REPEATS:
            return False
        ahead, later = self._ahead(row), self._later(row)
        if ahead is None and later is None:
            return False
        again = ahead <= 0 if ahead is not None else (later or 0.0) < 0
        # Numbers that begin again at their beginning are a device that was reset.
        anew = ahead is not None and ahead < 0 and row.number in (0, 1)
        return again and not anew and (row.number, row.ticks, row.values) in self._recent

    def _settle(self, row: Row, following: Row | None) -> Numbered:
        """Judge a sample that was held back by the one that followed it, if one did."""
        ahead, later = self._ahead(row), self._later(row)
        after = None if following is None else self._ahead(following)
        number = _ON if ahead in (None, 1.0, 1.0 + self._odd) else self._judged(ahead or 0.0, after)
        clock = _ON
        if not self._clock_fits(row, later):
            clock = _clock_judged(later or 0.0, None if following is None else self._later(following))
        if number == _RUN and clock != _RUN:
            modulus = self._wrapped(row)
            if modulus is not None:
                self.numbers.modulus = modulus
                number, ahead = _ON, self.numbers.ahead(row.number or 0.0)
        if _RUN in (number, clock):
            self.tally.restarts += 1
            number, ahead, self._odd = _ON, None if row.number is None else 1.0, 0
        if _GLITCH in (number, clock):
            self.tally.misnumbered += 1
        if clock == _RUN:
            later = self._passed_s(row) / self.tick_s
        numbered = self._accept(row, None if number == _GLITCH else ahead, later, clock == _GLITCH)
        return numbered._replace(clock_restarted=clock == _RUN)

    def _judged(self, ahead: float, after: float | None) -> str:
        """Judgement of a number that is not one above the last; after: the next one's lead over the last."""
        stubborn = self._odd >= _ODD
        if ahead > 0:
            goes_on = after is None or (after > ahead and (ahead <= _FAR or after - ahead <= _NEAR))
            return _ON if (goes_on or stubborn) and ahead < _LONGEST_GAP else _GLITCH
        if ahead < 0 and (stubborn or (after is not None and ahead < after <= 0)):
            return _RUN
        return _GLITCH

    def _wrapped(self, row: Row) -> int | None:
        """Count at which the device's number wrapped at this row, if it seems so."""
        last, number = self.numbers.last, row.number
        if last is None or number is None or number < 0 or self.numbers.modulus is not None:
            return None
        fitting = (m for m in _MODULI if last < m and 1 <= number + m - last <= max(1, m // 16) <= m)
        found = next(fitting, None)
        return found if found is not None and number <= _NEAR and found - last <= _NEAR else None

    def _accept(self, row: Row, ahead: float | None, later: float | None, glitch: bool = False) -> Numbered:
        """Accept a sample; ahead: samples since the last number, None to count on without using its own."""
        if self._sequence is None:
            self._sequence = 0 if row.number is None else int(row.number)
            self.numbers.last = row.number
        elif ahead is None:
            self._sequence += 1
            if self.numbers.last is None:
                self.numbers.last = row.number
            else:
                self._odd += 1
        else:
            step = max(1, int(ahead) - self._odd)
            self.tally.lost += step - 1
            self._sequence += step
            self.numbers.last, self._odd = row.number, 0
        device_s = math.nan
        if row.ticks is not None and not glitch:
            first = self.clock.last is None
            self._device_s = (
                row.ticks * self.tick_s if first else self._device_s + (later or 0.0) * self.tick_s
            )
            self.clock.last = row.ticks
            device_s = self._device_s
        self._at, self._repeats = row.at, 0
        self._recent.append((row.number, row.ticks, row.values))
        return Numbered(row, self._sequence, device_s)


def _clock_judged(later: float, after: float | None) -> str:
    """Judge a clock that is set back or leaps, as a number, by the next reading."""
    if later >= 0:
        return _ON if after is None or after >= later else _GLITCH
    return _RUN if after is not None and later <= after < 0 else _GLITCH
