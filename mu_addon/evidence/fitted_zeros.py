"""Zeros of a load cell, fitted test by test, that hide an error."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..errors import MuError
from .fit import Fit, Fitter

# Factor by which the error must grow with all zeros at 0 for them to be reported.
LARGER = 2.0


@attrs.frozen
class FittedZeros:
    """Zeros, one a test: the lowest and the highest, and the error with and without them, all in `unit`."""

    low: float
    high: float
    error: float
    error_without: float
    unit: str


def fitted_zeros(fitter: Fitter, base: Fit) -> FittedZeros | None:
    """The zeros of a fit without effects whose loss would make its error `LARGER` times as large; else None.

    Known zeros alone: those with prior knowledge, one an experiment.
    """
    zeros = [p for p in fitter.known if p.experiment and "zero_" in p.name]
    if not zeros:
        return None
    try:
        without = fitter.fit((), base.values, {p.name: p.null for p in zeros})
    except MuError:
        return None
    record = fitter.record
    seen = {p.experiment for p in zeros}
    of = {i for i, e in enumerate(record.experiments) if e.name in seen}
    unit = zeros[0].unit
    rows = [s.at for s in record.series if s.experiment in of and s.channel.endswith(f"_{unit}")]
    if not rows:
        return None
    error, error_without = (_error(fitter, fit, rows) for fit in (base, without))
    if error_without < LARGER * error:
        return None
    values = [base.values[p.name] for p in zeros]
    return FittedZeros(min(values), max(values), error, error_without, unit)


def _error(fitter: Fitter, fit: Fit, rows: Sequence[slice]) -> float:
    left = fitter.record.values - fitter.predict(fit.values)
    return float(np.sqrt(np.mean(np.concatenate([left[at] for at in rows]) ** 2)))
