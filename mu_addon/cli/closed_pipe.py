"""The end of a command whose output nobody reads any more, as of `| head -1`: quiet, as of other programs."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from ..errors import MuError

if TYPE_CHECKING:
    from ..run.progress import Sink


class _Closed(MuError):
    """The reader of the output has closed it."""

    status = 141


def until_closed(sink: Sink) -> Sink:
    """The sink; once its reader is gone, every message ends the run with exit status 141."""
    closed = False

    def passed(message: dict[str, Any]) -> None:
        nonlocal closed
        try:
            # Its own end needs no words.
            if not closed and message.get("status") != _Closed.status:
                sink(message)
        except BrokenPipeError:
            closed = True
        if closed:
            raise _Closed("the program that read the output has closed it", "", "run it again: it continues")

    return passed


def leave_quietly() -> None:
    """Write what is printed to its reader, if there still is one: Python would complain at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
