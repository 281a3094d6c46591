"""Progress of a worker that sends no messages, reported by the process that watches it.

A library may hold the interpreter, on a busy machine for half a minute, and no thread of the worker runs. The
worker sends each step to its watcher, which repeats the last one.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..files import plain
from .progress import BEAT_S, Message, Sink, seldom, spell

PATIENCE_S = BEAT_S + 1.5
"""Seconds without a message after which the watcher repeats the last: a worker's own beats come before."""
STARTING = "start"
_LEFT = ("seconds_left", "whole_seconds_left")
_KEPT = ("type", "stage", "state", "fraction", "seconds", *_LEFT, "whole", "why")


def to_watcher(send: Callable[[bytes], object], clock: Callable[[], float] = time.monotonic) -> Sink:
    """A sink that reports progress to the watcher by `send`, twice a second and at each percent."""
    percent = -1

    def sink(message: Message) -> None:
        nonlocal percent
        kept = {key: message[key] for key in _KEPT if key in message}
        now = round(100 * message.get("whole", 0.0))
        (send_now if now != percent else send_seldom)(kept)
        percent = now

    def send_now(kept: Message) -> None:
        send(json.dumps(plain(kept)).encode() + b"\n")

    send_seldom = seldom(send_now, 0.5, clock)
    return sink


class Heartbeat:
    """Repeats the last progress message of a worker that has sent nothing for `PATIENCE_S`.

    show: gets the message with its time advanced and its fraction unchanged. between: gets a text while no
    stage is running, before the first and after the last one.
    """

    def __init__(
        self, show: Sink, between: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._show, self._between, self._clock = show, between, clock
        self._message: dict[str, Any] = {}
        self._rest = b""
        self._at = self._shown = clock()

    def hear(self, words: bytes) -> None:
        """Process bytes from the worker, in pieces of any size; b"" after a second without any."""
        now = self._clock()
        if words:
            *lines, self._rest = (self._rest + words).split(b"\n")
            for line in lines:
                with suppress(ValueError):
                    message = json.loads(line)
                    if message["type"] == "progress":
                        self._message, self._at = message, now
                    # A terminal shows running fractions every few seconds only.
                    if message.get("state") != "run" or now - self._shown >= BEAT_S:
                        self._shown = now
        elif now - self._shown >= PATIENCE_S:
            self._shown = now
            with suppress(OSError):
                self._beat(now - self._at)

    def _beat(self, since_s: float) -> None:
        if self._message.get("state") not in ("start", "run"):
            before = f"after {self._message['stage']}" if self._message else STARTING
            self._between(f"{before}: for {spell(since_s)}")
            return
        message = {**self._message, "state": "run", "beat": True}
        message["seconds"] += since_s
        for key in _LEFT:
            if message.get(key) is not None:
                message[key] = max(message[key] - since_s, 0.0)
        self._show(message)
