"""Settings of an analysis mesh: element sizes are given for a cell of 12.5 mm and scale with the unit's."""

from __future__ import annotations

from typing import Any

import attrs

from ..design.quantity import described
from ..errors import InputError

FRACTIONS = ("half", "full")
CELL_MM = 12.5
"""Cell, in mm, to which the element sizes refer."""
REFINE = described("refine", 1.0, "mesh refinement: every element size is divided by it", low=0.2, high=8.0)
SELF_CONTACT = described(
    "self_contact",
    True,
    "keep walls and struts apart, at several times the cost; without it they may cross, and the run gives "
    "the pressure",
)
OF_CONTINUUM = {
    "material.lattice_modulus_kPa": "material.membrane_modulus_kPa",
}
"""Parameters that struts and sensor have not as printed, and those of the resin, which they have."""


def require_printed(name: object, where: str) -> None:
    """Raise InputError for a parameter that a printed body does not have."""
    if isinstance(name, str) and name in OF_CONTINUUM:
        raise InputError(
            f"{name} moves nothing: struts and sensor are printed of the unit's resin",
            where,
            f"vary {OF_CONTINUUM[name]}, the resin's, instead",
        )


def _one_of(*allowed: Any) -> Any:
    def check(_: object, field: attrs.Attribute[Any], value: Any) -> None:
        if value not in allowed:
            names = ", ".join(map(str, allowed))
            raise InputError(f"{field.name} = {value!r} is not offered", "mesh settings", f"one of: {names}")

    return check


@attrs.frozen
class MeshSettings:
    """Part and fineness of an analysis mesh.

    fraction: "half" (x >= 0) or "full" (the half and its mirror image). refine: divides every element size.
    Raises InputError for a value that is not offered or out of bounds.

    >>> MeshSettings(refine=0.5).fraction
    'half'
    """

    fraction: str = attrs.field(default="half", validator=_one_of(*FRACTIONS))
    refine: float = REFINE.field()
