"""Bytes from a serial line to samples: cut into pieces, read in their format, numbered and timed."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import Any

from .byte_accounts import Accounts, Counters, Reject
from .channel_names import ChannelNames, channels_of
from .csv_columns import CsvColumns
from .formats import ENOUGH, TEXT_READERS, format_of, text_of, whole_lines
from .framing import END, LONGEST, info_of, payload_of, sample_of
from .numbering import Row
from .samples import Layout, Samples, Timeline
from .text_lines import CLOCKS, NUMBERS, Pairs, json_of, pairs_of

# Without a format found: enough for a few of the longest lines, little enough for any memory.
_MOST_UNREAD_BYTES = 16384
_LONGEST_LINE = 4096
# Pieces in a row that mean nothing in the format found: the device speaks another one now.
_LOST_THREAD = 50
# A device says what its frames hold about once a second; samples that come before wait for it.
_PATIENCE_S = 1.5


class Decoder:
    """Converts the bytes of a serial line to samples: binary frames, label:value pairs, CSV and JSON.

    `feed` takes bytes as they come and returns the samples that are complete. Lost and damaged samples are
    counted in `counters`. It keeps at most a few kilobytes of input.
    """

    def __init__(self) -> None:
        self.format: str | None = None
        self.layout: Layout | None = None
        self._accounts = Accounts()
        self._timeline = Timeline(self._accounts)
        self._last_format: str | None = None
        self._buffer = bytearray()
        # Bytes before the buffer, and end and host time of each arrival that reaches into it.
        self._taken = 0
        self._arrivals: deque[tuple[int, float]] = deque()
        # Whether the next piece may lack its beginning.
        self._first = True
        self._bad_in_a_row = 0
        self._ends_in_cr = False
        self._at = 0.0
        # CSV; labels, a sample that is not whole yet; frames, samples that wait for their channels' names.
        self._csv = CsvColumns()
        self._names = ChannelNames()
        self._line = 0
        self._pending: Pairs = {}
        self._pending_at = 0.0
        self._unnamed: list[Row] = []
        self._unnamed_since = math.inf

    @property
    def counters(self) -> Counters:
        """Counts of bytes, samples and faults."""
        return self._accounts.counters

    @property
    def rejects(self) -> list[Reject]:
        """Input that gave no sample, for the caller to keep and to clear."""
        return self._accounts.rejects

    def interrupted(self) -> None:
        """Process pending input now: the line was cut, and the next bytes may begin within a frame."""
        self._flush_pending()
        self._flush_buffer()
        self._first = True

    def feed(self, data: bytes, at: float) -> list[Samples]:
        """Samples in bytes that arrived at host time `at` in s, a group for each run with one layout."""
        self.counters.bytes += len(data)
        self._buffer += data
        if data:
            self._arrivals.append((self.counters.bytes, at))
        self._mend_line_ends(data)
        self._at = at
        if self.format is None:
            self._detect_format()
        self._take_pieces()
        if self.format is None:
            self._trim_unrecognised()
        if self._bad_in_a_row >= _LOST_THREAD:
            self.format, self._bad_in_a_row = None, 0
        return self._timeline.groups()

    def finish(self, at: float) -> list[Samples]:
        """The samples still pending at the end of input, as they are; `at` is the host time in s.

        These are frames without channel names, a sample that lacks channels, and one whose number is in
        doubt.
        """
        self._at = at
        if self.format is None:
            self._detect_format(enough=1)
            self._take_pieces()
        self._flush_buffer()
        self._first = True
        self._name_waiting(force=True)
        self._flush_pending()
        self._timeline.finish()
        return self._timeline.groups()

    @property
    def complaint(self) -> tuple[str, str] | None:
        """Fault of input that is almost entirely unreadable, and remedy; else None."""
        return None if self.format is not None else self._accounts.complaint(bytes(self._buffer))

    @property
    def why_no_sample(self) -> tuple[str, str] | None:
        """Return `complaint`, for any amount of input, if nothing could be read by the end; else None."""
        return None if self.counters.samples else self._accounts.complaint(bytes(self._buffer), 1)

    # The buffer.

    def _flush_buffer(self) -> None:
        """Empty the buffer: whole lines of no known format are unreadable, the rest was cut."""
        rest = self._remove(len(self._buffer))
        if self.format is None:
            *lines, rest = rest.split(b"\n")
            self._accounts.reject_lines(lines)
        if len(rest) > _LONGEST_LINE:
            self._accounts.unended(rest)
        else:
            self._accounts.cut(rest)

    def _trim_unrecognised(self) -> None:
        """Keep the latest half of bytes in which no format is found."""
        if len(self._buffer) <= _MOST_UNREAD_BYTES:
            return
        excess = len(self._buffer) - _MOST_UNREAD_BYTES // 2
        end = self._buffer.rfind(b"\n", 0, excess) + 1
        if end:
            self._accounts.reject_lines(self._remove(end)[:-1].split(b"\n"))
        else:
            self._drop(excess)
        self._first = not end

    def _trim(self, most: int) -> None:
        """Drop part of a buffer longer than any line or frame: it may be of another format."""
        if len(self._buffer) > most:
            self._drop(len(self._buffer) - most // 2)
            self._first = True
            self._bad_in_a_row = _LOST_THREAD

    def _drop(self, count: int) -> None:
        self._accounts.drop(self._remove(count))

    def _remove(self, count: int) -> bytes:
        """The first bytes of the buffer, removed; `_at` becomes the host time at which the last came."""
        removed = bytes(self._buffer[:count])
        del self._buffer[:count]
        self._taken += count
        while len(self._arrivals) > 1 and self._arrivals[0][0] < self._taken:
            self._arrivals.popleft()
        if self._arrivals and removed:
            self._at = self._arrivals[0][1]
        return removed

    def _pieces(self, end: bytes) -> Iterator[bytes]:
        """Whole pieces, their ends included, each with `_at` as the time at which its end came."""
        while (count := self._buffer.find(end) + 1) > 0:
            yield self._remove(count)

    def _mend_line_ends(self, data: bytes) -> None:
        """Take CR for the end of a line once several have come, and neither LF nor the end of a frame."""
        if b"\n" in data or END in data or self.format == "frames":
            self._ends_in_cr = False
        elif self._ends_in_cr or (self._buffer.count(b"\r") >= ENOUGH and b"\n" not in self._buffer):
            self._ends_in_cr = True
            self._buffer = self._buffer.replace(b"\r", b"\n")

    # The format.

    def _take_pieces(self) -> None:
        if self.format == "frames":
            self._frames()
        elif self.format is not None:
            self._lines()

    def _detect_format(self, enough: int = ENOUGH) -> None:
        """Find the format in which most of the latest whole pieces can be read."""
        found = format_of(bytes(self._buffer), not self._first, enough, self._last_format)
        if found is None:
            return
        new = self.layout is None or found != self._last_format
        if new and enough == ENOUGH and self._is_unsure(found):
            return
        if found != self._last_format:
            self._flush_pending()
            self._timeline.restart()
            self.layout, self._csv = None, CsvColumns()
            self._names.forget_new()
        self.format = self._last_format = found
        self._learn(found)

    def _is_unsure(self, found: str) -> bool:
        """True if the buffer's lines are few and disagree on their channels: later ones decide."""
        if found == "csv":
            return self._csv.is_unsure(self._rows())
        return self._names.is_unsure(self._named_lines(found))

    def _learn(self, found: str) -> None:
        """Learn the layout that most of the latest lines agree on."""
        self._csv.learn([])
        self._names.trust()
        if found not in TEXT_READERS:
            return
        if found == "csv":
            self._csv.learn(self._rows())
        else:
            self.layout = self._names.learn(self._named_lines(found), self.layout)

    def _read_lines(self, format_: str) -> list[Pairs | list[float]]:
        """Samples of the buffer's lines in a format of text."""
        lines = whole_lines(bytes(self._buffer), not self._first)
        return [values for line in lines if line and (values := TEXT_READERS[format_](line))]

    def _rows(self) -> list[list[float]]:
        """The buffer's rows of numbers."""
        return [row for row in self._read_lines("csv") if isinstance(row, list)]

    def _named_lines(self, format_: str) -> list[Pairs]:
        """The buffer's lines of values by name; none in a format without names."""
        if format_ not in TEXT_READERS:
            return []
        return [pairs for pairs in self._read_lines(format_) if isinstance(pairs, dict)]

    # Frames.

    def _frames(self) -> None:
        self._timeline.numbering.numbers.modulus = self._timeline.numbering.clock.modulus = 1 << 32
        self._timeline.numbering.tick_s = 1e-6
        for piece in self._pieces(END):
            first, self._first = self._first, False
            payload = payload_of(piece[:-1])
            if payload is None:
                if len(piece) == 1:
                    self._accounts.read(piece)
                elif first:
                    self._accounts.cut(piece)
                else:
                    self._accounts.reject(piece, "crc")
                    self._bad_in_a_row += 1
                continue
            self._bad_in_a_row = 0
            sample = sample_of(payload)
            if sample is not None:
                self._accounts.read(piece)
                self._take_counts(Row(sample[0], sample[1], list(sample[2]), self._at, piece))
            elif self._take_info(info_of(payload)):
                self._accounts.read(piece)
                self._name_waiting()
            else:
                self._accounts.reject(piece, "malformed")
        self._name_waiting(force=self._at - self._unnamed_since > _PATIENCE_S)
        self._trim(LONGEST)

    def _take_counts(self, row: Row) -> None:
        if self.layout is None or len(self.layout.channels) != len(row.values):
            self.layout = None
            self._unnamed_since = min(self._unnamed_since, self._at)
            self._unnamed.append(row)
        else:
            self._number(row._replace(values=[self.layout.per_count * count for count in row.values]))

    def _name_waiting(self, force: bool = False) -> None:
        """Samples that waited for their channels' names, once these are known, or as they are if `force`."""
        if not self._unnamed or (self.layout is None and not force):
            return
        waiting, self._unnamed, self._unnamed_since = self._unnamed, [], math.inf
        for row in waiting:
            if self.layout is None or len(self.layout.channels) != len(row.values):
                self.layout = Layout(tuple(f"channel{k + 1}" for k in range(len(row.values))))
            self._number(row._replace(values=[self.layout.per_count * count for count in row.values]))

    def _take_info(self, info: dict[str, Any] | None) -> bool:
        """Take the layout from an INFO; False if it is invalid."""
        if info is None:
            return False
        names, factor = info.get("channels"), info.get("unit_per_count", 1.0)
        if not isinstance(names, list) or not isinstance(factor, int | float) or not abs(factor) < 1e100:
            return False
        if not names or not all(isinstance(name, str) and name for name in names):
            return False
        if len(set(names)) < len(names):
            return False
        self.layout = Layout(tuple(names), str(info.get("unit", "")), float(factor))
        return True

    # Text.

    def _lines(self) -> None:
        for piece in self._pieces(b"\n"):
            first, self._first = self._first, False
            line = text_of(piece) if len(piece) <= _LONGEST_LINE else None
            self._line += 1
            if line == "":
                self._accounts.read_line(piece)
            elif line is not None and self._take_line(line, piece, first):
                self._bad_in_a_row = 0
                self._accounts.read_line(piece)
            elif first:
                # It may be the rest of one.
                self._accounts.cut(piece)
            else:
                self._accounts.reject(piece, "malformed")
                # Text holds no zero bytes: each may be the end of a frame.
                self._bad_in_a_row += 1 + piece.count(END)
        self._trim(_LONGEST_LINE)

    def _take_line(self, line: str, piece: bytes, first: bool) -> bool:
        """Read a line of the present format; False if it is not one."""
        if self.format == "csv":
            return self._take_csv(line, piece, first)
        found = None if first else json_of(line) if self.format == "json" else pairs_of(line)
        if found is None:
            return False
        strange, self.layout = self._names.strange(channels_of(found), self.layout, self._line)
        if strange and strange == set(channels_of(found)):
            return False
        known = set() if self.layout is None else set(self.layout.channels)
        if strange and (not known or known - found.keys()):
            # It lacks one name and has another: a name that was damaged on its way.
            return False
        if strange:
            self.counters.incomplete += 1
            self.rejects.append(Reject("new name", piece))
            found = {name: value for name, value in found.items() if name not in strange}
        if self.format == "json":
            self._take_pairs(found, piece)
            return True
        # A label a line: a sample ends where a label comes again, or where every known one has come.
        if self._pending.keys() & found.keys():
            self._flush_pending()
        self._pending |= found
        self._pending_at = self._at
        if known and known <= self._pending.keys():
            self._flush_pending(piece)
        return True

    def _flush_pending(self, piece: bytes = b"") -> None:
        pending, self._pending = self._pending, {}
        if pending:
            self._take_pairs(pending, piece, self._pending_at)

    def _take_csv(self, line: str, piece: bytes, first: bool) -> bool:
        pairs = self._csv.take(line, piece, first)
        for header in self._csv.refused:
            self._accounts.reject_after_all(header)
        self._csv.refused.clear()
        if pairs:
            self._take_pairs(pairs, piece)
        return pairs is not None

    def _take_pairs(self, found: Pairs, piece: bytes, at: float | None = None) -> None:
        """A sample of the present layout, with number and clock separated from its values.

        at: host time of its arrival, that of the present piece if None.
        """
        pairs = dict(found)
        number = next((pairs.pop(name) for name in NUMBERS if name in pairs), None)
        ticks, numbering = None, self._timeline.numbering
        for name, (tick_s, modulus) in CLOCKS.items():
            if name in pairs:
                ticks = pairs.pop(name)
                numbering.tick_s, numbering.clock.modulus = tick_s, modulus
                break
        if not pairs:
            return
        if self.layout is None or (self.format == "csv" and self.layout.channels != tuple(pairs)):
            self.layout = Layout(tuple(pairs))
        values = [pairs.get(name, math.nan) for name in self.layout.channels]
        if len(pairs) < len(values):
            self.counters.incomplete += 1
        self._number(Row(number, ticks, values, self._at if at is None else at, piece))

    def _number(self, row: Row) -> None:
        assert self.layout is not None
        self._timeline.take(self.layout, row)
