"""`record` as a run of a node tree: some seconds of the sensor, in a separate folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs

from ...errors import InputError, MuError
from ...run.context import RunContext
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, read_inputs
from ...run.usecase import UseCase
from ...sensing.reconnecting import Control
from ...sensing.session import run_session
from ...sensing.settings import BAUD, PORT
from ...toml_writer import toml_text
from .stream import console_summary, ctrl_c_stops, require_samples, serial_source, simulated_source

LAYOUT = FolderLayout(
    "record.toml",
    "# The inputs of this recording.",
    results=("recording-[0-9]*",),
)
FOLDER = "recording"
# A clock that is read before and after may be off by a look of the session.
_SHORT_S = 0.5


@attrs.frozen
class Job:
    """Inputs of a recording: the source of samples, its seconds, and the number of the take.

    port: as of `serial_source`, "" for the only USB one; simulated: an oscillating sensor instead.
    """

    port: str = PORT.field()
    baud: int = BAUD.field()
    simulated: bool = False
    seconds: float = 10.0
    take: int = 1

    def __attrs_post_init__(self) -> None:
        if not 0 < self.seconds < float("inf"):
            raise InputError(
                f"{self.seconds:g} s is not a valid duration", "seconds", "give a number above zero"
            )

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name."""
        return {LAYOUT.inputs: toml_text({"format": FORMAT, **attrs.asdict(self)}, LAYOUT.header)}


def read_job(folder: Path) -> Job:
    """The job that a folder of a recording describes; raises InputError."""
    return read_inputs(folder / LAYOUT.inputs)[0].made(Job)


def record(job: Job, folder: Path, context: RunContext) -> Path:
    """Record into a new folder within the run's, next to those of stopped runs; return it.

    Raises InputError, OutputError, and MuError where the recording was stopped early.
    """
    place = next(p for k in range(1, 10**6) if not (p := folder / f"{FOLDER}-{k}").exists())
    source = simulated_source() if job.simulated else serial_source(job.port or None, job.baud)
    about = {"source": "simulated" if job.simulated else job.port, "baud": job.baud, "take": job.take}
    control, progress = Control(), context.progress

    def on_event(event: str, details: dict[str, Any]) -> None:
        if event == "status":
            progress.update(min(float(details["duration_s"]) / job.seconds, 1.0))
        elif event in ("disconnected", "waiting"):
            progress.warning(f"{event}: {details.get('detail', '')}", "sensor", "it is searched for")

    with progress.stage("record", expected_s=job.seconds), ctrl_c_stops(control):
        status = run_session(
            source, place, about=about, control=control, seconds=job.seconds, on_event=on_event
        )
    context.summary |= {**status, "recording": place.name}
    short = job.seconds - float(status["duration_s"])
    if short > _SHORT_S:
        raise _Stopped(
            f"the recording was stopped {short:.1f} s before its end",
            str(place),
            "evaluate again to record again; the existing recording stays in that folder",
        )
    require_samples(status, place)
    return place


class _Stopped(MuError):
    """The recording was asked to stop, which stops the whole evaluation."""

    status = 143


USE_CASE = UseCase[Any]("record", LAYOUT, read_job, record, console_summary)
