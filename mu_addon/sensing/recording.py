"""Recordings of a sensor: CSV that any program reads, written so that a crash loses at most a second.

A recording is a folder:

- recording-000.csv: time_s, device_s, sequence and one column a channel. Another file begins when the
  device's channels change.
- index.ndjson: the layout of the files, a line for every event (connected, lost, format, mark), and one a
  second with row, byte and counters.
- rejects.ndjson: input that gave no sample, a line each: time_s, why, and raw, its bytes as characters U+0000
  to U+00FF (Latin-1).

Rows reach the operating system with every batch and the disk once a second. A killed process loses none of
these, a power cut one second.
"""

from __future__ import annotations

import io
import json
import os
import re
from array import array
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..files import append_lines, make_folder, output_error, plain
from ..reading import file_bytes
from .byte_accounts import Reject
from .samples import Samples

FIXED = ("time_s", "device_s", "sequence")
INDEX = "index.ndjson"
REJECTS = "rejects.ndjson"
VERSION = 1
_SYNC_S = 1.0
# Bytes of a recording's file beyond which it is not read: some six hours of four channels at 5 kHz.
_LONGEST = 1 << 32
# Of what cannot be read no more is kept than this; the counters go on.
_MOST_REJECTS = 100_000_000


def columns_of(samples: Samples) -> tuple[str, ...]:
    """CSV column names of samples of this layout: the fixed ones, then one a channel with its unit.

    Characters that CSV cannot hold are replaced, and names that repeat are numbered.
    """
    unit = f"_{samples.layout.unit}" if samples.layout.unit else ""
    columns = list(FIXED)
    for channel in samples.layout.channels:
        name = _column(f"{channel.strip()}{unit}")
        again = 2
        while name in columns:
            name = f"{_column(channel.strip())}_{again}{_column(unit) if unit else ''}"
            again += 1
        columns.append(name)
    return tuple(columns)


def _column(name: str) -> str:
    """A device's name for a channel, without blanks, separators, quotes and unprintable characters."""
    shown = "".join(c if c.isprintable() else "_" for c in name)
    return re.sub(r"[\s,;\"']", "_", shown)[:200] or "_"


class Recorder:
    """Writes one recording; `folder` must not hold one.

    about: entries for the first line of the index. Raises InputError where the folder holds a recording and
    OutputError where it cannot be written; every method may raise OutputError.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        self.folder = make_folder(folder)
        if (folder / INDEX).exists():
            raise InputError(
                "the folder already contains a recording",
                str(folder),
                "choose another folder; recordings are never overwritten",
            )
        self.rows = 0
        self._file: IO[bytes] | None = None
        self._columns: tuple[str, ...] = ()
        self._number = -1
        self._row = 0
        self._rejects: IO[bytes] | None = None
        self._rejects_left = _MOST_REJECTS
        self._indexed = -np.inf
        try:
            self._index = (folder / INDEX).open("ab", buffering=0)
        except OSError as error:
            raise output_error(error, folder / INDEX) from error
        self._index_line({"type": "recording", "version": VERSION, **about})

    def write(self, samples: Samples, start_s: float) -> None:
        """Append samples with host times counted from start_s, in s; the system has them when this returns.

        A new file begins when the columns change. Raises OutputError.
        """
        columns = columns_of(samples)
        if columns != self._columns:
            self._begin(columns)
        rows = (
            f"{t:.6f},{d:.6f},{n:d},{','.join(map(repr, v))}\n"
            for t, d, n, v in zip(
                (samples.host_s - start_s).tolist(),
                samples.device_s.tolist(),
                samples.sequence.tolist(),
                samples.values.tolist(),
                strict=True,
            )
        )
        self._write("".join(rows).encode())
        self._row += len(samples)
        self.rows += len(samples)

    def reject(self, rejects: Iterable[Reject], time_s: float) -> None:
        """Append the bytes that gave no sample, and why, to rejects.ndjson; time_s in s from the start.

        Nothing is kept beyond some 100 MB. Raises OutputError.
        """
        messages = [
            {"time_s": round(time_s, 6), "why": why, "raw": raw.decode("latin-1")} for why, raw in rejects
        ]
        data = "".join(json.dumps(message) + "\n" for message in messages).encode()
        if not data or self._rejects_left <= 0:
            return
        path = self.folder / REJECTS
        try:
            if self._rejects is None:
                self._rejects = path.open("ab", buffering=0)
            append_lines(self._rejects, data)
        except OSError as error:
            raise output_error(error, path) from error
        self._rejects_left -= len(data)
        if self._rejects_left <= 0:
            self.event(
                "rejects_full", time_s, detail=f"{REJECTS} is no longer written; bytes are still counted"
            )

    def tick(self, time_s: float, counters: Mapping[str, int]) -> None:
        """Once a second, write file position and counters to the index, and everything to the disk.

        time_s: in s from the start; a call within a second of the last entry does nothing. Raises
        OutputError.
        """
        if time_s - self._indexed < _SYNC_S:
            return
        self._indexed = time_s
        place = 0 if self._file is None else self._file.tell()
        self._index_line({"type": "place", "time_s": time_s, "row": self._row, "byte": place, **counters})
        self._sync()

    def event(self, name: str, time_s: float, **details: Any) -> None:
        """Append an event to the index: name, time_s in s from the start, details; raises OutputError."""
        self._index_line(
            {"type": "event", "event": name, "time_s": round(time_s, 6), "row": self._row, **details}
        )

    def close(self) -> None:
        """Write everything to the disk and close the files, which may be closed; raises OutputError."""
        with ExitStack() as closing:
            for stream in self._open:
                closing.callback(stream.close)
            self._sync()

    def _begin(self, columns: tuple[str, ...]) -> None:
        if self._file is not None:
            self._sync()
            self._file.close()
            self._file = None
        self._number += 1
        self._row, self._columns = 0, columns
        path = self.folder / f"recording-{self._number:03d}.csv"
        try:
            self._file = path.open("ab", buffering=0)
        except OSError as error:
            raise output_error(error, path) from error
        self._write((",".join(columns) + "\n").encode())
        self._index_line({"type": "file", "file": path.name, "columns": columns})

    def _write(self, data: bytes) -> None:
        assert self._file is not None
        try:
            append_lines(self._file, data)
        except OSError as error:
            raise output_error(error, Path(self._file.name)) from error

    def _index_line(self, message: Mapping[str, Any]) -> None:
        try:
            append_lines(self._index, json.dumps(plain(message)).encode() + b"\n")
        except OSError as error:
            raise output_error(error, self.folder / INDEX) from error

    @property
    def _open(self) -> list[IO[bytes]]:
        """The files that are open now."""
        return [s for s in (self._file, self._rejects, self._index) if s is not None and not s.closed]

    def _sync(self) -> None:
        for stream in self._open:
            try:
                os.fsync(stream.fileno())
            except OSError as error:
                raise output_error(error, Path(stream.name)) from error


@attrs.frozen(eq=False)
class Recording:
    """One file of a recording: columns (n,) by name, units in the names, and the index's messages."""

    columns: dict[str, Array]
    messages: tuple[dict[str, Any], ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured columns."""
        return tuple(name for name in self.columns if name not in FIXED)


def read_recording(folder: Path) -> list[Recording]:
    """The files of a recording in order; a last line cut by a crash is left out.

    Raises InputError for a folder without an index and for a file or row that cannot be read.
    """
    folder = Path(folder)
    messages = []
    try:
        lines = file_bytes(folder / INDEX).split(b"\n")
    except OSError as error:
        raise InputError(
            f"the recording is invalid: {error.strerror}", str(folder), f"name a folder with {INDEX}"
        ) from None
    for line in lines:
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(message, dict):
            messages.append(message)
    found = [_read_file(path, tuple(messages)) for path in sorted(folder.glob("recording-*.csv"))]
    return [recording for recording in found if recording is not None]


def _read_file(path: Path, messages: tuple[dict[str, Any], ...]) -> Recording | None:
    try:
        head, _, body = file_bytes(path, _LONGEST).partition(b"\n")
        names = head.decode().split(",")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path.name}: {error}", str(path), "restore it from a copy") from None
    end = body.rfind(b"\n") + 1
    if tuple(names[:3]) != FIXED or not end:
        return None
    # Line by line: as text in lists, a row takes ten times its bytes in memory.
    cells = array("d")
    for number, line in enumerate(io.BytesIO(memoryview(body)[:end]), 2):
        try:
            row = [float(cell) for cell in line.split(b",")]
            if len(row) != len(names):
                raise ValueError
        except ValueError:
            raise InputError(
                f"row {number} of {path.name} is not {len(names)} numbers",
                str(path),
                "remove or correct that row",
            ) from None
        cells.extend(row)
    table = np.frombuffer(cells).reshape(-1, len(names))
    return Recording(dict(zip(names, table.T.copy(), strict=True)), messages)
