"""Jobs that outlive Blender: recorded by each session, taken over by the next.

A session has a folder, locked while it lives, with a file for each job. A later session that finds the folder
unlocked takes over its jobs, running or ended.
"""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs

from ...errors import InputError, MuError
from ...files import write_json
from ...reading import file_bytes, is_number, parse_json
from ...run.lock import FolderLock
from ..shared.compat import user_folder

_LONGEST = 1_000_000
_own: FolderLock | None = None


@attrs.frozen
class Record:
    """Record of a job: its key, its description, the folder of its run, its start, its plan.

    heavy: only one such job runs at a time; started_s: since the epoch.
    """

    key: str
    title: str
    run: Path
    started_s: float
    plan: tuple[tuple[str, float], ...] = ()
    heavy: bool = False


def _home() -> Path:
    return user_folder("jobs")


def _place(key: str) -> Path:
    """File of a job of this session, whose folder is made and locked with the first."""
    global _own
    if _own is None:
        _own = FolderLock(_home() / f"session-{uuid.uuid4().hex[:12]}")
    return _own.path.parent / f"{key.replace(':', '-')}.json"


def keep(record: Record) -> None:
    """Record a job. One that cannot be recorded is not found again, but runs all the same."""
    with suppress(MuError):
        write_json(_place(record.key), {**attrs.asdict(record), "run": str(record.run)})


def drop(key: str) -> None:
    """Remove the record of an ended job."""
    if _own is not None:
        with suppress(OSError):
            _place(key).unlink(missing_ok=True)


def take_up() -> list[Record]:
    """Return the jobs of ended sessions, and remove their files."""
    return [record for folder in sorted(_home().glob("session-*")) for record in _of_session(folder)]


def _of_session(folder: Path) -> Iterator[Record]:
    if _own is not None and folder == _own.path.parent:
        return
    try:
        lock = FolderLock(folder)
    except InputError:
        # Blender is still running.
        return
    except MuError:
        return
    try:
        found = [record for path in sorted(folder.glob("*.json")) if (record := _read(path))]
    finally:
        lock.release()
    shutil.rmtree(folder, ignore_errors=True)
    yield from found


def _read(path: Path) -> Record | None:
    try:
        found: Any = parse_json(file_bytes(path, _LONGEST), path.name)
        texts = [found[name] for name in ("key", "title", "run")]
        plan = tuple((str(name), float(seconds)) for name, seconds in found.get("plan", ()))
        started = found["started_s"]
        if not all(isinstance(text, str) for text in texts) or not is_number(started):
            return None
        return Record(texts[0], texts[1], Path(texts[2]), started, plan, found.get("heavy") is True)
    except (OSError, MuError, KeyError, TypeError, ValueError):
        return None


def close(leaves: bool) -> None:
    """Release this session's folder; remove it unless it leaves running jobs."""
    global _own
    if _own is None:
        return
    folder = _own.path.parent
    _own.release()
    _own = None
    if not leaves:
        shutil.rmtree(folder, ignore_errors=True)
