"""Mullins softening."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from ..instants import turns
from .declaration import CYCLED, IN_MODEL, MACHINE, Array, Declaration, Law, Parameter, Setting, Values

BY_ENERGY = (
    Parameter("softening", "", 0.0, 0.7, 0.0, (0.1,), "1/r of Ogden and Roxburgh 1999"),
    Parameter("energy_share", "", 0.02, 2.0, 0.3, (0.1, 0.6), "m of Ogden and Roxburgh 1999"),
)
REFERENCE = "reference_kPa"
"""Value beside these: pressure in kPa to whose energy that of a unit is relative."""
# Another law, by the largest strain so far, tried where the first is found.
BY_PEAK = (
    Parameter("by_peak", "", 0.0, 5.0, 0.0, (0.3,), "b of Beatty and Krishnaswamy 2000, over strain^power"),
    Parameter("power", "", 0.2, 2.0, 0.5, (0.5, 1.0), "one half in Beatty and Krishnaswamy 2000"),
)
# And one that saturates, by the distance below the largest strain over that strain.
BY_SHARE = (
    Parameter("lost", "", 0.0, 0.95, 0.0, (0.2,), "largest share of the stress lost by softening"),
    Parameter("width", "", 0.02, 5.0, 0.4, (0.3,), "of the largest strain: m of Dorfmann and Ogden 2004"),
    Parameter("shape", "", 0.2, 3.0, 1.0, (1.0,), "Weibull's, of the spread of chains that give way"),
)
# Samples that a turn between two of them needs.
FEWEST = 5
# Gauss-Legendre points on 0..1 for the energy: exact for laws up to degree 15.
_AT, _WEIGHT = np.polynomial.legendre.leggauss(8)
_AT, _WEIGHT = (_AT + 1) / 2, _WEIGHT / 2


def _left(energy: Array, before: float, softening: float, width: float) -> Array:
    """Share (n,) of the virgin modulus left, 1 - softening erf((W_max - W)/width), Ogden and Roxburgh 1999.

    energy (n,): W; before: the largest one of earlier experiments.
    """
    from scipy.special import erf

    most = np.maximum(np.maximum.accumulate(energy), before)
    return np.asarray(1.0 - softening * erf((most - energy) / width))


def _softer_unit(p: Array, v: Values, at: Setting) -> Array:
    """W is the square of the pressure, as the energy of the virgin unit nearly is."""
    width = v["energy_share"] * v.get(REFERENCE, at.reference_kPa) ** 2
    return p / _left(p**2, at.before_kPa**2, v["softening"], width)


def _softer(stress: Array, v: Values, at: Setting) -> Array:
    strain = at.path
    energy = _energy(at.law, strain)
    before = float(_energy(at.law, np.array([at.past.strain * (np.sign(strain.sum()) or 1.0)]))[0])
    width = v["energy_share"] * (max(float(energy.max()), before) or 1.0)
    return stress * _left(energy, before, v["softening"], width)


def _by_peak(stress: Array, v: Values, at: Setting) -> Array:
    below, _ = _below(at)
    return stress * np.exp(-v["by_peak"] * below ** v["power"])


def _by_share(stress: Array, v: Values, at: Setting) -> Array:
    return stress * _kept(*_below(at), v)


def _unit_by_share(p: Array, v: Values, at: Setting) -> Array:
    """Of a unit by its pressure over its modulus, as its strains nearly go with that."""
    size = np.abs(p)
    most = _largest(at.time_s.tobytes() if len(size) > FEWEST else b"", size.tobytes(), at.before_kPa)
    return p / _kept(most - size, most, v)


def _kept(below: Array, most: Array, v: Values) -> Array:
    """Share (n,) of the virgin modulus left at an amount (n,) below the largest strain or pressure (n,)."""
    way = below / np.maximum(v["width"] * most, 1e-12)
    return np.asarray(1 + v["lost"] * np.expm1(-(way ** v["shape"])))


def _below(at: Setting) -> tuple[Array, Array]:
    """Amount (n,) by which strains are below the largest so far in size, and that largest (n,)."""
    size = np.abs(at.path)
    timed = at.time_s is not None and len(size) > FEWEST
    most = _largest(at.time_s.tobytes() if timed else b"", size.tobytes(), at.past.strain)
    return most - size, most


# Unless the material yields, of each experiment alone.
@lru_cache(maxsize=256)
def _largest(t: bytes, size: bytes, before: float) -> Array:
    """The largest (n,) so far, read-only, of sizes (n,) at times (n,) if any, in bytes, and `before`."""
    so_far = found = np.frombuffer(size)
    if t:
        so_far = np.maximum(found, turns(np.frombuffer(t), found))
    found = np.maximum(np.maximum.accumulate(so_far), before)
    found.flags.writeable = False
    return found


def _energy(law: Callable[[Array], Array], strain: Array) -> Array:
    """Energy (n,) in kJ/m3 of straining from 0."""
    return strain * (law((strain[:, None] * _AT).ravel()).reshape(len(strain), -1) @ _WEIGHT)


EFFECT = Declaration(
    mechanism="the first loading softens all later loading below its peak",
    reveals="a virgin ladder",
    remedy=f"{IN_MODEL} where a unit was measured; load a new print to its full range once",
    shown_by={
        "coupon": "cycles of growing stretch on a coupon that was never loaded",
        "lattice_compression": "cycles of growing strain on a block that was never loaded",
    },
    memory=True,
    laws=(
        Law((*CYCLED, *MACHINE), BY_ENERGY, {"softening": _softer_unit, "stress_softening": _softer}),
        Law(
            MACHINE,
            BY_PEAK,
            {"stress_softening": _by_peak},
            "loading softens all later loading below its largest strain",
            refines=True,
        ),
        Law(
            (*CYCLED, *MACHINE),
            BY_SHARE,
            {"softening": _unit_by_share, "stress_softening": _by_share},
            "loading softens all later loading below its largest strain, by a share that ends",
            refines=True,
        ),
    ),
)
