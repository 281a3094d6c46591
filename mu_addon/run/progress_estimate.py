"""Progress and remaining time of a whole run, from a plan of its stages and its messages."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

Plan = Sequence[tuple[str, float]]
"""Stages of a run in order, with the expected seconds of each."""
LONGER = 1.2
"""Factor by which an estimate must grow before it is reported, with the reason; else the old one counts down.
"""
SLACK_S = 2.0
MOST_BY_CLOCK = 0.95
"""Largest share of a stage taken as done by the clock alone, as it has not ended."""
SURE = 0.1
"""Share of a stage, or of all, from which it alone determines the rest: first steps may be far slower."""
OVERDUE = 0.2
"""Share of its time assumed to remain for a stage that takes longer than planned."""
UNPLANNED_S = 20.0
"""Seconds assumed for a stage that no plan has."""
AT_ONCE_S = 1.0
"""A share reported within this time of a stage's start came from the cache and is left out of the pace."""
RECENT = 1.0 / 3.0
"""Share of a stage's time that is left out of its pace: its first steps may be other work than its last."""
SKIPPED = 0.1
"""A stage that took less than this share of its plan came from the cache and is left out of the pace."""
SHOWN_S = 7.0
"""Least seconds for which a reason is shown: a terminal's lines are almost that far apart."""
PACES = 0.2, 20.0
"""Least and largest ratio of a run's time to its plan that is believed."""
LOADED, LOADED_S = 0.2, 1.5
"""Largest share of a stage's seconds, and largest seconds, in which its finished work is loaded."""


class Pace:
    """Pace of a stage, from the shares that it reported in the later part of its time."""

    def __init__(self) -> None:
        self._shares = deque([(0.0, 0.0)])

    def tell(self, elapsed: float, share: float) -> None:
        """Process a share (0..1) known `elapsed` s after the stage's start."""
        shares = self._shares
        if elapsed < AT_ONCE_S:
            shares.clear()
        shares.append((elapsed, share))
        while len(shares) > 2 and shares[1][0] <= RECENT * elapsed:
            shares.popleft()

    def left(self, elapsed: float) -> float | None:
        """Seconds left `elapsed` s after the stage's start, less those since the last share; None if unknown.

        A stage that is overdue by that is assumed to take a fifth of its time still.
        """
        (began, before), (at, share) = self._shares[0], self._shares[-1]
        if share <= before:
            return None
        rest = (1.0 - share) * (at - began) / (share - before)
        return max(rest - (elapsed - at), min(0.2 * elapsed, rest / 2.0))


class ProgressEstimate:
    """Progress of the whole run; `tell` it each progress message.

    fraction: done of the whole, 0..1, which never shrinks; number and count: of the present stage and of all;
    why: why the time left grew, while it is more than before, or "". Without a plan only the stages so far
    are counted, and the time left is that of the current stage. slowed: factor on the plan's seconds by other
    work, until the run's own pace is known.
    """

    def __init__(
        self, plan: Plan = (), clock: Callable[[], float] = time.monotonic, slowed: float = 1.0
    ) -> None:
        self._clock = clock
        self._slowed = slowed
        self._expected = dict(plan)
        self._planned = bool(plan)
        self._taken: dict[str, float] = {}
        self._stage = ""
        self._share = self._kept = 0.0
        self._waits_for = ""
        self._by_itself = False
        self._spent = 0.0
        self._own_left: float | None = None
        self._left: float | None = None
        self._at = self._began = clock()
        self.fraction = 0.0
        self.why = ""
        self._grown_from = self._grown_at = 0.0

    @property
    def number(self) -> int:
        """Number of the present stage, from 1; 0 before the first."""
        return list(self._expected).index(self._stage) + 1 if self._stage else 0

    @property
    def count(self) -> int:
        """Number of stages, 0 without a plan."""
        return len(self._expected) if self._planned else 0

    @property
    def seconds_left(self) -> float | None:
        """Seconds until the end, counted down since the last message; None if unknown."""
        return None if self._left is None else max(self._left - (self._clock() - self._at), 0.0)

    def tell(self, message: Mapping[str, Any]) -> None:
        """Process a progress message, see `progress`."""
        stage, share = str(message.get("stage", "")), message.get("fraction")
        self._waits_for = str(message.get("waits_for", ""))
        whole = next((name for name in self._expected if stage.startswith(f"{name}: ")), "")
        if stage not in self._expected and whole:
            self._tell_part(whole, message)
            return
        added = ""
        if stage not in self._expected:
            added = stage
            self._add(stage)
        # Skipped stages were in the cache, or not asked for.
        if stage != self._stage:
            self._stage, self._kept = stage, 0.0
        seconds, left = message.get("seconds"), message.get("seconds_left")
        self._spent = float(seconds) if isinstance(seconds, int | float) else 0.0
        self._own_left = float(left) if isinstance(left, int | float) else None
        self._share = float(share) if isinstance(share, int | float) else 0.0
        self._by_itself = self._share > 0.0
        if self._spent < AT_ONCE_S:
            self._kept = self._share
        if self._planned and self._share < SURE:
            # At the pace of what is done, as the stages to come, else it would jump where one begins.
            expected = self._expected[stage] * self._pace()
            # The end of an overdue last stage is unknown, and an ever growing time is useless.
            last = stage == [*self._expected][-1]
            by_plan = max(expected - self._spent, 0.0 if last else OVERDUE * self._spent)
            if not self._share:
                # By the clock, as long as the stage itself says nothing.
                self._share = min(self._spent / expected, MOST_BY_CLOCK) if expected > 0.0 else 0.0
                self._own_left = by_plan
            elif self._own_left is not None:
                weight = (self._share / SURE) ** 2
                self._own_left = weight * self._own_left + (1.0 - weight) * by_plan
        if message.get("state") == "end":
            self._taken[stage] = self._spent
            self._share, self._own_left, self._by_itself = 1.0, 0.0, False
            self.why = self.why.replace(f"{stage} takes", f"{stage} took")
        self._estimate(added)

    def _tell_part(self, stage: str, message: Mapping[str, Any]) -> None:
        """Process a message of a planned stage's part: "wall 0.9: Model A".

        The stage's share comes from its own plan (`part` of the message), or from the clock if it has none.
        """
        now = self._clock()
        if stage != self._stage:
            if self._stage:
                self._taken.setdefault(self._stage, now - self._began)
            self._stage, self._began, self._kept = stage, now, 0.0
        self._spent = now - self._began
        share, left = (message.get(key) for key in ("part", "part_seconds_left"))
        self._by_itself = isinstance(share, int | float)
        if isinstance(share, int | float):
            self._share, self._own_left = float(share), float(left) if isinstance(left, int | float) else None
        else:
            left = message.get("seconds_left")
            self._share = min(self._spent / self._expected[stage], MOST_BY_CLOCK)
            left = float(left) if isinstance(left, int | float) else 0.0
            self._own_left = max(self._expected[stage] - self._spent, left)
        self._estimate("")

    def _add(self, stage: str) -> None:
        """Insert an unplanned stage after the present one."""
        items = list(self._expected.items())
        items.insert(self.number, (stage, UNPLANNED_S))
        self._expected = dict(items)

    def _estimate(self, added: str) -> None:
        names = list(self._expected)
        here = names.index(self._stage)
        before = sum(self._expected[name] for name in names[:here])
        whole = sum(self._expected.values())
        done = before + self._share * self._expected[self._stage]
        # An unfinished stage is not complete, however short the rest is expected to be.
        self.fraction = max(self.fraction, min(done / whole if whole else 0.0, 0.999))
        own = self._own_left
        if own is None:
            own = max((1.0 - self._share) * self._expected[self._stage] * self._pace(), 0.0)
        # One that ended before this one came again is not to come.
        rest = sum(self._expected[name] for name in names[here + 1 :] if name not in self._taken)
        rest *= self._pace()
        if self._planned:
            self._set_left(own + rest, added)
        elif self._own_left is not None:
            self._set_left(own, "")

    def _pace(self) -> float:
        """Ratio of time taken to time planned, within plausible bounds.

        Four seconds predict little of ten minutes: less than SURE of the whole is weighted by its share of
        SURE.
        """
        ran = [(s, self._expected[name]) for name, s in self._taken.items()]
        share = self._share - self._kept
        if self._by_itself and share >= SURE:
            ran.append((self._spent, share * self._expected[self._stage]))
        ran = [(s, expected) for s, expected in ran if s >= SKIPPED * expected]
        expected = sum(e for _, e in ran)
        if expected <= 1.0:
            return self._slowed
        factor = min(max(sum(s for s, _ in ran) / expected, PACES[0]), PACES[1])
        weight = min(expected / (SURE * sum(self._expected.values())), 1.0)
        return self._slowed + weight * (factor - self._slowed)

    def _set_left(self, left: float, added: str) -> None:
        """Set the time left: it shrinks, or grows by so much that the reason is reported."""
        shown = self.seconds_left
        if shown is not None and left > shown:
            if left <= LONGER * shown + SLACK_S:
                self._forget_reason(shown)
                return
            waited = self._waits_for or self._stage
            takes = "took" if waited in self._taken else "takes"
            self.why = f"{added} was added" if added else f"{waited} {takes} longer than expected"
            self._grown_from, self._grown_at = shown, self._clock()
        else:
            self._forget_reason(left)
        self._left, self._at = left, self._clock()

    def _forget_reason(self, left: float) -> None:
        """Clear the reason why the time left grew once the time left is about its former value."""
        shown_long = self._clock() - self._grown_at >= SHOWN_S
        if shown_long and left <= LONGER * self._grown_from + SLACK_S:
            self.why = ""
