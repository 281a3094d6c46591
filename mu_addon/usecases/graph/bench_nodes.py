"""Nodes of the sensor on the bench: recordings, calibrations, and measured data from both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from ...graph.definition import FILE, FOLDER, Call, Definition, Input, Output, Outputs, Setting, setting
from ...sensing.settings import ANGLES, BAUD, CHANNEL, DARK, PORT

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order

BENCH = "Bench"
_LEFT_OUT = "this node and those that need it are not computed"


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


def _calibrate(call: Call) -> Order:
    from ...graph.evaluation import Order
    from ...measured import Measured
    from ..sensor import calibrate

    s = call.settings
    places = tuple(v.folder if isinstance(v, Measured) else Path(v) for _, v in call.inputs["bending"])
    if not places:
        raise InputError(
            "no data for the calibration are linked", "bending", "link recordings, or measured data"
        )
    job = calibrate.Job(
        places,
        channel=s["channel"] or None,
        dark=s["dark"] or None,
        angles=Path(s["angles"]) if s["angles"] else None,
    )
    return Order(calibrate.USE_CASE, job)


def _calibrated(call: Call, done: Finished) -> Outputs:
    return {"calibration": done.folder / "calibration.toml", "error": float(done.summary["error_deg"])}


def _measure(call: Call) -> Order:
    from ...graph.evaluation import Order
    from ..sensor import measured_motion

    s, given = call.settings, call.inputs
    names = ("pressure", "kPa_per_unit", "zero", "rate_hz", "name", "specimen")
    job = measured_motion.Job(given["recording"], given["calibration"], **{name: s[name] for name in names})
    return Order(measured_motion.USE_CASE, job)


def _measured(call: Call, done: Finished) -> Outputs:
    from ...measured import read_folder

    return {"data": read_folder(done.folder), "range": done.summary["angle_deg"]}


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
            muting=_LEFT_OUT,
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
        Definition(
            "calibrate",
            "Calibrate",
            BENCH,
            "the map from voltage to bending angle, by recorded bending",
            (Input("bending", ("recording", "data"), "link recordings, or measured data", many=True),),
            (
                Output("calibration", "calibration", "the map"),
                Output("error", "number", "error in sweeps left out of the fit, in deg"),
            ),
            (
                Setting(CHANNEL),
                Setting(DARK),
                Setting(ANGLES, FILE),
            ),
            order=_calibrate,
            read=_calibrated,
            muting=_LEFT_OUT,
            remark=lambda outputs: f"error {outputs['error']:.2g} deg",
        ),
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
        Definition(
            "measure",
            "Measured Motion",
            BENCH,
            "a recording as measured data: the angle by the calibration against the pressure",
            (
                Input("recording", ("recording",), "link a node Record or Recording"),
                Input("calibration", ("calibration",), "link a node Calibrate or Calibration"),
            ),
            (Output("data", "data", "an experiment of a unit under pressure"),),
            (
                setting("pressure", "pressure_kPa", "channel of the gauge"),
                setting("kPa_per_unit", 1.0, "factor on the channel", low=-1e6, high=1e6),
                setting("zero", 0.0, "reading of the channel without pressure", low=-1e9, high=1e9),
                setting("rate_hz", 10.0, "rows a second", unit="Hz", low=1e-3, high=1e5),
                setting("name", "bench", "name of the experiment"),
                setting("specimen", "A", "which specimen"),
            ),
            order=_measure,
            read=_measured,
            muting=_LEFT_OUT,
            remark=lambda outputs: "{:.3g} to {:.3g} deg".format(*outputs["range"]),
        ),
    )
