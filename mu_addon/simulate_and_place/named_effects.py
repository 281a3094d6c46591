"""Effects named by measured data that are part of a simulation, not parameters of the unit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import attrs

from ..arrays import Array
from ..errors import InputError, did_you_mean
from ..evidence.effect import Parameter
from ..evidence.effects import DECLARED, laws_of
from ..evidence.effects import STATIC as EFFECTS
from ..evidence.prediction.unit_pressure import remembered_kPa
from ..evidence.unit_body import Body
from ..reading import is_finite
from .settings import ORIENTATION

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..fem.materials import Materials
    from ..fem.model import Model
    from ..meshing.mesh import Mesh


REFERENCE = Parameter("reference_kPa", "kPa", 0.01, 1e4, 1.0, (), "the largest pressure of the measured data")
# Those with materials, in the order in which they change what the others left: the first takes the wall as
# neo-Hookean, and what of it is isotropic then may stiffen.
_LAWS = ("anisotropy", "strain_stiffening", "tension_compression_asymmetry")
# The other effects change the unit that is meshed, or the mesh.
STATIC = tuple(name for name, e in EFFECTS.items() if e.materials or e.model or e.load)
# Effects in time: by the effective pressure, with the evidence's own rules.
_OF_UNIT = (
    "line_lag",
    "leak",
    "viscoelasticity",
    "rate_independent_hysteresis",
    "mullins_softening",
)
IN_TIME = {name: laws_of("unit_pressure")[name] for name in _OF_UNIT}
NAMES = (*STATIC, *_OF_UNIT)
# Each in a few words, its size included.
_DESCRIPTIONS = {
    "gravity": "solid parts have a density of {:.4g} kg/m³",
    "strain_stiffening": "the wall stiffens at large stretch, c2/c1 = {:.3g}",
    "anisotropy": "the wall is {:.0%} stiffer along the print's layers than across them",
    "tension_compression_asymmetry": "struts are {:.0%} stiffer in compression than in tension",
    "clogged_chamber": "the last chamber receives less pressure, by {:.0%} of the pressure",
    "line_lag": "the chambers follow the pressure with a time constant of {:.3g} s",
    "leak": "a leak conducts {:.2%} of what the line does",
    "rate_independent_hysteresis": "friction bears {:.1%} of the stiffness",
    "mullins_softening": "the first loading softens the unit by up to {:.1%}",
}

Values = Mapping[str, Mapping[str, float]]
_NONE: Values = MappingProxyType({})


@attrs.frozen
class NamedEffects:
    """Parameters of each effect by name, and the direction of gravity about x: at 0 the tip hangs down.

    Effects of `STATIC` change the model, those of `IN_TIME` the effective pressure. An effect whose first
    parameter, its size, is at its null is left out. Raises InputError for an unknown name or parameter and
    for a value out of bounds. where: a table's name, for that error.
    """

    values: Values = attrs.field(default=_NONE)
    orientation_deg: float = ORIENTATION.default
    where: str = attrs.field(default="effects", eq=False, repr=False)

    def __attrs_post_init__(self) -> None:
        turn = self.orientation_deg
        if not is_finite(turn) or abs(turn) > 360:
            raise InputError(
                f"orientation_deg = {turn!r} is not a valid orientation",
                self.where,
                "give a number from -360 to 360; 0: hanging, tip down",
            )
        if not isinstance(self.values, Mapping):
            raise InputError(f"{self.values!r} is not a table", self.where, "write it as a table")
        checked = {name: self._checked(name, given) for name, given in self.values.items()}
        kept = {name: given for name, given in checked.items() if next(iter(given.values())) != _null(name)}
        # In one order, so that the same effects are the same text.
        object.__setattr__(self, "values", {name: kept[name] for name in NAMES if name in kept})
        object.__setattr__(self, "orientation_deg", float(turn) % 360.0)

    def _checked(self, name: str, given: Any) -> dict[str, float]:
        where = f"{self.where}.{name}"
        if name not in NAMES:
            why = " it is not an effect that a simulation of the unit can contain" if name in DECLARED else ""
            raise InputError(
                f"no effect {name!r} is known here{';' + why if why else did_you_mean(name, NAMES)}",
                self.where,
                f"known: {', '.join(NAMES)}",
            )
        laws = _laws(name)
        for law in laws:
            if isinstance(given, Mapping) and set(given) == {p.name for p in law}:
                return {p.name: _size(p, given[p.name], where) for p in law}
        keys = ", ".join(map(str, given)) if isinstance(given, Mapping) else repr(given)
        wanted = " or ".join(", ".join(p.name for p in law) for law in laws)
        raise InputError(
            f"{name} has {wanted}, not {keys or 'nothing'}", where, f"write {laws[0][0].name} = .."
        )

    def __bool__(self) -> bool:
        return bool(self.values)

    @property
    def sizes(self) -> dict[str, float]:
        """Size of every static effect by its name."""
        return {
            name: given[EFFECTS[name].parameter.name] for name, given in self.values.items() if name in STATIC
        }

    @property
    def in_time(self) -> bool:
        """True if the unit's state depends on the past pressure."""
        return any(name in IN_TIME for name in self.values)

    def effective_kPa(self, time_s: Array, pressure_kPa: Array) -> Array:
        """Effective pressure (n,) in kPa on the unit without the effects in time, from rest.

        time_s, pressure_kPa (n,): of the supply, linear in between.
        """
        if not self.in_time:
            return pressure_kPa
        values = {f"{name}.{p}": v for name, given in self.values.items() for p, v in given.items()}
        return remembered_kPa(time_s, pressure_kPa, values)

    @property
    def has_gravity(self) -> bool:
        """True if the direction of gravity matters."""
        return any(EFFECTS[name].has_gravity for name in self.sizes)

    @property
    def clogged(self) -> bool:
        """True if a neck is closed: the model's tangent then lacks the pressure on its rim.

        Newton's method takes longer without it, but a linearisation about a state is off by 14 to 26 %.
        """
        return "clogged_chamber" in self.values

    @property
    def tables(self) -> dict[str, Any]:
        """Entries of study.toml for the effects: none without effects, no direction without weight."""
        if not self:
            return {}
        turned = {"orientation_deg": self.orientation_deg} if self.has_gravity else {}
        return {**turned, "effects": {name: dict(given) for name, given in self.values.items()}}

    @property
    def parts(self) -> tuple[Any, ...]:
        """Parts of a key that distinguish results with these effects; empty without any."""
        return (self.tables,) if self else ()

    def words(self) -> list[str]:
        """Each effect as text."""
        return [_in_words(name, given) for name, given in self.values.items()]

    def materials(self, base: Materials, mesh: Mesh) -> Materials:
        """Materials of a unit's mesh with these effects, from those without."""
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
        found.load = self.load(unit, mesh, device)
        found.threads = threads
        return found

    def load(self, unit: Unit, mesh: Mesh, device: str = "cpu") -> Array | None:
        """Dead forces (n, 3) in N on a unit's mesh by these effects, None without any."""
        body = Body(unit, orientation_deg=self.orientation_deg, device=device)
        found = None
        for name, size in self.sizes.items():
            if load := EFFECTS[name].load:
                found = load(body, mesh, size)
        return found


def _laws(name: str) -> tuple[tuple[Parameter, ...], ...]:
    """Sets of parameters by which an effect may be given, one for each law."""
    if name in STATIC:
        return ((EFFECTS[name].parameter,),)
    # With the pressure that the energy of softening was relative to, which a diagnosis of units states.
    more = (REFERENCE,) if name == "mullins_softening" else ()
    return tuple((*law.parameters, *more) for law in IN_TIME[name])


def parameters_of(name: str, given: Iterable[str]) -> tuple[Parameter, ...] | None:
    """Parameters of the law of an effect that has these names, None if no law has them."""
    return next((law for law in _laws(name) if {p.name for p in law} == set(given)), None)


def law_within(name: str, given: Iterable[str]) -> tuple[Parameter, ...] | None:
    """Law of a unit's effect whose parameters are all among those given; None without one.

    Parameters of other kinds of experiment are ignored; of several laws the one with most parameters is used.
    """
    names = set(given)
    whole = [law for law in _laws(name) if {p.name for p in law} <= names]
    return max(whole, key=len, default=None)


def _null(name: str) -> float:
    return _laws(name)[0][0].null


def _in_words(name: str, given: Mapping[str, float]) -> str:
    """An effect with its size, as text."""
    if name == "viscoelasticity" and "share" in given:
        return f"all moduli relax by {given['share']:.1%}, with a time constant of {given['time_s']:.3g} s"
    if name == "viscoelasticity" and "spread_share" in given:
        return (
            f"all moduli relax by {given['spread_share']:.1%}, by times over {given['decades']:.2g} decades "
            f"around {given['middle_s']:.3g} s"
        )
    if name == "viscoelasticity":
        share, onset = given["per_decade"], given["onset_s"]
        return f"all moduli relax by {share:.1%} in each decade of time after {onset:.3g} s"
    if name == "line_lag" and "slower_s" in given:
        slower, faster = given["slower_s"], given["faster_share"] * given["slower_s"]
        return f"the chambers follow the pressure with time constants of {slower:.3g} and {faster:.3g} s"
    size, words = next(iter(given.values())), _DESCRIPTIONS[name]
    return words.format(size) if size > 0.0 else words.replace("stiffer", "softer").format(abs(size))


def _size(p: Parameter, size: Any, where: str) -> float:
    if not is_finite(size) or not p.low <= size <= p.high:
        unit = f" {p.unit}" if p.unit else ""
        raise InputError(
            f"{p.name} = {size!r} is out of bounds", where, f"give {p.low:g} to {p.high:g}{unit}"
        )
    return float(size)
