"""Faults injected into whole runs, one place after the other, and what must hold afterwards.

The runs are as they are, but for what takes long and has no part in it: solid, mesh and states are computed
once for all runs, points of a sweep have a known answer, and a sensor's bytes come from memory.
"""

from __future__ import annotations

import functools
import hashlib
import json
import shutil
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, Protocol

import attrs
import numpy as np
import pytest

from mu_addon import design
from mu_addon.body import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem.protocol import Protocol as PressureProtocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.cache import Cache
from mu_addon.run.context import RunContext, run_to_end
from mu_addon.run.kept_results import Results
from mu_addon.run.progress import Progress
from mu_addon.sensing.framing import info_frame, sample_frame
from mu_addon.sensing.optics import Optics
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.sources import EndOfStream
from mu_addon.simulate_and_place import light
from mu_addon.studies.parameter_study.point import Outcome, Task
from mu_addon.studies.starting import start
from mu_addon.studies.unit_ranking import UnitStudy

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


END_OF_VTK = b"</VTKFile>\n"


def _begun(data: bytes, whole: bytes) -> bool:
    """Whether a table begins as the whole one does and has whole lines, no more of them.

    Files for ParaView may have fewer states and fields.
    """
    if whole.endswith(END_OF_VTK):
        return data.endswith(END_OF_VTK)
    lines, all_lines = data.splitlines(keepends=True), whole.splitlines(keepends=True)
    begins = lines[0].split(b",")[0] == all_lines[0].split(b",")[0]
    return begins and lines[-1].endswith(b"\n") and len(lines) <= len(all_lines)


def faults(
    folder: Path,
    ended: tuple[int, Messages],
    reference: dict[str, bytes] | None,
    expected: int,
    partial: Sequence[str] = (),
) -> Iterator[str]:
    """What is wrong with the end of a run that met a fault, and with what it leaves.

    reference: what the run finds undisturbed; None where that is never the same. expected: its exit status,
    where it is not 0. partial: tables that hold what has been found so far.
    """
    status, messages = ended
    last = messages[-1] if messages else {}
    if status not in (0, expected):
        yield f"exit status {status}: {last}"
    if status and not (last.get("type") == "error" and last["what"] and last["where"] and last["what_to_do"]):
        yield f"no clear error: {last}"
    found = results(folder)
    yield from (f"left behind: {name}" for name in found if ".part" in name)
    if reference is not None:
        for name, data in found.items():
            if name not in reference:
                yield f"left behind: {name}"
            elif data != reference[name] and not (
                any(fnmatch(name, one) for one in partial) and _begun(data, reference[name])
            ):
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


class Layer(Protocol):
    """What injects a fault: how many places it came upon, and which of them failed first."""

    @property
    def places(self) -> int: ...

    @property
    def where(self) -> str: ...


def inject_each(
    run: Run,
    work: Path,
    layer: Callable[[Path, int, bool], AbstractContextManager[Layer]],
    expected: int,
    partial: Sequence[str] = (),
    step: int = 1,
    first: int = 1,
) -> list[str]:
    """Have a run fail at its first place, then at the next, until none is left; what was wrong afterwards.

    layer: has the n-th place in a folder fail, and all later ones, too, where told so: in every second run.
    expected, partial: see `faults`. step: only each step-th place fails, from the `first` on. Once all works
    again, the same run must come to the same results.
    """
    status, messages = ran(run, work / "reference")
    assert status == 0, messages[-1]
    reference = results(work / "reference")
    wrong: list[str] = []
    seen: set[str] = set()
    for at in range(first, 5000, step):
        folder = work / f"at-{at}"
        with layer(folder, at, at // step % 2 == 0) as met:
            status, messages = ran(run, folder)
        if at > met.places:
            assert at > 20, "too few places: the layer does not see them"
            return wrong
        where = f"{at}, {met.where}"
        found = faults(folder, (status, messages), reference, expected, partial)
        wrong += [f"{where}: {fault}" for fault in found]
        # Most faults leave what another one left: only the first of each is run once more.
        left = hashlib.sha256(repr(sorted(results(folder).items())).encode()).hexdigest()
        if left not in seen:
            seen.add(left)
            status, messages = ran(run, folder)
            if status or results(folder) != reference:
                wrong.append(f"{where}, again: exit status {status}, {messages[-1]}")
        shutil.rmtree(folder, ignore_errors=True)
    raise AssertionError("the run never came to its end")


UNIT = load_preset("mu-1.0x")
STUDY = UnitStudy(
    unit=attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3)),
    protocol=PressureProtocol(np.arange(3.0), np.array([0.0, -2.0, 2.0])),
    mesh=MeshSettings(refine=0.35),
    times=3,
    mesh_check=False,
    workers=1,
    stages=("design", "simulate"),
)


PLACEMENT = attrs.evolve(
    STUDY,
    protocol=PressureProtocol(np.arange(2.0), np.array([0.0, 4.0])),
    times=2,
    stations=11,
    stages=("design", "simulate", "place"),
)


@pytest.fixture(autouse=True)
def unraisable(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """What fails where no one can be told, as in `__del__` and in threads; none of it may happen."""
    caught: list[str] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda found: caught.append(repr(found.exc_value)))
    monkeypatch.setattr(threading, "excepthook", lambda found: caught.append(repr(found.exc_value)))
    yield caught
    assert caught == []


# Tables of a study that hold what has been found so far.
PARTIAL = ("motion.csv", "model_a.pvd", "model_a/*.vtu")


def computed_once(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function whose first answer holds for every call, whatever it is called with."""
    found: list[Any] = []

    def call(*given: Any, **named: Any) -> Any:
        if not found:
            found.append(function(*given, **named))
        return found[0]

    return call


PLAN = """
format = 1
preset = "mu-1.0x"
stages = "simulate"
method = "grid"
[vary]
"chambers.wall_mm" = { values = [0.9, 1.0] }
"""


def answered(task: Task) -> Outcome:
    """A point whose answer is known."""
    summary = {
        "gates": {"unit.stl": {"volume_mm3": 1000.0}},
        "angle_deg": {"20": len(task.files["unit.toml"])},
    }
    return Outcome("done", 0.1, 1, summary=json.dumps(summary))


def started(job: UnitStudy) -> Run:
    """A run of a study of a unit."""
    return lambda folder, context: start(job, folder, context)


def simulation(monkeypatch: pytest.MonkeyPatch) -> Run:
    """A `simulate` that computes its solid and mesh once in a session."""
    monkeypatch.setattr(design, "build_solid", functools.cache(design.build_solid))
    monkeypatch.setattr("mu_addon.body.mesh_printed", computed_once(mesh_printed))
    return started(STUDY)


def made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the results that runs keep made once in a session; they are kept as if they had just been made."""
    made, known = Results.made, dict[Any, Any]()

    def remembered(results: Results, task: Any, values: Any) -> Any:
        name = results.stages[task[0]].kept and results.key(task)
        if name and name in known:
            return known[name]
        found = made(results, task, values)
        return known.setdefault(name, found) if name else found

    monkeypatch.setattr(Results, "made", remembered)


def placement(monkeypatch: pytest.MonkeyPatch, known: Cache | None = None) -> Run:
    """A whole `place` that computes its solid, its rays and what it keeps once in a session.

    known: a cache that holds the law of light.
    """
    made_once(monkeypatch)
    monkeypatch.setattr(design, "build_solid", functools.cache(design.build_solid))
    law = light.cached_law(PLACEMENT.unit.printed, Optics(), known) if known else None
    fitted = computed_once((lambda *_, **__: law) if law else light.fit_law)
    monkeypatch.setattr(light, "fit_law", fitted)
    monkeypatch.setattr(light, "traced_signal", computed_once(light.traced_signal))
    return started(PLACEMENT)


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
