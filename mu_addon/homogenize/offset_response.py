"""A lattice's modulus at every scale and print offset, from one scale's virtual tests.

A printed offset is the only length that does not grow with the scale. So a lattice of scale s with offset o
is that of scale 1 with offset o/s, enlarged; its modulus is the resin's times a function of o/s alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize_scalar
from scipy.special import chdtri

from ..design.strut_cell import StrutCell, relative_density
from ..errors import InputError

Array = np.ndarray[Any, Any]


def _float64(values: Any) -> Array:
    return np.ascontiguousarray(values, np.float64)


@attrs.frozen(eq=False)
class OffsetResponse:
    """Modulus over the resin's, and relative density, of a lattice of scale 1 at print offsets.

    offsets_mm (k,): of every surface, ascending, 4 or more; modulus (k,): over the resin's; density (k,).
    Between them both are splines, the modulus in its logarithm. Raises InputError.
    """

    offsets_mm: Array = attrs.field(converter=_float64)
    modulus: Array = attrs.field(converter=_float64)
    density: Array = attrs.field(converter=_float64)

    def __attrs_post_init__(self) -> None:
        if len(self.offsets_mm) < 4 or not (np.diff(self.offsets_mm) > 0).all():
            raise InputError("4 or more ascending offsets are needed", "response to a print offset")
        if not ((self.modulus > 0).all() and np.isfinite(self.modulus).all()):
            raise InputError("a modulus is not positive", "response to a print offset")

    @property
    def range_mm(self) -> tuple[float, float]:
        """Least and largest offset at scale 1."""
        return float(self.offsets_mm[0]), float(self.offsets_mm[-1])

    def modulus_MPa(self, scale: Any, offset_mm: Any, resin_MPa: float) -> Array:
        """Modulus at scales with an offset in mm, numbers or arrays; raises InputError outside the range."""
        at = self._at(scale, offset_mm)
        return resin_MPa * np.exp(CubicSpline(self.offsets_mm, np.log(self.modulus))(at))

    def relative_density(self, scale: Any, offset_mm: Any) -> Array:
        """Share of the volume that is solid at scales with an offset in mm."""
        return np.asarray(CubicSpline(self.offsets_mm, self.density)(self._at(scale, offset_mm)))

    def _at(self, scale: Any, offset_mm: Any) -> Array:
        at = np.asarray(offset_mm, float) / np.asarray(scale, float)
        low, high = self.range_mm
        if not ((at >= low - 1e-12) & (at <= high + 1e-12)).all():
            raise InputError(
                f"an offset over scale of {float(np.max(np.abs(at))):.3g} mm was not computed",
                "response to a print offset",
                f"stay between {low:g} and {high:g} mm",
            )
        return at


def offset_response(
    cell: StrutCell, test: Callable[[StrutCell], float], offsets_mm: Sequence[float]
) -> OffsetResponse:
    """The response of a cell of scale 1 to offsets alike in all directions, added to its own.

    test: modulus of a printed cell over the resin's, periodic or of a specimen.
    """
    cells = [
        attrs.evolve(cell, offset_xy_mm=cell.offset_xy_mm + o, offset_z_mm=cell.offset_z_mm + o)
        for o in offsets_mm
    ]
    return OffsetResponse(offsets_mm, [test(c) for c in cells], [relative_density(c) for c in cells])


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
