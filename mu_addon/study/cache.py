"""Finished work of a study, kept by a hash of all that it depends on."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from ..files import read_npz, write_npz

Array = np.ndarray[Any, Any]

# Part of every key: raise it when a change of the code changes what is computed.
REVISION = 1


def key(*parts: Any) -> str:
    """Hash of text, numbers, tuples and arrays; equal inputs give equal keys in every process."""
    digest = hashlib.sha256(str(REVISION).encode())
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.shape} {part.dtype.str}".encode() + np.ascontiguousarray(part).tobytes())
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:32]


class Cache:
    """A folder of NPZ files named by kind and key. A damaged file counts as missing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, kind: str, name: str) -> Path:
        """Where the entry lies, or would."""
        return self.folder / f"{kind}-{name}.npz"

    def get(self, kind: str, name: str) -> dict[str, Array] | None:
        """The arrays of an entry, or None where there is none that can be read whole."""
        return read_npz(self.path(kind, name))

    def put(self, kind: str, name: str, arrays: dict[str, Any]) -> None:
        """Store an entry whole. Raises OutputError."""
        write_npz(self.path(kind, name), arrays)
