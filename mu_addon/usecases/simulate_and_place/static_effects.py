"""Identified effects that a quasi-static simulation of the unit can contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import attrs

from ...design.toml_text import nearest
from ...errors import InputError
from ...evidence.effect import LIBRARY
from ...evidence.unit_effects import EFFECTS, SMOOTH, Body
from ...fem.newton_settings import NewtonSettings

if TYPE_CHECKING:
    from ...design.parameters import Unit
    from ...fem.materials import Materials
    from ...fem.model import Model
    from ...meshing.mesh import Mesh

# Those with materials, in the order in which they change what the others left: the first takes the wall as
# neo-Hookean, and what of it is isotropic then may stiffen.
_LAWS = ("anisotropy", "strain_stiffening", "tension_compression_asymmetry")
# The other effects change the unit that is meshed, or the mesh.
NAMES = tuple(name for name, e in EFFECTS.items() if e.materials or e.model or e.load)
# Of each in a few words, its size included.
_DESCRIPTIONS = {
    "gravity": "solid parts have a density of {:.4g} kg/m³",
    "strain_stiffening": "the wall stiffens at large stretch, c2/c1 = {:.3g}",
    "anisotropy": "the wall is stiffer by {:.0%} along the print's layers than across them",
    "tension_compression_asymmetry": "struts are stiffer by {:.0%} in compression than in tension",
    "clogged_chamber": "the last chamber receives less pressure, by {:.0%} of the pressure",
}

Values = Mapping[str, Mapping[str, float]]
_NONE: Values = MappingProxyType({})


@attrs.frozen
class StaticEffects:
    """Parameters of each effect by name, and the direction of gravity about x: at 0 the tip hangs down.

    An effect whose parameter is at its null is none, and left out. Raises InputError for an unknown name or
    parameter and for a value out of bounds. where: a table's name, for that error.
    """

    values: Values = attrs.field(default=_NONE)
    orientation_deg: float = 0.0
    where: str = attrs.field(default="effects", eq=False, repr=False)

    def __attrs_post_init__(self) -> None:
        turn = self.orientation_deg
        if not _is_number(turn) or abs(turn) > 360:
            raise InputError(
                f"orientation_deg = {turn!r} is not a valid orientation",
                self.where,
                "give a number from -360 to 360; 0: hanging, tip down",
            )
        if not isinstance(self.values, Mapping):
            raise InputError(f"{self.values!r} is not a table", self.where, "write it as a table")
        sizes = {name: self._checked(name, given) for name, given in self.values.items()}
        kept = {n: {EFFECTS[n].parameter.name: s} for n, s in sizes.items() if s != EFFECTS[n].parameter.null}
        # In one order, so that the same effects are the same text.
        object.__setattr__(self, "values", {name: kept[name] for name in NAMES if name in kept})
        object.__setattr__(self, "orientation_deg", float(turn) % 360.0)

    def _checked(self, name: str, given: Any) -> float:
        where = f"{self.where}.{name}"
        if name not in NAMES:
            why = " it is not an effect that a simulation of the unit can contain" if name in LIBRARY else ""
            raise InputError(
                f"no effect {name!r} is known here{';' + why if why else nearest(name, NAMES)}",
                self.where,
                f"known: {', '.join(NAMES)}",
            )
        p = EFFECTS[name].parameter
        if not isinstance(given, Mapping) or set(given) != {p.name}:
            keys = ", ".join(map(str, given)) if isinstance(given, Mapping) else repr(given)
            raise InputError(f"{name} has {p.name}, not {keys or 'nothing'}", where, f"write {p.name} = ..")
        size = given[p.name]
        if not _is_number(size) or not p.low <= size <= p.high:
            unit = f" {p.unit}" if p.unit else ""
            raise InputError(
                f"{p.name} = {size!r} is out of bounds", where, f"give {p.low:g} to {p.high:g}{unit}"
            )
        return float(size)

    def __bool__(self) -> bool:
        return bool(self.values)

    @property
    def sizes(self) -> dict[str, float]:
        """Size of every effect by its name."""
        return {name: given[EFFECTS[name].parameter.name] for name, given in self.values.items()}

    @property
    def has_gravity(self) -> bool:
        """Whether the direction of gravity matters."""
        return any(EFFECTS[name].has_gravity for name in self.values)

    @property
    def clogged(self) -> bool:
        """Whether a neck closes: the model's tangent then lacks what of the pressure the rim bears.

        Newton's method only takes longer for it, but what is linear about a state comes out 14 to 26 % off.
        """
        return "clogged_chamber" in self.values

    @property
    def tables(self) -> dict[str, Any]:
        """What study.toml has of them: nothing where there is none, no direction where nothing has weight."""
        if not self:
            return {}
        turned = {"orientation_deg": self.orientation_deg} if self.has_gravity else {}
        return {**turned, "effects": {name: dict(given) for name, given in self.values.items()}}

    @property
    def newton(self) -> NewtonSettings:
        """Newton's settings that these effects ask for."""
        asked = [EFFECTS[name].newton for name in self.values]
        return next((n for n in asked if n != SMOOTH), NewtonSettings())

    @property
    def parts(self) -> tuple[Any, ...]:
        """What tells a result with these effects from others, in a key; nothing where there is none."""
        return (self.tables,) if self else ()

    def words(self) -> list[str]:
        """Each effect in words."""
        return [_DESCRIPTIONS[name].format(size) for name, size in self.sizes.items()]

    def materials(self, base: Materials, mesh: Mesh) -> Materials:
        """Materials of a unit's mesh with these effects, of those without."""
        sizes = self.sizes
        for name in _LAWS:
            change = EFFECTS[name].materials
            if name in sizes and change:
                base = change(base, mesh, sizes[name])
        return base

    def model(self, unit: Unit, mesh: Mesh, threads: int = 2, device: str = "cpu") -> Model:
        """Model of a unit's mesh with these effects. Raises InputError where one does not fit the unit."""
        body = Body(unit, orientation_deg=self.orientation_deg, device=device)
        sizes = self.sizes
        # One at most has a model of its own.
        found = next((make(body, mesh, s) for n, s in sizes.items() if (make := EFFECTS[n].model)), None)
        found = found or body.model(mesh)
        for name, size in sizes.items():
            if load := EFFECTS[name].load:
                found.load = load(body, mesh, size)
        found.threads = threads
        return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
