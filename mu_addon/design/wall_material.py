"""The law of the membrane's wall beyond its elastic constants: stiffening, layers, memory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import attrs

from ..errors import InputError
from .quantity import choice, quantity

LAWS = ("neo-hooke", "yeoh", "prony", "ogden-roxburgh")
BRANCHES = (1, 2, 3)
# The long-term modulus is what the shares leave: with all of it relaxing there is none.
LARGEST_SHARE = 0.95

_SHAPE = ("c2_over_c1", "c3_over_c1")
_PRONY = tuple(f"prony_{name}" for i in BRANCHES for name in (f"g{i}", f"tau{i}_s"))
_MULLINS = ("mullins_r", "mullins_m_kPa", "mullins_beta")
# The parameters of each law, in the order of the class.
_OF_LAW = {
    "neo-hooke": (),
    "yeoh": _SHAPE,
    "prony": (*_SHAPE, *_PRONY),
    "ogden-roxburgh": (*_SHAPE, *_MULLINS),
}


def _share(number: int) -> float:
    return quantity(
        0.0,
        "",
        0.0,
        LARGEST_SHARE,
        f"share of the wall's shear modulus at once that relaxes in branch {number} of the Prony series",
        "assumed: none relaxes unless a relaxation test says otherwise",
    )


def _time(number: int, default: float) -> float:
    return quantity(
        default,
        "s",
        1e-4,
        1e7,
        f"relaxation time of branch {number}",
        "assumed: decades around a grasp of some seconds",
    )


@attrs.frozen
class Wall:
    """Section [wall]: the membrane's law beyond the small-strain moduli of [material].

    Those moduli are the long-term ones of a wall that has not been loaded. c2_over_c1 and c3_over_c1 shape
    Yeoh's law, on which prony and ogden-roxburgh build; `names` are the parameters in use. The lattice's law
    is unchanged. Raises InputError for Prony shares that add up to more than LARGEST_SHARE.
    """

    section: ClassVar[str] = "wall"

    law: str = choice(
        "neo-hooke",
        lambda: LAWS,
        "law of the wall; prony relaxes with time, ogden-roxburgh softens below its largest strain (Mullins)",
        "assumed: the paper prints none; the simplest, right to stretches of about 1.5",
    )
    c2_over_c1: float = quantity(
        0.0,
        "",
        -0.05,
        10.0,
        "second over first coefficient of Yeoh's law",
        "assumed: none unless a coupon says otherwise",
    )
    c3_over_c1: float = quantity(
        0.0,
        "",
        0.0,
        10.0,
        "third over first coefficient of Yeoh's law",
        "assumed: none unless a coupon says otherwise",
    )
    prony_g1: float = _share(1)
    prony_tau1_s: float = _time(1, 1.0)
    prony_g2: float = _share(2)
    prony_tau2_s: float = _time(2, 10.0)
    prony_g3: float = _share(3)
    prony_tau3_s: float = _time(3, 100.0)
    mullins_r: float = quantity(
        2.0,
        "",
        1.0,
        1e3,
        "Ogden-Roxburgh's r: the largest loss of stress is 1/r of it",
        "assumed: a filled rubber loses about half",
    )
    mullins_m_kPa: float = quantity(
        50.0,
        "kPa",
        0.01,
        1e5,
        "Ogden-Roxburgh's m: differences of strain energy far below it soften nothing",
        "assumed: the energy of the default wall at a stretch of 1.2",
    )
    mullins_beta: float = quantity(
        0.1,
        "",
        0.0,
        10.0,
        "Ogden-Roxburgh's beta: widens the return to the first loading's stress",
        "assumed: a customary value",
    )
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
        total = sum(self.prony_shares)
        if self.law == "prony" and total > LARGEST_SHARE:
            raise InputError(
                f"the shares that relax add up to {total:g}",
                "[wall] prony_g1",
                f"give prony_g1 to prony_g3 a sum of at most {LARGEST_SHARE:g}",
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that this law uses; empty for the default wall."""
        sliding = ("friction_share", "friction_yield_kPa") if self.friction_share else ()
        layers = ("layers_excess",) if self.layers_excess else ()
        if self.law == LAWS[0] and not (sliding or layers):
            return ()
        return ("law", *_OF_LAW[self.law], *layers, *sliding)

    @property
    def prony_shares(self) -> tuple[float, ...]:
        """Shares g_i of the shear modulus that relax, one for each of the three branches; without unit."""
        return tuple(getattr(self, f"prony_g{i}") for i in BRANCHES)

    @property
    def prony_times_s(self) -> tuple[float, ...]:
        """Relaxation times tau_i in s, one for each of the three branches."""
        return tuple(getattr(self, f"prony_tau{i}_s") for i in BRANCHES)

    @property
    def has_memory(self) -> bool:
        """True if the stress depends on the history of deformation, so that motions are solved in time."""
        return self.law in ("prony", "ogden-roxburgh") or self.friction_share > 0

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
    return ("law", *_OF_LAW[law], "layers_excess", *sliding)


def require_used(wall: Wall, given: Iterable[str]) -> None:
    """Raise InputError for a parameter among `given` that the wall's law does not use."""
    for name in given:
        if name not in offered(wall.law, 1.0):
            having = [law for law, names in _OF_LAW.items() if name in names]
            raise InputError(
                f"{name} has no effect with law = {wall.law!r}",
                f"[wall] {name}",
                f"write law = {' or '.join(map(repr, having))}, or leave it out",
            )
