"""A large block of memory is refused to a run: a clear error, no half file, then the same digits."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from mu_addon.errors import MuError
from mu_addon.run.cache import Cache
from mu_addon.run.context import RunContext
from mu_addon.studies.export import Export
from mu_addon.studies.sweep import Sweep
from mu_addon.studies.use_case import use_case
from mu_addon.usecases.parameter_study import point
from mu_addon.usecases.parameter_study.plan import parse_plan
from mu_addon.usecases.sensor.stream import stream

from ..run.failing_memory import FailingMemory, short_of_memory
from .fault_injection import (
    PARTIAL,
    PLAN,
    STUDY,
    Prepared,
    answered,
    faults,
    inject_each,
    placement,
    ran,
    rows_of,
    simulation,
    unraisable,  # noqa: F401 - a fixture of every test here
)


def layer(folder: Path, at: int, for_good: bool) -> AbstractContextManager[FailingMemory]:
    """Blocks of 64 kB and more, wherever the run keeps its files."""
    return short_of_memory(at, for_good)


def any_array(folder: Path, at: int, for_good: bool) -> AbstractContextManager[FailingMemory]:
    """Blocks of any size, for runs that have no large ones."""
    return short_of_memory(at, for_good, least=1)


@pytest.mark.nightly("test_export")
@pytest.mark.parametrize("step", [43, 7])
def test_simulate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    """From the solid on; all is solved anew, each time."""
    assert inject_each(simulation(monkeypatch), tmp_path, layer, MuError.status, PARTIAL, step=step) == []


@pytest.mark.nightly("test_export")
@pytest.mark.parametrize("step", [307, 41])
def test_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, with_light: Any, step: int) -> None:
    """What follows from the states of the unit and of its candidates; all of it by `benchmarks.faults`."""
    run = placement(monkeypatch, Cache(with_light(tmp_path / "known") / "cache"))
    assert inject_each(run, tmp_path, layer, MuError.status, PARTIAL, step=step) == []


@pytest.mark.parametrize("step", [211, pytest.param(31, marks=pytest.mark.nightly("test_export"))])
def test_export(tmp_path: Path, step: int) -> None:
    job = Export(unit=STUDY.unit, formats=("stl", "txt"), quality="interactive")

    def run(folder: Path, context: RunContext) -> None:
        use_case("export").start(job, folder, context)

    assert inject_each(run, tmp_path, layer, MuError.status, step=step) == []


@pytest.mark.parametrize("step", [5, pytest.param(1, marks=pytest.mark.nightly("test_sweep"))])
def test_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    monkeypatch.setattr(point, "run_point", answered)
    job = Sweep(plan=parse_plan(PLAN, tmp_path), workers=1)

    def run(folder: Path, context: RunContext) -> None:
        use_case("sweep").start(job, folder, context)

    assert inject_each(run, tmp_path, any_array, MuError.status, ["points.csv"], step=step) == []


def test_record(tmp_path: Path) -> None:
    def run(folder: Path, context: RunContext) -> None:
        stream(Prepared(), folder, seconds=None, about={}, context=context)

    assert ran(run, tmp_path / "whole")[0] == 0
    whole = rows_of(tmp_path / "whole")
    for at in range(1, 1000):
        folder = tmp_path / f"at-{at}"
        with any_array(folder, at, at % 2 == 0) as memory:
            status, messages = ran(run, folder)
        if at > memory.places:
            assert at > 20
            return
        wrong = list(faults(folder, (status, messages), None, MuError.status))
        if (folder / "index.ndjson").exists():
            found = rows_of(folder)
            pairs = zip(found, whole, strict=False)
            wrong += [f"{len(part)} rows" for part, every in pairs if part != every[: len(part)]]
            if status == 0 and found != whole:
                wrong.append("rows are missing")
        assert wrong == [], f"{at}, {memory.where}"
    raise AssertionError("the run never came to its end")
