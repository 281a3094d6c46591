"""pressure_hold: the gas balance of a chamber whose valve was shut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ...measured import Experiment
from ...measured.folder import ATMOSPHERE_kPa
from ..chamber import ROOM, Chamber, beginning_kPa, warmed
from ..effect import offered
from ..effects import Acting
from ..effects.declaration import Data, Setting
from ..parameter import Parameter

KIND = "pressure_hold"
# Of the absolute pressure: how near its first readings a hold starts.
NEAR = 0.01
# Pressures in chambers that are kept.
REMEMBERED = 256


class ChamberPressure:
    """Predicts pressure holds: p V = m R T in a chamber that, without effects, keeps V, m and T.

    experiments: those of kind pressure_hold each add two nuisances, the initial pressure in kPa and the time
    in s at which the valve was shut, until when the supply keeps the pressure. compliance_per_kPa: relative
    growth of the volume a kPa; it acts only while the pressure changes, so a hold does not show it.
    """

    def __init__(self, experiments: Sequence[Experiment], compliance_per_kPa: float = 0.0) -> None:
        self._compliance = compliance_per_kPa
        self.effects = offered(Data(kind=KIND, experiments=experiments))
        self._kept: dict[Any, Array] = {}
        nuisances = []
        for e in experiments:
            if e.kind != KIND:
                continue
            first = beginning_kPa(e)
            near = NEAR * (first + ATMOSPHERE_kPa)
            lasts = float(e["time_s"][-1] - e["time_s"][0])
            nuisances.append(
                Parameter(_initial(e), "kPa", first - near, first + near, first, (), "its first readings")
            )
            nuisances.append(
                Parameter(_shut(e), "s", 0.0, 0.5 * lasts, 0.0, (), "records begin by hand", spread=5.0)
            )
            nuisances[-2:] = [attrs.evolve(p, experiment=e.name) for p in nuisances[-2:]]
        self.nuisances = tuple(nuisances)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: gauge pressure in kPa."""
        return ("pressure_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Gauge pressure (1, n) in kPa at the experiment's times; values as in `Simulator`."""
        get = values.get
        initial = get(_initial(experiment), None)
        initial = beginning_kPa(experiment) if initial is None else initial
        time = experiment["time_s"] - experiment["time_s"][0] - get(_shut(experiment), 0.0)
        clock = experiment["time_s"]
        acting = Acting(KIND, values, Setting(experiment=experiment, time_s=clock))
        # Derivatives by what the gauge adds need the same chamber again.
        key = time.tobytes(), initial, acting.at("gas")
        if key not in self._kept:
            if len(self._kept) >= REMEMBERED:
                self._kept.clear()
            chamber = acting.along(Chamber(initial, self._compliance), "gas")
            self._kept[key] = chamber.pressure_kPa(time)
        p = self._kept[key]
        if (room := experiment.columns.get(ROOM)) is not None:
            p = warmed(p, room - room[0])
        return np.asarray(acting.along(p, "room", "read_gain", "read_zero", "read_drift"))[None]


def _initial(experiment: Experiment) -> str:
    return f"initial_kPa of {experiment.name}"


def _shut(experiment: Experiment) -> str:
    return f"shut_s of {experiment.name}"
