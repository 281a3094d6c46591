"""Progress of a run: stages with time left, warnings, one result or one error.

A `Progress` makes messages, plain dictionaries with a `type`, and hands each to its sinks:

- plan: the stages that are expected, as [name, seconds], the seconds of all, and how many times slower other
  work of the machine makes them
- progress: stage, state ("start" | "run" | "end"), fraction (0..1 or None), seconds, seconds_left (or None).
  Optional: detail, the last step done or, at the end, the stage's result; waits_for, what is being done;
  beat, only the time is new. With a plan: whole (0..1) and whole_seconds_left of the run, and why, the
  reason if the time left grew. Of a run within this one the stage begins with its name, and part (0..1) and
  part_seconds_left are its own.
- finding: what, a first finding while the run goes on
- warning: what, where, what_to_do
- result: whatever the run found; the last message of a run that succeeded
- error: what, where, what_to_do, status; the last message of a run that did not
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
import time
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from ..errors import MuError
from ..files import append_lines, output_error, plain
from .processes import slowed_so_far
from .progress_estimate import Pace, Plan, ProgressEstimate

Message = dict[str, Any]
Sink = Callable[[Message], None]
Clock = Callable[[], float]


BEAT_S = 5.0
"""Seconds after which a message is sent for a stage that reports nothing."""
SLOWED = 1.25
"""From this slowdown by other work on, a run's time is shown with and without that work."""


class Progress:
    """Stages of one run, reported to `sinks`; `seconds` keeps each stage's duration, in order.

    estimate: of the whole run, if there is a `plan`; waits_for: what is being done, in a few words, or "".
    """

    def __init__(self, sinks: Sequence[Sink] = (), clock: Clock = time.perf_counter) -> None:
        self.sinks = list(sinks)
        self.seconds: dict[str, float] = {}
        self._clock = clock
        self._stage = ""
        self._start = 0.0
        self._expected: float | None = None
        self._planned_s: dict[str, float] = {}
        self._fraction: float | None = None
        self._pace = Pace()
        self._emitted_s = clock()
        self._made = self.waits_for = ""
        self._one_at_a_time = threading.RLock()
        self.estimate = ProgressEstimate((), clock)

    def plan(self, stages: Plan) -> None:
        """Report the expected stages of the run, with their seconds; no effect without any."""
        self._planned_s = dict(stages)
        if stages:
            slowed = slowed_so_far()
            self.estimate = ProgressEstimate(stages, self._clock, slowed)
            seconds = sum(s for _, s in stages)
            self.emit({"type": "plan", "stages": [*map(list, stages)], "seconds": seconds, "slowed": slowed})

    @contextmanager
    def beating(self, every_s: float = BEAT_S) -> Iterator[None]:
        """Context in which a thread reports the stage's time after `every_s` without another report.

        None in Blender, which bears no threads.
        """
        if "bpy" in sys.modules:
            yield
            return
        ended = threading.Event()

        def beat() -> None:
            while not ended.wait(every_s / 5.0):
                with self._one_at_a_time, suppress(OSError, MuError):
                    if self._stage and self._clock() - self._emitted_s >= every_s:
                        self._emit_progress("run", self._fraction, beat=True)

        thread = threading.Thread(target=beat, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    @contextmanager
    def stage(self, name: str, expected_s: float | None = None) -> Iterator[None]:
        """Time the body as stage `name`; `expected_s`, or the plan, gives a time left before an `update`.

        Stages do not nest. One that is left by an exception keeps its seconds and is not reported as ended.
        """
        if self._stage:
            raise ValueError(f"stage {name!r} inside stage {self._stage!r}")
        with self._one_at_a_time:
            self._stage, self._start = name, self._clock()
            self._expected = self._planned_s.get(name) if expected_s is None else expected_s
            self._fraction, self._pace = None, Pace()
        try:
            self._emit_progress("start", self._fraction)
            yield
            self._emit_progress("end", 1.0, self._made)
        finally:
            with self._one_at_a_time:
                elapsed = self._clock() - self._start
                self.seconds[name] = self.seconds.get(name, 0.0) + elapsed
                self._stage = self._made = self.waits_for = ""

    def made(self, size: str) -> None:
        """Set the size of the present stage's result, such as "6210 nodes", reported at its end."""
        self._made = size

    def update(self, fraction: float, detail: str = "") -> None:
        """Report that `fraction` (0..1) of the present stage is done; outside a stage, no effect.

        The fraction never decreases. detail: a few words on the last step, such as a load step and its
        residual.
        """
        with self._one_at_a_time:
            if self._stage:
                self._fraction = max(min(max(float(fraction), 0.0), 1.0), self._fraction or 0.0)
                self._pace.tell(self._clock() - self._start, self._fraction)
                self._emit_progress("run", self._fraction, detail)

    def finding(self, what: str) -> None:
        """Report a first finding, which a terminal shows on a line of its own."""
        self.emit({"type": "finding", "what": what})

    def warning(self, what: str, where: str = "", what_to_do: str = "") -> None:
        """Report a problem that does not end the run."""
        self.emit({"type": "warning", "what": what, "where": where, "what_to_do": what_to_do})

    def result(self, found: Mapping[str, Any]) -> None:
        """Report the run's results: the terminal message of a run that succeeded."""
        self.emit({**found, "type": "result"})

    def error(self, error: MuError) -> None:
        """Report the error that ended the run: the terminal message of a run that did not succeed.

        A sink that fails is skipped: the others should still get the reason.
        """
        message = {
            "type": "error",
            "what": error.what,
            "where": error.where,
            "what_to_do": error.remedy,
            "status": error.status,
        }
        with self._one_at_a_time:
            for sink in self.sinks:
                with suppress(OSError, MuError):
                    sink(message)

    def part(self, name: str, message: Message) -> None:
        """Send a progress message of a run within this one, which the plan has as stage `name`."""
        own = {**message, "stage": f"{name}: {message['stage']}"}
        for key in ("whole", "whole_seconds_left", "why"):
            if key in own:
                own[key.replace("whole", "part")] = own.pop(key)
        with self._one_at_a_time:
            self._emit_estimated(own)

    def emit(self, message: Message) -> None:
        """Send `message` to every sink."""
        with self._one_at_a_time:
            for sink in self.sinks:
                sink(message)

    def _emit_progress(
        self, state: str, fraction: float | None, detail: str = "", beat: bool = False
    ) -> None:
        with self._one_at_a_time:
            self._emitted_s = now = self._clock()
            elapsed = now - self._start
            left = self._pace.left(elapsed)
            if not fraction and self._expected is not None and self._expected > elapsed:
                # One that is overdue by its plan has no known end.
                left = self._expected - elapsed
            message: Message = {
                "type": "progress",
                "stage": self._stage,
                "state": state,
                "fraction": fraction,
                "seconds": elapsed,
                "seconds_left": 0.0 if state == "end" else left,
                **({"detail": detail} if detail else {}),
                **({"waits_for": self.waits_for} if self.waits_for and state == "run" else {}),
                **({"beat": True} if beat else {}),
            }
            self._emit_estimated(message)

    def _emit_estimated(self, message: Message) -> None:
        """Send a progress message with the state of the whole run."""
        self.estimate.tell(message)
        if self.estimate.count:
            message["whole"] = self.estimate.fraction
            message["whole_seconds_left"] = self.estimate.seconds_left
            if self.estimate.why:
                message["why"] = self.estimate.why
        self.emit(message)


def within(on_progress: Callable[..., None], low: float, high: float) -> Callable[..., None]:
    """A part's `on_progress`, whose shares are between `low` and `high` of the whole's."""
    return lambda share, *words: on_progress(low + share * (high - low), *words)


def terminal(stream: TextIO = sys.stderr, clock: Clock = time.perf_counter) -> Sink:
    """A sink for terminals: one live line a stage on a tty, else plain lines at start, end and every 5 s."""
    return _LiveLine(stream, clock) if stream.isatty() else _PlainLines(stream, clock)


def outcome(sink: Sink) -> Sink:
    """Pass only the outcome of the run, result or error, to `sink`."""

    def passed(message: Message) -> None:
        if message["type"] in ("result", "error"):
            sink(message)

    return passed


def printable(text: str, stream: TextIO | None = None) -> str:
    """`text` with everything but line ends that would not be shown as a character spelt as \\xNN or \\uNNNN.

    Names and values come from devices and files: a terminal would obey an escape sequence among them, and a
    change of direction would show another text. Characters that `stream` cannot encode are replaced, too.
    """
    if not text.isascii() or not text.replace("\n", "").isprintable():
        text = "".join(
            _spelt(c) if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c
            for c in text
        )
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def _spelt(character: str) -> str:
    """A character's escape in the terms of Python."""
    return character.encode("unicode_escape").decode()


def _json_line(message: Mapping[str, Any]) -> str:
    """A message as one line of JSON; control characters and invalid text as JSON's own escapes."""
    line = json.dumps(plain(message), ensure_ascii=False)
    if line.isprintable():
        return line + "\n"
    return "".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in line) + "\n"


class _Lines:
    """Wording shared by both terminal sinks."""

    def __init__(self, stream: TextIO, clock: Clock) -> None:
        self.stream = stream
        self.clock = clock
        self.last = 0.0

    def __call__(self, message: Message) -> None:
        if message["type"] == "plan":
            seconds, slowed, count = message["seconds"], message["slowed"], len(message["stages"])
            alone = f"about {spell(seconds)} on two cores"
            busy = f"about {spell(seconds * slowed)} with other programs running, {alone[6:]} without"
            self.write(f"{busy if slowed >= SLOWED else alone}, {count} stage{'s' * (count > 1)}\n")
        elif message["type"] == "progress":
            self.progress(message)
        elif message["type"] == "finding":
            self.write(printable(message["what"], self.stream) + "\n")
        elif message["type"] in ("warning", "error"):
            self.write(printable(_formatted(message), self.stream) + "\n")

    def progress(self, message: Message) -> None:
        raise NotImplementedError

    def write(self, text: str) -> None:
        self.stream.write(text)
        self.stream.flush()

    def due(self, every_s: float) -> bool:
        if self.clock() - self.last < every_s:
            return False
        self.last = self.clock()
        return True


class _LiveLine(_Lines):
    """One line for each stage, redrawn in place at most ten times a second."""

    bar = 24
    open = False

    def progress(self, message: Message) -> None:
        ended = message["state"] == "end"
        if message["state"] == "run" and not self.due(0.1):
            return
        line = f"{message['stage']:<28} "
        share = message.get("whole", message["fraction"])
        if share is None:
            line += f"... {spell(message['seconds'])}"
        else:
            full = round(self.bar * share)
            line += "[" + "#" * full + "." * (self.bar - full) + f"] {100 * share:3.0f} %"
        line += f"  {spell(message['seconds'])}" if ended else _left(message, "  ")
        # One that wraps could not be redrawn in place.
        line = line[: shutil.get_terminal_size().columns - 1]
        self.stream.write("\r" + line + "\x1b[K" + ("\n" if ended else ""))
        self.stream.flush()
        self.open = not ended

    def write(self, text: str) -> None:
        super().write("\n" + text if self.open else text)
        self.open = False


class _PlainLines(_Lines):
    """For pipes and logs: no line is ever redrawn."""

    def progress(self, message: Message) -> None:
        stage, share = message["stage"], message["fraction"]
        whole = f"{100 * message['whole']:3.0f} %  " if "whole" in message else ""
        if message["state"] == "start":
            self.last = self.clock()
            self.write(f"{whole}{stage} ...\n")
        elif message["state"] == "end":
            self.write(f"{whole}{stage}: done in {spell(message['seconds'])}\n")
        elif self.due(5.0):
            done = f"for {spell(message['seconds'])}" if whole or share is None else f"{100 * share:.0f} %"
            self.write(f"{whole}{stage}: {done}{_left(message, ', ')}\n")


def _left(message: Message, before: str) -> str:
    """Time left as text, of the whole run if it has a plan, and why it grew; or ""."""
    left = message.get("whole_seconds_left", message["seconds_left"])
    # Shorter stages need no display, and would leave it standing.
    if left is None or left < 1.0:
        return ""
    # The stage in question has its name in front.
    why = message.get("why", "").removeprefix(f"{message['stage']} ")
    return f"{before}{spell(left)} left" + (f" ({why})" if why else "")


def _formatted(message: Message) -> str:
    lines = [f"{message['type']}: {message['what']}"]
    if message["where"]:
        lines.append(f"  where: {message['where']}")
    if message["what_to_do"]:
        lines.append(f"  what to do: {message['what_to_do']}")
    return "\n".join(lines)


def spell(seconds: float) -> str:
    """Format `seconds` as "0.4 s", "12 s", "3 min 05 s" or "2 h 10 min"."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def json_lines(stream: TextIO = sys.stdout, clock: Clock = time.perf_counter) -> Sink:
    """A sink for programs: every message as one line of JSON, running fractions at most five a second."""

    def sink(message: Message) -> None:
        stream.write(_json_line(message))
        stream.flush()

    return seldom(sink, 0.2, clock)


def seldom(sink: Sink, every_s: float, clock: Clock) -> Sink:
    """The sink, with running fractions no more often than every `every_s` seconds."""
    last = -every_s

    def thinned(message: Message) -> None:
        nonlocal last
        if message.get("state") == "run":
            if clock() - last < every_s:
                return
            last = clock()
        sink(message)

    return thinned


def log_file(path: Path, clock: Clock = time.perf_counter) -> Sink:
    """A sink that appends to `path` (log.ndjson): messages with the time of day, running fractions every 5 s.

    Raises OutputError, now or on a later message, if the file cannot be written.
    """

    def sink(message: Message) -> None:
        stamped = {"time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), **plain(message)}
        try:
            with path.open("ab", buffering=0) as stream:
                append_lines(stream, _json_line(stamped).encode())
        except OSError as error:
            raise output_error(error, path) from error

    try:
        with path.open("ab+", buffering=0) as stream:
            if stream.seek(0, os.SEEK_END):
                stream.seek(-1, os.SEEK_END)
                # A line that a killed process left half must not take the next one with it.
                if stream.read(1) != b"\n":
                    append_lines(stream, b"\n")
    except OSError as error:
        raise output_error(error, path) from error
    thinned = seldom(sink, 5.0, clock)
    return lambda message: None if message.get("beat") else thinned(message)
