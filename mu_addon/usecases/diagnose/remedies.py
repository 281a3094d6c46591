"""Remedy for each cause, for those at the bench and at the printer."""

from __future__ import annotations

from ...evidence.effect import SLIP, SUPPLY_LIMIT, SUPPLY_RATE, THICKNESS

_INSTRUMENT = "the simulation is not at fault"
_MODEL = "simulate with --model model.toml, which has it"

# One sentence each, without a full stop. Instruments are put right, physics goes into the simulation.
TO_DO = {
    "viscoelasticity": f"{_MODEL}; compare loads at one rate, and read holds at one time",
    "rate_independent_hysteresis": f"{_MODEL} where a unit was measured; approach a pressure from one side",
    "strain_stiffening": _MODEL,
    "mullins_softening": f"{_MODEL} where a unit was measured; load a new print to its full range once",
    "tension_compression_asymmetry": _MODEL,
    "anisotropy": f"{_MODEL}; print all parts the same way, or along another direction",
    "fatigue_drift": "replace the specimen, or recalibrate after that many cycles",
    "temperature_drift": "keep the temperature constant, or record it with every experiment",
    "overcure": f"{_MODEL}; print with that offset (export --compensate), or expose less",
    "skin_cure": f"{_MODEL}; cure less, or longer and more evenly",
    "wall_thickness": f"{_MODEL}; cut one unit and measure its wall",
    "pressure_offset": f"set the gauge's zero, or subtract the offset from the readings; {_INSTRUMENT}",
    "pressure_gain": f"have the gauge calibrated, or divide its readings by the gain; {_INSTRUMENT}",
    "pressure_nonlinearity": (
        f"compare the gauge with another one in steps up to the largest pressure; {_INSTRUMENT}"
    ),
    "pressure_drift": f"let the gauge warm up, and read its zero before and after; {_INSTRUMENT}",
    "force_scale": (
        "check which specimen was in each test, hang a dead weight from the load cell, measure the section, "
        "and clamp the specimen again"
    ),
    "force_nonlinearity": f"calibrate the load cell by dead weights up to its largest force; {_INSTRUMENT}",
    "geometry_as_typed": "measure the specimen and correct the height that was entered",
    "step_change": "find what was changed between these tests, and repeat the first one",
    "self_heating": "test slowly or with pauses, or measure the specimen's temperature",
    "force_drift": f"let the load cell warm up, and read its zero before and after; {_INSTRUMENT}",
    "force_lag": f"switch off the load cell's filter, or test slower; {_INSTRUMENT}",
    "line_lag": f"{_MODEL}; a shorter or wider line, or a gauge at the unit",
    SUPPLY_LIMIT: f"set the supply to give that pressure, or log a gauge at the unit; {_INSTRUMENT}",
    SUPPLY_RATE: f"ask for slower changes, or log a gauge at the unit; {_INSTRUMENT}",
    "leak": "find the leak (soapy water at joints and inlet) and seal it, then measure again",
    "clogged_chamber": "drain and clean the unit, and look for cured resin in its necks; print with drains",
    "gravity": f"{_MODEL}, and give the direction in which the unit hangs by --orientation",
    "contact": "remove the obstacle, or simulate it with --obstacle",
    "angle_offset": f"set the camera's zero by a record at rest; {_INSTRUMENT}",
    "angle_drift": f"fix the camera, or follow a mark on the bench; {_INSTRUMENT}",
    "camera_scale": f"measure the scale by a ruler in the plane of the markers; {_INSTRUMENT}",
    "camera_tilt": f"set the camera at right angles to the plane of bending; {_INSTRUMENT}",
    "camera_perspective": f"set the camera at right angles to the plane of bending; {_INSTRUMENT}",
    "lens_distortion": f"calibrate the lens, or move the camera farther away; {_INSTRUMENT}",
    SLIP: (
        "leave this marker out from that moment on, or glue it again and repeat the later records; "
        f"{_INSTRUMENT}"
    ),
    "inertia": "read steps after they have settled, or let pressure in slowly: the simulation has no inertia",
    "clock_offset": f"record with one clock, or shift the records by the offset; {_INSTRUMENT}",
    "seating": "preload the specimen until its faces are in full contact; the simulation is not at fault",
    "frame_compliance": "subtract the machine's compliance, found with a rigid block, or use an extensometer",
    "led_drift": f"let the light source warm up, or measure it with the signal; {_INSTRUMENT}",
    "ambient_light": f"shield the waveguide from light, or subtract a dark reading; {_INSTRUMENT}",
    "waveguide_play": "remove the play of the waveguide in its channel, or of the stage, and record again",
    "optical_nonlinearity": "calibrate the sensor over the whole range of bending",
    "batch_variation": "print and test the specimens in one batch, or give that specimen another modulus",
    THICKNESS: "measure the struts of each specimen, and write one unit file for each design",
    "mesh_error": "simulate with a finer mesh, --refine",
}


def in_the_simulation(effect: str) -> bool:
    """Return True if a cause is physics that a simulation should have, not an instrument's fault."""
    return _INSTRUMENT not in TO_DO[effect]


def what_to_do(effects: tuple[str, ...], sure: bool = True) -> str:
    """Remedies for these causes, a sentence each; empty without any.

    sure: nothing inside the simulation would do as well; only then is it said to be right.
    """
    sentences = (TO_DO[name] if sure else TO_DO[name].replace(f"; {_INSTRUMENT}", "") for name in effects)
    return " ".join(f"{text[:1].upper()}{text[1:]}." for text in dict.fromkeys(sentences))
