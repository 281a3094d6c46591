"""waveguide_bending: light through a waveguide in a bent body, as the voltage of a photodiode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...measured import Experiment
from ..effect import Effect, Parameter, laws
from .effective_pressure import play_operator
from .unit_pressure import TIMED

Array = np.ndarray[Any, Any]

KIND = "waveguide_bending"

STRAIGHT = Parameter("straight_V", "V", 1e-3, 100.0, 1.0, (), "set by light source and photodiode")
LOSS = Parameter("loss_per_deg", "1/deg", -0.2, 0.2, 0.01, (), "wells on the outside lose light, inside gain")

EFFECTS = (
    Effect(
        "led_drift",
        (Parameter("per_hour", "1/h", -10.0, 10.0, 0.0, (-0.2,), "light sources lose light as they warm"),),
        (KIND,),
    ),
    Effect(
        "led_drift",
        (
            Parameter(
                "settled", "", -2.0, 2.0, 0.0, (-0.05,), "logarithm of the light's share after warm-up"
            ),
            Parameter("settling_s", "s", 1.0, 1e4, 100.0, (20.0, 200.0), "warming of lamp and driver"),
        ),
        (KIND,),
        refines=True,
    ),
    Effect(
        "ambient_light",
        (Parameter("ambient_V", "V", 0.0, 5.0, 0.0, (0.05,), "photodiodes see the room"),),
        (KIND,),
    ),
    Effect(
        "ambient_light",
        (
            Parameter("at_first_V", "V", 0.0, 5.0, 0.0, (0.05,), "photodiodes see the room"),
            Parameter(
                "per_hour", "1/h", -10.0, 10.0, 0.0, (-1.0, 1.0), "daylight, a room's lamps that warm up"
            ),
        ),
        (KIND,),
        "ambient light adds to the signal, and changes during the record",
        refines=True,
    ),
    Effect(
        "optical_nonlinearity",
        (
            Parameter("excess", "", -0.9, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional, less 1"),
            Parameter("onset_deg", "deg", 0.0, 90.0, 0.0, (0.0, 20.0), "bend at which modes begin to leak"),
        ),
        (KIND,),
    ),
    # Modes that are guided less leave first, others begin to leak: calibrations go by a power of the bend or
    # by a polynomial in it, which has any smooth curve to third order.
    Effect(
        "optical_nonlinearity",
        (
            Parameter("at_90_deg", "", -0.9, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional, less 1"),
            Parameter("power", "", 1.1, 4.0, 2.0, (1.5, 2.5), "of the bend, for the excess"),
        ),
        (KIND,),
        "the light loss is not proportional to curvature, but a power of it",
        refines=True,
    ),
    Effect(
        "optical_nonlinearity",
        (
            Parameter("square", "", -10.0, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional"),
            Parameter("cube", "", -10.0, 10.0, 0.0, (0.0,), "loss at 90 deg over proportional"),
        ),
        (KIND,),
        "the light loss is not proportional to curvature, by its square and cube",
        refines=True,
    ),
    Effect(
        "waveguide_play",
        (
            Parameter(
                "play_deg", "deg", 0.0, 20.0, 0.0, (1.0, 4.0), "half a millimetre in a bend: 1 to 5 deg"
            ),
        ),
        (KIND,),
    ),
    *(Effect(e.name, e.parameters, (KIND,)) for e in TIMED if e.name in ("angle_offset", "clock_offset")),
)


class WaveguideVoltage:
    """Predicts waveguides: voltage V exp(-b a) at bending angle a in degrees.

    Each bend loses a share of the light. The loss of the straight guide is in V, so a zero of the angle has
    the same effect as another V until something else is nonlinear. Missing angles are interpolated in time by
    Akima's cubics: linear interpolation of a fast bend errs as much as a late clock does.
    """

    nuisances = (STRAIGHT, LOSS)
    effects = (*EFFECTS, *laws(KIND, ()))

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: voltage of the photodiode in V."""
        return ("voltage_V",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Voltage (1, n) in V at the experiment's times and angles; values as in `Simulator`."""
        get = values.get
        time, angle = experiment["time_s"], experiment["angle_deg"]
        angle = _angle(time, angle, get("clock_offset.offset_s", 0.0))
        angle = angle - get("angle_offset.offset_deg", 0.0)
        if play := get("waveguide_play.play_deg", 0.0):
            angle = play_operator(angle, play)
        if excess := get("optical_nonlinearity.excess", 0.0):
            beyond = np.maximum(np.abs(angle) - get("optical_nonlinearity.onset_deg", 0.0), 0.0)
            angle = angle + np.sign(angle) * excess * beyond**2 / 90.0
        if excess := get("optical_nonlinearity.at_90_deg", 0.0):
            beyond = np.abs(angle / 90.0) ** get("optical_nonlinearity.power", 2.0)
            angle = angle + 90.0 * excess * np.sign(angle) * beyond
        square, cube = (get(f"optical_nonlinearity.{k}", 0.0) for k in ("square", "cube"))
        if square or cube:
            x = angle / 90.0
            angle = angle + 90.0 * (square * np.abs(x) * x + cube * x**3)
        exponent = -get(LOSS.name, LOSS.null) * angle
        exponent = exponent + get("led_drift.per_hour", 0.0) * (time - time[0]) / 3600.0
        if settled := get("led_drift.settled", 0.0):
            exponent = exponent - settled * np.expm1(-(time - time[0]) / get("led_drift.settling_s", 100.0))
        # Far from the data a fit may try losses beyond floating point.
        voltage = get(STRAIGHT.name, STRAIGHT.null) * np.exp(np.clip(exponent, -100.0, 100.0))
        ambient = get("ambient_light.at_first_V", 0.0)
        ambient = ambient * (1.0 + get("ambient_light.per_hour", 0.0) * (time - time[0]) / 3600.0)
        return (voltage + get("ambient_light.ambient_V", 0.0) + ambient)[None]


def _angle(time: Array, angle: Array, delay_s: float) -> Array:
    """Angles (n,) in deg `delay_s` before times (n,); the first and the last beyond the record."""
    from scipy.interpolate import Akima1DInterpolator

    seen = np.isfinite(angle)
    if not delay_s and seen.all():
        return angle
    if np.count_nonzero(seen) < 2:
        return np.full(len(time), angle[seen][0])
    at = np.clip(time - delay_s, time[seen][0], time[seen][-1])
    return np.asarray(Akima1DInterpolator(time[seen], angle[seen])(at))
