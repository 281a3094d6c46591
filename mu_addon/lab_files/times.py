"""Time of each row: from an interval, a clock, or a counter that begins again."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..measured.kinds import KINDS
from .proposal import Proposal

# Seconds or days since 1970 or 1900 are no time of a test.
_LONGEST_TEST_S = 1e8
# Bits of counters that begin again, seconds of their ticks, and usual steps across at most.
_BITS, _TICKS_S, _STEPS = (16, 31, 32), (1.0, 1e-3, 1e-6), 5.0


def with_interval(draft: Proposal) -> Proposal:
    """A time made from an interval, if the file has none; asked for where the kind needs one."""
    if "time_s" in draft.columns:
        return draft
    interval = draft.positive("interval_s")
    if interval is not None:
        time = interval * np.arange(len(draft.rows), dtype=float)
        return draft.with_column("time_s", time, f"rows, {interval:g} s apart")
    if KINDS[draft.kind].timed:
        words = f"{draft.kind} needs a time, and there is none: seconds from row to row?"
        return draft.asked("interval_s", words)
    return draft


def with_rising_time(draft: Proposal) -> Proposal:
    """Count on a counter that begins again; leave out a constant time, if allowed.

    Raises InputError for a time that runs backward otherwise.
    """
    if "time_s" not in draft.columns:
        return draft
    time = draft.columns["time_s"]
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        bits, turn = _turn(time, back)
        line = draft.lines[back[0] + 1]
        if not turn:
            raise InputError(
                "the time runs backward",
                f"{draft.file}, line {line}",
                "divide the file where a new record begins; a counter of 16, 31 or 32 bits that begins again "
                "is counted on where no rows are missing",
            )
        time = time + turn * np.concatenate([[0], np.cumsum(np.diff(time) < 0)])
        draft = draft.with_column("time_s", time - time[0]).concluding(
            f"time_s: its counter begins again at 2^{bits} in line {line}; counted on, from the first row"
        )
    elif time[0] > _LONGEST_TEST_S:
        draft = draft.with_column("time_s", time - time[0]).concluding(
            f"time_s: minus its first value, {time[0]:.10g} s, of a calendar"
        )
    still = np.flatnonzero(np.diff(draft.columns["time_s"]) == 0)
    if len(still) and not KINDS[draft.kind].timed:
        line = draft.lines[still[0] + 1]
        return draft.without_column(
            "time_s", f"time does not increase at line {line}, and {draft.kind} does not need it"
        )
    return draft


def _turn(time: Array, back: Array) -> tuple[int, float]:
    """Bits and seconds of the counter that begins again after the rows `back`, 0 where none fits."""
    step = np.diff(time)
    usual = float(np.median(step[step > 0])) if (step > 0).any() else 0.0
    for bits in _BITS:
        for tick in _TICKS_S:
            turn = 2.0**bits * tick
            across = step[back] + turn
            if time.min() >= 0 and time.max() <= turn and ((across > 0) & (across <= _STEPS * usual)).all():
                return bits, turn
    return 0, 0.0
