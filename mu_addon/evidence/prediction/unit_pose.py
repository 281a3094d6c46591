"""unit_pose: a unit at rest under pressure, turned to any direction of gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...measured import Experiment
from ..effect import Effect, offered
from ..effects import Acting
from ..effects.declaration import Data, Setting
from ..parameter import Parameter
from .unit_pressure import TO_THE_SUPPLY, UnitPressure, UnitResponse, believed

KIND = "unit_pose"
# Orientations about an axis that are simulated. Between them their trigonometric polynomial is used, exact if
# the angle has at most three waves in a turn.
STATIONS = tuple(np.arange(0.0, 360.0, 45.0).tolist())
# Of the fixture's protractor, or of how upright its base stands.
TILT = Parameter("pose_tilt_deg", "deg", -10.0, 10.0, 0.0, (), "fixtures set by eye or level", spread=1.0)
ANGLE = "angle_deg"


class UnitPose:
    """Predicts unit_pose experiments: one row a pose, read at rest.

    responses: at every scale and axis of the experiments, in each of `STATIONS` about that axis. The angle of
    a unit bent by its weight depends on gravity's direction, more for a softer unit; out of the plane of
    bending the effect is of second order in the weight. Without weight the angle is that of the pressure, in
    every pose. Raises InputError without a response.
    """

    effects: tuple[Effect, ...]

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        if not responses:
            raise InputError("no response of the unit is given", KIND, "simulate the unit first")
        # Zero, modulus and discrepancy are shared with a driven unit: it is the same unit.
        driven = UnitPressure(responses)
        static = [e for e in driven.effects if e.name in responses[0].variants]
        data = Data(kind=KIND, experiments=experiments)
        self.effects = (*(attrs.evolve(e, kinds=(KIND,)) for e in static), *offered(data))
        self._driven = driven
        self._largest_kPa = data.largest("pressure_kPa")
        self._around = _around(responses)
        curved = tuple(p for p in driven.nuisances if not p.linear)
        asked = [(self._stations(e)[0], e) for e in experiments if e.kind == KIND]
        self.nuisances = (*believed(curved, asked), _zero_of(driven), TILT)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: the bending angle in degrees."""
        return (ANGLE,)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Angle (1, n) in degrees at the experiment's pressures and orientations; values as in `Simulator`.

        Raises InputError where no responses are of its scale and axis.
        """
        acting = Acting(KIND, values, Setting(experiment=experiment, largest=self._largest_kPa))
        p = acting.along(experiment["pressure_kPa"], *TO_THE_SUPPLY)
        modulus = acting.along(values.get("modulus_factor", 1.0), "modulus")
        p = self._driven.discrepant(p / modulus, values)
        static = self._driven.static(values, modulus)
        stations = self._stations(experiment)
        row = stations[0].channels.index(ANGLE)
        each = np.stack([r.at(p, static)[row] for r in stations])
        share = between_stations(experiment["orientation_deg"] + values.get(TILT.name, 0.0))
        return ((share * each).sum(axis=0) + values.get("angle_zero_deg", 0.0))[None]

    def _stations(self, experiment: Experiment) -> tuple[UnitResponse, ...]:
        axis = tuple(experiment.orientation_axis)
        for (scale, other), found in self._around.items():
            if abs(scale - experiment.scale) < 0.02 and np.allclose(other, axis, atol=1e-6):
                return found
        raise InputError(
            f"no responses about axis {axis} at scale {experiment.scale:g}",
            experiment.name,
            "simulate the unit there, or leave the experiment out",
        )


def between_stations(orientation_deg: Array) -> Array:
    """Shares (s, n) of the responses at the `STATIONS` (s,), at orientations (n,) in degrees.

    Trigonometric interpolation at equally spaced points, which add up to 1 everywhere (Dirichlet's kernel).
    """
    many = len(STATIONS)
    x = np.radians(orientation_deg[None] - np.array(STATIONS)[:, None])
    found = np.ones_like(x)
    for k in range(1, many // 2):
        found += 2.0 * np.cos(k * x)
    return np.asarray((found + np.cos(many // 2 * x)) / many)


def _zero_of(driven: UnitPressure) -> Parameter:
    return next(p for p in driven.nuisances if p.name == "angle_zero_deg")


def _around(responses: Sequence[UnitResponse]) -> dict[Any, tuple[UnitResponse, ...]]:
    """The responses at all `STATIONS`, in their order, by scale and axis."""
    every: dict[Any, dict[float, UnitResponse]] = {}
    for r in responses:
        every.setdefault((r.scale, tuple(r.orientation_axis)), {})[r.orientation_deg % 360.0] = r
    return {k: tuple(v[s] for s in STATIONS) for k, v in every.items() if set(STATIONS) <= set(v)}
