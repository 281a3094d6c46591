"""Implausible values: of nuisances a sign of a wrong unit or sign, of effects one that they are no cause."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping

import attrs
import numpy as np

from ..errors import InputError
from .effect import Effect, Parameter
from .effects import DECLARED, laws_of
from .fit import Fit, Fitter, logarithmic
from .found_causes import RIVAL_DELTA_CHI2

# Mistaken units: N for kN, kPa for MPa or Pa, mm for m.
FACTORS = (1e3, 1e-3, 1e6, 1e-6)
# Readings go against the prediction if their correlation with it is below this.
AGAINST = -0.8


def require_plausible(fitter: Fitter, base: Fit) -> None:
    """Raise InputError where a fit without effects needs a value that no specimen has.

    `Parameter.plausible` holds the range. The error names the experiment's file and column, and the factor,
    or the sign, that would make the value plausible.
    """
    for p in fitter.curved:
        low, high = p.plausible
        if not low <= base.values[p.name] <= high:
            _refuse(fitter, p, base.values[p.name])


def _refuse(fitter: Fitter, p: Parameter, fitted: float) -> None:
    """Raise InputError for a parameter by the experiment whose readings depend on it most."""
    record = fitter.record
    at_null = fitter.predict({})
    slope = fitter.predict({p.name: p.null + p.step}) - at_null
    series = max(record.series, key=lambda s: float(np.abs(slope[s.at]).sum()))
    e = record.experiments[series.experiment]
    predicted, read = at_null[series.at], record.values[series.at]
    size = float(predicted @ predicted) or 1.0
    implied = p.null * float(predicted @ read) / size
    low, high = p.plausible
    unit = f" {p.unit}" if p.unit else ""
    remedy = f"check its unit and that of every length; a value from {low:g} to {high:g}{unit} is expected"
    if np.corrcoef(predicted, read)[0, 1] < AGAINST:
        remedy = "its sign is wrong: check its direction, or that of the strain"
    else:
        for factor in FACTORS:
            if low <= implied * factor <= high:
                remedy = (
                    f"{factor:g} times as large it would be {implied * factor:.3g}{unit}: check whether the "
                    "column is in the unit that its name ends with"
                )
                break
    name = p.name.removesuffix(f"_{p.unit}").replace("_", " ")
    raise InputError(
        f"{name} would be {fitted:.3g}{unit}, which no specimen of this kind has",
        f"{e.file}, column {_source(e.columns, series.channel)}",
        remedy,
    )


def _source(columns: Container[str], channel: str) -> str:
    """The column that a channel was read from: the force where stress was computed from it."""
    return "force_N" if channel == "stress_kPa" and "force_N" in columns else channel


def held_back(fitter: Fitter, fit: Fit) -> Parameter | None:
    """The nuisance whose bound holds a fit back; None without any.

    Beyond that bound chi squared would fall by more than `RIVAL_DELTA_CHI2`, to first order: part of the
    misfit is made by the bound, and no effect may explain it.
    """
    nuisances = {p.name: p for p in fitter.curved}
    every, left = np.vstack([fit.jacobian, fit.prior]), fit.residual
    for i, key in enumerate(fit.keys):
        p = nuisances.get(key)
        if p is None or not math.isfinite(fit.chi2):
            continue
        # At its null there is none of it: no bound of ours.
        ends = [(end, out) for end, out in ((p.low, -1.0), (p.high, 1.0)) if end != p.null]
        beyond = [out for end, out in ends if math.isclose(fit.values[key], end, rel_tol=1e-4)]
        others = np.linalg.qr(np.delete(every, i, axis=1))[0]
        own = every[:, i] - others @ (others.T @ every[:, i])
        length = float(np.linalg.norm(own)) or 1.0
        along = float(own[: len(left)] @ left) / length
        if any(along * out > 0.0 and along**2 > RIVAL_DELTA_CHI2 for out in beyond):
            return p
    return None


def unabsorbed(fit: Fit) -> list[float]:
    """Share of each effect's change of the prediction, by its size, that the nuisances do not take up."""
    every = np.vstack([fit.jacobian, fit.prior])
    sizes = [fit.keys.index(e.keys[0]) for e in fit.effects if not e.among]
    of_effects = {key for e in fit.effects for key in e.keys}
    others = [i for i, key in enumerate(fit.keys) if key not in of_effects]
    q = np.linalg.qr(every[:, others])[0]
    left = every[:, sizes] - q @ (q.T @ every[:, sizes])
    length = np.linalg.norm(every[:, sizes], axis=0)
    return (np.linalg.norm(left, axis=0) / np.maximum(length, 1e-300)).tolist()


def at_a_bound(fit: Fit) -> bool:
    """Return True if a fitted value of an effect lies at a bound that is not its null."""
    return any(
        value_at_a_bound(p, fit.values[key])
        for e in fit.effects
        for key, p in zip(e.keys, e.parameters, strict=True)
    )


def value_at_a_bound(p: Parameter, value: float) -> bool:
    """Return True if a value lies at a bound of its parameter that is not its null, or is implausible."""
    # An implausible value is no cause, though a fit may reach it.
    return not p.plausible[0] <= value <= p.plausible[1] or bool(_reached(p, value))


def _reached(p: Parameter, value: float) -> list[float]:
    """Bounds of a parameter, other than its null, that a value lies at."""
    ends = [b for b in (p.low, p.high) if b != p.null]
    if logarithmic(p):
        # Over decades the range's own size is near the low end's neighbours, too.
        near = 1e-3 * math.log(p.high / p.low)
        return [b for b in ends if abs(math.log(value / b)) < near]
    return [b for b in ends if abs(value - b) < 1e-3 * (p.high - p.low)]


def widened(effect: Effect, values: Mapping[str, float]) -> Effect | None:
    """An effect with the bounds farther away that its values, by key, lie at; None if they lie at none.

    Its fits start from these values. A bound by the data stays: that of adiabatic compression, or of sizes
    that were simulated.
    """
    declared = [p for kind in effect.kinds for w in laws_of(kind).get(effect.name, ()) for p in w.parameters]
    if unit := DECLARED[effect.name].unit:
        declared.append(unit.parameter)
    known = {(p.name, bound) for p in declared for bound in (p.low, p.high)}
    found = []
    for key, p in zip(effect.keys, effect.parameters, strict=True):
        value = values.get(key, p.null)
        away = {b: p.farther(b) for b in _reached(p, value) if (p.name, b) in known}
        low, high = away.get(p.low, p.low), away.get(p.high, p.high)
        found.append(attrs.evolve(p, low=low, high=high, starts=(value,)))
    same = all((a.low, a.high) == (b.low, b.high) for a, b in zip(found, effect.parameters, strict=True))
    return None if same else attrs.evolve(effect, parameters=tuple(found))
