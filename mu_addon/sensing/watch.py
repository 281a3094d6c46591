"""A sensor's session seen from another process: status and samples as they arrive, without blocking."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..reading import file_bytes
from .ring_buffer import Ring
from .session import STATUS


class Watched:
    """A session that records into `folder`; `status` is its last status, empty before that."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.status: dict[str, Any] = {}
        self._written = 0
        self._last_status_s = self._sampled = time.monotonic()
        self._ring: Ring | None = None
        self._name = ""
        self._next = 0

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of `fresh`."""
        return tuple(self.status.get("columns", ()))

    @property
    def silent_s(self) -> float:
        """Seconds since the session's last status, which it writes five times a second."""
        return time.monotonic() - self._last_status_s

    @property
    def starved_s(self) -> float:
        """Seconds since the last sample was seen."""
        return time.monotonic() - self._sampled

    def look(self) -> bool:
        """Read the status if there is a newer one; return True if there was."""
        path = self.folder / STATUS
        try:
            written = path.stat().st_mtime_ns
            if written == self._written:
                return False
            status = json.loads(file_bytes(path))
        except (OSError, ValueError, RecursionError):
            return False
        if not isinstance(status, dict):
            return False
        self._written, self._last_status_s = written, time.monotonic()
        self.status = status
        self._attach(str(status.get("live", "")))
        return True

    def _attach(self, name: str) -> None:
        if name == self._name:
            return
        self.close()
        if name:
            try:
                self._ring = Ring.attach(self.folder / name)
            except InputError:
                # Made this moment, or gone with the session: the next status says which.
                return
        self._name, self._next = name, 0

    def fresh(self) -> Array:
        """Samples (m, columns) since the last call; if more than half a ring, the latest half."""
        if self._ring is None:
            return np.empty((0, len(self.columns)))
        rows, self._next = self._ring.since(self._next)
        if len(rows):
            self._sampled = time.monotonic()
        return rows

    def latest(self, n: int) -> Array:
        """The last samples (m, columns), at most n."""
        return np.empty((0, len(self.columns))) if self._ring is None else self._ring.latest(n)

    def rewind(self) -> None:
        """Restart `fresh` at the oldest samples still in the ring."""
        self._next = 0

    def close(self) -> None:
        """Release the samples."""
        if self._ring is not None:
            self._ring.close()
        self._ring, self._name = None, ""
