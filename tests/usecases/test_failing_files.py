"""Every call of a run that can fail on a disk fails once: a clear error, no half file, then the same digits.

`simulate`, `export`, `sweep` and `record` as they are, but for what touches no file: solid and mesh are built
once for all runs, points of a sweep have a known answer, and a sensor's bytes come from memory.
"""

from __future__ import annotations

import functools
import hashlib
import json
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.fem.protocol import Protocol
from mu_addon.materials.library import load_material
from mu_addon.meshing.settings import MeshSettings
from mu_addon.meshing.unit import mesh_unit
from mu_addon.run.context import RunContext, run_to_end
from mu_addon.run.progress import Progress
from mu_addon.sensing.framing import info_frame, sample_frame
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.sources import EndOfStream
from mu_addon.usecases.export import run as exporting
from mu_addon.usecases.export.job import Job as ExportJob
from mu_addon.usecases.parameter_study import run as sweeping
from mu_addon.usecases.parameter_study.plan import parse_plan
from mu_addon.usecases.parameter_study.point import Task, run_point, version
from mu_addon.usecases.sensor.stream import stream
from mu_addon.usecases.simulate_and_place import run as placing
from mu_addon.usecases.simulate_and_place import study
from mu_addon.usecases.simulate_and_place.job import Job

from ..run.failing_files import failing

Run = Callable[[Path, RunContext], Any]
Messages = list[dict[str, Any]]
# What a run says of itself, with its time, and what only its lock and those who look on read.
_OWN = (
    "summary.json",
    "log.ndjson",
    "run.lock",
    "status.json",
    "report.html",
    "index.ndjson",
    "rejects.ndjson",
)


def ran(run: Run, folder: Path) -> tuple[int, Messages]:
    """A run to its end: its exit status and what it told."""
    messages: Messages = []
    with run_to_end(Progress([messages.append])) as context:
        context.wants_report = False
        run(folder, context)
    return context.status, messages


def results(folder: Path) -> dict[str, bytes]:
    """What every file of a folder holds, by its place, but those that tell of the run itself."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in _OWN and path.suffix != ".npz"
    } | {
        # The same arrays: an archive's bytes are those of one version of its library.
        f"cache/{path.name}": path.read_bytes()
        for path in sorted(folder.rglob("*.npz"))
    }


def lines_of(path: Path) -> list[Any]:
    """The messages of a file of lines; raises ValueError for one that is not whole."""
    text = path.read_text(encoding="utf-8")
    if text and not text.endswith("\n"):
        raise ValueError(f"{path.name} ends within a line: {text[-60:]!r}")
    return [json.loads(line) for line in text.splitlines()]


def _begun(data: bytes, whole: bytes) -> bool:
    """Whether a table begins as the whole one does and has whole lines, no more of them."""
    lines, all_lines = data.splitlines(keepends=True), whole.splitlines(keepends=True)
    begins = lines[0].split(b",")[0] == all_lines[0].split(b",")[0]
    return begins and lines[-1].endswith(b"\n") and len(lines) <= len(all_lines)


def faults(
    folder: Path,
    status: int,
    messages: Messages,
    reference: dict[str, bytes] | None,
    partial: Sequence[str] = (),
) -> Iterator[str]:
    """What is wrong with the end of a run one of whose calls failed, and with what it leaves.

    reference: what the run finds undisturbed; None where that is never the same. partial: tables that hold
    what has been found so far.
    """
    last = messages[-1] if messages else {}
    if status not in (0, 5):
        yield f"exit status {status}: {last}"
    if status and not (last.get("type") == "error" and last["what"] and last["where"] and last["what_to_do"]):
        yield f"no clear error: {last}"
    found = results(folder)
    yield from (f"left behind: {name}" for name in found if ".part" in name)
    if reference is not None:
        for name, data in found.items():
            if name not in reference:
                yield f"left behind: {name}"
            elif data != reference[name] and not (name in partial and _begun(data, reference[name])):
                yield f"not whole: {name}"
        if status == 0 and found != reference:
            yield f"success without {sorted(reference.keys() - found.keys())}"
    try:
        if (folder / "summary.json").exists():
            state = json.loads((folder / "summary.json").read_text())["status"]
            if state != ("partial" if status else "complete"):
                yield f"exit status {status} and a summary that says {state}"
        elif not status:
            yield "success without a summary"
        for path in (folder / "log.ndjson", folder / "rejects.ndjson"):
            if path.exists() and any(message.get("type") == "traceback" for message in lines_of(path)):
                yield f"a traceback in {path.name}"
    except (ValueError, KeyError) as error:
        yield f"damaged: {error}"


def fail_each_call(run: Run, work: Path, partial: Sequence[str] = ()) -> list[str]:
    """Fail one call after the other of a run until none is left; returns what was wrong afterwards.

    After every second one all later calls fail, too. partial: see `faults`. Once all works again, the same
    run must come to the same results.
    """
    status, messages = ran(run, work / "reference")
    assert status == 0, messages[-1]
    reference = results(work / "reference")
    wrong: list[str] = []
    seen: set[str] = set()
    for at in range(1, 2000):
        folder = work / f"at-{at}"
        with failing(folder, at, for_good=at % 2 == 0) as files:
            status, messages = ran(run, folder)
        if at > len(files.calls):
            assert at > 20, "too few calls: the layer does not see them"
            return wrong
        where = f"{at}, {files.calls[at - 1]}"
        wrong += [f"{where}: {fault}" for fault in faults(folder, status, messages, reference, partial)]
        # Most faults leave what another one left: only the first of each is run once more.
        left = hashlib.sha256(repr(sorted(results(folder).items())).encode()).hexdigest()
        if left not in seen:
            seen.add(left)
            status, messages = ran(run, folder)
            if status or results(folder) != reference:
                wrong.append(f"{where}, again: exit status {status}, {messages[-1]}")
    raise AssertionError("the run never came to its end")


@pytest.fixture(autouse=True)
def unraisable(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """What fails where no one can be told, as in `__del__` and in threads; none of it may happen."""
    caught: list[str] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda found: caught.append(repr(found.exc_value)))
    monkeypatch.setattr(threading, "excepthook", lambda found: caught.append(repr(found.exc_value)))
    yield caught
    assert caught == []


@pytest.fixture(params=[False, True], ids=["once", "for good"])
def for_good(request: pytest.FixtureRequest) -> bool:
    """Whether a disk works again after the call that failed."""
    return bool(request.param)


UNIT = load_preset("mu-1.0x")
STUDY = Job(
    unit=attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3)),
    protocol=Protocol(np.arange(3.0), np.array([0.0, -2.0, 2.0])),
    mesh=MeshSettings(refine=0.3, order=1),
    times=3,
    mesh_check=False,
    workers=1,
    stages=("design", "simulate"),
)


def test_simulate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "build_solid", functools.cache(study.build_solid))
    mesh = functools.cache(lambda: mesh_unit(STUDY.unit, STUDY.mesh_settings(STUDY.mesh)))
    monkeypatch.setattr(study, "mesh_of", lambda *_: mesh())

    def run(folder: Path, context: RunContext) -> None:
        placing.USE_CASE.start(STUDY, folder, context)

    assert fail_each_call(run, tmp_path, partial=["angle.csv", "stretch.csv", "model_a.pvd"]) == []


def test_export(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exporting, "build_solid", functools.cache(exporting.build_solid))
    job = ExportJob(
        STUDY.unit, load_material("elastic-50a-v1"), formats=("stl", "txt"), quality="interactive"
    )

    def run(folder: Path, context: RunContext) -> None:
        exporting.USE_CASE.start(job, folder, context)

    assert fail_each_call(run, tmp_path) == []


PLAN = """
format = 1
preset = "mu-1.0x"
stages = "simulate"
method = "grid"
[vary]
"chambers.wall_mm" = { values = [0.9, 1.0] }
"""


def answered(task: Task) -> dict[str, Any]:
    """A point whose answer is known."""
    summary = {
        "gates": {"unit.stl": {"volume_mm3": 1000.0}},
        "angle_deg": {"20": len(task.files["unit.toml"])},
    }
    return {"status": "done", "seconds": 0.1, "memory_MB": 1, "summary": summary}


class OneProcess:
    """Stands for the cluster, which writes nothing into the folder and takes a second to start."""

    def __init__(self, scheduler: str | None, workers: int) -> None:
        pass

    def results(self, tasks: list[Task], work: Any, warn: Any) -> Iterator[tuple[int, dict[str, Any]]]:
        yield from enumerate(map(work, tasks))

    def close(self) -> None:
        pass


def test_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "Cluster", OneProcess)
    job = sweeping.Job(parse_plan(PLAN, tmp_path), work=answered)

    def run(folder: Path, context: RunContext) -> None:
        sweeping.USE_CASE.start(job, folder, context)

    assert fail_each_call(run, tmp_path, partial=["points.csv"]) == []


FAKE = str(Path(__file__).resolve().parents[1] / "run" / "fake_worker.py")


def test_a_point_of_a_sweep(tmp_path: Path, for_good: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its folder lies where the system keeps what is of no duration."""
    pytest.importorskip("psutil", reason="sweeps are an extra")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    task = Task({"study.toml": "", "unit.toml": ""}, 1000, 1.0, version(), (FAKE, "good"))
    for at in range(1, 100):
        with failing(tmp_path, at, for_good) as files:
            row, error = None, None
            try:
                row = run_point(task)
            except MuError as told:
                error = told
        assert row is None or row["status"] == "done", f"{at}, {files.calls[at - 1]}"
        assert error is None or error.what.startswith("cannot write"), f"{at}, {files.calls[at - 1]}"
        assert list(tmp_path.iterdir()) == []
        if at > len(files.calls):
            assert at > 10
            return


class Prepared:
    """A line on which all has come: two layouts of channels, and bytes that are no frame."""

    def __init__(self) -> None:
        self.pieces = [
            info_frame({"channels": ["light"], "unit": "V", "gain": 1e-3}),
            b"".join(sample_frame(k, 10_000 * k, (100 + k,)) for k in range(30)),
            b"\x00garbage\x00more of it\x00",
            info_frame({"channels": ["light", "dark"], "unit": "V", "gain": 1e-3}),
            b"".join(sample_frame(k, 10_000 * k, (100 + k, 3)) for k in range(30, 60)),
        ]

    def open(self) -> str:
        return "prepared"

    def read(self) -> bytes:
        if not self.pieces:
            raise EndOfStream
        return self.pieces.pop(0)

    def close(self) -> None:
        pass


def rows_of(folder: Path) -> list[list[list[float]]]:
    """The rows of every file of a recording, without host times."""
    return [
        np.column_stack([values for name, values in part.columns.items() if name != "time_s"]).tolist()
        for part in read_recording(folder)
    ]


def test_record(tmp_path: Path, for_good: bool) -> None:
    def run(folder: Path, context: RunContext) -> None:
        stream(Prepared(), folder, seconds=None, about={}, context=context)

    status, _ = ran(run, tmp_path / "whole")
    whole = rows_of(tmp_path / "whole")
    assert (status, [len(part) for part in whole]) == (0, [30, 30])
    for at in range(1, 500):
        folder = tmp_path / f"at-{at}"
        with failing(folder, at, for_good) as files:
            status, messages = ran(run, folder)
        if at > len(files.calls):
            assert at > 50
            return
        where = f"{at}, {files.calls[at - 1]}"
        wrong = list(faults(folder, status, messages, None))
        if (folder / "index.ndjson").exists():
            lines_of(folder / "index.ndjson")
            found = rows_of(folder)
            pairs = zip(found, whole, strict=False)
            wrong += [f"{len(part)} rows" for part, every in pairs if part != every[: len(part)]]
            if status == 0 and found != whole:
                wrong.append("rows are missing")
            wrong += [f"left behind: {path.name}" for path in folder.glob("live-*")]
            # What is recorded is never written over.
            status, messages = ran(run, folder)
            if status != 2 or "already contains a recording" not in messages[-1]["what"]:
                wrong.append(f"again: exit status {status}, {messages[-1]}")
        elif ran(run, folder)[0] or rows_of(folder) != whole:
            wrong.append("again: not the same rows")
        assert wrong == [], where
    raise AssertionError("the run never came to its end")
