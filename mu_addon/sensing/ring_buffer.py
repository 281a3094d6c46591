"""The latest samples in a file that one process writes and others read; none waits for another."""

from __future__ import annotations

import mmap
import os
import struct
from contextlib import suppress
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..files import output_error

_MAGIC = b"mu-ring1"
# Magic, columns, capacity, rows written so far.
_HEAD = struct.Struct("<8sIIQ")
_COUNT_AT = 16
_START = 64


@attrs.define(eq=False)
class Ring:
    """Ring buffer (capacity, columns) of float64 in a mapped file; row k lies at index k modulo capacity.

    Columns have whatever units the writer gives them. One process appends, others read, none waits.
    """

    rows: Array
    _map: mmap.mmap

    @classmethod
    def create(cls, path: Path, columns: int, capacity: int = 1 << 16) -> Ring:
        """A new, empty ring in the file `path`, 65536 rows by default; raises OutputError."""
        size = _START + 8 * columns * capacity
        # Whole before it has its name: who waits for the file attaches at once.
        making = path.with_name(f"{path.stem}-making{path.suffix}")
        try:
            with making.open("wb") as stream:
                stream.write(_HEAD.pack(_MAGIC, columns, capacity, 0))
                stream.truncate(size)
                stream.flush()
                if hasattr(os, "posix_fallocate"):
                    # Room that the disk turns out not to have later ends a process that writes to a map.
                    os.posix_fallocate(stream.fileno(), 0, size)
            making.replace(path)
            with path.open("rb+") as stream:
                mapped = mmap.mmap(stream.fileno(), size)
        except OSError as error:
            for left in (making, path):
                with suppress(OSError):
                    left.unlink(missing_ok=True)
            raise output_error(error, path) from error
        return cls(_rows(mapped, columns, capacity), mapped)

    @classmethod
    def attach(cls, path: Path) -> Ring:
        """Open the ring in the file `path` to read; raises InputError if the file is not a ring."""
        try:
            with path.open("rb") as stream:
                mapped = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
            magic, columns, capacity, _ = _HEAD.unpack_from(mapped)
        except (OSError, ValueError, struct.error):
            magic, columns, capacity = b"", 0, 0
        if magic != _MAGIC or len(mapped) < _START + 8 * columns * capacity:
            raise InputError(
                "the file does not contain live data of a stream", str(path), "start the stream again"
            )
        return cls(_rows(mapped, columns, capacity), mapped)

    @property
    def written(self) -> int:
        """Number of rows written so far, overwritten ones included."""
        return int(struct.unpack_from("<Q", self._map, _COUNT_AT)[0])

    def append(self, rows: Array) -> None:
        """Write rows (n, columns); the last `capacity` rows written remain."""
        capacity, count = len(self.rows), self.written
        kept = rows[-capacity:]
        places = np.arange(count + len(rows) - len(kept), count + len(rows)) % capacity
        self.rows[places] = kept
        # Counted after they are written, so that readers see complete rows.
        struct.pack_into("<Q", self._map, _COUNT_AT, count + len(rows))

    def since(self, row: int) -> tuple[Array, int]:
        """A copy (m, columns) of the rows from number `row` on, and the number of the next row.

        Values have the units of their writer. At most the latest half of the ring: the writer may overwrite
        the other half during the call.
        """
        count, capacity = self.written, len(self.rows)
        m = min(max(count - row, 0), capacity // 2)
        return self.rows[np.arange(count - m, count) % capacity], count

    def latest(self, n: int) -> Array:
        """A copy (m, columns) of the last rows, at most n and at most half of the ring."""
        return self.since(max(0, self.written - n))[0][-n:]

    def close(self) -> None:
        """Close the file; the ring cannot be used any more."""
        del self.rows
        self._map.close()


def _rows(mapped: mmap.mmap, columns: int, capacity: int) -> Array:
    return np.frombuffer(mapped, dtype="<f8", count=columns * capacity, offset=_START).reshape(
        capacity, columns
    )
