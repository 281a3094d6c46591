"""`record` in a node tree: some seconds of the sensor, in a folder of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs

from ..design.quantity import described
from ..errors import MuError
from ..run.context import RunContext
from ..run.study import Node, Study, setting
from ..sensing.settings import BAUD, PORT

# A clock that is read before and after may be off by a look of the session.
_SHORT_S = 0.5


def _recording(done: Any, call: Any) -> dict[str, Any]:
    return {"recording": done.folder / str(done.summary["recording"])}


@attrs.frozen(kw_only=True, eq=False)
class Record(Study):
    """Record some seconds of the sensor."""

    name = "record"
    header = "# The inputs of this recording."
    streams = True
    page = ""
    files = {"recording-[0-9]*": "samples, next to those of runs that were stopped"}
    node = Node(
        "Bench",
        "seconds of the sensor on its serial port",
        (("recording", "recording", "its samples"),),
        "{rows} samples, {duration_s:.3g} s".format_map,
        read=_recording,
    )

    port: str = setting(PORT)
    baud: int = setting(BAUD)
    simulated: bool = setting(
        described("simulated", False, "a simulated sensor that bends back and forth, in place of a port")
    )
    seconds: float = setting(described("seconds", 10.0, "duration", unit="s", low=0.1, high=86_400))
    take: int = setting(
        described("take", 1, "raise it to record again; earlier recordings are kept", low=1, high=10_000)
    )

    def work(self, folder: Path, context: RunContext) -> Path:
        """Record into a new folder within the run's; return it.

        Raises InputError, OutputError, and MuError where the recording was stopped early.
        """
        from ..sensing import stream
        from ..sensing.reconnecting import Control
        from ..sensing.session import run_session

        place = next(p for k in range(1, 10**6) if not (p := folder / f"recording-{k}").exists())
        source = (
            stream.simulated_source()
            if self.simulated
            else stream.serial_source(self.port or None, self.baud)
        )
        about = {"source": "simulated" if self.simulated else self.port, "baud": self.baud, "take": self.take}
        control, progress = Control(), context.progress
        context.console_summary = stream.console_summary

        def on_event(event: str, details: dict[str, Any]) -> None:
            if event == "status":
                progress.update(min(float(details["duration_s"]) / self.seconds, 1.0))
            elif event in ("disconnected", "waiting"):
                progress.warning(f"{event}: {details.get('detail', '')}", "sensor", "it is searched for")

        with progress.stage("record", expected_s=self.seconds), stream.ctrl_c_stops(control):
            status = run_session(
                source, place, about=about, control=control, seconds=self.seconds, on_event=on_event
            )
        context.summary |= {**status, "recording": place.name}
        short = self.seconds - float(status["duration_s"])
        if short > _SHORT_S:
            raise _Stopped(
                f"the recording was stopped {short:.1f} s before its end",
                str(place),
                "evaluate again to record again; the existing recording stays in that folder",
            )
        stream.require_samples(status, place)
        return place


class _Stopped(MuError):
    """The recording was asked to stop, which stops the whole evaluation."""

    status = 143
