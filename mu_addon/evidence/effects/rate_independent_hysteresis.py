"""Rate-independent hysteresis."""

import math
from bisect import bisect_right
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ..lags import play_operator
from .declaration import CYCLED, IN_MODEL, MACHINE, Array, Declaration, Law, Parameter, Setting, Values

FRICTION = (
    Parameter("share", "", 0.0, 0.6, 0.0, (0.1,), "share of the stiffness carried by friction"),
    Parameter("threshold_kPa", "kPa", 0.05, 30.0, 2.0, (0.7, 3.0, 9.0), "pressure at which it slips"),
)
# Parallel elements with separate yield strains (Ishlinskii).
YIELDING = (
    Parameter(
        "per_strain",
        "",
        0.0,
        200.0,
        0.0,
        (5.0, 20.0, 60.0),
        "1 over the mean strain at which it yields: glassy polymers 0.02 to 0.1",
    ),
    Parameter("hardening", "", 0.0, 0.9, 0.1, (0.1,), "share that never yields: 0.01 to 0.3"),
)
# Tried where that one is found: one element that yields gradually.
BOUC_WEN = (
    Parameter("bouc_wen_share", "", 0.0, 0.99, 0.0, (0.3,), "that yields: 0.1 to 0.99"),
    Parameter(
        "bouc_wen_per_strain",
        "",
        1.0,
        200.0,
        30.0,
        (10.0, 40.0),
        "1 over the strain at which it yields: glassy polymers 0.02 to 0.1",
    ),
    Parameter("bouc_wen_power", "", 0.5, 8.0, 1.0, (1.5,), "n of Wen 1976: large is abrupt"),
)
_WORDS = (
    "the material yields: part of its strain stays after unloading, however slow the test",
    "loops to several strains, to zero stress and at two rates a decade apart",
)
# Strain at which a law's first slope is taken.
_SMALL = np.array([1e-4])
# Of Bouc and Wen's first loading curve, in yield strains: beyond it has its end to rounding.
_FARTHEST = 40.0
# Gauss-Legendre points on 0..1.
_AT, _WEIGHT = np.polynomial.legendre.leggauss(8)
_AT, _WEIGHT = (_AT + 1) / 2, _WEIGHT / 2


def _sliding(p: Array, v: Values, at: Setting) -> Array:
    return (1.0 - v["share"]) * p + v["share"] * play_operator(p, v["threshold_kPa"])


def _elastic(strain: Array, v: Values, at: Setting) -> Array:
    """Elastic strain (n,), which determines stress, from the strain (n,) of a new specimen in order.

    First loading to e gives h e + (1 - h) m (1 - exp(-e/m)), with the mean yield strain m and the share h
    that never yields; after a reversal the same with twice m (Masing 1926).
    """
    return _by_masing(np.ascontiguousarray(strain, np.float64).tobytes(), v["per_strain"], v["hardening"])


# A derivative by any other parameter needs the same history again, of each experiment.
@lru_cache(maxsize=256)
def _by_masing(strain: bytes, per_strain: float, hardening: float) -> Array:
    """Elastic strain (n,), read-only, of the bytes of strains (n,), see `_elastic`.

    Branches by the turning points that the material remembers at each of their samples, then all samples at
    once.
    """

    def first(e: float) -> float:
        # Of a mean strain m beyond all numbers it is e itself, and m alone would be infinite.
        x = abs(e) * per_strain
        return hardening * e + (1.0 - hardening) * e * (-math.expm1(-x) / x if x else 1.0)

    x = np.frombuffer(strain)
    way, back = x.tolist(), (-x).tolist()
    rows = np.flatnonzero(steps := np.diff(x, prepend=0.0))
    rises = steps[rows] > 0.0
    reversals = rows[np.flatnonzero(np.diff(rises)) + 1].tolist()
    rising = not len(rises) or bool(rises[0])
    # Turning points, in pairs of strain and elastic strain, as far as the material remembers.
    turns = [(0.0, 0.0)]
    begun: list[int] = []
    branches: list[tuple[float, float, float]] = []
    for start, end in pairwise((0, *reversals, len(x))):
        if start:
            last, (at, then, scale) = way[start - 1], branches[-1]
            turn = last, then + scale * first((last - at) / scale)
            if turns[-1] != turn:
                turns.append(turn)
            rising = not rising
        k, sign, ascends = start, *((1.0, way) if rising else (-1.0, back))
        while k < end:
            e = way[k]
            # A loop that closes is forgotten, and so is the first turn beyond its mirror image.
            while len(turns) > 2 and sign * e > sign * turns[-2][0]:
                del turns[-2:]
            if len(turns) == 2 and abs(e) > abs(turns[1][0]):
                del turns[1]
            begun.append(k)
            branches.append((*turns[-1], 2.0 if len(turns) > 1 else 1.0))
            if len(turns) == 1:
                break
            closes = sign * turns[-2][0] if len(turns) > 2 else abs(turns[1][0])
            k = bisect_right(ascends, closes, k + 1, end)
    at, then, scale = np.repeat(np.array(branches), np.diff([*begun, len(x)]), axis=0).T
    u = (x - at) / scale
    m = np.abs(u) * per_strain
    yields = np.divide(-np.expm1(-m), m, out=np.ones_like(m), where=m > 0.0)
    found = then + scale * u * (hardening + (1.0 - hardening) * yields)
    found.flags.writeable = False
    return found


def _yielded(stress: Array, v: Values, at: Setting) -> Array:
    """Stress (n,) of which a share yields as one element, at the strains (n,) of a new specimen in order.

    With the law's stress s and its first slope k, (1 - a) s + a k m z, where a is the share, m the yield
    strain, and dz/de is (1 - |z|^n)/m while |z| grows and 1/m while it falls (Wen, J. Eng. Mech. 102 (1976)
    249, with beta = gamma).
    """
    share, per_strain = v["bouc_wen_share"], v["bouc_wen_per_strain"]
    x = per_strain * np.ascontiguousarray(at.path, np.float64)
    borne = _borne_by_one(x.tobytes(), v["bouc_wen_power"]) / per_strain
    return np.asarray((1.0 - share) * stress + share * at.law(_SMALL) / _SMALL * borne)


# As of `_by_masing`: of each experiment, and once more for each parameter that changes it.
@lru_cache(maxsize=256)
def _borne_by_one(strain: bytes, power: float) -> Array:
    """z (n,), read-only, of Bouc and Wen's element by the bytes of strains (n,) in yield strains, in order.

    Any loading in one direction is exact: elastic until z is 0, then along the curve of first loading, whose
    strain x = int_0^z du/(1 - u^n) is tabulated.
    """
    way, height = _first_loading(power)
    x = np.frombuffer(strain)
    found = np.zeros(len(x))
    at = np.flatnonzero(signs := np.sign(x - np.concatenate([[0.0], x[:-1]])))
    turns = at[np.flatnonzero(np.diff(signs[at])) + 1]
    z = start = 0.0
    for first, end in pairwise((0, *turns.tolist(), len(x))):
        gone, side = np.abs(x[first:end] - start), np.sign(x[end - 1] - start) or 1.0
        # Along the stretch: elastic up to 0, as far as it goes, and first loading from there.
        begun = side * z
        loaded = float(np.interp(max(begun, 0.0), height, way)) + gone - max(-begun, 0.0)
        along = np.where(begun + gone < 0.0, begun + gone, np.interp(loaded, way, height))
        found[first:end] = side * along
        z, start = float(found[end - 1]), float(x[end - 1])
    found.flags.writeable = False
    return found


@lru_cache(maxsize=16)
def _first_loading(power: float) -> tuple[Array, Array]:
    """Strains in yield strains and z of first loading, both ascending: x = int_0^z du/(1 - u^n).

    With z = 1 - exp(-s) the integrand is smooth in s; Gauss and Legendre's rule between the table's rows.
    """
    s = _FARTHEST * np.linspace(0.0, 1.0, 3001) ** 2
    step = np.diff(s)
    at = s[:-1, None] + step[:, None] * _AT
    slope = np.exp(-at) / -np.expm1(power * np.log1p(-np.exp(-at)))
    way = np.concatenate([[0.0], np.cumsum(step * (slope @ _WEIGHT))])
    # `interp` wants them to ascend; at the end z is 1 to rounding.
    return way, -np.expm1(-s) + 1e-15 * np.arange(len(s))


EFFECT = Declaration(
    mechanism="friction inside the material resists every reversal",
    reveals="slow loops",
    remedy=f"{IN_MODEL} where a unit was measured; approach a pressure from one side",
    shown_by={
        "coupon": "loading and unloading at two rates a decade apart",
        "lattice_compression": "loading and unloading at two rates a decade apart",
    },
    memory=True,
    laws=(
        Law(CYCLED, FRICTION, {"friction": _sliding}),
        Law(MACHINE, YIELDING, {"yielding_strain": _elastic}, *_WORDS),
        Law(
            MACHINE,
            BOUC_WEN,
            {"yielding": _yielded},
            "the material yields at one strain, more or less abruptly, and unloads elastically",
            _WORDS[1],
            refines=True,
        ),
    ),
)
