"""A run that another session of Blender started and that outlives it, watched by its folder.

Its messages are in files, and its lock names its process.
"""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import MuError
from ..files import output_error
from .child import ERRORS, MESSAGES, PATIENCE_S, RUNNING, Child
from .lock import holder
from .progress_estimate import Plan

STARTS_S = 60.0
"""Seconds from its start in which a run may not have locked its folder yet, as it loads the solver."""


class FoundChild(Child):
    """`Child` of a process that another process started."""

    def __init__(self, run: Path, own: Path, plan: Plan = (), started_s: float = 0.0) -> None:
        """The run in a folder. own: folder of its messages; started_s: its start in s since the epoch."""
        super().__init__((), own, {}, plan=plan, waits=True)
        self.run = run
        try:
            self._stream = (own / MESSAGES).open("rb")
        except OSError as error:
            raise output_error(error, own / MESSAGES) from error
        self._began_s = started_s
        self._seen = False
        self.started = time.monotonic() - max(time.time() - started_s, 0.0)
        self.state = RUNNING

    @property
    def pid(self) -> int:
        """Number of the process, 0 if unknown."""
        return holder(self.run) or 0

    def poll(self) -> bool:
        """Read new messages; return True if there were any. Never waits."""
        if self.state != RUNNING:
            return False
        self.seconds = time.monotonic() - self.started
        # Asked first: all messages of an ended run are then there.
        number = holder(self.run)
        new = self._read()
        finished = self.result is not None or self.error is not None
        self._seen = self._seen or number is not None
        if number is None and (finished or self._seen or time.time() - self._began_s > STARTS_S):
            self._end(0)
            return True
        if self._asked is not None and number and time.monotonic() - self._asked > PATIENCE_S:
            self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))
        return new

    def begin(self) -> None:
        """Do nothing: it has been started."""

    def cancel(self) -> None:
        """Ask it to stop; it keeps its finished results."""
        if self.state == RUNNING and self._asked is None:
            self._asked = time.monotonic()
            self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """Kill it at once."""
        if self.state == RUNNING:
            self._asked = time.monotonic()
            self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))
            self._end(0)

    def send(self, words: str) -> None:
        """Do nothing: its standard input is closed."""

    def _signal(self, number: int) -> None:
        pid = holder(self.run)
        if pid:
            with suppress(OSError):
                os.kill(pid, number)

    def _close_input(self) -> None:
        """Do nothing: its standard input is closed."""

    def _without_message(self, status: int) -> dict[str, Any]:
        error = MuError(
            "the process ended without a message while no Blender watched it",
            str(self.folder / ERRORS),
            "run again, it resumes where it stopped",
        )
        return {"what": error.what, "where": error.where, "what_to_do": error.remedy, "status": 1}
