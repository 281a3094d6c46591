"""The sensor in use from the command line and from Blender: ports, streams, recordings, replays."""

from __future__ import annotations

import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from ..errors import InputError, MuError
from ..run.context import RunContext
from ..run.progress import Sink, printable
from .calibration import deriver, read_calibration
from .reconnecting import Control
from .recording import REJECTS
from .session import LOSSES, run_session
from .sources import SerialLine, Simulated, Source, ports


def port_lines() -> list[str]:
    """A line for each serial port: its device, its name independent of the socket, and its description."""
    return [f"{port.device:20s} {port.identity or '-':32s} {port.description}" for port in ports()]


def serial_source(port: str | None, baud: int) -> Source:
    """The port of that name, or the only USB one there is; raises InputError."""
    if port is not None:
        return SerialLine(port, baud)
    usb = [p for p in ports() if p.identity is not None]
    if len(usb) == 1 and usb[0].identity is not None:
        return SerialLine(usb[0].identity, baud)
    what = "no USB serial port was found" if not usb else f"{len(usb)} USB serial ports were found"
    raise InputError(what, "--port", "plug the sensor in, or name its port (`ports` lists them)")


def simulated_source() -> Source:
    """A simulated sensor that bends by up to 45 degrees in 8 s and loses 0.6 % of its light a degree."""

    def volts(t: float) -> tuple[float, ...]:
        angle_deg = 22.5 * (1 - math.cos(2 * math.pi * t / 8.0))
        return (2.4 * math.exp(-0.006 * angle_deg), 0.02)

    return Simulated(volts, ("light", "dark"), 100.0, noise_V=0.004)


def stream(
    source: Source,
    folder: Path,
    *,
    seconds: float | None,
    about: Mapping[str, Any],
    context: RunContext,
    controlled: bool = False,
    calibration: str | None = None,
    keep_time: bool = False,
    show: Sink | None = None,
) -> None:
    """Record a source into `folder`, reporting events; Ctrl-C ends it cleanly.

    show: gets the status five times a second, and events. keep_time: see run_session. calibration: a file
    whose angles are shown beside the voltages. controlled: lines on standard input request "pause", "resume",
    "stop" and "mark WORDS", as from Blender; its end ends the session. Raises InputError and OutputError.
    """
    control = Control()
    if controlled:
        threading.Thread(target=_obey, args=(control,), daemon=True).start()
    derive = None if calibration is None else deriver(read_calibration(Path(calibration)))
    context.open_folder(folder)
    context.console_summary = console_summary
    progress = context.progress

    def on_event(event: str, details: dict[str, Any]) -> None:
        message = {"type": "stream", "event": event, **details}
        if show is not None:
            show(message)
        if event != "status":
            # Into the log, which five lines a second would fill.
            progress.emit(message)
        if event in ("disconnected", "waiting"):
            words = (
                "the sensor was disconnected" if event == "disconnected" else "the sensor is not connected"
            )
            progress.warning(
                f"{words}: {details.get('detail', '')}", "", "it is searched for until it is connected"
            )
        elif event == "unreadable":
            progress.warning(str(details["detail"]), "", str(details["what_to_do"]))

    with ctrl_c_stops(control):
        status = run_session(
            source,
            folder,
            about=about,
            control=control,
            seconds=seconds,
            on_event=on_event,
            keep_time=keep_time,
            derive=derive,
        )
    context.summary.update(status)
    if not controlled:
        require_samples(status, folder)


def require_samples(status: Mapping[str, Any], folder: Path) -> None:
    """Raise MuError, with the remedy, if an ended session recorded nothing; status: its last."""
    if status["rows"]:
        return
    if status["complaint"]:
        what, remedy = status["complaint"]
        raise MuError(f"nothing was recorded: {what}", str(folder), remedy)
    what = f"{status['bytes']} bytes came, and no whole sample" if status["bytes"] else "nothing came"
    raise MuError(
        f"nothing was recorded: {what} in {status['duration_s']:.1f} s",
        f"port {status['port'] or '(none found)'}",
        "press reset on the board (some restart, or stay silent, as DTR is set when the port opens); give "
        "the rate of the sketch's Serial.begin(...) by --baud; try another port (`ports` lists them); a "
        "sketch that waits for a command or a button sends nothing until then",
    )


@contextmanager
def ctrl_c_stops(control: Control) -> Iterator[None]:
    """Context in which Ctrl-C or SIGTERM ends a stream cleanly; it has no other end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: control.stop.set()) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _obey(control: Control) -> None:
    for line in sys.stdin:
        word, _, rest = line.strip().partition(" ")
        if word == "pause":
            control.pause.set()
        elif word == "resume":
            control.pause.clear()
        elif word == "mark":
            control.marks.put(rest)
        elif word == "stop":
            break
    control.stop.set()


class Display:
    """Displays a stream: one live line on a terminal, else a line every five seconds."""

    def __init__(self, out: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self.out, self.live, self.clock = out, out.isatty(), clock
        self._last, self._open = -math.inf, False

    def __call__(self, message: Mapping[str, Any]) -> None:
        """Show a message of `stream`."""
        if message["event"] != "status":
            words = str(message.get("detail") or message.get("text") or "")
            self._write(printable(f"{message['event']}{': ' if words else ''}{words}\n", self.out))
        elif self.live or self.clock() - self._last >= 5.0:
            self._last = self.clock()
            line = printable(status_line(message), self.out)
            self._write(f"\r\x1b[K{line}" if self.live else line + "\n", self.live)

    def _write(self, text: str, stays_open: bool = False) -> None:
        self.out.write("\n" + text if self._open and not stays_open else text)
        self.out.flush()
        self._open = stays_open


def status_line(status: Mapping[str, Any]) -> str:
    """A session's status in a line: time, rate, the latest values, losses."""
    values = [
        f"{name} {value:.4g}"
        for name, value in zip(status["columns"][3:], list(status["latest"])[3:], strict=False)
    ]
    parts = [f"{status['duration_s']:.1f} s", status["state"], f"{status['rate_hz']:.0f} Hz", *values]
    return "  ".join([*parts, *_losses(status)])


def _losses(status: Mapping[str, Any]) -> list[str]:
    return [f"{status[key]} {word}" for key, word in LOSSES.items() if status.get(key)]


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a session's `summary`."""
    rows, seconds = summary["rows"], summary["duration_s"]
    losses = _losses(summary) or ["nothing lost" if summary["bytes"] else "nothing came"]
    if summary["cut_bytes"]:
        losses.append(f"{summary['cut_bytes']} bytes cut at the start, the end or while unplugged")
    kept, coloured = summary["rejected_bytes"] or summary["overlong"], summary["coloured"]
    return [
        f"{rows} samples in {seconds:.1f} s, format {summary['format'] or 'not found'}",
        ", ".join(losses),
        *([f"colour codes (ANSI escape sequences) left out of {coloured} lines"] if coloured else []),
        *summary["complaint"],
        *([f"unreadable input is in {REJECTS}"] if kept else []),
    ]
