"""A lattice's modulus at every scale and print offset, from one scale's virtual tests.

A printed offset is the only length that does not grow with the scale. A lattice of scale s with offset o is
therefore the enlarged lattice of scale 1 with offset o/s, and its modulus over the resin's depends on o/s
alone.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ..arrays import Array, float64
from ..errors import InputError


@attrs.frozen(eq=False)
class OffsetResponse:
    """Modulus over the resin's, and relative density, of a lattice of scale 1 at print offsets.

    offsets_mm (k,): of every surface, ascending, 4 or more; modulus (k,): over the resin's; density (k,).
    Between them both are cubic splines, the modulus in its logarithm. Raises InputError for too few offsets
    or a modulus that is not positive.
    """

    offsets_mm: Array = attrs.field(converter=float64)
    modulus: Array = attrs.field(converter=float64)
    density: Array = attrs.field(converter=float64)

    def __attrs_post_init__(self) -> None:
        if len(self.offsets_mm) < 4 or not (np.diff(self.offsets_mm) > 0).all():
            raise InputError("4 or more ascending offsets are needed", "response to a print offset")
        if not ((self.modulus > 0).all() and np.isfinite(self.modulus).all()):
            raise InputError("a modulus is not positive", "response to a print offset")

    @property
    def range_mm(self) -> tuple[float, float]:
        """Least and largest offset in mm at scale 1."""
        return float(self.offsets_mm[0]), float(self.offsets_mm[-1])

    def modulus_MPa(self, scale: Any, offset_mm: Any, resin_MPa: float) -> Array:
        """Young's modulus (...) in MPa at scales (...) with print offsets (...) in mm, of a resin's in MPa.

        Scales and offsets are numbers or arrays. Raises InputError where offset over scale is outside the
        range.
        """
        at = self._at(scale, offset_mm)
        return np.asarray(resin_MPa * np.exp(self._log_modulus(at)))

    def relative_density(self, scale: Any, offset_mm: Any) -> Array:
        """Share (...) of the volume that is solid at scales (...) with print offsets (...) in mm.

        Raises InputError where offset over scale is outside the range.
        """
        return np.asarray(self._density(self._at(scale, offset_mm)))

    @cached_property
    def _log_modulus(self) -> Any:
        return _through(self.offsets_mm, np.log(self.modulus))

    @cached_property
    def _density(self) -> Any:
        return _through(self.offsets_mm, self.density)

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


def _through(x: Array, y: Array) -> Any:
    """The cubic spline through y (k,) at x (k,)."""
    # Imported late: naming an effect must not load it.
    from scipy.interpolate import CubicSpline

    return CubicSpline(x, y)
