"""Parameters of a unit's design that nobody measured: fitted beside every cause, by units drawn otherwise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..errors import InputError
from .effect import Parameter

# More than parameters by so many: a plane has a constant, and one design left out tells its error.
SPARE = 2
ROUNDS, LEADING = 2, 2
"""Times that the shapes that fit best are simulated themselves, and how many of them each time."""


@attrs.frozen(eq=False)
class Designs:
    """Units drawn alike but for d parameters: units[i] has the values at[i] (d,), in the parameters' units.

    A parameter's null is that of the unit as given. Raises InputError for too few of them.
    """

    parameters: tuple[Parameter, ...]
    at: tuple[tuple[float, ...], ...]
    units: tuple[Unit, ...]

    def __attrs_post_init__(self) -> None:
        require_enough(len(self.units), len(self.parameters))

    def also(self, at: Sequence[Sequence[float]], units: Sequence[Unit]) -> Designs:
        """With further units."""
        return attrs.evolve(self, at=(*self.at, *(tuple(a) for a in at)), units=(*self.units, *units))


def require_enough(count: int, parameters: int) -> None:
    """Raise InputError where so many designs tell nothing about the parameters."""
    if count < parameters + SPARE:
        raise InputError(
            f"{count} designs could be computed, too few for {parameters} unknown parameters",
            "unknown parameters",
            f"leave some out, narrow their bounds, or ask for {parameters + SPARE} designs at least",
        )


@attrs.frozen(eq=False)
class Surface:
    """The unit's response over d parameters of its design, from n designs.

    parameters: d of them. at (n, d): in their units. values (n, c, k): c channels at k pressures. Between
    designs a cubic radial basis with a plane beneath it, in the parameters' ranges; at a design it is exact.
    Raises InputError for too few designs.
    """

    parameters: tuple[Parameter, ...]
    at: Array
    values: Array

    def __attrs_post_init__(self) -> None:
        require_enough(len(self.at), len(self.parameters))

    def places(self, at: Array) -> Array:
        """Places (m, d) of designs (m, d) between the bounds, 0 to 1."""
        low, high = (np.array([getattr(p, end) for p in self.parameters]) for end in ("low", "high"))
        return np.asarray((np.atleast_2d(at) - low) / (high - low))

    @cached_property
    def _through(self) -> Any:
        return self._basis(np.ones(len(self.at), bool))

    def _basis(self, kept: Array) -> Any:
        from scipy.interpolate import RBFInterpolator

        flat = self.values[kept].reshape(int(kept.sum()), -1)
        return RBFInterpolator(self.places(self.at[kept]), flat, kernel="cubic", degree=1)

    def of(self, sizes: Mapping[str, float]) -> Array | None:
        """Values (c, k) of the unit with some parameters' values, by name; None at the null of all."""
        at = np.array([sizes.get(p.name, p.null) for p in self.parameters])
        if all(v == p.null for v, p in zip(at, self.parameters, strict=True)):
            return None
        return np.asarray(self._through(self.places(at)).reshape(self.values.shape[1:]))

    @cached_property
    def errors(self) -> Array:
        """Values (n, c, k) that each design would have by all others, less its own; nan where others fail."""
        found = np.full_like(self.values, np.nan)
        for i in range(len(self.at)):
            kept = np.arange(len(self.at)) != i
            places = self.places(self.at[kept])
            if np.linalg.matrix_rank(places[1:] - places[0]) < len(self.parameters):
                # The others lie in a plane, on which rounding decides.
                continue
            other = self._basis(kept)(self.places(self.at[i])).reshape(self.values.shape[1:])
            found[i] = other - self.values[i]
        return found
