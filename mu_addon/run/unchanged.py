"""A run begun again ends at once where its inputs, its results and this program are as they were.

What a run leaves is told by the digests of its folder's files, inputs among them; a file that was edited,
removed or added makes it a run again, which takes finished stages from its cache.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import InputError, MuError
from ..files import make_folder, plain, write_json
from ..reading import file_bytes, parse_json
from .context import RunContext
from .folder import ALWAYS, OWN
from .progress import Message
from .study import Study
from .versions import package_versions

FILE = "finished.json"
CACHE = "cache"
# Larger folders are not read to the end: their stages are found in their caches.
MOST_BYTES = 400_000_000


def finished(folder: Path, job: Study, context: RunContext) -> dict[str, Any] | None:
    """Record of a job's last complete run in a claimed folder; None if anything differs."""
    if not context.repeats:
        return None
    with suppress(OSError, InputError):
        found = parse_json(file_bytes(folder / CACHE / FILE), FILE)
        # A damaged record is none.
        whole = isinstance(found, dict) and found.keys() == {"asked", "files", "summary", "lines", "warnings"}
        if whole and found["asked"] == _asked(job, context) and found["files"] == _digests(folder):
            return dict(found)
    return None


def tell(before: Mapping[str, Any], context: RunContext) -> None:
    """Say again what a record's run said."""
    context.summary = dict(before["summary"])
    for message in before["warnings"]:
        context.progress.warning(message["what"], message["where"], message["what_to_do"])
    lines = [*before["lines"], "nothing has changed: every file is as the last run left it"]
    context.console_summary = lambda summary: lines


def remember(folder: Path, job: Study, context: RunContext, warnings: Sequence[Message]) -> None:
    """Record a run that is complete; a record that cannot be written is none."""
    if not context.repeats:
        return
    with suppress(OSError, MuError):
        make_folder(folder / CACHE)
        record = {
            "asked": _asked(job, context),
            "files": _digests(folder),
            "summary": plain(context.summary | {"seconds": context.seconds}),
            "lines": context.console_summary(context.summary),
            "warnings": list(warnings),
        }
        write_json(folder / CACHE / FILE, record)


def _asked(job: Study, context: RunContext) -> list[Any]:
    """What no file of inputs says: targets, options; and packages' versions, the program's newest file."""
    package = Path(__file__).parents[1]
    newest = max(path.stat().st_mtime_ns for path in package.rglob("*.py"))
    options = context.summary.get("options")
    return [list(job.wanted_targets), options, package_versions(), newest]


def _files(folder: Path) -> Iterator[Path]:
    for where, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name not in (CACHE, "stale")]
        yield from (Path(where, name) for name in names)


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a folder but caches and what tells of the run; raises InputError if large."""
    found, size = {}, 0
    for path in sorted(_files(folder)):
        if path.name in (*OWN, *ALWAYS):
            continue
        size += path.stat().st_size
        if size > MOST_BYTES:
            raise InputError("the folder is too large to compare", str(folder))
        with path.open("rb") as file:
            found[path.relative_to(folder).as_posix()] = hashlib.file_digest(file, "sha256").hexdigest()
    return found
