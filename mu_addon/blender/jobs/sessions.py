"""Jobs that go on when Blender is closed: written down by each session, taken up by the next.

A session has a folder, locked as long as it lives, with a file a job. Whoever finds such a folder unlocked
takes up its jobs: they run on, or have ended meanwhile.
"""

from __future__ import annotations

import shutil
import time
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
    """A job as it is written down: its key, what it is in words, the folder of its run, when it began, plan.

    heavy: whether of such jobs one runs at a time; started_s: since the epoch.
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
    """Write a job down. One that cannot be written is not found again, and runs all the same."""
    with suppress(MuError):
        write_json(_place(record.key), {**attrs.asdict(record), "run": str(record.run)})


def drop(key: str) -> None:
    """A job has ended, and was seen to."""
    if _own is not None:
        with suppress(OSError):
            _place(key).unlink(missing_ok=True)


def take_up() -> list[Record]:
    """Jobs of sessions that are gone; their files are removed."""
    return [record for folder in sorted(_home().glob("session-*")) for record in _of_session(folder)]


def _of_session(folder: Path) -> Iterator[Record]:
    if _own is not None and folder == _own.path.parent:
        return
    try:
        lock = FolderLock(folder)
    except InputError:
        # That Blender is still there.
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
    """Give this session's folder free; remove it unless it leaves jobs that go on."""
    global _own
    if _own is None:
        return
    folder = _own.path.parent
    _own.release()
    _own = None
    if not leaves:
        shutil.rmtree(folder, ignore_errors=True)


def now_s() -> float:
    """Seconds since the epoch: other sessions' clocks have no other origin in common."""
    return time.time()
