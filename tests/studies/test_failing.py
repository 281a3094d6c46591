"""Calls on a disk and blocks of memory fail one by one: a clear error, no half file, then the same digits.

`simulate`, `place`, `export`, `sweep` and `record` as they are, but for what touches no file: solid, mesh and
states are computed once for all runs, points of a sweep have a known answer, and a sensor's bytes come from
memory.
"""

from __future__ import annotations

import functools
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from mu_addon.design import solid
from mu_addon.errors import MuError
from mu_addon.run.cache import Cache
from mu_addon.run.context import RunContext
from mu_addon.sensing.stream import stream
from mu_addon.studies.export import Export
from mu_addon.studies.parameter_study import point
from mu_addon.studies.parameter_study.plan import parse_plan
from mu_addon.studies.parameter_study.point import Task, run_point
from mu_addon.studies.sweep import Sweep

from ..run.failing_files import failing
from ..run.failing_memory import FailingMemory, short_of_memory
from .fault_injection import (
    PARTIAL,
    PLAN,
    STUDY,
    Prepared,
    answered,
    faults,
    inject_each,
    lines_of,
    made_once,
    placement,
    ran,
    rows_of,
    simulation,
    started,
    unraisable,  # noqa: F401 - a fixture of every test here
)


@pytest.fixture(params=[False, True], ids=["once", "for good"])
def for_good(request: pytest.FixtureRequest) -> bool:
    """Whether a disk works again after the call that failed."""
    return bool(request.param)


def layer(folder: Path, at: int, for_good: bool) -> AbstractContextManager[FailingMemory]:
    """Blocks of 64 kB and more, wherever the run keeps its files."""
    return short_of_memory(at, for_good)


def any_array(folder: Path, at: int, for_good: bool) -> AbstractContextManager[FailingMemory]:
    """Blocks of any size, for runs that have no large ones."""
    return short_of_memory(at, for_good, least=1)


AT_NIGHT = pytest.mark.nightly("test_export")
FILES, MEMORY = (failing, 5), (layer, MuError.status)
"""What fails, and the exit status with which a run then ends."""


def each(files: tuple[int, int], memory: tuple[int, int], night: Any = ()) -> pytest.MarkDecorator:
    """What fails, and the calls that do: each so many-th, to be quick; night: mark of the second ones.

    `python -m benchmarks.faults calls` has every one fail.
    """
    kinds = (("files", FILES, files), ("memory", MEMORY, memory))
    return pytest.mark.parametrize(
        ("fails", "step"),
        [
            pytest.param(fails, step, id=f"{name}-{step}", marks=night if k else ())
            for name, fails, steps in kinds
            for k, step in enumerate(steps)
        ],
    )


@pytest.mark.nightly("test_export")
@each((67, 3), (43, 7))
def test_simulate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: Any, step: int) -> None:
    """From the solid on; short of memory all is solved anew, each time."""
    if fails is FILES:
        made_once(monkeypatch)
    assert inject_each(simulation(monkeypatch), tmp_path, *fails, PARTIAL, step=step) == []


@pytest.mark.nightly("test_export")
@each((251, 9), (307, 41))
def test_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, with_light: Any, fails: Any, step: int
) -> None:
    """What follows from the states of the unit and of its candidates."""
    run = placement(monkeypatch, Cache(with_light(tmp_path / "known") / "cache"))
    assert inject_each(run, tmp_path, *fails, PARTIAL, step=step) == []


@each((5, 1), (211, 31), AT_NIGHT)
def test_export(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: Any, step: int) -> None:
    if fails is FILES:
        monkeypatch.setattr(solid, "build_solid", functools.cache(solid.build_solid))
    run = started(Export(unit=STUDY.unit, formats=("stl", "txt"), quality="interactive"))
    assert inject_each(run, tmp_path, *fails, step=step) == []


@each((5, 1), (5, 1), AT_NIGHT)
def test_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: Any, step: int) -> None:
    monkeypatch.setattr(point, "run_point", answered)
    run = started(Sweep(plan=parse_plan(PLAN, tmp_path), workers=1))
    inject, status = fails if fails is FILES else (any_array, MuError.status)
    assert inject_each(run, tmp_path, inject, status, partial=["points.csv"], step=step) == []


FAKE = str(Path(__file__).resolve().parents[1] / "run" / "fake_worker.py")


def test_a_point_of_a_sweep(tmp_path: Path, for_good: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its folder lies where the system keeps what is of no duration."""
    pytest.importorskip("psutil", reason="sweeps are an extra")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    task = Task({"study.toml": "", "unit.toml": ""}, 1000, 1.0, (FAKE, "good"))
    for at in range(1, 100):
        with failing(tmp_path, at, for_good) as files:
            row, error = None, None
            try:
                row = run_point(task)
            except MuError as told:
                error = told
        assert row is None or row.status == "done", f"{at}, {files.calls[at - 1]}"
        assert error is None or error.what.startswith("cannot write"), f"{at}, {files.calls[at - 1]}"
        assert list(tmp_path.iterdir()) == []
        if at > len(files.calls):
            assert at > 10
            return


def recording(folder: Path, context: RunContext) -> None:
    stream(Prepared(), folder, seconds=None, about={}, context=context)


@pytest.mark.parametrize(("layer", "status", "fewest"), [(failing, 5, 50), (any_array, MuError.status, 20)])
def test_record(tmp_path: Path, for_good: bool, layer: Any, status: int, fewest: int) -> None:
    ended, _ = ran(recording, tmp_path / "whole")
    whole = rows_of(tmp_path / "whole")
    assert (ended, [len(part) for part in whole]) == (0, [30, 30])
    for at in range(1, 1000):
        folder = tmp_path / f"at-{at}"
        with layer(folder, at, for_good) as met:
            ended, messages = ran(recording, folder)
        if at > met.places:
            assert at > fewest
            return
        wrong = list(faults(folder, (ended, messages), None, status))
        if (folder / "index.ndjson").exists():
            lines_of(folder / "index.ndjson")
            found = rows_of(folder)
            pairs = zip(found, whole, strict=False)
            wrong += [f"{len(part)} rows" for part, every in pairs if part != every[: len(part)]]
            if ended == 0 and found != whole:
                wrong.append("rows are missing")
            wrong += [f"left behind: {path.name}" for path in folder.glob("live-*")]
            # What is recorded is never written over.
            ended, messages = ran(recording, folder)
            if ended != 2 or "already contains a recording" not in messages[-1]["what"]:
                wrong.append(f"again: exit status {ended}, {messages[-1]}")
        elif ran(recording, folder)[0] or rows_of(folder) != whole:
            wrong.append("again: not the same rows")
        assert wrong == [], f"{at}, {met.where}"
    raise AssertionError("the run never came to its end")
