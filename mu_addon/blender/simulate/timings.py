"""Durations of jobs' stages on this machine, used to announce a new one."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import MuError
from ...files import write_text
from ...reading import file_bytes, parse_json
from ...run.child import DONE
from ...studies import unit_runs
from ..jobs import start_child
from ..shared.compat import user_folder
from ..shared.file_cache import UNREADABLE, FileCache
from ..shared.registration import at_end, connected

if TYPE_CHECKING:
    from ...simulate_and_place.expected import Size

LEAST_SHARE = 0.05
"""A stage that took less than this share of its earlier time was cached, and is not a measurement."""


def of_size(size: Size) -> str:
    """Detail under which a simulation's seconds are kept: those of another unit or mesh are other ones."""
    contact = "contact" if size.self_contact else "no contact"
    part = "" if min(size.pressures_kPa) < 0 else ", under pressure"
    return f"{size.chambers} chambers, refine {size.refine:g}, {contact}{part}"


def of_run(run: unit_runs.Run) -> str:
    """Detail of a run's seconds, as `of_size`."""
    from ...simulate_and_place.expected import SHIPPED_KPA, Size

    contact = bool(run.tables.get("simulate", {}).get("self_contact"))
    pressures = tuple(p for p in SHIPPED_KPA if p > 0 or not run.left_out)
    return of_size(Size(run.unit.chambers.count, run.refine, contact, pressures))


def _of_simulation(folder: Path) -> tuple[str, dict[str, Any]]:
    run = unit_runs.read_run(folder)
    return of_run(run), run.summary["seconds"]


READERS: dict[str, Callable[[Path], tuple[str, dict[str, Any]]]] = {"simulate": _of_simulation}
"""By kind of job: function of a finished run's folder that returns its detail and its stages' seconds."""

_kept: FileCache[dict[str, dict[str, float]]] = FileCache()


def _file() -> Path:
    return user_folder() / "timings.json"


def _every() -> dict[str, Any]:
    """Content of the file, by detail: of a simulation, see `of_size`."""
    path = _file()
    return _kept.read([path], lambda: parse_json(file_bytes(path), path.name)) or {}


def measured(detail: str) -> dict[str, float]:
    """Seconds of each stage of the last job of that detail here; empty before the first one."""
    found: Any = _every().get(detail)
    if not isinstance(found, dict):
        return {}
    return {str(k): float(v) for k, v in found.items() if isinstance(v, int | float) and v >= 0.0}


def announced(detail: str) -> float | None:
    """Expected seconds of a job of that detail: those of all stages of its last one here; None without."""
    taken = measured(detail)
    return sum(taken.values()) if taken else None


def note(detail: str, seconds: dict[str, float]) -> None:
    """Store the seconds of the stages of a job that ended well. Raises OutputError."""
    before = measured(detail)
    real = {name: s for name, s in seconds.items() if s >= LEAST_SHARE * before.get(name, 0.0)}
    write_text(_file(), json.dumps({**_every(), detail: {**before, **real}}, indent=1) + "\n")


@connected(start_child.JOB_ENDED)
def _ended(key: str) -> None:
    child = start_child.child_of(key)
    read = READERS.get(key.rpartition(":")[2])
    if child is None or child.state != DONE or read is None:
        return
    try:
        detail, seconds = read(child.folder.parent)
        note(detail, {str(name): float(s) for name, s in seconds.items()})
    except (MuError, *UNREADABLE):
        # A failure to store the timings is not reported; the results are there.
        return


@at_end
def _forget() -> None:
    _kept.clear()
