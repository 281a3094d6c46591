"""Nodes of the sensor on the bench: recordings, calibrations, and measured data from both."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..graph.definition import FILE, FOLDER, Call, Definition, Output, Outputs, node, setting
from .studies import node_of

BENCH = "Bench"


@node(
    BENCH,
    outputs=(Output("recording", "recording", "its samples"),),
    settings=(setting("folder", "", "folder of a recording", path=FOLDER),),
    remark=lambda outputs: outputs["words"],
)
def recording(call: Call) -> Outputs:
    """A recording that was made before."""
    from ..sensing.recording import read_recording

    folder = call.settings["folder"]
    if not folder:
        raise InputError("no recording is named", "folder", "give a folder that `record` or the bench wrote")
    found = read_recording(Path(folder))
    if not found:
        raise InputError("the recording contains no samples", folder, "choose another recording")
    time_s = found[-1].columns["time_s"]
    words = f"{len(time_s)} samples, {time_s[-1] - time_s[0]:.3g} s: {', '.join(found[-1].channels)}"
    return {"recording": Path(folder), "words": words}


@node(
    BENCH,
    outputs=(Output("calibration", "calibration", "the map"),),
    settings=(setting("file", "", "calibration.toml", path=FILE),),
    remark=lambda outputs: "{:.3g} to {:.3g} deg".format(*outputs["range"]),
)
def calibration(call: Call) -> Outputs:
    """A calibration that was made before."""
    from ..sensing.calibration import read_calibration

    file = call.settings["file"]
    if not file:
        raise InputError("no calibration is named", "file", "give the calibration.toml of `calibrate`")
    found = read_calibration(Path(file))
    return {"calibration": Path(file), "range": found.range_deg}


def bench_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of the bench."""
    return node_of("record"), recording, node_of("calibrate"), calibration, node_of("measure")
