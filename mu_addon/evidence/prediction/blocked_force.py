"""blocked_force: force of a unit's tip on a load cell that holds it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...measured import Experiment
from ...measured.pose import down
from ..effect import Effect, Parameter, laws
from ..effects import acted
from .drift import drift, drifts, largest_reading
from .effective_pressure import DECADES, first_order_lag, in_the_chambers, lag_weights
from .instruments import amplified, amplifier, before_the_gauge, filtered
from .unit_pressure import (
    GAUGE_SHARE,
    REFERENCE_C,
    RELAXING,
    TIMED,
    TWO_VOLUMES,
    UnitPressure,
    UnitResponse,
    believed,
)

Array = np.ndarray[Any, Any]

KIND = "blocked_force"
FORCE = "force_N"
# Of the largest force: drift allowed by a cell's data sheet, and errors of zeroing by hand.
ZERO_SHARE = 0.01
ACTING = (
    "viscoelasticity",
    "temperature_drift",
    "pressure_offset",
    "pressure_gain",
    "pressure_nonlinearity",
    "line_lag",
    "leak",
    "clock_offset",
)
GAP = "seating.tip_gap_mm"
STAND = Parameter("stand_mm_per_N", "mm/N", 0.0, 1.0, 0.0, (0.05,), "beams of load cells, printed stands")
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
    (`blocked_responses`), one a scale, gap and orientation. Raises InputError without a response.
    """

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        if not responses:
            raise InputError("no response of the unit is given", KIND, "simulate the unit first")
        self._responses = tuple(responses)
        self._driven = UnitPressure(responses)
        here = [e for e in experiments if e.kind == KIND]
        static = [e for e in self._driven.effects if e.name in responses[0].variants]
        self._sizes = {e.name: e.keys[0] for e in static}
        self._most = most = largest_reading(FORCE, KIND, here)
        self._largest_kPa = largest_reading("pressure_kPa", KIND, here)
        self.effects = (
            *(
                Effect(e.name, e.parameters, (KIND,), e.mechanism, refines=e.refines)
                for e in (*TIMED, RELAXING, TWO_VOLUMES)
                if e.name in ACTING
            ),
            *(Effect(e.name, e.parameters, (KIND,)) for e in static),
            *drifts("pressure_drift", "kPa", GAUGE_SHARE * self._largest_kPa, KIND, here),
            *drifts("force_drift", "N", ZERO_SHARE * most, KIND, here),
            *laws(KIND, here),
            *amplifier(KIND),
            *([Effect("frame_compliance", (STAND,), (KIND,))] if "seating" in self._sizes else []),
        )
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
        get, t, p = values.get, experiment["time_s"], experiment["pressure_kPa"]
        response = self._response(experiment)
        if delay := get("clock_offset.offset_s", 0.0):
            p = np.interp(t - delay, t, p)
        p = p - drift("pressure_drift", t, values)
        p = before_the_gauge(p, values, self._largest_kPa)
        p = acted("pressure", experiment, p, values, self._largest_kPa)
        if experiment.valve != "shut":
            p = in_the_chambers(t, p, values)
        kelvin = experiment.temperature_C - REFERENCE_C
        modulus = get("modulus_factor", 1.0)
        modulus *= 1.0 + get("temperature_drift.per_K", 0.0) * (kelvin if math.isfinite(kelvin) else 0.0)
        relaxing = shares(values)
        p = self._driven.discrepant(_weighed(t, p / modulus, relaxing), values)
        static = self._driven.static(values)
        if "gravity" in static:
            static["gravity"] = static["gravity"] / modulus
        force = self._balanced(response, p, static, get("frame_compliance.stand_mm_per_N", 0.0) * modulus)
        read = modulus * pressing(t, force, relaxing)
        read = amplified(filtered(t, read, values), values, self._most) + drift("force_drift", t, values)
        return (read + get(_zero(experiment), 0.0))[None]

    def _balanced(self, response: UnitResponse, p: Array, static: Mapping[str, float], give: float) -> Array:
        """Force (n,) in N of the held tip, negative for tension; give: compliance of the stand in mm/N."""
        force = response.at(p, static)[0]
        if not give:
            return force
        gap = static.get("seating", 0.0)
        for _ in range(ROUNDS):
            # At most a few points of the stand's way are asked for: the response is smooth in it.
            at = np.linspace(0.0, max(float(force.max()) * give, 1e-9), 5)
            every = np.stack([response.at(p, {**static, "seating": gap + a})[0] for a in at])
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


def shares(values: Mapping[str, float]) -> tuple[tuple[float, float], ...]:
    """Share of the modulus and time in s of each element that relaxes, of either law of viscoelasticity."""
    get = values.get
    found = []
    if share := get("viscoelasticity.share", 0.0):
        found.append((share, get("viscoelasticity.time_s", 1.0) / (1.0 - share)))
    if share := get("viscoelasticity.per_decade", 0.0):
        onset = get("viscoelasticity.onset_s", 1.0)
        found += [(share, onset * 10.0**k) for k in range(DECADES)]
    return tuple(found)


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
