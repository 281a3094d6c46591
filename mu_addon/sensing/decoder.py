"""Bytes from a serial line to samples: the format told apart, every byte that gives none counted and kept.

What arrives is in a line or frame that was read, in one that could not be, in one cut by the beginning, a
pulled cable or the end, in a stretch that nothing ended, or still in the buffer:
bytes = read_bytes + rejected_bytes + cut_bytes + overlong + buffered.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import attrs
import numpy as np

from .clock import HostTime
from .framing import END, LONGEST, info_of, payload_of, sample_of
from .lines import CLOCKS, NUMBERS, Pairs, header_of, json_of, pairs_of, pairs_of_row, row_of
from .numbering import Numbered, Numbering, Row

Array = np.ndarray[Any, Any]

FORMATS = ("frames", "json", "labels", "csv")
# Without a format found: enough for a few of the longest lines, little enough for any memory.
_MOST_UNREAD_BYTES = 16384
_LONGEST_LINE = 4096
_ENOUGH = 3
# The format is told by the latest lines: what a device says while it starts is soon past.
_LATEST_LINES = 20
# Pieces in a row that mean nothing in the format found: the device speaks another one now.
_LOST_THREAD = 50
# A name that is new must come this often within so many lines; more, if its line lacks nothing else.
_NEW_WITHIN, _MORE_WITHIN = 12, 64
# So many bytes without a format are enough to say what is wrong with them.
_COMPLAINT_BYTES = 400
# A text's share of characters that can be printed; half of all bytes can, in noise a third.
_TEXT = 0.9
# A device says what its frames hold about once a second; samples that come before wait for it.
_PATIENCE_S = 1.5
# Least step of the host's time from sample to sample, the last digit that a recording has.
_TICK_S = 1e-6

_READERS: dict[str, Callable[[str], Pairs | list[float] | None]] = {
    "json": json_of,
    "labels": pairs_of,
    "csv": row_of,
}


@attrs.define
class Counters:
    """Counts of bytes, samples, and faults on a line since the decoder began."""

    bytes: int = 0
    samples: int = 0
    lost: int = 0
    """Samples that gaps in the running number say are missing."""
    repeated: int = 0
    """Samples that came again, the same in number, clock and values, and were left out."""
    misnumbered: int = 0
    """Samples whose running number or clock fits neither before nor after; kept, and counted on."""
    incomplete: int = 0
    """Samples without a channel that others have (nan), or with one not yet recorded."""
    crc_errors: int = 0
    malformed: int = 0
    """Lines or frames that could not be read."""
    restarts: int = 0
    """Times the device's clock or running number began anew."""
    read_bytes: int = 0
    """Bytes of lines and frames that were read."""
    rejected_bytes: int = 0
    """Bytes of lines and frames that could not be read, or have a wrong CRC."""
    overlong: int = 0
    """Bytes of stretches longer than any line or frame, that nothing ended."""
    cut_bytes: int = 0
    """Bytes of lines cut by the beginning, by a pulled cable or by the end."""


class Reject(NamedTuple):
    """Bytes that gave no sample, and why: malformed, crc, repeated, new name, no end, cut."""

    why: str
    raw: bytes


@attrs.frozen
class Layout:
    """What a sample holds: names of its channels, the unit of their values (or none), size of a count.

    per_count: in `unit`; raw counts of frames are multiplied by it.
    """

    channels: tuple[str, ...]
    unit: str = ""
    per_count: float = 1.0


@attrs.frozen(eq=False)
class Samples:
    """n samples of one layout with c channels, in the order they came.

    host_s (n,): seconds on the host's clock, rising; device_s (n,): the device's own in s, without wraps, or
    nan; sequence (n,): running number without wraps, counted on where the device sends none; values (n, c) in
    the layout's unit.
    """

    layout: Layout
    host_s: Array
    device_s: Array
    sequence: Array
    values: Array

    def __len__(self) -> int:
        return len(self.host_s)


class Decoder:
    """Converts the bytes of a serial line to samples; knows binary frames, label:value pairs, CSV and JSON.

    `feed` takes bytes as they come and returns the samples that are complete. Lost and damaged samples are
    counted in `counters`. It keeps at most a few kilobytes of input.
    """

    def __init__(self) -> None:
        self.counters = Counters()
        self.format: str | None = None
        self.layout: Layout | None = None
        self.rejects: list[Reject] = []
        """What gave no sample, for the caller to keep and to clear."""
        self._last_format: str | None = None
        self._buffer = bytearray()
        self._first = True
        self._bad_in_a_row = 0
        self._at = 0.0
        self._out: list[tuple[Layout, Numbered]] = []
        self._numbering = Numbering()
        self._layouts: deque[Layout] = deque()
        self._host = HostTime()
        self._last_host_s = -math.inf
        self._unrecognised = bytearray()
        # CSV: the names of columns, a header that waits for its first row, the width of most rows.
        self._columns: list[str] | None = None
        self._header: tuple[list[str], bytes] | None = None
        self._header_rows = 0
        self._width, self._other_widths = 0, [0, 0]
        self._rows_of: Counter[int] = Counter()
        self._columns_of: dict[int, list[str]] = {}
        # Labels: a sample that is not whole yet; names that were read wrong, or will be channels.
        self._pending: Pairs = {}
        self._doubtful: set[str] = set()
        self._new_names: dict[str, deque[int]] = {}
        self._line = 0
        # Frames: samples that wait for the names of their channels.
        self._unnamed: list[Row] = []
        self._unnamed_since = math.inf

    def interrupted(self) -> None:
        """Process pending input as it is: the line was cut, and the next bytes may begin within a frame."""
        self._flush_pending()
        self._flush_buffer()
        self._first = True

    def feed(self, data: bytes, at: float) -> list[Samples]:
        """Samples in bytes that arrived at host time `at` in s, a group for each run with one layout."""
        self.counters.bytes += len(data)
        self._buffer += data
        self._at = at
        if self.format is None:
            self._detect_format()
        self._take_pieces()
        if self.format is None:
            self._trim_unrecognised()
        if self._bad_in_a_row >= _LOST_THREAD:
            self.format, self._bad_in_a_row = None, 0
        return self._timed_groups()

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
        self._number_on(self._numbering.finish())
        return self._timed_groups()

    @property
    def complaint(self) -> tuple[str, str] | None:
        """What is wrong with input of which almost nothing can be read, and what to do; else None."""
        counted = self.counters
        unread = counted.bytes - counted.read_bytes
        if self.format is not None or unread < _COMPLAINT_BYTES or 20 * counted.read_bytes > counted.bytes:
            return None
        seen = bytes(self._unrecognised[-4096:] + self._buffer[-4096:])
        shown = sum(32 <= byte < 127 or byte in b"\t\r\n" for byte in seen)
        if shown < _TEXT * len(seen):
            return (
                "what comes is noise: neither text nor frames, as with a wrong baud rate",
                "give the rate of the device's Serial.begin(...) by --baud (9600, 57600, 115200, ...), "
                "and check the wiring and the port",
            )
        return (
            "what comes is text in no format that is known",
            "send `label:value` pairs, CSV, JSON lines or frames (docs/sensing.md), or choose another port",
        )

    # Accounts: each byte is counted once.

    def _read_piece(self, piece: bytes) -> None:
        self.counters.read_bytes += len(piece)

    def _reject(self, piece: bytes, why: str) -> None:
        self.counters.rejected_bytes += len(piece)
        if why == "crc":
            self.counters.crc_errors += 1
        else:
            self.counters.malformed += 1
        self.rejects.append(Reject(why, piece))

    def _cut(self, piece: bytes) -> None:
        if piece:
            self.counters.cut_bytes += len(piece)
            self.rejects.append(Reject("cut", piece))

    def _unended(self, piece: bytes) -> None:
        self.counters.overlong += len(piece)
        self.rejects.append(Reject("no end", piece))

    def _flush_buffer(self) -> None:
        """Empty the buffer: whole lines of no known format are unreadable, the rest was cut."""
        rest = bytes(self._buffer)
        self._buffer.clear()
        if self.format is None:
            *lines, rest = rest.split(b"\n")
            self._reject_lines(lines)
        if len(rest) > _LONGEST_LINE:
            self._unended(rest)
        else:
            self._cut(rest)

    def _reject_lines(self, lines: Iterable[bytes]) -> None:
        for line in lines:
            self._unrecognised = (self._unrecognised + line + b"\n")[-4096:]
            if line.strip():
                self._reject(line + b"\n", "malformed")
            else:
                self._read_piece(line + b"\n")

    def _trim_unrecognised(self) -> None:
        """Keep the latest half of bytes in which no format is found."""
        if len(self._buffer) <= _MOST_UNREAD_BYTES:
            return
        excess = len(self._buffer) - _MOST_UNREAD_BYTES // 2
        end = self._buffer.rfind(b"\n", 0, excess) + 1
        if end:
            self._reject_lines(bytes(self._buffer[: end - 1]).split(b"\n"))
            del self._buffer[:end]
        else:
            self._drop(excess)
        self._first = not end

    def _trim(self, most: int) -> None:
        """No line or frame is that long: it may be another format's."""
        if len(self._buffer) > most:
            self._drop(len(self._buffer) - most // 2)
            self._first = True
            self._bad_in_a_row = _LOST_THREAD

    def _drop(self, count: int) -> None:
        self._unrecognised = (self._unrecognised + self._buffer[:count])[-4096:]
        self._unended(bytes(self._buffer[:count]))
        del self._buffer[:count]

    # The format.

    def _take_pieces(self) -> None:
        if self.format == "frames":
            self._frames()
        elif self.format is not None:
            self._lines()

    def _detect_format(self, enough: int = _ENOUGH) -> None:
        """Find the format by what most of the latest whole pieces can be read as."""
        found = self._most_read(enough)
        if found is None:
            return
        if found != self._last_format:
            self._flush_pending()
            self._number_on(self._numbering.forget())
            self._host.restart()
            self.layout, self._columns, self._header, self._new_names = None, None, None, {}
            self._rows_of, self._columns_of = Counter(), {}
        self.format = self._last_format = found
        self._learn_names(found)

    def _most_read(self, enough: int) -> str | None:
        whole = 1 if self._first else 0
        data = bytes(self._buffer)
        frames = [p for p in data.split(END)[whole:-1] if p]
        framed = sum(payload_of(p) is not None for p in frames)
        if framed >= enough or (framed and self._last_format == "frames"):
            return "frames"
        lines = self._whole_lines()[-_LATEST_LINES:]
        read = {
            name: sum(reader(line) is not None for line in lines if line) for name, reader in _READERS.items()
        }
        best = max(read, key=lambda name: read[name])
        if read[best] >= enough and 2 * read[best] > len(lines):
            return best
        # One that was there before needs less to be believed again.
        last = self._last_format
        return last if last in _READERS and any(_READERS[last](line or "") for line in lines) else None

    def _whole_lines(self) -> list[str | None]:
        lines = [_text(p) for p in bytes(self._buffer).split(b"\n")[1 if self._first else 0 : -1]]
        return [line for line in lines if line != ""]

    def _learn_names(self, found: str) -> None:
        """What most lines agree on, lest a damaged one that comes first should set it."""
        self._width, self._other_widths = 0, [0, 0]
        self._doubtful = set()
        if found not in _READERS:
            return
        lines = [found_in for line in self._whole_lines() if line and (found_in := _READERS[found](line))]
        if found == "csv":
            self._width = Counter(map(len, lines)).most_common(1)[0][0] if lines else 0
            return
        sets = Counter(tuple(_channels(line)) for line in lines)
        names = Counter(name for line in lines for name in _channels(line))
        if self.layout is None and sets:
            most, times = sets.most_common(1)[0]
            if len(most) > 1 and 4 * times >= 3 * len(lines):
                self.layout = Layout(most)
        commonest = max(names.values(), default=0)
        self._doubtful = {name for name, times in names.items() if 2 * times < commonest}

    def _pieces(self, end: bytes) -> list[bytes]:
        """Whole pieces, their ends included."""
        *pieces, rest = bytes(self._buffer).split(end)
        if pieces:
            self._buffer = bytearray(rest)
        return [piece + end for piece in pieces]

    # Frames.

    def _frames(self) -> None:
        self._numbering.numbers.modulus = self._numbering.clock.modulus = 1 << 32
        self._numbering.tick_s = 1e-6
        for piece in self._pieces(END):
            first, self._first = self._first, False
            payload = payload_of(piece[:-1])
            if payload is None:
                if len(piece) == 1:
                    self._read_piece(piece)
                elif first:
                    self._cut(piece)
                else:
                    self._reject(piece, "crc")
                    self._bad_in_a_row += 1
                continue
            self._bad_in_a_row = 0
            sample = sample_of(payload)
            if sample is not None:
                self._read_piece(piece)
                self._take_counts(Row(sample[0], sample[1], list(sample[2]), self._at, piece))
            elif self._take_info(info_of(payload)):
                self._read_piece(piece)
                self._name_waiting()
            else:
                self._reject(piece, "malformed")
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
        """Take the layout that an INFO tells; False if it makes no sense."""
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
            line = _text(piece) if len(piece) <= _LONGEST_LINE else None
            self._line += 1
            if line == "":
                self._read_piece(piece)
            elif line is not None and self._take_line(line, piece, first):
                self._bad_in_a_row = 0
                self._read_piece(piece)
            elif first:
                # It may be the rest of one.
                self._cut(piece)
            else:
                self._reject(piece, "malformed")
                # Text holds no zero bytes: each may be the end of a frame.
                self._bad_in_a_row += 1 + piece.count(END)
        self._trim(_LONGEST_LINE)

    def _take_line(self, line: str, piece: bytes, first: bool) -> bool:
        """Read a line of the present format; False if it is none."""
        if self.format == "csv":
            return self._take_csv(line, piece, first)
        found = None if first else json_of(line) if self.format == "json" else pairs_of(line)
        if found is None:
            return False
        strange = self._strange(_channels(found))
        if strange and strange == set(_channels(found)):
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
        if known and known <= self._pending.keys():
            self._flush_pending(piece)
        return True

    def _flush_pending(self, piece: bytes = b"") -> None:
        pending, self._pending = self._pending, {}
        if pending:
            self._take_pairs(pending, piece)

    def _strange(self, names: list[str]) -> set[str]:
        """Names that are no channels, or not yet: those that keep coming become channels."""
        if self.layout is None:
            return {name for name in names if name in self._doubtful}
        known = set(self.layout.channels)
        unknown = [name for name in names if name not in known]
        within = _NEW_WITHIN + 3 * len(known) if known - set(names) else _MORE_WITHIN
        strange = set()
        for name in unknown:
            came = self._new_names.setdefault(name, deque(maxlen=_ENOUGH))
            came.append(self._line)
            if len(came) == _ENOUGH and came[-1] - came[0] <= within:
                self.layout = attrs.evolve(self.layout, channels=(*self.layout.channels, name))
                del self._new_names[name]
            else:
                strange.add(name)
        if len(self._new_names) > 1000:
            old = self._line - _MORE_WITHIN
            self._new_names = {name: came for name, came in self._new_names.items() if came[-1] > old}
        return strange

    def _take_csv(self, line: str, piece: bytes, first: bool) -> bool:
        row = row_of(line)
        if row is None:
            header = header_of(line)
            if header is None:
                return False
            self._no_header()
            self._header, self._header_rows = (header, piece), 0
            return True
        if first:
            return False
        if self._header is not None and len(self._header[0]) == len(row):
            self._columns, self._header = self._header[0], None
        self._header_rows += 1
        if self._header_rows >= _ENOUGH:
            self._no_header()
        width = self._width if self._columns is None else len(self._columns)
        if len(row) != width and self._rows_of[len(row)] > self._rows_of[width]:
            # Back to what there was before a few damaged rows.
            self._columns = self._columns_of[len(row)]
        elif len(row) != width:
            # Rows of another width that keep coming are the device's new ones.
            times = self._other_widths[1] + 1 if self._other_widths[0] == len(row) else 1
            self._other_widths = [len(row), times]
            if times < _ENOUGH:
                return False
            self._columns = None
        if self._columns is None:
            self._columns = [f"channel{k + 1}" for k in range(len(row))]
        self._other_widths = [0, 0]
        pairs = pairs_of_row(self._columns, row)
        if pairs is None:
            return False
        self._rows_of[len(row)] += 1
        self._columns_of[len(row)] = self._columns
        self._take_pairs(pairs, piece)
        return True

    def _no_header(self) -> None:
        """A header that no row of its width followed was none."""
        if self._header is not None:
            self.counters.read_bytes -= len(self._header[1])
            self._reject(self._header[1], "malformed")
            self._header = None

    def _take_pairs(self, found: Pairs, piece: bytes) -> None:
        """A sample of the present layout, with its number and clock told from its values."""
        pairs = dict(found)
        number = next((pairs.pop(name) for name in NUMBERS if name in pairs), None)
        ticks = None
        for name, (tick_s, modulus) in CLOCKS.items():
            if name in pairs:
                ticks = pairs.pop(name)
                self._numbering.tick_s, self._numbering.clock.modulus = tick_s, modulus
                break
        if not pairs:
            return
        if self.layout is None or (self.format == "csv" and self.layout.channels != tuple(pairs)):
            self.layout = Layout(tuple(pairs))
        values = [pairs.get(name, math.nan) for name in self.layout.channels]
        if len(pairs) < len(values):
            self.counters.incomplete += 1
        self._number(Row(number, ticks, values, self._at, piece))

    # Numbers and times.

    def _number(self, row: Row) -> None:
        assert self.layout is not None
        self._layouts.append(self.layout)
        self._number_on(self._numbering.take(row))

    def _number_on(self, settled: list[Numbered]) -> None:
        for _ in self._numbering.left_out:
            self._layouts.pop()
        self.rejects += [Reject("repeated", row.raw) for row in self._numbering.left_out]
        self._numbering.left_out.clear()
        self._out += [(self._layouts.popleft(), numbered) for numbered in settled]

    def _timed_groups(self) -> list[Samples]:
        out, self._out = self._out, []
        groups: list[tuple[Layout, list[Numbered]]] = []
        for layout, numbered in out:
            if not groups or groups[-1][0] != layout:
                groups.append((layout, []))
            groups[-1][1].append(numbered)
        tally = self._numbering.tally
        counted = self.counters
        counted.lost, counted.repeated, counted.restarts = tally.lost, tally.repeated, tally.restarts
        counted.misnumbered = tally.misnumbered
        return [self._timed(layout, rows) for layout, rows in groups]

    def _timed(self, layout: Layout, rows: list[Numbered]) -> Samples:
        """Numbered samples with the device's clock told in the host's."""
        self.counters.samples += len(rows)
        if any(numbered.clock_restarted for numbered in rows):
            self._host.restart()
        sequence = np.array([numbered.sequence for numbered in rows], dtype=np.int64)
        device = np.array([numbered.device_s for numbered in rows])
        host = np.array([numbered.row.at for numbered in rows])
        timed = np.isfinite(device)
        if timed.any():
            self._host.learn(float(device[timed][-1]), float(host[timed][-1]))
            host[timed] = self._host.of(device[timed])
        # A mapping that has learned better may be a little behind what was told before.
        rising = _TICK_S * np.arange(len(rows))
        host = np.maximum.accumulate(np.maximum(host - rising, self._last_host_s)) + rising
        self._last_host_s = float(host[-1]) + _TICK_S
        table = np.array([numbered.row.values for numbered in rows], dtype=float)
        return Samples(layout, host, device, sequence, table.reshape(len(rows), len(layout.channels)))


def _channels(found: Pairs | list[float]) -> list[str]:
    """Names that are neither running number nor clock."""
    return [name for name in found if isinstance(name, str) and name not in NUMBERS and name not in CLOCKS]


def _text(piece: bytes) -> str | None:
    """A line as text without blanks around it, or None if it is none."""
    try:
        line = piece.decode().strip()
    except UnicodeDecodeError:
        return None
    return line if line.replace("\t", " ").isprintable() else None
