"""The thread that reads a source: it reconnects when the cable is pulled and releases the port on request."""

from __future__ import annotations

import queue
import threading
import time

import attrs

from .sources import ConnectionLost, EndOfStream, Source

_BACK_OFF_S = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)


@attrs.define
class Control:
    """Requests to a running session, from any thread: stop, pause, or leave a mark (a text)."""

    stop: threading.Event = attrs.field(factory=threading.Event)
    pause: threading.Event = attrs.field(factory=threading.Event)
    """While set, the port is released; the session continues when it is cleared."""
    marks: queue.SimpleQueue[str] = attrs.field(factory=queue.SimpleQueue)


@attrs.frozen
class Piece:
    """Bytes that a source sent, or an event of its connection, at a time in s since the epoch."""

    at: float
    data: bytes = b""
    event: str = ""
    detail: str = ""


@attrs.frozen
class Failure(Piece):
    """An error that ends the session."""

    error: Exception = attrs.field(kw_only=True)


class Clock:
    """Seconds since the epoch that never run backward, independent of changes of the computer's clock."""

    def __init__(self) -> None:
        self.start = time.time()
        self._origin = time.perf_counter()

    def now(self) -> float:
        """Time in s since the epoch."""
        return self.start + time.perf_counter() - self._origin


def read_on(source: Source, pieces: queue.SimpleQueue[Piece], control: Control, clock: Clock) -> None:
    """Read a source into `pieces` until it ends or `control` stops it; reopen the line when it is lost."""
    connected, tries = False, 0
    try:
        while not control.stop.is_set():
            if control.pause.is_set():
                if connected:
                    source.close()
                    pieces.put(Piece(clock.now(), event="paused"))
                connected = False
                time.sleep(0.02)
                continue
            try:
                if not connected:
                    words = source.open()
                    connected, tries = True, 0
                    pieces.put(Piece(clock.now(), event="connected", detail=words))
                data = source.read()
            except ConnectionLost as gone:
                source.close()
                if connected or tries == 0:
                    event = "disconnected" if connected else "waiting"
                    pieces.put(Piece(clock.now(), event=event, detail=str(gone)))
                connected = False
                control.stop.wait(_BACK_OFF_S[min(tries, len(_BACK_OFF_S) - 1)])
                tries += 1
                continue
            if data:
                pieces.put(Piece(clock.now(), data))
        source.close()
    except EndOfStream:
        pieces.put(Piece(clock.now(), event="ended"))
    # Any other error of the reading ends the session with its message.
    except Exception as error:  # noqa: BLE001 - handed to the thread that can raise it
        pieces.put(Failure(clock.now(), error=error))
