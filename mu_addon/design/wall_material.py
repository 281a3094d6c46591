"""The law of the membrane's wall beyond its elastic constants: stiffening, layers, memory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import attrs

from ..errors import InputError
from .declared_laws import wall_laws, wall_parameters
from .quantity import Groups, choice, quantity

DEFAULT = "neo-hooke"
OF_RESIN: Groups = {"constants of the resin": ()}


def _fields_of_laws() -> dict[str, Any]:
    """The field `law` and those of every law's own parameters; a law's come after those it builds on."""
    laws = wall_laws()
    texts = ", ".join(f"{key} {law.wall_text}" for key, law in laws.items())
    source = "assumed: the paper prints none; the simplest, right to stretches of about 1.5"
    rows = {name: row for law in laws.values() for name, row in law.parameters.items()}
    ordered = dict.fromkeys(name for key in laws for name in wall_parameters(key))
    law = choice(DEFAULT, lambda: tuple(wall_laws()), f"law of the wall; {texts}", source)
    return {"law": law} | {name: quantity(*rows[name]) for name in ordered}


_OfLaws: Any = attrs.make_class("_OfLaws", _fields_of_laws(), frozen=True)


@attrs.frozen
class Wall(_OfLaws):
    """Section [wall]: the membrane's law beyond the small-strain moduli of [material].

    Those moduli are the long-term ones of a wall that has not been loaded. `law` is one of `fem/laws`, whose
    file declares its further parameters; `names` are those in use. The lattice's law is unchanged. Raises
    InputError for parameters of the law that add up to more than it allows.
    """

    section: ClassVar[str] = "wall"
    advanced: ClassVar[Groups] = OF_RESIN

    layers_excess: float = quantity(
        0.0,
        "",
        -0.6,
        3.0,
        "Young's modulus along the print's layers over that across them, less 1",
        "assumed: as stiff along the layers as across them unless coupons say otherwise",
    )
    friction_share: float = quantity(
        0.0,
        "",
        0.0,
        10.0,
        "shear modulus of a branch that slides, over the wall's: hysteresis that knows no rate",
        "assumed: none unless slow loops say otherwise",
    )
    friction_yield_kPa: float = quantity(
        20.0,
        "kPa",
        0.01,
        1e5,
        "uniaxial stress at which that branch slides",
        "assumed: a strain of about 1 % in a branch as stiff as the default wall",
    )

    def __attrs_post_init__(self) -> None:
        *names, most = wall_laws()[self.law].wall_total or (0,)
        total = sum(getattr(self, name) for name in names)
        if total > most:
            raise InputError(
                f"{', '.join(names)} add up to {total:g}",
                f"[wall] {names[0]}",
                f"give them a sum of at most {most:g}",
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that this law uses; empty for the default wall."""
        sliding = ("friction_share", "friction_yield_kPa") if self.friction_share else ()
        layers = ("layers_excess",) if self.layers_excess else ()
        if self.law == DEFAULT and not (sliding or layers):
            return ()
        return ("law", *wall_parameters(self.law), *layers, *sliding)

    @property
    def has_memory(self) -> bool:
        """True if the stress depends on the history of deformation, so that motions are solved in time."""
        return wall_laws()[self.law].memory or self.friction_share > 0

    def require_without_memory(self, what: str) -> None:
        """Raise InputError if the stress depends on history; what: the job that does not support it."""
        if self.has_memory:
            raise InputError(
                f"{what} does not support a wall with memory",
                "[wall] law, friction_share",
                'simulate it with `simulate` or `place`, or take law = "yeoh" and friction_share = 0',
            )


def offered(law: str, friction_share: float) -> tuple[str, ...]:
    """Names of the parameters to show with a law, in the order of `Wall`.

    friction_share: its value, 0 .. 10, without unit; 0 leaves out the yield stress.
    """
    sliding = ("friction_share", "friction_yield_kPa") if friction_share else ("friction_share",)
    return ("law", *wall_parameters(law), "layers_excess", *sliding)


def require_used(wall: Wall, given: Iterable[str]) -> None:
    """Raise InputError for a parameter among `given` that the wall's law does not use."""
    for name in given:
        if name not in offered(wall.law, 1.0):
            having = [law for law in wall_laws() if name in wall_parameters(law)]
            raise InputError(
                f"{name} has no effect with law = {wall.law!r}",
                f"[wall] {name}",
                f"write law = {' or '.join(map(repr, having))}, or leave it out",
            )
