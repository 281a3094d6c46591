"""A folder of measured data as the input of a run: identified by its path and its files' digests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InputError
from ..measured import Measured
from ..measured.folder import FILE
from ..reading import file_bytes
from ..run.inputs import digest


def experiments_digest(measured: Measured) -> str:
    """SHA-256 of the file that describes a folder's experiments."""
    return digest(file_bytes(measured.folder / FILE))


def described(measured: Measured) -> dict[str, list[str]]:
    """Kind, role and SHA-256 of each experiment's file, by name."""
    return {e.name: [e.kind, e.role, e.sha256] for e in measured.experiments}


def require_same_data(measured: Measured, before: Any, now: Mapping[str, Any]) -> None:
    """Raise InputError if measured data differ from those that a run was made with.

    before: in the run's inputs by name, or None; now: the present ones.
    """
    if before is None or before == now:
        return
    known = before if isinstance(before, Mapping) else {}
    other = [name for name in {**known, **now} if known.get(name) != now.get(name)]
    raise InputError(
        f"the measured data are not those that the run was made with: {', '.join(other[:3])}",
        str(measured.folder),
        "put those back, or give these a separate folder of results",
    )
