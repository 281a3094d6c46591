"""One resin and one print offset behind moduli measured at several scales."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import chdtri

from mu_addon.errors import InputError
from mu_addon.homogenize.offset_response import OffsetResponse


@attrs.frozen
class OffsetFit:
    """One resin and one print offset for several scales: resin_MPa, offset_mm, and chi2 of what is left.

    low95_mm, high95_mm: offsets whose chi2, the resin fitted again, is within the 95 % limit of one
    parameter, cut off at the range that was computed. resin_fixed: whether the resin was given.
    """

    resin_MPa: float
    offset_mm: float
    chi2: float
    low95_mm: float
    high95_mm: float
    resin_fixed: bool


def fit_offset(
    response: OffsetResponse,
    scales: Sequence[float],
    measured_MPa: Sequence[float],
    spread_MPa: Sequence[float],
    resin_MPa: float | None = None,
) -> OffsetFit:
    """Offset, and the resin unless it is given, that fit moduli measured at some scales, weighted by spread.

    Raises InputError where there are fewer scales than unknowns.
    """
    s, y, sigma = (np.asarray(v, float) for v in (scales, measured_MPa, spread_MPa))
    if len(s) < (2 if resin_MPa is None else 1):
        raise InputError(f"{len(s)} scales do not determine resin and offset", "fit of a print offset")
    low, high = (bound * float(s.min()) for bound in response.range_mm)

    def left(offset: float) -> tuple[float, float]:
        unit = response.modulus_MPa(s, offset, 1.0)
        weight = 1 / sigma**2
        E = float((weight * unit * y).sum() / (weight * unit**2).sum()) if resin_MPa is None else resin_MPa
        return float((((E * unit - y) / sigma) ** 2).sum()), E

    grid = np.linspace(low, high, 81)
    values = np.array([left(o)[0] for o in grid])
    k = int(values.argmin())
    around = (grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)])
    found = minimize_scalar(
        lambda o: left(o)[0], bounds=around, method="bounded", options={"xatol": 1e-9 * (high - low)}
    )
    best = float(found.x)
    least, E = left(best)
    limit = least + float(chdtri(1, 0.05))

    def edge(end: float) -> float:
        if left(end)[0] <= limit:
            return end
        return float(brentq(lambda o: left(o)[0] - limit, best, end))

    return OffsetFit(E, best, least, edge(low), edge(high), resin_MPa is not None)
