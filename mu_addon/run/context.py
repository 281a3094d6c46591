"""End of a run: complete, partial or interrupted, with a message, an exit status and a summary.json."""

from __future__ import annotations

import errno
import signal
import sys
import threading
import time
import traceback
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

import attrs

from ..errors import MuError
from ..files import output_error
from ..reading import file_bytes
from .lock import FolderLock
from .progress import Message, Progress, log_file
from .summary import SUMMARY, ended_early, replace_summary, says_running, write_running
from .supervisor import INTERRUPTED, TERMINATED

DONE, UNEXPECTED = 0, 70
STOPPED = "<!-- of a run that stopped early -->"
"""Last line of a report written on a stop, which the run's next start therefore removes."""
# Messages of libraries without memory, in other errors than MemoryError: Warp, the loader, C++.
_REFUSED = ("Failed to allocate", "failed to map segment", "Cannot allocate memory", "bad_alloc")
# Errors of a disk on writing.
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
KEEP_EVERY_S = 2.0


class _Interrupted(MuError):
    """The user asked the run to stop, by Ctrl-C."""

    status = INTERRUPTED


class _Terminated(MuError):
    """The parent process asked the run to stop, by SIGTERM."""

    status = TERMINATED


class _Unexpected(MuError):
    """A fault of this program."""

    status = UNEXPECTED


@attrs.define
class RunContext:
    """Outcome of a run: its exit status, and the `summary` that its body fills and its folder keeps.

    report: writes the report of the results so far; its argument is the reason of an early stop, else "".
    short_report: writes a report quickly from a folder, with the reason of a requested stop. wants_report:
    False to write no report. hurried: the user or the parent process waits for the run to stop.
    console_summary: makes the last lines at a terminal from the summary. repeats: it may end at once where
    nothing has changed (`run.unchanged`).
    """

    progress: Progress
    folder: Path | None = None
    summary: dict[str, Any] = attrs.field(factory=dict)
    status: int = DONE
    report: Callable[[str], None] | None = None
    short_report: Callable[[Path, str], None] | None = None
    wants_report: bool = True
    hurried: bool = False
    console_summary: Callable[[dict[str, Any]], list[str]] = lambda summary: []
    repeats: bool = False
    _lock: FolderLock | None = None
    _kept_s: float = 0.0

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of each stage, of this run and of those before it that it continues."""
        return {**self.summary.get("seconds", {}), **self.progress.seconds}

    def write_report(self, stopped: str = "") -> None:
        """Write the report, if it is wanted. stopped: reason of an early stop."""
        if self.report is not None and self.wants_report:
            self.report(stopped)

    def lock_folder(self, folder: Path) -> None:
        """Keep other processes out of `folder` until the run ends. Raises InUseError and OutputError."""
        if self._lock is not None and self._lock.path.parent == folder:
            return
        self.unlock()
        self._lock = FolderLock(folder)
        if not self._lock.held:
            self.progress.warning(
                "this disk does not support file locks, so a second run in the same folder is not prevented",
                str(folder),
                "do not start another run with the same folder",
            )
        elif says_running(folder / SUMMARY):
            # Nobody holds the lock, so that run is gone, and could not report it.
            self.progress.warning(
                "the last run in this folder was interrupted: it was killed, or the computer stopped",
                str(folder),
                "nothing: this run continues from its finished stages; log.ndjson shows the last one",
            )

    def unlock(self) -> None:
        """Release the folder."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def open_folder(self, folder: Path) -> Path:
        """Make `folder` the run's: locked, with log.ndjson, and "running" in summary.json until the end.

        A run that was killed or replaced is therefore never shown as complete. The summary is padded with
        blanks to RESERVED bytes, which the last summary may use. Raises InUseError and OutputError.
        """
        self.lock_folder(folder)
        self.progress.sinks.append(log_file(folder / "log.ndjson"))
        report = folder / "report.html"
        with suppress(OSError):
            if file_bytes(report).rstrip().endswith(STOPPED.encode()):
                report.unlink()
        self.folder = folder
        self._write_running()
        # Without a circle of references the lock goes with the context.
        own = weakref.WeakMethod(self._keep_found)

        def keep(message: Message) -> None:
            found = own()
            if found is not None:
                found(message)

        self.progress.sinks.append(keep)
        return folder

    def _write_running(self) -> None:
        write_running(self.folder / SUMMARY, self.summary)  # type: ignore[operator]

    def _keep_found(self, message: Message) -> None:
        """Write results to summary.json between stages and every few seconds, so that a kill loses none."""
        if message.get("type") != "progress" or message.get("beat"):
            return
        now = time.monotonic()
        if message["state"] != "run" or now - self._kept_s > KEEP_EVERY_S:
            self._kept_s = now
            if seconds := self.seconds:
                self.summary["seconds"] = seconds
            self._write_running()


@contextmanager
def run_to_end(progress: Progress) -> Iterator[RunContext]:
    """Run the body; anything that stops it becomes a message and `RunContext.status`, never a traceback.

    A body that ends well leaves summary.json with "status": "complete". Any other leaves the files it has
    written, and summary.json with the reason and "status": "partial", after SIGTERM "cancelled". Exit status:
    0, a MuError's own, 130 after Ctrl-C, 143 after SIGTERM, 70 for a fault of this program, whose traceback
    goes to log.ndjson.
    """
    context = RunContext(progress)
    # Blender replaces Python's handler of Ctrl-C, and leaves SIGTERM to kill the process where it stands.
    with _signals_raise() as asked:
        try:
            yield context
            _write_summary(context, {"status": "complete"})
            progress.result({"folder": context.folder, "summary": context.summary})
        except KeyboardInterrupt:
            _stop(context, asked_to_stop(signal.SIGINT, context.folder))
        except Exception as error:  # noqa: BLE001 - the last resort: told, logged and turned into a status
            # A library that Ctrl-C meets while it is loaded makes an ImportError of it.
            _stop(
                context, asked_to_stop(signal.SIGINT, context.folder) if asked else _failure(context, error)
            )
        finally:
            context.unlock()


def asked_to_stop(number: int, folder: Path | None) -> MuError:
    """Error for a run that was asked to stop by a signal, SIGINT or SIGTERM."""
    where = f"finished results are in {folder}" if folder else ""
    if number == signal.SIGTERM:
        return _Terminated("cancelled", where, "run it again: it continues from there")
    return _Interrupted("stopped by Ctrl-C", where, "run it again: it continues from there" if folder else "")


def _failure(context: RunContext, error: Exception) -> MuError:
    """Error that stopped a run, as a MuError; the stack of a fault of this program goes to log.ndjson."""
    if isinstance(error, _Terminated):
        return asked_to_stop(signal.SIGTERM, context.folder)
    if isinstance(error, MuError):
        return error
    if isinstance(error, ModuleNotFoundError):
        what = f"the package {error.name} is not installed"
        return MuError(what, sys.executable, "install the packages that README.md names")
    if isinstance(error, MemoryError) or any(words in str(error) for words in _REFUSED):
        where = f"finished results are in {context.folder}" if context.folder else ""
        remedy = "use a coarser mesh, fewer workers or a machine with more memory"
        return MuError("out of memory", where, remedy)
    if isinstance(error, OSError) and error.errno in _DISK:
        # From a library that prints by itself.
        return output_error(error, Path(error.filename or context.folder or "a file"))
    remedy = "report it"
    if context.folder is not None:
        remedy = "report it with log.ndjson, which holds the details"
        with suppress(MuError):
            trace = "".join(traceback.format_exception(error))
            log_file(context.folder / "log.ndjson")({"type": "traceback", "text": trace})
    return _Unexpected(f"internal error: {type(error).__name__}: {error}", remedy=remedy)


def _stop(context: RunContext, error: MuError) -> None:
    """End a run early: summary.json, a report of the results so far, and the error message."""
    _set_signals(signal.SIG_IGN)
    context.status = error.status
    reason = {"what": error.what, "where": error.where, "what_to_do": error.remedy}
    partial = ended_early(error) | {"reason": reason}
    # The reason for stopping may be that writing is impossible.
    with suppress(MuError):
        _write_summary(context, partial)
    context.hurried = isinstance(error, (_Interrupted, _Terminated))
    if context.hurried:
        # The watcher may not wait for the rest.
        if context.folder is not None and context.short_report is not None and context.wants_report:
            with suppress(Exception):
                context.short_report(context.folder, error.what)
        if isinstance(error, _Interrupted) and context.report is not None and context.wants_report:
            with suppress(MuError):
                context.progress.warning(
                    "stopping: the report shows the results so far",
                    what_to_do="press Ctrl-C again for a short one",
                )
        context.progress.error(error)
    if context.report is not None:
        # What takes long can be cut short by a second Ctrl-C; a failure here would only hide the first one.
        _set_signals(signal.default_int_handler)
        with suppress(Exception, KeyboardInterrupt):
            context.write_report(error.what)
        _set_signals(signal.SIG_IGN)
        with suppress(MuError):
            _write_summary(context, partial)
    if not context.hurried:
        context.progress.error(error)


def _write_summary(context: RunContext, state: dict[str, Any]) -> None:
    seconds = {"seconds": context.seconds}
    # Twice, so that the state is read first and yet overrides an older one.
    context.summary = {**state, **context.summary, **state, **seconds}
    if context.folder is None:
        return
    # Without room for all results, a stopped run at least states the reason.
    stopped = [state] if "reason" in state else []
    replace_summary(context.folder / SUMMARY, [context.summary, *stopped])


@contextmanager
def _signals_raise() -> Iterator[list[int]]:
    """Context in which Ctrl-C raises KeyboardInterrupt and SIGTERM _Terminated; yields each Ctrl-C."""
    asked: list[int] = []
    if not _may_set_signals():
        yield asked
        return

    def interrupted(number: int, frame: FrameType | None) -> None:
        asked.append(number)
        raise KeyboardInterrupt

    def terminated(number: int, frame: FrameType | None) -> None:
        raise _Terminated("cancelled")

    before = {
        signal.SIGINT: signal.signal(signal.SIGINT, interrupted),
        signal.SIGTERM: signal.signal(signal.SIGTERM, terminated),
    }
    try:
        yield asked
    finally:
        for number, handler in before.items():
            # None: a handler that was not set from Python and cannot be restored.
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _set_signals(handler: Any) -> None:
    """Set `handler` for Ctrl-C and SIGTERM, until `_signals_raise` restores the former one."""
    if _may_set_signals():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, handler)


def _may_set_signals() -> bool:
    return threading.current_thread() is threading.main_thread()
