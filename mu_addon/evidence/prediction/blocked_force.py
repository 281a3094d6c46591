"""blocked_force: force of a unit's tip on a load cell that holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...measured import Experiment
from ...measured.pose import down
from ..effect import Effect, offered
from ..effects import ON_UNITS, Acting, places
from ..effects.declaration import Data, Setting
from ..lags import first_order_lag, lag_weights
from ..load_cell import ZERO_SHARE
from ..parameter import Parameter
from ..unit_body import HELD
from .unit_pressure import UnitPressure, UnitResponse, believed, driving_kPa

KIND = "blocked_force"
FORCE = "force_N"
# What a load cell shows, in order.
SHOWN = ("filter", "cell_curve", "cell_gain", "cell_drift")
# Iterations until the stand's deflection and the force agree: each gains the stand's share of the unit's
# stiffness.
ROUNDS = 8


class BlockedForce:
    """Predicts blocked_force experiments: the base clamped, the tip's edge against a flat load cell.

    The cell lies across the axis on the side toward which pressure bends the unit, `gap_mm` from the tip at
    rest; the tip slides along it without friction, and rotates. A cell cannot pull: the force is 0 where the
    tip does not reach it. A blocked unit hardly deforms, so that its moduli have little effect. They scale by
    one factor (m F(p/m)), and relax as an integral over the history of pressure and force. Friction in the
    resin and Mullins' softening need motion and are left out. responses: forces in N with the tip held
    (`unit_responses`), one a scale, gap and orientation. Raises InputError without a response.
    """

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        if not responses:
            raise InputError("no response of the unit is given", KIND, "simulate the unit first")
        self._responses = tuple(responses)
        self._driven = UnitPressure(responses)
        data = Data(kind=KIND, experiments=experiments)
        here = data.own
        static = [e for e in self._driven.effects if e.name in responses[0].variants]
        # How far the stand gives way is known by runs of the tip at other gaps.
        self._gap = next((e.name for e in static if ON_UNITS[e.name].of == HELD), "")
        self._most, self._largest_kPa = data.largest(FORCE), data.largest("pressure_kPa")
        laws = (e for e in offered(data) if self._gap or "stand" not in places(KIND, e.name))
        self.effects = (*(Effect(e.name, e.parameters, (KIND,)) for e in static), *laws)
        curved = tuple(p for p in self._driven.nuisances if not p.linear)
        asked = [(self._response(e), e) for e in here]
        self.nuisances = (*believed(curved, asked), *(_zero_parameter(e) for e in here))

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: force on the load cell in N."""
        return (FORCE,)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Force (1, n) in N that the load cell reads; values as in `Simulator`.

        Raises InputError where no response is near the experiment's scale, gap and orientation.
        """
        t = experiment["time_s"]
        setting = Setting(experiment=experiment, time_s=t, largest=self._largest_kPa, fed=1.0)
        acting = Acting(KIND, values, setting)
        response = self._response(experiment)
        p = driving_kPa(acting)
        modulus = acting.along(values.get("modulus_factor", 1.0), "modulus")
        relaxing = acting.along((), "elements")
        p = self._driven.discrepant(_weighed(t, p / modulus, relaxing), values)
        static = self._driven.static(values, modulus)
        force = self._balanced(response, p, static, acting.along(0.0, "stand") * modulus)
        setting.largest, setting.kPa_per_N = self._most, 1.0
        read = acting.along(modulus * pressing(t, force, relaxing), *SHOWN)
        return np.asarray(read + values.get(_zero(experiment), 0.0))[None]

    def _balanced(self, response: UnitResponse, p: Array, static: Mapping[str, float], give: float) -> Array:
        """Force (n,) in N of the held tip, negative for tension; give: compliance of the stand in mm/N."""
        force = response.at(p, static)[0]
        if not give:
            return force
        gap = static.get(self._gap, 0.0)
        for _ in range(ROUNDS):
            # At most a few points of the stand's way are asked for: the response is smooth in it.
            at = np.linspace(0.0, max(float(force.max()) * give, 1e-9), 5)
            every = np.stack([response.at(p, {**static, self._gap: gap + a})[0] for a in at])
            way = np.clip(give * force, 0.0, at[-1])
            k = np.clip(np.searchsorted(at, way) - 1, 0, len(at) - 2)
            share = (way - at[k]) / (at[k + 1] - at[k])
            row = np.arange(len(p))
            new = (1.0 - share) * every[k, row] + share * every[k + 1, row]
            if np.abs(new - force).max() <= 1e-9 * max(np.abs(new).max(), 1e-12):
                break
            force = new
        return np.asarray(force)

    def _response(self, experiment: Experiment) -> UnitResponse:
        here = down(experiment.orientation_deg, experiment.orientation_axis)
        for r in self._responses:
            turned = float(np.linalg.norm(down(r.orientation_deg, r.orientation_axis) - here))
            near = abs(r.scale - experiment.scale) + turned < 0.02
            if near and abs(r.gap_mm - experiment.gap_mm) < 1e-6:
                return r
        raise InputError(
            f"no response at scale {experiment.scale:g} with the tip held at {experiment.gap_mm:g} mm",
            experiment.name,
            "simulate the unit there, or leave the experiment out",
        )


def _weighed(t: Array, p: Array, relaxing: Sequence[tuple[float, float]]) -> Array:
    """Load (n,) that puts a unit without memory in the same state, for loads p (n,) at times t (n,) in s."""
    if not relaxing:
        return p
    now = 1.0 - sum(share for share, _ in relaxing)
    return np.asarray(now * p + sum(share * first_order_lag(t, p, time) for share, time in relaxing))


def pressing(t: Array, held: Array, relaxing: Sequence[tuple[float, float]] = ()) -> Array:
    """Force (n,) on a cell that cannot pull, from the force (n,) that would hold a unit without memory.

    t (n,): times in s, ascending. relaxing: shares and times in s of the resin's elements. Relaxation acts
    equally on pressure and force: the unit has the state of one without memory under both, each weighted by
    its history (`_weighed`). While the tip touches, the force's load is `held`; else the force is 0, and its
    past fades.
    """
    if not relaxing:
        return np.maximum(held, 0.0)
    h = np.diff(t)
    share = [s for s, _ in relaxing]
    weights = [[w.tolist() for w in lag_weights(h, time)] for _, time in relaxing]
    now = 1.0 - sum(share)
    force = max(float(held[0]), 0.0)
    past = [force] * len(share)
    found = [force]
    for i, wanted in enumerate(held[1:].tolist()):
        kept = [a[i] * x + b0[i] * force for (a, b0, _), x in zip(weights, past, strict=True)]
        gain = now + sum(s * b1[i] for s, (_, _, b1) in zip(share, weights, strict=True))
        force = max((wanted - sum(s * k for s, k in zip(share, kept, strict=True))) / gain, 0.0)
        past = [k + b1[i] * force for k, (_, _, b1) in zip(kept, weights, strict=True)]
        found.append(force)
    return np.array(found)


def _zero(experiment: Experiment) -> str:
    return f"force_zero_N of {experiment.name}"


def _zero_parameter(experiment: Experiment) -> Parameter:
    """Zero of the load cell in an experiment, known to a share of the largest force: set before each."""
    most = float(np.nanmax(np.abs(experiment[FORCE]))) or 1.0
    zero = Parameter(_zero(experiment), "N", -most, most, 0.0, (), "set by hand", spread=ZERO_SHARE * most)
    return attrs.evolve(zero, experiment=experiment.name)
