"""Accounts of a serial line's bytes: each is counted once by its outcome; those without a sample are kept.

bytes = read_bytes + rejected_bytes + cut_bytes + overlong + buffered. Read: lines and frames with a sample.
Rejected: those that could not be read. Cut: by the start, a pulled cable or the end. Overlong: bytes without
a line or frame end. Buffered: still with the decoder.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import attrs

from .formats import text_of, without_colour
from .text_lines import why_unread

# So many bytes without a format are enough to say what is wrong with them; the latest are looked at.
_COMPLAINT_BYTES, _LATEST_BYTES = 400, 4096
# A text's share of characters that can be printed; half of all bytes can, in noise a third.
_TEXT = 0.9


@attrs.define
class Counters:
    """Counts of bytes, samples, and faults on a line since the decoder began."""

    bytes: int = 0
    samples: int = 0
    lost: int = 0
    """Samples missing by gaps in the running number."""
    repeated: int = 0
    """Samples repeated, equal in number, clock and values, which were left out."""
    misnumbered: int = 0
    """Samples whose running number or clock fits neither before nor after; kept, and counted on."""
    incomplete: int = 0
    """Samples without a channel that others have (nan), or with one not yet recorded."""
    crc_errors: int = 0
    malformed: int = 0
    """Lines or frames that could not be read."""
    restarts: int = 0
    """Times the device's clock or running number restarted."""
    read_bytes: int = 0
    """Bytes of lines and frames that were read."""
    rejected_bytes: int = 0
    """Bytes of lines and frames that could not be read, or have a wrong CRC."""
    overlong: int = 0
    """Bytes in stretches without an end that are longer than any line or frame."""
    cut_bytes: int = 0
    """Bytes of lines cut by the beginning, by a pulled cable or by the end."""
    coloured: int = 0
    """Lines that were read with colour codes (ANSI escape sequences) in them, which were left out."""


class Reject(NamedTuple):
    """Bytes that gave no sample, and why: malformed, crc, repeated, new name, no end, cut."""

    why: str
    raw: bytes


class Accounts:
    """Counters of a line, and the rejected bytes, for the caller to keep and to clear."""

    def __init__(self) -> None:
        self.counters = Counters()
        self.rejects: list[Reject] = []
        self._unrecognised = b""
        self._first_line = ""

    def read(self, piece: bytes) -> None:
        """Count a line or frame that was read."""
        self.counters.read_bytes += len(piece)

    def read_line(self, piece: bytes) -> None:
        """Count a line of text that was read, and its colour codes."""
        self.counters.coloured += without_colour(piece) is not piece
        self.read(piece)

    def reject(self, piece: bytes, why: str) -> None:
        """Count and keep a line or frame that could not be read: malformed, or with a wrong crc."""
        self.counters.rejected_bytes += len(piece)
        if why == "crc":
            self.counters.crc_errors += 1
        else:
            self.counters.malformed += 1
        self.rejects.append(Reject(why, piece))

    def reject_after_all(self, piece: bytes) -> None:
        """Count as malformed a line that had been counted as read."""
        self.counters.read_bytes -= len(piece)
        self.reject(piece, "malformed")

    def reject_lines(self, lines: Iterable[bytes]) -> None:
        """Count lines, without their ends, of no known format."""
        for line in lines:
            self._unrecognised = (self._unrecognised + line + b"\n")[-_LATEST_BYTES:]
            if without_colour(line).strip():
                self._first_line = self._first_line or text_of(line) or ""
                self.reject(line + b"\n", "malformed")
            else:
                self.read(line + b"\n")

    def cut(self, piece: bytes) -> None:
        """Count and keep an incomplete line or frame."""
        if piece:
            self.counters.cut_bytes += len(piece)
            self.rejects.append(Reject("cut", piece))

    def unended(self, piece: bytes) -> None:
        """Count and keep a stretch without an end."""
        self.counters.overlong += len(piece)
        self.rejects.append(Reject("no end", piece))

    def drop(self, piece: bytes) -> None:
        """Count and keep the beginning of a stretch that is too long to be waited for."""
        self._unrecognised = (self._unrecognised + piece)[-_LATEST_BYTES:]
        self.unended(piece)

    def complaint(self, buffered: bytes, least: int = _COMPLAINT_BYTES) -> tuple[str, str] | None:
        """Fault of input in no known format, and what to do; None while less than `least` bytes came."""
        unread = self.counters.bytes - self.counters.read_bytes
        if unread < least or 20 * self.counters.read_bytes > self.counters.bytes:
            return None
        seen = without_colour(self._unrecognised + buffered[-_LATEST_BYTES:])
        shown = sum(32 <= byte < 127 or byte in b"\t\r\n" for byte in seen)
        if shown < _TEXT * len(seen):
            return (
                "the input is noise: neither text nor frames, as with a wrong baud rate",
                "give the rate of the device's Serial.begin(...) by --baud (9600, 57600, 115200, ...), "
                "and check the wiring and the port",
            )
        # The first piece may be the rest of a line.
        _, *whole = seen.split(b"\n") if seen.count(b"\n") > 1 else [b"", seen]
        first = self._first_line or next((text for line in whole if (text := text_of(line))), "")
        self._first_line = first
        quoted = f": the first line is {first[:80]!r}, in which {why_unread(first)}" if first else ""
        return (
            f"the input is text in an unknown format{quoted}",
            "send `label:value` pairs, CSV, JSON lines or frames (docs/guide/bench.md), or try another port",
        )
