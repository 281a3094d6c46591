"""A run in a separate process that writes one JSON message a line; no thread, no bpy.

The child writes to files and `poll` reads new lines: nothing blocks, no pipe fills up, and the messages
survive the parent. Blender's panels and sweeps watch their runs this way.
"""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import MuError
from ..files import make_folder, output_error
from .processes import slowed_by_load
from .progress_estimate import Plan, ProgressEstimate

PATIENCE_S = 20.0
"""Seconds that a child may take to save its work after it was asked to stop, before it is killed."""
MESSAGES, ERRORS = "messages.ndjson", "stderr.txt"
WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"


class Child:
    """One process and its messages; `state` is waiting, running, done, failed or cancelled.

    progress: its latest such message; estimate: of the whole run; warnings: texts; result, error: its last
    message, one of them.
    """

    def __init__(
        self,
        command: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        ends_with_parent: bool = False,
        plan: Plan = (),
        waits: bool = False,
    ) -> None:
        """Start `command`, with its output in `folder`: messages.ndjson and stderr.txt. Raises MuError.

        plan: its expected stages; waits: leave the start to `begin`. ends_with_parent: keep the child's
        standard input open, so that `processes.end_with_input` detects the end of this process.
        """
        self.folder = folder
        self.state = WAITING
        self.estimate = ProgressEstimate(plan, slowed=slowed_by_load())
        self.progress: dict[str, Any] = {}
        self.warnings: list[str] = []
        self.result: dict[str, Any] | None = None
        self.error: dict[str, Any] | None = None
        self.started = time.monotonic()
        self.seconds = 0.0
        self.garbage = 0
        self._asked: float | None = None
        self._rest = b""
        self._line = list(command), dict(environment), ends_with_parent
        if not waits:
            self.begin()

    def begin(self) -> None:
        """Start the process of a waiting child. Raises MuError."""
        command, environment, ends_with_parent = self._line
        folder = self.folder
        make_folder(folder)
        self.started = time.monotonic()
        try:
            out, err = (folder / MESSAGES).open("wb"), (folder / ERRORS).open("wb")
            self._stream = (folder / MESSAGES).open("rb")
        except OSError as error:
            raise output_error(error, folder / MESSAGES) from error
        with out, err:
            try:
                self._process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE if ends_with_parent else subprocess.DEVNULL,
                    stdout=out,
                    stderr=err,
                    env=environment,
                    start_new_session=True,
                )
            except OSError as error:
                self._stream.close()
                raise MuError(
                    f"the process cannot start: {error.strerror or error}",
                    str(command[0]),
                    "reinstall mu_addon; in Blender, the extension built for this Blender and system",
                ) from error
        self.state = RUNNING

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def stopping(self) -> bool:
        """True if it was asked to stop and has not stopped yet."""
        return self.state == RUNNING and self._asked is not None

    def poll(self) -> bool:
        """Read new messages; return True if there were any. Never waits."""
        if self.state != RUNNING:
            return False
        self.seconds = time.monotonic() - self.started
        # Asked first: all messages of an ended child are then there.
        status = self._process.poll()
        new = self._read()
        if self._asked is not None and status is None and time.monotonic() - self._asked > PATIENCE_S:
            self._process.kill()
        if status is not None:
            self._end(status)
            return True
        return new

    def cancel(self) -> None:
        """Ask it to stop; it keeps its finished results. It is killed later if it does not respond."""
        if self.state == WAITING:
            self.state = CANCELLED
        if self.state == RUNNING and self._asked is None:
            self._asked = time.monotonic()
            self._process.terminate()

    def send(self, words: str) -> None:
        """Write a line to its standard input, held open by `ends_with_parent`; no effect after its end."""
        if self.state == RUNNING and self._process.stdin is not None:
            # It has just ended: the next poll reports it.
            with suppress(OSError):
                self._process.stdin.write(f"{words}\n".encode())
                self._process.stdin.flush()

    def kill(self) -> None:
        """Kill it at once."""
        if self.state == WAITING:
            self.state = CANCELLED
        if self.state == RUNNING:
            self._process.kill()
            self._end(self._process.wait())

    def _read(self) -> bool:
        added = self._stream.read()
        *lines, self._rest = (self._rest + added).split(b"\n")
        for line in lines:
            self._read_message(line)
        return bool(added)

    def _read_message(self, line: bytes) -> None:
        if not line.strip():
            return
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            message = None
        kind = message.get("type") if isinstance(message, dict) else None
        if kind == "progress":
            self.progress = message
            self.estimate.tell(message)
        elif kind == "plan":
            # It knows what its folder has already.
            self.estimate = ProgressEstimate(message["stages"], slowed=message["slowed"])
        elif kind == "warning":
            self.warnings.append(str(message.get("what", "")))
        elif kind == "result":
            self.result = message
        elif kind == "error":
            self.error = message
        elif kind != "finding":
            # Blender and libraries write to standard output, too: that is in the file, and no reason to stop.
            self.garbage += 1

    def _end(self, status: int) -> None:
        self._read()
        self._stream.close()
        self._close_input()
        if self._asked is not None:
            self.state = CANCELLED
        elif self.result is not None and status == 0:
            self.state = DONE
        else:
            self.state = FAILED
            if self.error is None:
                self.error = self._without_message(status)

    def _close_input(self) -> None:
        if self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()

    def _without_message(self, status: int) -> dict[str, Any]:
        tail = " / ".join(_last_lines(self.folder / ERRORS, 3)) or "it left no message"
        return {
            "what": f"the process ended without a message ({_context(status)}): {tail}",
            "where": str(self.folder / ERRORS),
            "what_to_do": "open the log; run the command again, it resumes where it stopped. If memory was "
            "short, close other programs first",
            "status": status,
        }


def _context(status: int) -> str:
    if status >= 0:
        return f"exit status {status}"
    try:
        return f"ended by {signal.Signals(-status).name}"
    except ValueError:
        return f"ended by signal {-status}"


def _last_lines(path: Path, count: int) -> list[str]:
    try:
        text = path.read_bytes()[-4000:].decode("utf-8", "replace")
    except OSError:
        return []
    return [line.strip() for line in text.splitlines() if line.strip()][-count:]
