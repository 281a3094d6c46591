"""coupon: nominal stress of an incompressible solid stretched in one of the modes of a tensile machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ...measured import Experiment
from ..effect import Effect, Parameter, laws
from .specimen import NEW, largest_N, load_cell, load_zeros, machine, recorded, strain_histories

Array = np.ndarray[Any, Any]

KIND = "coupon"

MODULUS = Parameter(
    "coupon_modulus_kPa",
    "kPa",
    1.0,
    1e8,
    1000.0,
    (),
    "gels to polymers filled with fibres",
    plausible=(30.0, 1e7),
)

STRAIN_STIFFENING = Effect(
    "strain_stiffening",
    (
        Parameter(
            "c2_over_c1", "", -0.03, 2.0, 0.0, (0.02, 0.3), "Yeoh 1993: -0.01 of filled rubber to 1 of foams"
        ),
    ),
    (KIND,),
)

# W' = c1 (1 + q s (I1 - 3))^(1/q): Yeoh's two terms at q = 1, Fung's and Demiray's exponential at 0, Gent's
# limit of I1 at -1; Knowles, Int. J. Fracture 13 (1977) 611.
POWER = (
    Parameter(
        "by_invariant", "", -0.03, 3.0, 0.0, (0.05, 0.3), "slope of W' over c1; Gent's: 1 over his limit"
    ),
    Parameter("form", "", -2.0, 2.0, 1.0, (1.0, -1.0), "1 Yeoh 1993, 0 Demiray 1972, -1 Gent 1996"),
)
# A term of Ogden's beside the neo-Hookean one: Ogden, Proc. R. Soc. A 326 (1972) 565.
OGDEN = (
    Parameter("by_stretch", "", 0.0, 5.0, 0.0, (0.2,), "modulus of the term over the neo-Hookean one's"),
    Parameter("stretch_power", "", 2.5, 20.0, 6.0, (6.0,), "Ogden 1972: 5.0 of rubber"),
)

EFFECTS = (
    STRAIN_STIFFENING,
    Effect("strain_stiffening", POWER, (KIND,), refines=True),
    Effect("strain_stiffening", OGDEN, (KIND,), refines=True),
    Effect(
        "tension_compression_asymmetry",
        (Parameter("excess", "", -0.8, 4.0, 0.0, (0.3,), "stiffness in compression over tension, less 1"),),
        (KIND,),
    ),
    *machine(KIND),
)


# Difference of another correct code of the same law at the largest strain, relative: a solid whose bulk
# modulus is 200 shear moduli instead of an incompressible one is off by 0.1 %, in proportion to the strain.
DISCREPANCY = Parameter(
    "coupon_discrepancy", "", -0.03, 0.03, 0.0, (), "between codes of the same physics", spread=0.002
)


class CouponStress:
    """Predicts coupons by the neo-Hookean law, stiffened as Yeoh's: W = c1 (I1 - 3) + c2 (I1 - 3)^2.

    Young's modulus is E = 6 c1, in kPa. experiments: in the order they were run, from which the earlier
    strain of each specimen is known.
    """

    def __init__(self, experiments: Sequence[Experiment] = ()) -> None:
        self.effects = (*EFFECTS, *load_cell(experiments, KIND), *laws(KIND, experiments))
        self.nuisances = (MODULUS, DISCREPANCY, *load_zeros(experiments, KIND))
        strains = [float(np.abs(e["strain"]).max()) for e in experiments if e.kind == KIND]
        self._largest = max(strains, default=0.0) or 1.0
        self._histories = strain_histories(experiments, KIND)
        self._largest_N = largest_N(experiments, KIND)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: nominal stress in kPa."""
        return ("stress_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Nominal stress (1, n) in kPa at the strains of the experiment; values as in `Simulator`.

        Raises InputError for a stretch that is not positive and ConvergenceError, see `recorded`.
        """
        c1 = values.get(MODULUS.name, MODULUS.null) / 6
        c2 = c1 * values.get("strain_stiffening.c2_over_c1", 0.0)
        excess = values.get("tension_compression_asymmetry.excess", 0.0)
        mode = experiment.mode or "uniaxial"
        slope, form = (values.get(f"strain_stiffening.{p.name}", p.null) for p in POWER)
        share, power = (values.get(f"strain_stiffening.{p.name}", p.null) for p in OGDEN)

        off = values.get(DISCREPANCY.name, 0.0) / self._largest

        def law(strain: Array) -> Array:
            stress = yeoh(c1, c2, mode, 1 + strain)
            if slope:
                stress = stress * _stiffer(slope, form, mode, 1 + strain)
            if share:
                stress = stress + share * ogden(6 * c1, power, mode, 1 + strain)
            if off:
                stress = stress * (1.0 + off * strain)
            return stress * np.where(strain < 0, 1 + excess, 1.0) if excess else stress

        past = self._histories.get(experiment.name, NEW)
        return recorded(experiment, law, values, past, self._largest_N)[None]


def yeoh(c1: float, c2: float, mode: str, stretch: Array) -> Array:
    """Nominal stress (n,) of an incompressible solid of W = c1 (I1 - 3) + c2 (I1 - 3)^2, in the unit of c1.

    stretch (n,): length over undeformed length. mode: "uniaxial", "equibiaxial" or "pure_shear". P = 2 W' (a
    - a^-m), where m = 2, 5, 3 in the three modes. In closed form: fits evaluate it thousands of times, and a
      test compares it with the finite elements' law. Raises InputError for a stretch that is not positive.
    """
    if not (stretch > 0).all():
        raise InputError("a stretch is not positive", mode, "stretch is length over initial length")
    stiffness = 2 * (c1 + 2 * c2 * (_first(mode, stretch) - 3)) if c2 else 2 * c1
    return np.asarray(stiffness * (stretch - stretch ** -_ACROSS[mode]))


def ogden(modulus: float, power: float, mode: str, stretch: Array) -> Array:
    """Nominal stress (n,) of an incompressible solid of one term of Ogden's, in the unit of its modulus E.

    stretch (n,), mode: as of `yeoh`. P = 2 E/(3 a) (x^(a - 1) - x^(-m a - 1)) of power a, where x^-m is the
    stretch of the free side: m = 1/2, 2, 1 in the three modes.
    """
    across = 0.5 * (_ACROSS[mode] - 1.0)
    return np.asarray(2 * modulus / (3 * power) * (stretch ** (power - 1) - stretch ** (-across * power - 1)))


# What the stretch is brought to beside itself in the neo-Hookean stress x - x^-m.
_ACROSS = {"uniaxial": 2.0, "equibiaxial": 5.0, "pure_shear": 3.0}


def _first(mode: str, stretch: Array) -> Array:
    """First invariant (n,) of an incompressible solid."""
    square = stretch**2
    if mode == "uniaxial":
        return np.asarray(square + 2 / stretch)
    if mode == "equibiaxial":
        return np.asarray(2 * square + square**-2)
    return np.asarray(square + 1 + 1 / square)


def _stiffer(slope: float, form: float, mode: str, stretch: Array) -> Array:
    """W' over c1 (n,), see `POWER`; held constant where it would be without bound."""
    x = slope * (_first(mode, stretch) - 3)
    if abs(form) < 1e-6:
        return np.asarray(np.exp(np.minimum(x, 20.0)))
    return np.asarray(np.exp(np.minimum(np.log1p(np.maximum(form * x, -0.98)) / form, 20.0)))
