"""Element sizes of an analysis mesh, given for a cell of 12.5 mm and scaled with the unit's."""

from __future__ import annotations

from typing import Any

import attrs

from ..design.quantity import described
from ..errors import InputError

FRACTIONS = ("half", "full")
FIDELITIES = RESOLVED, SOLID, HOMOGENISED = ("resolved", "solid", "homogenised")
CELL_MM = 12.5
"""Cell, in mm, to which the element sizes refer."""
ORDER = described("order", 2, "order of the finite elements; 1 for a quick look only", low=1, high=2)
REFINE = described("refine", 1.0, "mesh refinement: every element size is divided by it", low=0.2, high=8.0)
FIDELITY = described(
    "fidelity",
    RESOLVED,
    "model of the lattice: every strut as printed (resolved: beams where they are whole; solid, to check "
    "these), or a continuum",
    choices=FIDELITIES,
)
SOLID_STRUTS = described(
    "solid_struts",
    False,
    "mesh every strut as a solid, to check the beams; takes three to four times as long",
)
SELF_CONTACT = described(
    "self_contact",
    True,
    "keep walls and struts apart, at several times the cost; without it they may cross, and the run gives "
    "the pressure",
)
OF_CONTINUUM = {
    "material.lattice_modulus_kPa": "material.membrane_modulus_kPa",
    "material.lattice_poisson": "material.membrane_poisson",
    "material.sensor_modulus_kPa": "material.membrane_modulus_kPa",
}
"""Parameters that struts and sensor have not as printed, and those of the resin, which they have."""


def fidelity_of(solid_struts: bool) -> str:
    """Fidelity of a printed body: its whole struts as beams, or all of them as solids."""
    return SOLID if solid_struts else RESOLVED


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


def _between(low: float, high: float) -> Any:
    def check(_: object, field: attrs.Attribute[Any], value: Any) -> None:
        if not low <= value <= high:
            raise InputError(
                f"{field.name} = {value!r} is out of bounds", "mesh settings", f"{low:g} to {high:g}"
            )

    return check


@attrs.frozen
class MeshSettings:
    """Element order, mirror fraction and element sizes of an analysis mesh.

    fraction: "half" (x >= 0) or "full" (the half and its mirror image). order: 1 or 2; linear elements lock
    in thin walls. refine: divides every size and multiplies through_wall. Sizes in mm for a cell of 12.5 mm:
    along the membrane's meridian and around its apex, at the line of anchors and at the lattice's envelope.
    through_wall: elements across the membrane. fidelity: "homogenised", the lattice as a continuum;
    "resolved", its struts as printed, as beams where they are whole; or "solid", every strut meshed, to check
    "resolved". For both order 2, fraction and refine alone count. Raises InputError for a value that is not
    offered or out of bounds.

    >>> MeshSettings().order, MeshSettings(refine=0.5).fraction
    (2, 'half')
    """

    order: int = ORDER.field()
    fraction: str = attrs.field(default="half", validator=_one_of(*FRACTIONS))
    refine: float = REFINE.field()
    meridian_mm: float = attrs.field(default=1.5, validator=_between(0.1, 100.0))
    hoop_mm: float = attrs.field(default=4.0, validator=_between(0.1, 100.0))
    through_wall: int = attrs.field(default=1, validator=_between(1, 8))
    anchor_mm: float = attrs.field(default=2.5, validator=_between(0.1, 100.0))
    envelope_mm: float = attrs.field(default=14.0, validator=_between(0.1, 100.0))
    fidelity: str = FIDELITY._replace(default=HOMOGENISED).field()

    @property
    def resolved(self) -> bool:
        """True if struts are meshed as printed."""
        return self.fidelity != HOMOGENISED

    def table(self) -> dict[str, Any]:
        """Settings as a table of a file of inputs; fidelity only where it is not homogenised."""
        found = attrs.asdict(self)
        if self.fidelity == HOMOGENISED:
            # As files were written before there was another.
            del found["fidelity"]
        return found


def require_self_contact_resolvable(mesh: MeshSettings, self_contact: bool) -> None:
    """Raise InputError where self-contact is asked for without meshed walls and struts."""
    if self_contact and not mesh.resolved:
        raise InputError(
            "self-contact needs walls and struts as they are printed",
            "--self-contact",
            "leave self-contact out, or simulate the printed body",
        )
