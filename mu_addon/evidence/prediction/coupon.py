"""coupon: nominal stress of an incompressible solid stretched in one of the modes of a tensile machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...arrays import Array
from ...measured import Experiment
from ..effect import offered
from ..effects import Acting
from ..effects.declaration import Data
from ..load_cell import largest_N
from ..parameter import Parameter
from ..stretching import yeoh
from .specimen import NEW, load_zeros, recorded, specimen_setting, strain_histories

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

# Difference of another correct code of the same law at the largest strain, relative: a solid whose bulk
# modulus is 200 shear moduli instead of an incompressible one is off by 0.1 %, in proportion to the strain.
DISCREPANCY = Parameter(
    "coupon_discrepancy", "", -0.03, 0.03, 0.0, (), "between codes of the same physics", spread=0.002
)


class CouponStress:
    """Predicts coupons by the neo-Hookean law, W = c1 (I1 - 3).

    Young's modulus is E = 6 c1, in kPa. experiments: in the order they were run, from which the earlier
    strain of each specimen is known.
    """

    def __init__(self, experiments: Sequence[Experiment] = ()) -> None:
        data = Data(kind=KIND, experiments=experiments)
        self.effects = offered(data)
        self.nuisances = (MODULUS, DISCREPANCY, *load_zeros(experiments, KIND))
        strains = [float(np.abs(e["strain"]).max()) for e in experiments if e.kind == KIND]
        self._largest = max(strains, default=0.0) or 1.0
        self._histories = strain_histories(experiments, KIND)
        self._largest_N = largest_N(data)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: nominal stress in kPa."""
        return ("stress_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Nominal stress (1, n) in kPa at the strains of the experiment; values as in `Simulator`.

        Raises InputError for a stretch that is not positive and ConvergenceError, see `recorded`.
        """
        modulus = values.get(MODULUS.name, MODULUS.null)
        off = values.get(DISCREPANCY.name, 0.0) / self._largest
        setting = specimen_setting(
            experiment, self._histories.get(experiment.name, NEW), self._largest_N, modulus
        )
        acting = Acting(KIND, values, setting)

        def law(strain: Array) -> Array:
            setting.strain = strain
            stress = acting.along(yeoh(modulus / 6, 0.0, setting.mode, 1 + strain), "law")
            if off:
                stress = stress * (1.0 + off * strain)
            return np.asarray(acting.along(stress, "sign"))

        return recorded(acting, law, values)[None]
