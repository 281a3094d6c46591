"""Curve of a virtual test: nominal stress and lateral stretches of a body stretched along one axis."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..errors import InputError

Array = np.ndarray[Any, Any]


def _float64(values: Any) -> Array:
    return np.ascontiguousarray(values, np.float64)


@attrs.frozen(eq=False)
class Curve:
    """Uniaxial response (k,) in ascending stretch, the undeformed state (1, 0) among it.

    stretch: length over initial length along z; stress_MPa: force over initial area, tension positive;
    lateral (k, 2): stretches along x and y, 1 where they were held. Raises InputError where shapes differ or
    stretches do not ascend.
    """

    stretch: Array = attrs.field(converter=_float64)
    stress_MPa: Array = attrs.field(converter=_float64)
    lateral: Array = attrs.field(converter=_float64)

    def __attrs_post_init__(self) -> None:
        k = len(self.stretch)
        if self.stress_MPa.shape != (k,) or self.lateral.shape != (k, 2):
            raise InputError(f"a curve of {k} stretches has {self.stress_MPa.shape} stresses")
        if not (np.diff(self.stretch) > 0).all():
            raise InputError("the stretches of a curve do not ascend", "virtual test", "sort its points")

    @property
    def strain(self) -> Array:
        """Nominal strain (k,), compression negative."""
        return self.stretch - 1.0
