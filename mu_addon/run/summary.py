"""summary.json of a run: its key figures, and its status running, complete, partial or cancelled."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import InputError, MuError, OutputError
from ..files import plain, write_json, write_text
from ..reading import file_bytes, parse_json
from .lock import FolderLock
from .progress import log_file
from .supervisor import TERMINATED

SUMMARY = "summary.json"
# Bytes reserved for the summary of a running run: room for its last one on a full disk.
RESERVED = 1 << 14


def write_running(path: Path, summary: dict[str, Any]) -> None:
    """Write a summary with status "running", padded with blanks to RESERVED bytes; raises OutputError."""
    text = json.dumps(plain({**summary, "status": "running"}), ensure_ascii=False, allow_nan=False)
    write_text(path, text.ljust(RESERVED) + "\n")


def says_running(path: Path) -> bool:
    """Return True if a summary is that of a run which has not ended."""
    return read_summary(path).get("status") == "running"


def read_summary(path: Path) -> dict[str, Any]:
    """Content of a summary; empty if it cannot be read."""
    try:
        found = parse_json(file_bytes(path), SUMMARY)
    except (OSError, InputError):
        return {}
    return found if isinstance(found, dict) else {}


def record_crash(folder: Path, error: MuError, stack: str = "") -> None:
    """Record in a folder, in summary.json and log.ndjson, how its run ended whose process was lost.

    Results of its stages stay in the summary. stack: Python's, at the crash. Nothing is written if no run of
    the folder was in progress, or another one owns the folder.
    """
    found = read_summary(folder / SUMMARY)
    if found.get("status") != "running":
        return
    # Files that cannot be written, or belong to another run, are left: the error is reported all the same.
    with suppress(MuError):
        lock = FolderLock(folder)
        try:
            reason = {"what": error.what, "where": error.where, "what_to_do": error.remedy}
            state = ended_early(error) | {"reason": reason}
            replace_summary(folder / SUMMARY, [found | state, state])
            log = log_file(folder / "log.ndjson")
            if stack:
                log({"type": "traceback", "text": stack})
            log({"type": "error", **reason, "status": error.status})
        finally:
            lock.release()


def last_stage(folder: Path) -> tuple[str, list[str]]:
    """Stage of the folder's unfinished run, and sizes from its stages, by its log; else empty."""
    stage = ""
    made: dict[str, str] = {}
    if not says_running(folder / SUMMARY):
        return "", []
    try:
        lines = file_bytes(folder / "log.ndjson").splitlines()
    except (OSError, InputError):
        return "", []
    for line in lines:
        try:
            message = parse_json(line, "log.ndjson")
        except InputError:
            continue
        if not isinstance(message, dict):
            continue
        if message.get("type") in ("result", "error"):
            stage, made = "", {}
        if message.get("type") == "progress":
            name = str(message.get("stage"))
            stage = "" if message.get("state") == "end" else name
            if message.get("state") == "end" and message.get("detail"):
                made[name] = str(message["detail"])
    return stage, list(made.values())


def has_ended(folder: Path) -> bool:
    """Return True if the last run of a folder has recorded its end."""
    return read_summary(folder / SUMMARY).get("status", "running") != "running"


def ended_early(error: MuError) -> dict[str, str]:
    """Status of a run that an error ended: "cancelled" after SIGTERM, else "partial"."""
    return {"status": "cancelled" if error.status == TERMINATED else "partial"}


def replace_summary(path: Path, wanted: Sequence[dict[str, Any]]) -> None:
    """Write the first summary that fits on the disk; raises OutputError if none does.

    On a full disk the existing one is removed first: a folder without a summary does not pass for one with a
    run in progress.
    """
    try:
        write_json(path, wanted[0])
        return
    except OutputError:
        with suppress(OSError):
            path.unlink(missing_ok=True)
    for summary in wanted[:-1]:
        with suppress(OutputError):
            write_json(path, summary)
            return
    write_json(path, wanted[-1])
