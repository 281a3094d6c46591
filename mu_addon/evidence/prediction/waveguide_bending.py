"""waveguide_bending: light through a waveguide in a bent body, as the voltage of a photodiode."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...arrays import Array
from ...measured import Experiment
from ..effect import offered
from ..effects import Acting
from ..effects.declaration import Data, Setting
from ..lags import smooth_at
from ..parameter import Parameter

KIND = "waveguide_bending"

STRAIGHT = Parameter("straight_V", "V", 1e-3, 100.0, 1.0, (), "set by light source and photodiode")
LOSS = Parameter("loss_per_deg", "1/deg", -0.2, 0.2, 0.01, (), "wells on the outside lose light, inside gain")


class WaveguideVoltage:
    """Predicts waveguides: voltage V exp(-b a) at bending angle a in degrees.

    Each bend loses a share of the light. The loss of the straight guide is in V, so a zero of the angle has
    the same effect as another V until something else is nonlinear. Missing angles are interpolated in time by
    Akima's cubics: linear interpolation of a fast bend errs as much as a late clock does.
    """

    nuisances = (STRAIGHT, LOSS)
    effects = offered(Data(kind=KIND))

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: voltage of the photodiode in V."""
        return ("voltage_V",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Voltage (1, n) in V at the experiment's times and angles; values as in `Simulator`."""
        get = values.get
        time = experiment["time_s"]
        acting = Acting(KIND, values, Setting(experiment=experiment, time_s=time))
        angle = smooth_at(time, experiment["angle_deg"])
        angle = acting.along(angle, "bent_clock", "bent_zero", "bend")
        exponent = acting.along(-get(LOSS.name, LOSS.null) * angle, "exponent")
        # Far from the data a fit may try losses beyond floating point.
        voltage = get(STRAIGHT.name, STRAIGHT.null) * np.exp(np.clip(exponent, -100.0, 100.0))
        return np.asarray(acting.along(voltage, "voltage"))[None]
