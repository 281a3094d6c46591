"""Finished work of a study, cached by a hash of its inputs."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..files import output_error, read_npz, write_npz

# Part of every key: raise it when a change of the code changes what is computed.
REVISION = 1


def key(*parts: Any) -> str:
    """Hash of text, numbers, tuples and arrays; equal inputs give equal keys in every process."""
    return _digest(parts).hexdigest()[:32]


def _digest(parts: Iterable[Any]) -> hashlib._Hash:
    digest = hashlib.sha256(str(REVISION).encode())
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.shape} {part.dtype.str}".encode())
            # Its memory as it is: a copy of a large array would double it.
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest


# Array of an entry that identifies it as the one stored.
SEAL = "seal"


class Cache:
    """A folder of NPZ files named by kind and key. A damaged file, or another entry's, counts as missing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, kind: str, name: str) -> Path:
        """Path of an entry, existing or not."""
        return self.folder / f"{kind}-{name}.npz"

    def get(self, kind: str, name: str) -> dict[str, Array] | None:
        """Arrays of an entry, or None where there is none that can be read completely."""
        found = read_npz(self.path(kind, name))
        if found is None or not np.array_equal(found.pop(SEAL, None), _seal(kind, name, found)):
            return None
        return found

    def has(self, kind: str, name: str) -> bool:
        """Return True if `get` would find an entry."""
        return self.path(kind, name).exists() and self.get(kind, name) is not None

    def drop(self, kind: str, name: str) -> None:
        """Remove an entry, if there is one. Raises OutputError."""
        try:
            self.path(kind, name).unlink(missing_ok=True)
        except OSError as error:
            raise output_error(error, self.path(kind, name)) from error

    def put(self, kind: str, name: str, arrays: dict[str, Any]) -> None:
        """Store an entry, completely or not at all. Raises OutputError."""
        kept = {key: np.asarray(value) for key, value in arrays.items()}
        write_npz(self.path(kind, name), {**kept, SEAL: _seal(kind, name, kept)})


def _seal(kind: str, name: str, arrays: dict[str, Array]) -> Array:
    """Digest (32,) of an entry: its kind and name, its arrays and their names."""
    parts = [part for key in sorted(arrays) for part in (key, arrays[key])]
    return np.frombuffer(bytes.fromhex(_digest((kind, name, *parts)).hexdigest()), np.uint8)
