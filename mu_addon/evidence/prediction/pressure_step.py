"""pressure_step: a unit after steps of pressure, with its inertia."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...measured import Experiment
from ..effect import Effect, Parameter
from ..ringing import swinging
from .instants import SHARE, finer
from .unit_pressure import UnitPressure, UnitResponse

Array = np.ndarray[Any, Any]

KIND = "pressure_step"
# An interval this many times longer than usual has lost samples. Its mean pressure is unknown: for a step at
# a random moment it differs from the chord's by 0.29 of the change (a standard deviation).
LOST, MEAN = 1.5, 0.29
# Longest period of units of the printed sizes, with their damping.
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

    A step excites dynamics that quasi-static cycles do not. Inertia overshoots, or begins with zero slope. A
    lagging line begins with a slope and ends within a few time constants. A relaxing resin continues for
    decades of time, equally in both directions. The mode is linear: one period at every pressure, and all
    channels follow it in proportion to their way. Where samples were lost while the pressure changed, its
    mean between those that are left is a nuisance. Raises InputError without a response.
    """

    kind = KIND

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        super().__init__(responses, experiments)
        self.effects = (*self.effects, INERTIA, TWO_MODES)
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

    def _moving(self, experiment: Experiment, still: Array, values: Mapping[str, float]) -> Array:
        time, get = experiment["time_s"], values.get
        if (period := get("inertia.period_s", 0.0)) > 0.0:
            moved = swinging(time, still, 1.0 / period, get("inertia.damping", 0.1))
            return self._seen(experiment, still, moved, period)
        if (period := get("inertia.first_s", 0.0)) > 0.0:
            loss, second = get("inertia.loss", 0.1), get("inertia.second", 0.0)
            first, fast = (
                swinging(time, still, hertz, loss)
                for hertz in (1.0 / period, get("inertia.faster", 6.27) / period)
            )
            return self._seen(experiment, still, (1.0 - second) * first + second * fast, period)
        return still

    def _seen(self, experiment: Experiment, still: Array, moved: Array, period_s: float) -> Array:
        """Channels (c, n) of a swing as a camera sees them: reduced where an exposure takes a period.

        Each picture is a mean over its exposure. Otherwise a swing faster than the pictures would alias to
        any slow one, and fit noise.
        """
        share = min(1.0, period_s / (2.0 * self._picture_s[experiment.name])) ** 2
        return np.asarray(still + share * (moved - still))


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
