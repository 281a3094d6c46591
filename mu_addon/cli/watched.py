"""Commands in a watched process, and the message when that process crashes."""

from __future__ import annotations

import io
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MuError
from ..run.supervisor import CRASHED, Crash, supervised

if TYPE_CHECKING:
    from ..run.heartbeat import Heartbeat
    from ..run.progress import Sink

_UNWATCHED = ("presets", "ports", "stream", "record", "replay")
"""Commands without a solver: a recording writes its data to disk before anything else."""
_LIMITS = (("RLIMIT_AS", "addresses"), ("RLIMIT_DATA", "memory"))


class _Crashed(MuError):
    """End of a process that could not report it itself."""

    status = CRASHED


def run_watched(line: Sequence[str], work: Callable[[], int], ends_with_input: bool = False) -> int:
    """Run `work` of a command line, in a separate process if it may crash; return its exit status.

    ends_with_input: end it once standard input ends, see `run.processes.end_with_input`.
    """
    at_once = not line or line[0] in _UNWATCHED or line[0].startswith("-") or {"-h", "--help"} & {*line}
    # Blender has threads, whose locks a fork would copy as they are.
    if not at_once and "bpy" not in sys.modules:
        return supervised(work, lambda crash: tell_crash(line, crash), ends_with_input, _heartbeat(line))
    if ends_with_input:
        from ..run.processes import end_with_input

        end_with_input()
    return work()


def _heartbeat(line: Sequence[str]) -> Callable[[bytes], None]:
    """Listener to a command's worker process; shows that the worker is alive while it is silent.

    Loaded with the first message: the worker starts first and names a missing package.
    """

    @cache
    def heartbeat() -> Heartbeat:
        from ..run.heartbeat import Heartbeat

        # Its sink is loaded now: what the worker shows while it loads would come before an older share.
        return Heartbeat(sink(), between)

    @cache
    def options() -> Any:
        from .main import parser

        # Wrong ones are the worker's to refuse.
        with redirect_stderr(io.StringIO()):
            return parser().parse_args(list(line))

    def sink() -> Sink:
        from .main import sink_of

        return sink_of(options())

    def between(words: str) -> None:
        if not getattr(options(), "json", False) and not options().quiet:
            sys.stderr.write(f"{words}\n")
            sys.stderr.flush()

    def hear(words: bytes) -> None:
        # Without a reader the worker ends by itself.
        with suppress(ModuleNotFoundError, BrokenPipeError, MuError, SystemExit):
            heartbeat().hear(words)

    return hear


def tell_crash(line: Sequence[str], crash: Crash) -> None:
    """Report how the process of a command line ended, its stage and what to do, also in its folder."""
    # Imported late: unless something fails, this process needs none of it.
    from ..run.context import asked_to_stop
    from ..run.progress import Progress
    from ..run.summary import has_ended, last_stage, record_crash
    from .main import parser, sink_of

    options = parser().parse_args(list(line))
    folder = Path(options.out) if getattr(options, "out", None) else None
    if crash.asked and folder is not None and has_ended(folder):
        # It reported that itself, and was writing its report.
        return
    stage, made = last_stage(folder) if folder is not None else ("", [])
    error = asked_to_stop(crash.asked, folder) if crash.asked else _error(options, folder, stage, made, crash)
    if folder is not None:
        record_crash(folder, error, crash.stack)
    if folder is not None and crash.asked and getattr(options, "report", True) is not False:
        from ..report.stopped import write_stopped_report

        # Whatever the error, the message below must be printed.
        with suppress(Exception):
            write_stopped_report(folder, error.what)
    if not getattr(options, "json", False) and not options.quiet and sys.stderr.isatty():
        # Leave the line of its progress.
        sys.stderr.write("\n")
    Progress([sink_of(options)]).error(error)


def _error(options: Any, folder: Path | None, stage: str, made: Sequence[str], crash: Crash) -> MuError:
    limit = _limit()
    parts = [
        f"in stage {stage}" if stage else "",
        f"at {', '.join(made)}" if made else "",
        f"with {crash.memory_MB:.0f} MB of memory taken",
        limit,
    ]
    where = ", ".join(part for part in parts if part)
    again = "the same command" if folder is None else f"`run.py resume {folder}` or the same command"
    coarser = ", or a coarser mesh (--refine below 1)" if hasattr(options, "refine") else ""
    memory = "raise that limit" if limit else "close other programs, or use a machine with more memory"
    shared = ", --workers 1" if hasattr(options, "workers") else ""
    keep = "report it with log.ndjson" if folder is not None else "report it"
    return _Crashed(
        f"the process that did the work {_how(crash)}",
        where,
        f"if memory was short: {memory}{shared}{coarser}; then {again} continues from the finished stages. "
        f"If it ends like this again, {keep}",
    )


def _how(crash: Crash) -> str:
    if not crash.signal:
        return f"was ended by a library without a message (exit status {crash.status})"
    name = signal.Signals(crash.signal).name if crash.signal in {*signal.Signals} else str(crash.signal)
    if name == "SIGKILL":
        return "was killed (SIGKILL) by a user, or by the system because memory ran out"
    return f"crashed ({name}): a library that it uses was refused memory, or has a fault"


def _limit() -> str:
    """The system's limits on this process's memory, as text."""
    try:
        import resource
    except ImportError:
        return ""
    found = []
    for name, what in _LIMITS:
        most, _ = resource.getrlimit(getattr(resource, name))
        if most != resource.RLIM_INFINITY:
            found.append(f"{most / 1e6:.0f} MB of {what} allowed ({name})")
    return ", ".join(found)
