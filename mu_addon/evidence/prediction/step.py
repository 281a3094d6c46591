"""pressure_step: a unit after steps of pressure, whose inertia the camera sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...measured import Experiment
from ..effect import Effect, Parameter
from ..ringing import swinging
from .unit import UnitPressure, UnitResponse

Array = np.ndarray[Any, Any]

KIND = "pressure_step"
# Slower than this a unit of the sizes that are printed does not swing, nor one without its damping.
SLOWEST_s = 2.0

INERTIA = Effect(
    "inertia",
    (
        Parameter(
            "period_s",
            "s",
            0.0,
            SLOWEST_s,
            0.0,
            (0.03, 0.06, 0.12, 0.25, 0.5),
            "of the first bending mode, undamped; 0 has no mass",
        ),
        Parameter("damping", "", 0.005, 0.95, 0.1, (0.05, 0.3), "share of the critical damping"),
    ),
    (KIND,),
)


class PressureStep(UnitPressure):
    """Predicts pressure_step experiments: as `UnitPressure`, and with the inertia of the unit's first mode.

    A step excites what quasi-static cycles do not. Inertia overshoots, or begins with a slope of zero; a line
    that lags begins with a slope and ends within a few of its times; a resin that relaxes goes on for decades
    of time, in both directions alike. The mode is linear: one period at every pressure, and all channels
    follow it in proportion to their way. Raises InputError without a response.
    """

    kind = KIND

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        super().__init__(responses, experiments)
        self.effects = (*self.effects, INERTIA)

    def _moving(self, experiment: Experiment, still: Array, values: Mapping[str, float]) -> Array:
        period = values.get("inertia.period_s", 0.0)
        if not period > 0.0:
            return still
        return swinging(experiment["time_s"], still, 1.0 / period, values.get("inertia.damping", 0.1))
