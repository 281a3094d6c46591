"""Bytes from a serial line to samples: the format told apart, what is lost or damaged counted."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from .clock import Endless, HostTime
from .framing import END, LONGEST, info_of, payload_of, sample_of
from .lines import CLOCKS, NUMBERS, Pairs, header_of, json_of, pairs_of, row_of

Array = np.ndarray[Any, Any]

FORMATS = ("frames", "json", "labels", "csv")
# Without a format found: enough for a few of the longest lines, little enough for any memory.
_MOST_UNTOLD = 16384
_LONGEST_LINE = 4096
_ENOUGH = 3
# Pieces in a row that mean nothing in the format found: the device speaks another one now.
_LOST_THREAD = 50
# A running number this far behind is not an old sample but a device that started anew.
_RESTART = 1000


@attrs.define
class Counters:
    """What has come over a line so far, and what has not come whole."""

    bytes: int = 0
    samples: int = 0
    lost: int = 0
    """Samples that gaps in the running number say are missing."""
    repeated: int = 0
    """Samples that came again or out of order, and were left out."""
    crc_errors: int = 0
    malformed: int = 0
    """Lines or frames that could not be read."""
    overlong: int = 0
    """Bytes thrown away because nothing ended them."""
    restarts: int = 0
    """Times the device's clock or running number began anew."""


@attrs.frozen
class Layout:
    """What a sample holds: channels by name, the unit of their values (or none), and its size a count."""

    channels: tuple[str, ...]
    unit: str = ""
    per_count: float = 1.0


@attrs.frozen(eq=False)
class Samples:
    """Samples of one layout in the order they came.

    host_s (n,): seconds on the host's clock, rising; device_s (n,): the device's own, without wraps, or nan;
    sequence (n,): running number without wraps, counted on where the device sends none; values (n, c).
    """

    layout: Layout
    host_s: Array
    device_s: Array
    sequence: Array
    values: Array

    def __len__(self) -> int:
        return len(self.host_s)


# Of one sample: running number or None, ticks of the device's clock or None, values.
_Row = tuple[float | None, float | None, list[float]]
# A device says what its frames hold about once a second; samples that come before wait for it.
_PATIENCE_S = 1.5
# Least step of the host's time from sample to sample, the last digit that a recording has.
_TICK_S = 1e-6
# A device that starts anew soon after its start looks like one that repeats itself.
_REPEATS = 20


class Decoder:
    """Feed it bytes as they come; it keeps at most a few kilobytes of them."""

    def __init__(self) -> None:
        self.counters = Counters()
        self.format: str | None = None
        self._last_format: str | None = None
        self.layout: Layout | None = None
        self._buffer = bytearray()
        self._first = True
        self._bad_in_a_row = 0
        self._columns: list[str] | None = None
        self._pending: Pairs = {}
        self._new_names: dict[str, int] = {}
        self._unnamed: list[_Row] = []
        self._unnamed_since = math.inf
        self._host = HostTime()
        self._numbers, self._sequence = Endless(None), -1
        self._clock, self._tick_s, self._device_s = Endless(None), 1.0, 0.0
        self._repeats = 0
        self._at = math.inf
        self._told = -math.inf

    def interrupted(self) -> None:
        """The line was cut: what is half read is gone, and what comes next may begin in the middle."""
        self._buffer.clear()
        self._pending = {}
        self._first = True

    def feed(self, data: bytes, at: float) -> list[Samples]:
        """Samples in bytes that arrived at host time `at` in s, a group for each layout they came in."""
        self.counters.bytes += len(data)
        self._buffer += data
        if self.format is None:
            self._tell()
            if self.format is None:
                self._trim(_MOST_UNTOLD)
                return []
        groups = self._frames(at) if self.format == "frames" else self._lines()
        if self._bad_in_a_row >= _LOST_THREAD:
            self.format, self._bad_in_a_row = None, 0
        return self._timed_groups(groups, at)

    def finish(self, at: float) -> list[Samples]:
        """What still waits for a device to name its channels, or for the rest of a sample."""
        groups = self._named(force=True)
        if self._pending and self.layout is not None:
            row = self._row(self._pending)
            groups += [(self.layout, [row])] if row is not None else []
            self._pending = {}
        return self._timed_groups(groups, at)

    def _timed_groups(self, groups: list[tuple[Layout, list[_Row]]], at: float) -> list[Samples]:
        result = [self._timed(layout, rows, at) for layout, rows in groups if rows]
        if result:
            self._at = at
        return [samples for samples in result if len(samples)]

    def _trim(self, most: int) -> None:
        if len(self._buffer) > most:
            excess = len(self._buffer) - most // 2
            del self._buffer[:excess]
            self.counters.overlong += excess
            self._first = True
            # No line or frame is that long: it may be another format's.
            self._bad_in_a_row = _LOST_THREAD

    def _tell(self) -> None:
        """Find the format by what most of the whole pieces so far can be read as."""
        found = self._most_read()
        if found is not None and found != self._last_format:
            self.layout, self._columns, self._pending, self._new_names = None, None, {}, {}
            self._numbers.last = self._clock.last = None
            self._host.restart()
        if found is not None:
            self.format = self._last_format = found

    def _most_read(self) -> str | None:
        frames = [p for p in bytes(self._buffer).split(END)[1:-1] if p]
        if sum(payload_of(p) is not None for p in frames) >= _ENOUGH:
            return "frames"
        lines = [_text(p) for p in bytes(self._buffer).split(b"\n")[1:-1]]
        lines = [line for line in lines if line]
        readers: dict[str, Callable[[str], object]] = {"json": json_of, "labels": pairs_of, "csv": row_of}
        read = {
            name: sum(reader(line) is not None for line in lines if line) for name, reader in readers.items()
        }
        best = max(read, key=lambda name: read[name])
        return best if read[best] >= _ENOUGH and 2 * read[best] > len(lines) else None

    def _pieces(self, end: bytes, longest: int) -> list[bytes]:
        """Whole pieces between ends, without the first, which may be the rest of one."""
        *pieces, rest = bytes(self._buffer).split(end)
        if pieces:
            self._buffer = bytearray(rest)
        self._trim(longest)
        return pieces

    def _frames(self, at: float) -> list[tuple[Layout, list[_Row]]]:
        self._numbers.modulus = self._clock.modulus = 1 << 32
        self._tick_s = 1e-6
        groups: list[tuple[Layout, list[_Row]]] = []
        for piece in self._pieces(END, LONGEST):
            first, self._first = self._first, False
            payload = payload_of(piece)
            if payload is None:
                if piece and not first:
                    self.counters.crc_errors += 1
                    self._bad_in_a_row += 1
                continue
            self._bad_in_a_row = 0
            sample = sample_of(payload)
            info = info_of(payload) if sample is None else None
            if info is not None:
                self._take_info(info)
                groups += self._named()
            elif sample is None:
                self.counters.malformed += 1
            elif self.layout is None or len(self.layout.channels) != len(sample[2]):
                self.layout = None
                self._unnamed_since = min(self._unnamed_since, at)
                self._unnamed.append((sample[0], sample[1], list(sample[2])))
            else:
                values = [self.layout.per_count * count for count in sample[2]]
                self._add(groups, self.layout, (sample[0], sample[1], values))
        return groups + self._named(force=at - self._unnamed_since > _PATIENCE_S)

    def _named(self, force: bool = False) -> list[tuple[Layout, list[_Row]]]:
        """Samples that waited for their channels' names, once these are known, or as they are if `force`."""
        if not self._unnamed or (self.layout is None and not force):
            return []
        groups: list[tuple[Layout, list[_Row]]] = []
        for number, ticks, counts in self._unnamed:
            if self.layout is None or len(self.layout.channels) != len(counts):
                self.layout = Layout(tuple(f"channel{k + 1}" for k in range(len(counts))))
            values = [self.layout.per_count * count for count in counts]
            self._add(groups, self.layout, (number, ticks, values))
        self._unnamed, self._unnamed_since = [], math.inf
        return groups

    def _take_info(self, info: dict[str, Any]) -> None:
        names, factor = info.get("channels"), info.get("unit_per_count", 1.0)
        good = (
            isinstance(names, list)
            and all(isinstance(name, str) and name for name in names)
            and len(set(names)) == len(names) > 0
            and isinstance(factor, int | float)
            and math.isfinite(factor)
        )
        if good and names is not None:
            self.layout = Layout(tuple(names), str(info.get("unit", "")), float(factor))
        else:
            self.counters.malformed += 1

    def _lines(self) -> list[tuple[Layout, list[_Row]]]:
        groups: list[tuple[Layout, list[_Row]]] = []
        for piece in self._pieces(b"\n", _LONGEST_LINE):
            first, self._first = self._first, False
            line = _text(piece)
            if line == "":
                continue
            pairs = None if line is None else self._read(line, first)
            if pairs is None:
                # The first line may be the rest of one; a header is no sample.
                if not first and (line is None or header_of(line) is None):
                    self.counters.malformed += 1
                    # Text holds no zero bytes: each may be the end of a frame.
                    self._bad_in_a_row += 1 + piece.count(END)
                continue
            self._bad_in_a_row = 0
            for whole in pairs:
                row = self._row(whole)
                if row is not None and self.layout is not None:
                    self._add(groups, self.layout, row)
        return groups

    def _read(self, line: str, first: bool) -> list[Pairs] | None:
        """Whole samples that a line completes, or None if it is none of this format."""
        if self.format == "csv":
            header = header_of(line)
            if header is not None:
                self._columns = header
                return None
            row = row_of(line)
            if row is None or first:
                return None
            if self._columns is None or len(self._columns) != len(row):
                if self._columns is not None:
                    return None
                self._columns = [f"channel{k + 1}" for k in range(len(row))]
            return [dict(zip(self._columns, row, strict=True))]
        if first:
            return None
        if self.format == "json":
            found = json_of(line)
            return None if found is None else [found]
        found = pairs_of(line)
        return None if found is None else self._completed(found)

    def _completed(self, found: Pairs) -> list[Pairs]:
        """Samples told a label a line end where a label comes again, or where every known one has come."""
        whole = []
        if self._pending.keys() & found.keys():
            whole.append(self._pending)
            self._pending = {}
        self._pending |= found
        known = set() if self.layout is None else set(self.layout.channels)
        if known and known <= self._pending.keys():
            whole.append(self._pending)
            self._pending = {}
        return whole

    def _row(self, pairs: Pairs) -> _Row | None:
        """A sample of the present layout, which grows by names that keep coming."""
        number = next((pairs.pop(name) for name in NUMBERS if name in pairs), None)
        ticks = None
        for name, (tick_s, modulus) in CLOCKS.items():
            if name in pairs:
                ticks = pairs.pop(name)
                self._tick_s, self._clock.modulus = tick_s, modulus
                break
        if not pairs:
            return None
        if self.layout is None or (self.format == "csv" and self.layout.channels != tuple(pairs)):
            self.layout = Layout(tuple(pairs))
        for name in pairs.keys() - set(self.layout.channels):
            self._new_names[name] = self._new_names.get(name, 0) + 1
            if self._new_names[name] >= _ENOUGH:
                self.layout = attrs.evolve(self.layout, channels=(*self.layout.channels, name))
        return number, ticks, [pairs.get(name, math.nan) for name in self.layout.channels]

    @staticmethod
    def _add(groups: list[tuple[Layout, list[_Row]]], layout: Layout, row: _Row) -> None:
        if not groups or groups[-1][0] != layout:
            groups.append((layout, []))
        groups[-1][1].append(row)

    def _timed(self, layout: Layout, rows: list[_Row], at: float) -> Samples:
        """Rows with running number and clock made endless, without those that came before."""
        kept: list[tuple[int, float, list[float]]] = []
        for number, ticks, values in rows:
            if self._count(number, ticks, at):
                device_s = math.nan if ticks is None else self._device_s
                kept.append((self._sequence, device_s, values))
        self.counters.samples += len(kept)
        sequence = np.array([row[0] for row in kept], dtype=np.int64)
        device = np.array([row[1] for row in kept], dtype=float)
        timed = np.isfinite(device)
        host = np.full(len(kept), at)
        if timed.any():
            self._host.learn(float(device[timed][-1]), at)
            host[timed] = self._host.of(device[timed])
        # A mapping that has learned better may be a little behind what was told before.
        rising = _TICK_S * np.arange(len(kept))
        host = np.maximum.accumulate(np.maximum(host - rising, self._told)) + rising
        self._told = float(host[-1]) + _TICK_S if len(kept) else self._told
        width = len(layout.channels)
        table = np.array([row[2] for row in kept], dtype=float).reshape(len(kept), width)
        return Samples(layout, host, device, sequence, table)

    def _count(self, number: float | None, ticks: float | None, at: float) -> bool:
        """Take a sample's running number and clock into the endless ones; False if it came before."""
        passed_s = max(0.0, at - self._at) if math.isfinite(self._at) else 0.0
        known = self._sequence >= 0
        ahead = 1.0 if number is None or self._numbers.last is None else self._numbers.ahead(number)
        later = 0.0 if ticks is None else self._clock.ahead(ticks, passed_s / self._tick_s)
        again = ahead <= 0 or (number is None and later < 0)
        restarted = (ahead <= -_RESTART) or (later * self._tick_s < -1.0)
        if again and not restarted and self._repeats < _REPEATS:
            self._repeats += 1
            self.counters.repeated += 1
            return False
        if again or restarted:
            self.counters.restarts += 1
            self._host.restart()
            ahead, later = 1.0, passed_s / self._tick_s
        self._repeats = 0
        self.counters.lost += max(0, int(ahead) - 1) if known else 0
        # The first number of all is taken as it is.
        self._sequence = int(number) if not known and number is not None else self._sequence + int(ahead)
        self._device_s += later * self._tick_s
        if ticks is not None and self._clock.last is None:
            self._device_s = ticks * self._tick_s
        self._numbers.last, self._clock.last = number, ticks
        return True


def _text(piece: bytes) -> str | None:
    """A line as text without blanks around it, or None if it is none."""
    try:
        line = piece.decode().strip()
    except UnicodeDecodeError:
        return None
    return line if line.isprintable() or "\t" in line else None
