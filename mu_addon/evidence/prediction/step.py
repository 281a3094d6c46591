"""pressure_step: a unit after steps of pressure, whose inertia the camera sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...measured import Experiment
from ..effect import Effect, Parameter
from ..ringing import swinging
from .instants import finer
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


# A law with a second mode, tried where inertia is found. A uniform beam clamped at one end swings 6.27 times
# as fast in its second bending mode (1.8751 and 4.6941 squared). Elastomers lose about the same share of
# energy in each cycle at any frequency, hence one damping.
TWO_MODES = Effect(
    "inertia",
    (
        Parameter("first_s", "s", 0.0, SLOWEST_s, 0.0, (0.06, 0.12, 0.25, 0.5), "of the first bending mode"),
        Parameter("loss", "", 0.005, 0.5, 0.1, (0.1,), "half the tangent of loss of elastomers, below 1"),
        Parameter("second", "", -0.5, 0.5, 0.0, (0.05,), "share of the way that the second mode has"),
        Parameter(
            "faster", "", 1.5, 20.0, 6.27, (4.0, 6.27), "of a clamped beam, and with a mass at its tip"
        ),
    ),
    (KIND,),
    "the unit's mass swings after each change of pressure, in two modes of bending",
    refines=True,
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
        self.effects = (*self.effects, INERTIA, TWO_MODES)
        self._finer: dict[int, tuple[Experiment, Experiment, Array]] = {}

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """As `UnitPressure.predict`, driven by what pressure did between samples, too (`instants.finer`)."""
        if id(experiment) not in self._finer:
            time, pressure, rows = finer(experiment["time_s"], experiment["pressure_kPa"])
            columns = {c: np.full(len(time), np.nan) for c in experiment.columns}
            columns |= {"time_s": time, "pressure_kPa": pressure}
            dense = attrs.evolve(experiment, columns=columns, rows=np.arange(len(time)))
            # With the experiment, whose identity would otherwise be given to another one.
            self._finer[id(experiment)] = experiment, dense, rows
        _, dense, rows = self._finer[id(experiment)]
        return super().predict(dense, values)[:, rows]

    def _moving(self, experiment: Experiment, still: Array, values: Mapping[str, float]) -> Array:
        time, get = experiment["time_s"], values.get
        if (period := get("inertia.period_s", 0.0)) > 0.0:
            return swinging(time, still, 1.0 / period, get("inertia.damping", 0.1))
        if (period := get("inertia.first_s", 0.0)) > 0.0:
            loss, second = get("inertia.loss", 0.1), get("inertia.second", 0.0)
            first, fast = (
                swinging(time, still, hertz, loss)
                for hertz in (1.0 / period, get("inertia.faster", 6.27) / period)
            )
            return np.asarray((1.0 - second) * first + second * fast)
        return still
