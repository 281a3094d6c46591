"""pressure_step: a unit after steps of pressure, with its inertia."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ...arrays import Array
from ...measured import Experiment
from ..effects.declaration import Setting
from ..instants import SHARE, finer
from ..parameter import Parameter
from .unit_pressure import UnitPressure, UnitResponse

KIND = "pressure_step"
# An interval this many times longer than usual has lost samples. Its mean pressure is unknown: for a step at
# a random moment it differs from the chord's by 0.29 of the change (a standard deviation).
LOST, MEAN = 1.5, 0.29


class PressureStep(UnitPressure):
    """Predicts pressure_step experiments: as `UnitPressure`, and with the inertia of the unit's first mode.

    A step excites dynamics that quasi-static cycles do not. Inertia overshoots, or begins with zero slope. A
    lagging line begins with a slope and ends within a few time constants. A relaxing resin continues for
    decades of time, equally in both directions. The mode is linear: one period at every pressure, and all
    channels follow it in proportion to their way. Where samples were lost while the pressure changed, its
    mean between those that are left is a nuisance. Raises InputError without a response.
    """

    kind = KIND

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        super().__init__(responses, experiments)
        self._finer: dict[int, tuple[Experiment, Experiment, Array]] = {}
        self._picture_s: dict[str, float] = {}
        self._lost = {e.name: _lost_while_changing(e) for e in experiments if e.kind == self.kind}
        self.nuisances = (
            *self.nuisances,
            *(
                Parameter(
                    _mean(name, start), "", -0.5, 0.5, 0.0, (), "samples lost", spread=MEAN, experiment=name
                )
                for name, gaps in self._lost.items()
                for start, _, _ in gaps
            ),
        )

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Return `UnitPressure.predict`, driven by the pressure between samples, too (`instants.finer`)."""
        if id(experiment) not in self._finer:
            time, pressure, rows = finer(experiment["time_s"], experiment["pressure_kPa"])
            self._picture_s[experiment.name] = float(np.median(np.diff(experiment["time_s"])))
            columns = {c: np.full(len(time), np.nan) for c in experiment.columns}
            columns |= {"time_s": time, "pressure_kPa": pressure}
            dense = attrs.evolve(experiment, columns=columns, rows=np.arange(len(time)))
            # Stored with the experiment, whose identity could otherwise be reused.
            self._finer[id(experiment)] = experiment, dense, rows
        _, dense, rows = self._finer[id(experiment)]
        pressure = dense["pressure_kPa"]
        for start, end, way in self._lost.get(experiment.name, ()):
            if off := values.get(_mean(experiment.name, start), 0.0):
                # A triangle of the height that has this mean.
                share = (dense["time_s"] - start) / (end - start)
                pressure = pressure + 2.0 * off * way * np.maximum(1.0 - np.abs(2.0 * share - 1.0), 0.0)
        if pressure is not dense["pressure_kPa"]:
            dense = attrs.evolve(dense, columns={**dense.columns, "pressure_kPa": pressure})
        return super().predict(dense, values)[:, rows]

    def _setting(
        self, experiment: Experiment, response: UnitResponse, values: Mapping[str, float]
    ) -> Setting:
        setting = super()._setting(experiment, response, values)
        setting.picture_s = self._picture_s[experiment.name]
        return setting


def _mean(experiment: str, start_s: float) -> str:
    return f"mean_pressure of {experiment} after {start_s:.4g} s"


def _lost_while_changing(experiment: Experiment) -> tuple[tuple[float, float, float], ...]:
    """Intervals in which samples were lost while pressure changed much: begin and end in s, change in kPa."""
    t, p = experiment["time_s"], experiment["pressure_kPa"]
    if len(t) < 3:
        return ()
    apart, way = np.diff(t), np.diff(p)
    lost = (apart > LOST * np.median(apart)) & (np.abs(way) > SHARE * np.ptp(p))
    return tuple((float(t[i]), float(t[i + 1]), float(way[i])) for i in np.flatnonzero(lost))
