"""Point caches in the PC2 format, which animation programs play: positions of one mesh, sample by sample."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..files import write_bytes

_HEADER = "<12siiffi"
_MAGIC = b"POINTCACHE2\0"


def write_pc2(path: Path, positions: Array, start_s: float, step_s: float) -> None:
    """Write positions (k, p, 3) of p points at k samples, `step_s` apart from `start_s` on, both in s.

    The PC2 format: little-endian, single precision, a header of 12 letters, version 1, points, start, step
    and samples, then the positions. Raises OutputError.
    """
    samples, points, _ = positions.shape
    head = struct.pack(_HEADER, _MAGIC, 1, points, start_s, step_s, samples)
    write_bytes(path, head + np.ascontiguousarray(positions, "<f4").tobytes())


def read_pc2(path: Path) -> tuple[Array, float, float]:
    """Positions (k, p, 3) in the unit of the file, and start and step in s, of a PC2 file.

    Raises InputError for a file that is missing, incomplete or of another format.
    """
    try:
        data = path.read_bytes()
        magic, version, points, start, step, samples = struct.unpack_from(_HEADER, data)
    except (OSError, struct.error) as error:
        raise InputError(f"cannot read the point cache: {error}", str(path)) from None
    size = struct.calcsize(_HEADER)
    if magic != _MAGIC or version != 1 or len(data) != size + 12 * points * samples:
        raise InputError("not a complete point cache of version 1", str(path), "write it again")
    positions = np.frombuffer(data, "<f4", offset=size).reshape(samples, points, 3)
    return positions, start, step
