"""One point of a parameter study: its study in a child process, within limits of memory and time."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from ...files import output_error, plain
from ...reading import file_text
from ...run.child import RUNNING, Child
from ...run.folder import keep_inputs
from ...run.interpreter import core_command, core_path

# Seconds between two looks at a study's memory.
LOOK_S = 0.05


@attrs.frozen
class Task:
    """One study to run: files of inputs by name, and its limits; plain data, so that it can be sent.

    module: run by the process in place of the core's command line.
    """

    files: Mapping[str, str]
    memory_MB: int
    minutes: float
    module: tuple[str, ...] = ()

    def hash(self) -> str:
        """Hash of all inputs that decide the result."""
        from ...run.cache import key

        return key(*(part for item in sorted(self.files.items()) for part in item))


@attrs.frozen
class Outcome:
    """Result of a study: "done" with its `summary` as JSON, or "failed" with the reason; worker: of Dask."""

    status: str
    seconds: float = 0.0
    memory_MB: int = 0
    worker: str = ""
    summary: str = "{}"
    what: str = ""
    where: str = ""
    what_to_do: str = ""


def run_point(task: Task) -> Outcome:
    """Run a study; a failing one raises nothing. Raises OutputError where there is no room for it."""
    start = time.monotonic()
    try:
        scratch = tempfile.TemporaryDirectory(prefix="mu-point-", ignore_cleanup_errors=True)
    except OSError as fault:
        raise output_error(fault, Path(fault.filename or "temporary folder")) from fault
    with scratch as name:
        folder = Path(name)
        keep_inputs(folder / "study", task.files)
        line = [sys.executable, *task.module] if task.module else [*core_command(), "resume"]
        command = [*line, str(folder / "study"), "--json", "--no-report", "--workers", "1"]
        child = Child(command, folder / "words", _environment(task), ends_with_parent=True)
        try:
            peak_MB, stopped = _watch(child, task)
        finally:
            child.kill()
    cost = round(time.monotonic() - start, 3), round(peak_MB), _worker()
    if stopped is None and child.result is not None and child.error is None:
        return Outcome("done", *cost, json.dumps(plain(child.result.get("summary", {}))))
    error = stopped or child.error or {}
    what, where, remedy = (
        str(error.get(name, "")).replace(str(folder), "") for name in ("what", "where", "what_to_do")
    )
    return Outcome("failed", *cost, what=what, where=where, what_to_do=remedy)


def _worker() -> str:
    """Name of the Dask worker that runs this, or ""."""
    try:
        from distributed import get_worker

        return str(get_worker().name)
    except (ImportError, ValueError):
        return ""


def _environment(task: Task) -> dict[str, str]:
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    more = {"PYTHONPATH": core_path(), "MU_MEMORY_MB": str(task.memory_MB), "MU_ENDS_WITH_INPUT": "1"}
    return {**os.environ, **threads, **more}


def _watch(child: Child, task: Task) -> tuple[float, dict[str, str] | None]:
    """Peak memory of a study in MB, and why it was stopped if it was."""
    peak = 0.0
    while child.state == RUNNING:
        child.poll()
        peak = max(peak, _memory_MB(child.pid))
        over = _too_much(child, task, peak)
        if over is not None:
            child.kill()
            return peak, over
        time.sleep(LOOK_S)
    return peak, None


def _too_much(child: Child, task: Task, peak_MB: float) -> dict[str, str] | None:
    if peak_MB > task.memory_MB:
        return {
            "what": f"the study took more than the {task.memory_MB} MB of memory that are allowed",
            "where": str(child.progress.get("stage", "at its start")),
            "what_to_do": "raise memory_MB, or use a coarser mesh",
        }
    if child.seconds > 60 * task.minutes:
        return {
            "what": f"the study took longer than the {task.minutes:g} minutes that are allowed",
            "where": str(child.progress.get("stage", "at its start")),
            "what_to_do": "raise minutes, or use a coarser mesh",
        }
    return None


def _memory_MB(pid: int) -> float:
    """Memory that a process and its children hold, in MB; 0 once it has ended."""
    try:
        import psutil
    except ImportError:
        # Blender's archive has none.
        return _of_proc(pid)
    try:
        process = psutil.Process(pid)
        family: Sequence[Any] = [process, *process.children(recursive=True)]
    except psutil.Error:
        return 0.0
    found = 0
    for one in family:
        try:
            found += one.memory_info().rss
        except psutil.Error:
            continue
    return found / 1e6


def _of_proc(pid: int) -> float:
    """Memory in MB from Linux's files on each process; 0 on other systems."""
    found, family = 0, [pid]
    while family:
        place = Path("/proc") / str(family.pop())
        try:
            # Pages: the second figure is what lies in memory.
            found += int(file_text(place / "statm").split()[1]) * os.sysconf("SC_PAGE_SIZE")
            family += [int(n) for n in file_text(place / "task" / place.name / "children").split()]
        except (OSError, ValueError, IndexError, AttributeError):
            continue
    return found / 1e6
