"""coupon: nominal stress of an incompressible solid stretched in one of the modes of a tensile machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...fem.laws import Yeoh
from ...materials.coupon import incompressible
from ...measured import Experiment
from ..effect import Effect, Parameter
from .specimen import NEW, machine, pasts, recorded

Array = np.ndarray[Any, Any]

KIND = "coupon"

MODULUS = Parameter("coupon_modulus_kPa", "kPa", 1.0, 1e6, 1000.0, (), "soft gels to hard rubber")

STRAIN_STIFFENING = Effect(
    "strain_stiffening",
    (
        Parameter(
            "c2_over_c1", "", -0.03, 2.0, 0.0, (0.02, 0.3), "Yeoh 1993: -0.01 of filled rubber to 1 of foams"
        ),
    ),
    (KIND,),
)

EFFECTS = (
    STRAIN_STIFFENING,
    Effect(
        "tension_compression_asymmetry",
        (Parameter("excess", "", -0.8, 4.0, 0.0, (0.3,), "stiffness in compression over tension, less 1"),),
        (KIND,),
    ),
    *machine(KIND),
)


class CouponStress:
    """Predicts coupons by the neo-Hookean law, stiffened as Yeoh's: W = c1 (I1 - 3) + c2 (I1 - 3)^2.

    The modulus is E = 6 c1. Experiments, in the order they were run, tell what each specimen went through.
    """

    nuisances = (MODULUS,)
    effects = EFFECTS

    def __init__(self, experiments: Sequence[Experiment] = ()) -> None:
        self._pasts = pasts(experiments, KIND)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The nominal stress."""
        return ("stress_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Prediction (1, n) in kPa, see Simulator."""
        c1 = values.get(MODULUS.name, MODULUS.null) / 6
        c2 = c1 * values.get("strain_stiffening.c2_over_c1", 0.0)
        excess = values.get("tension_compression_asymmetry.excess", 0.0)
        mode = experiment.mode or "uniaxial"

        def law(strain: Array) -> Array:
            # The bulk modulus has no part in it.
            stress = incompressible(Yeoh, np.array([c1, c2, 0.0, 1.0]), mode, 1 + strain)
            return stress * np.where(strain < 0, 1 + excess, 1.0) if excess else stress

        return recorded(experiment, law, values, self._pasts.get(experiment.name, NEW))[None]
