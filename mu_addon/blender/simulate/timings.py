"""Durations of jobs' stages on this machine, used to announce a new one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from ...errors import MuError
from ...files import write_text
from ...reading import file_bytes, parse_json
from ...run.child import DONE
from ...run.progress_estimate import Plan
from ...run.study import Study
from ...run.summary import SUMMARY
from ...studies.starting import kind_of
from ..jobs import start_child
from ..shared.compat import user_folder
from ..shared.file_cache import UNREADABLE, FileCache
from ..shared.registration import at_end, connected

LEAST_SHARE = 0.05
"""A stage that took less than this share of its earlier time was cached, and is not a measurement."""

# Members of a set differ in a number: one takes about as long as another.
_NUMBER = re.compile(r"[\d.]+")


def of_run(folder: Path) -> tuple[str, dict[str, float]]:
    """Detail of a finished study, and the seconds of its stages; raises MuError."""
    return kind_of(folder).read(folder).detail(), parse_json(file_bytes(folder / SUMMARY), SUMMARY)["seconds"]


READERS: dict[str, Callable[[Path], tuple[str, dict[str, Any]]]] = {}
"""By kind of job whose seconds are kept: `of_run`, or a function like it."""
_kept: FileCache[dict[str, dict[str, float]]] = FileCache()
_runs: FileCache[tuple[str, dict[str, float]]] = FileCache()


def _file() -> Path:
    return user_folder() / "timings.json"


def _every() -> dict[str, Any]:
    """Content of the file, by detail of a study."""
    path = _file()
    return _kept.read([path], lambda: parse_json(file_bytes(path), path.name)) or {}


def measured(detail: str) -> dict[str, float]:
    """Seconds of each stage of the last job of that detail here; empty before the first one."""
    found: Any = _every().get(detail)
    if not isinstance(found, dict):
        return {}
    return {str(k): float(v) for k, v in found.items() if isinstance(v, int | float) and v >= 0.0}


def expected(wanted: Study, runs: Iterable[Path] = ()) -> tuple[Plan, bool]:
    """Stages of a study with the seconds that they took here, else are declared to take.

    runs: folders of complete studies, of which one may be alike. The second result is True if all were
    measured.
    """
    declared, detail = wanted.expected(), wanted.detail()
    found = (_runs.read([folder / SUMMARY], partial(of_run, folder)) for folder in runs)
    taken = measured(detail) | next((one[1] for one in found if one and one[0] == detail), {})
    alike = {_NUMBER.sub("", title): seconds for title, seconds in taken.items()}
    known = {title: taken.get(title, alike.get(_NUMBER.sub("", title))) for title in declared}
    plan = [(title, declared[title] if s is None else s) for title, s in known.items()]
    return [*plan, ("report", taken.get("report", wanted.report_s))], None not in known.values()


def announced(wanted: Study, runs: Iterable[Path] = ()) -> tuple[float, bool]:
    """Seconds of all stages of a study, see `expected`, and True if all were measured."""
    plan, known = expected(wanted, runs)
    return sum(seconds for _, seconds in plan), known


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
    _runs.clear()
