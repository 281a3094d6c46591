"""Nodes of the sensor on the bench: recordings, calibrations, and measured data from both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from ...graph.definition import FILE, FOLDER, Call, Definition, Output, Outputs, Setting, setting
from ...sensing.settings import BAUD, PORT
from .studies import MUTED, node_of

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order

BENCH = "Bench"


def _recording(call: Call) -> Outputs:
    from ...sensing.recording import read_recording

    folder = call.settings["folder"]
    if not folder:
        raise InputError("no recording is named", "folder", "give a folder that `record` or the bench wrote")
    found = read_recording(Path(folder))
    if not found:
        raise InputError("the recording contains no samples", folder, "choose another recording")
    time_s = found[-1].columns["time_s"]
    words = f"{len(time_s)} samples, {time_s[-1] - time_s[0]:.3g} s: {', '.join(found[-1].channels)}"
    return {"recording": Path(folder), "words": words}


def _calibration(call: Call) -> Outputs:
    from ...sensing.calibration import read_calibration

    file = call.settings["file"]
    if not file:
        raise InputError("no calibration is named", "file", "give the calibration.toml of `calibrate`")
    found = read_calibration(Path(file))
    return {"calibration": Path(file), "range": found.range_deg}


def _record(call: Call) -> Order:
    from ...graph.evaluation import Order
    from ..sensor import record

    names = ("port", "baud", "simulated", "seconds", "take")
    return Order(record.USE_CASE, record.Job(**{name: call.settings[name] for name in names}))


def _recorded(call: Call, done: Finished) -> Outputs:
    s = done.summary
    words = f"{s['rows']} samples, {s['duration_s']:.3g} s"
    return {"recording": done.folder / str(s["recording"]), "words": words}


def bench_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of the bench."""
    return (
        Definition(
            "record",
            "Record",
            BENCH,
            "seconds of the sensor on its serial port",
            outputs=(Output("recording", "recording", "its samples"),),
            settings=(
                Setting(PORT),
                Setting(BAUD),
                setting(
                    "simulated", False, "a simulated sensor that bends back and forth, in place of a port"
                ),
                setting("seconds", 10.0, "duration", unit="s", low=0.1, high=86_400),
                setting(
                    "take", 1, "raise it to record again; earlier recordings are kept", low=1, high=10_000
                ),
            ),
            order=_record,
            read=_recorded,
            muting=MUTED,
            remark=lambda outputs: outputs["words"],
        ),
        Definition(
            "recording",
            "Recording",
            BENCH,
            "a recording that was made before",
            outputs=(Output("recording", "recording", "its samples"),),
            settings=(setting("folder", "", "folder of a recording", path=FOLDER),),
            make=_recording,
            remark=lambda outputs: outputs["words"],
        ),
        node_of("calibrate"),
        Definition(
            "calibration",
            "Calibration",
            BENCH,
            "a calibration that was made before",
            outputs=(Output("calibration", "calibration", "the map"),),
            settings=(setting("file", "", "calibration.toml", path=FILE),),
            make=_calibration,
            remark=lambda outputs: "{:.3g} to {:.3g} deg".format(*outputs["range"]),
        ),
        node_of("measure"),
    )
