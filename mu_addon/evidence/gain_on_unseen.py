"""Gain of an extended model on unseen experiments, against three models without a cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MuError
from ..measured import Experiment
from .fit import Fit, Fitter
from .record import KNOWN, Record, record

RESAMPLES = 400


@attrs.frozen
class Errors:
    """Root mean square residuals of the base model and the extended one, in `unit`.

    low95, high95: 95 % interval of before - after, by bootstrap. permuted, black_box: residuals of the base
    with the effects' changes taken from the wrong experiments, and with as many arbitrary correction terms as
    the effects have parameters. All are in `unit`, and nan without such a model. unit: last part of a
    column's name, or "spreads" for records whose uncertainty is given.
    """

    before: float
    after: float
    unit: str
    low95: float = math.nan
    high95: float = math.nan
    permuted: float = math.nan
    black_box: float = math.nan

    def as_json(self) -> dict[str, Any]:
        """The entries of verdict.json by their names there; nan becomes null when written."""
        return {
            "rmse_before": self.before,
            "rmse_after": self.after,
            "unit": self.unit,
            "low95": self.low95,
            "high95": self.high95,
            "rmse_permuted": self.permuted,
            "rmse_black_box": self.black_box,
        }


@attrs.frozen
class Gain:
    """Errors on the experiments that were fitted, and on those held out (None without any).

    fit and held_out are of one quantity: the first that an effect concerns and that clearly improves, an
    angle before markers. by_quantity: fitted and held-out errors of every group of series ("unit_pressure
    angle"), None if it has no held-out data. refused: reasons, by name, why held-out experiments without a
    prediction are left out.
    """

    fit: Errors
    held_out: Errors | None
    by_quantity: Mapping[str, tuple[Errors, Errors | None]] = attrs.field(factory=dict)
    refused: Mapping[str, str] = attrs.field(factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The entry "gain" of verdict.json."""
        every = {
            name: {"fit": fit.as_json(), "held_out": held.as_json() if held else None}
            for name, (fit, held) in self.by_quantity.items()
        }
        held = self.held_out.as_json() if self.held_out else None
        return {"fit": self.fit.as_json(), "held_out": held, "by_quantity": every}


def gain(fitter: Fitter, base: Fit, extended: Fit, held_out: Sequence[Experiment]) -> Gain:
    """Root mean square errors of the base and extended fits, on the record and on held-out experiments.

    held_out: experiments that were not fitted; kinds without a simulator are ignored, and so are those that a
    model cannot predict (`Gain.refused`). See `Gain` and `Errors`.
    """
    fitted = _errors(fitter, fitter.record, base, extended)
    asked = [e for e in held_out if fitter.simulator.knows(e)]
    refused = {e.name: why for e in asked if (why := _refusal(fitter, e, base, extended))}
    known = [e for e in asked if e.name not in refused]
    unseen = _errors(fitter, record(known, fitter.simulator), base, extended) if known else {}
    every = {name: (errors, unseen.get(name)) for name, errors in fitted.items()}
    first = _best_served_group(base, extended, fitter.record)
    # Held-out experiments may be of another kind altogether.
    held = unseen.get(first) or next(iter(unseen.values()), None)
    return Gain(fitted[first], held, every, refused)


def _refusal(fitter: Fitter, experiment: Experiment, base: Fit, extended: Fit) -> str:
    """Return why a model of the gain has no prediction for an experiment; "" if all have one."""
    try:
        found = [fitter.simulator.predict(experiment, v) for v in (base.values, extended.values)]
    except MuError as error:
        return error.what
    return "" if all(np.isfinite(f).any() for f in found) else "the model gives no number"


# A gain of chi squared of four standard deviations.
_CLEAR = 16.0


def _best_served_group(base: Fit, extended: Fit, judged: Record) -> str:
    """First group of series of a kind that an effect concerns and that clearly improves.

    Others improve as well, as the modulus no longer compensates the missing effect. The first of all, if
    none.
    """
    gained = dict.fromkeys(judged.groups, 0.0)
    for s in judged.series:
        before, after = base.residual[s.at], extended.residual[s.at]
        gained[s.group] += float(before @ before - after @ after)
    about = {kind for effect in extended.effects for kind in effect.kinds}
    clear = (g for g, v in gained.items() if v > _CLEAR and g.split()[0] in about)
    return next(clear, judged.groups[0])


def _errors(fitter: Fitter, judged: Record, base: Fit, extended: Fit) -> dict[str, Errors]:
    """Errors by group of series of a record."""
    simulator = fitter.simulator
    before = judged.values - judged.predict(simulator, base.values)
    after = judged.values - judged.predict(simulator, extended.values)
    many = sum(len(e.keys) for e in extended.effects)
    nulls = None
    if extended.effects:
        null_of = (
            _or_none(judged, lambda: _permuted(fitter, judged, base, extended)),
            _or_none(judged, lambda: _black_box(fitter, judged, base, many)),
        )
        nulls = [judged.values - null for null in null_of]
    found = {}
    for group in judged.groups:
        members = [s for s in judged.series if s.group == group]
        rows = slice(members[0].at.start, members[-1].at.stop)
        # A record whose spread is known is one number, in such spreads.
        unit = "spreads" if group == KNOWN else members[0].channel.rpartition("_")[2]
        ends = _rms(before[rows]), _rms(after[rows])
        if nulls is None:
            found[group] = Errors(*ends, unit)
            continue
        low, high = _bootstrap(members, rows.start, before[rows], after[rows])
        found[group] = Errors(*ends, unit, low, high, *(_rms(null[rows]) for null in nulls))
    return found


def _or_none(judged: Record, null: Callable[[], Array]) -> Array:
    """A null's prediction (N,) of a record; nan where no model has its values."""
    try:
        return null()
    except MuError:
        return np.full(len(judged), math.nan)


def _rms(r: Array) -> float:
    return float(np.sqrt(np.mean(r**2)))


def _bootstrap(members: Sequence[Any], first: int, before: Array, after: Array) -> tuple[float, float]:
    """95 % interval of the drop of the error, from eighths of series drawn with replacement."""
    pieces: list[Array] = []
    for s in members:
        at = np.arange(s.at.start, s.at.stop) - first
        pieces += [p for p in np.array_split(at, min(8, len(at))) if len(p)]
    squares = np.array([(np.sum(before[p] ** 2), np.sum(after[p] ** 2), len(p)) for p in pieces])
    drawn = np.random.default_rng(0).integers(0, len(pieces), (RESAMPLES, len(pieces)))
    sums = squares[drawn].sum(axis=1)
    drop = np.sqrt(sums[:, 0] / sums[:, 2]) - np.sqrt(sums[:, 1] / sums[:, 2])
    low, high = np.quantile(drop, [0.025, 0.975])
    return float(low), float(high)


def _permuted(fitter: Fitter, judged: Record, base: Fit, extended: Fit) -> Array:
    """The base with the change by the effects taken from other experiments, its size fitted."""

    def shift(r: Record) -> Array:
        plain = {k: v for k, v in extended.values.items() if k in base.values}
        change = r.predict(fitter.simulator, extended.values) - r.predict(fitter.simulator, plain)
        moved = np.zeros(len(r))
        for channel in dict.fromkeys(s.channel for s in r.series):
            same = [s for s in r.series if s.channel == channel]
            for s, other in zip(same, same[1:] + same[:1], strict=True):
                source = change[other.at]
                if other is s:
                    source = source[::-1]
                at = np.linspace(0.0, 1.0, s.at.stop - s.at.start)
                moved[s.at] = np.interp(at, np.linspace(0.0, 1.0, len(source)), source)
        return moved

    return _with_columns(fitter, judged, base, shift(fitter.record)[:, None], shift(judged)[:, None])


def _black_box(fitter: Fitter, judged: Record, base: Fit, many: int) -> Array:
    """The base with as many arbitrary corrections of its response as the effects have parameters."""
    fitted, applied = (_corrections(fitter, r, base, many) for r in (fitter.record, judged))
    return _with_columns(fitter, judged, base, fitted, applied)


def _corrections(fitter: Fitter, r: Record, base: Fit, many: int) -> Array:
    """The base's response to its modulus times powers of its drives, and of the time since its start."""
    response = fitter.response(base.values, r)
    drives = ("pressure_kPa", "strain", "added_mass_g", "angle_deg")

    def driven(e: Experiment) -> Array:
        i = next(i for i, other in enumerate(r.experiments) if other is e)
        name = next((d for d in drives if r.driven(i, d)), None)
        return e[name] if name else np.zeros(len(e))

    x = r.covariate(driven)
    t = r.covariate(lambda e: e["time_s"] - e["time_s"][0] if "time_s" in e.columns else np.zeros(len(e)))
    columns = [response * x**k for k in range(1, many + 1)]
    columns[many // 2 :] = [response * t**k for k in range(1, many - many // 2 + 1)] if many > 1 else columns
    return np.stack(columns, axis=1)


def _with_columns(fitter: Fitter, judged: Record, base: Fit, fitted: Array, applied: Array) -> Array:
    """Prediction (N,) of the base plus columns, with sizes fitted together with the nuisances."""
    p = list(fitter.curved)
    plain = fitter.predict(base.values)
    tangent = [
        (fitter.predict({**base.values, q.name: base.values[q.name] + q.step}) - plain) / q.step for q in p
    ]
    every = np.column_stack([fitted, *tangent]) if tangent else fitted
    length = np.linalg.norm(every, axis=0)
    white = fitter.project(every / np.where(length > 0, length, 1.0))
    left = fitter.project(fitter.record.values - plain)
    size = np.linalg.lstsq(white, left, rcond=1e-10)[0] / np.where(length > 0, length, 1.0)
    k = fitted.shape[1]
    zeros = fitter.zeros(fitter.record.values - plain - every @ size)
    values = {**base.values, **{q.name: base.values[q.name] + s for q, s in zip(p, size[k:], strict=True)}}
    values |= {name: base.values.get(name, 0.0) + z for name, z in zeros.items()}
    return np.asarray(judged.predict(fitter.simulator, values) + applied @ size[:k])
