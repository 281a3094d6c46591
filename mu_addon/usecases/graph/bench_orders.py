"""Runs of the bench's nodes, and their results."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError
from ...graph.definition import Call, Outputs
from ...graph.evaluation import Finished, Order
from ...measured import Measured, read_folder
from ..sensor import calibrate, measured_motion, record


def record_order(call: Call) -> Order:
    """Run that records the sensor for some seconds."""
    names = ("port", "baud", "simulated", "seconds", "take")
    return Order(record.USE_CASE, record.Job(**{name: call.settings[name] for name in names}))


def recording_of(call: Call, done: Finished) -> Outputs:
    """Recording made by a run of `record`."""
    s = done.summary
    words = f"{s['rows']} samples, {s['duration_s']:.3g} s"
    return {"recording": done.folder / str(s["recording"]), "words": words}


def calibrate_order(call: Call) -> Order:
    """Run that calibrates from recordings and measured data."""
    s = call.settings
    places = tuple(v.folder if isinstance(v, Measured) else Path(v) for _, v in call.inputs["bending"])
    if not places:
        raise InputError("nothing is linked to calibrate by", "bending", "link recordings, or measured data")
    job = calibrate.Job(
        places,
        channel=s["channel"] or None,
        dark=s["dark"] or None,
        angles=Path(s["angles"]) if s["angles"] else None,
    )
    return Order(calibrate.USE_CASE, job)


def calibration_of(call: Call, done: Finished) -> Outputs:
    """File and error of a calibration."""
    return {"calibration": done.folder / "calibration.toml", "error": float(done.summary["error_deg"])}


def measure_order(call: Call) -> Order:
    """Run that makes measured data from a recording and a calibration."""
    s, given = call.settings, call.inputs
    names = ("pressure", "kPa_per_unit", "zero", "rate_hz", "name", "specimen")
    job = measured_motion.Job(given["recording"], given["calibration"], **{name: s[name] for name in names})
    return Order(measured_motion.USE_CASE, job)


def measured_of(call: Call, done: Finished) -> Outputs:
    """Folder of the measured data written by a run."""
    return {"data": read_folder(done.folder), "range": done.summary["angle_deg"]}
