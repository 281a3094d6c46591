"""beam_deadweight: a horizontal cantilever sagging under masses at its tip, at any deflection."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...arrays import Array
from ...errors import ConvergenceError
from ...measured import Experiment
from ..effect import offered
from ..effects import Acting
from ..effects.declaration import Data, Setting
from ..effects.gravity import G as GRAVITY
from ..parameter import Parameter

KIND = "beam_deadweight"
# Shear coefficient of a rectangle, 10 (1 + nu)/(12 + 11 nu) at 1/2: Cowper, J. Appl. Mech. 33 (1966) 335.
SHEAR = 15.0 / 17.5
NODES = 24

MODULUS = Parameter(
    "beam_modulus_kPa",
    "kPa",
    10.0,
    1e6,
    300.0,
    (),
    "soft silicones to hard rubber",
    plausible=(20.0, 1e7),
)
# Of the clamp, or of the zero of sag. Sag under its own weight and a tilt look alike: only prior knowledge of
# clamps separates them, as part of the weight's uncertainty.
TILT = Parameter("tilt_deg", "deg", -10.0, 10.0, 0.0, (), "clamps set by eye or level", spread=1.0)


class BeamSag:
    """Predicts the tip deflection of a cantilever: an elastica of given modulus, without weight.

    What acts on the `beam` are arguments of `cantilever`.
    Shear is added at first order; the solid is incompressible. An experiment needs section_mm (width,
    thickness), length_mm and the column added_mass_g.
    """

    nuisances = (MODULUS, TILT)
    effects = offered(Data(kind=KIND))

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: sag of the tip in mm."""
        return ("tip_deflection_mm",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Sag (1, n) of the tip in mm under the masses of added_mass_g (n,); values as in `Simulator`.

        Raises ConvergenceError where no equilibrium is found, see `cantilever`.
        """
        assert experiment.section_mm is not None
        assert experiment.length_mm is not None
        (width, h), L = experiment.section_mm, experiment.length_mm
        bending = 1e-3 * values.get(MODULUS.name, MODULUS.null) * width * h**3 / 12
        lengths = {"width_mm": width, "thickness_mm": h, "length_mm": L}
        acting = Acting(KIND, values, Setting(experiment=experiment, bending=bending, **lengths))
        masses, row = np.unique(experiment["added_mass_g"], return_inverse=True)
        sag = cantilever(
            1e-3 * GRAVITY * masses * L**2 / bending,
            tilt=np.radians(values.get(TILT.name, 0.0)),
            shear=h**2 / (4 * SHEAR * L**2),
            **acting.along({}, "beam"),
        )
        return (L * sag[row])[None]


def cantilever(
    tip: Array,
    weight: float = 0.0,
    *,
    tilt: float = 0.0,
    give: float = 0.0,
    stiffening: float = 0.0,
    shear: float = 0.0,
) -> Array:
    """Sag (m,) of a level cantilever's tip over its length, at any deflection.

    tip (m,): force at the tip times L^2/EI; weight: of the beam times L^2/EI. tilt: of the clamp, in rad,
    down; give: turn of the clamp a moment, times EI/L; stiffening: moment = EI k (1 + stiffening (L k)^2) of
    curvature k; shear: EI/(GA' L^2), whose sag is added at first order. The slope a below the level obeys (a'
    + stiffening a'^3)' = -(tip + weight (1 - s)) cos a, solved by collocation at Chebyshev points. Raises
    ConvergenceError where Newton's method finds no equilibrium.
    """
    s, D = _chebyshev(NODES)
    load = np.asarray(tip, float)[:, None] + weight * (1 - s)
    identity = np.eye(NODES + 1)
    a = np.full_like(load, tilt)
    # Large loads are reached in steps.
    steps = max(1, int(np.ceil(np.sqrt(load.max() / 2)))) if load.size else 1
    for share in np.linspace(1 / steps, 1, steps):
        for _ in range(60):
            k = a @ D.T
            moment = k * (1 + stiffening * k**2)
            stiff = 1 + 3 * stiffening * k**2
            residual = moment @ D.T + share * load * np.cos(a)
            J = D @ (stiff[:, :, None] * D) - (share * load * np.sin(a))[:, :, None] * identity
            residual[:, -1] = k[:, -1]
            J[:, -1] = D[-1]
            residual[:, 0] = a[:, 0] - tilt - give * moment[:, 0]
            J[:, 0] = identity[0] - give * stiff[:, :1] * D[0]
            step = np.linalg.solve(J, -residual[:, :, None])[:, :, 0]
            largest = np.abs(step).max() if step.size else 0.0
            a = a + step * min(1.0, 0.7 / max(largest, 1e-300))
            if largest < 1e-9 and (stiff > 0).all():
                break
        else:
            raise ConvergenceError(
                "no equilibrium of the beam was found", KIND, "its modulus is far too low, or its law softens"
            )
    weights = _clenshaw_curtis(NODES)
    return np.asarray((np.sin(a) + shear * load * np.cos(a) ** 2) @ weights)


def _chebyshev(n: int) -> tuple[Array, Array]:
    """Points (n + 1,) from 0 to 1 and the matrix that differentiates there (Trefethen 2000, chapter 6)."""
    x = -np.cos(np.pi * np.arange(n + 1) / n)
    c = (-1.0) ** np.arange(n + 1)
    c[[0, -1]] *= 2
    apart = x[:, None] - x + np.eye(n + 1)
    D = c[:, None] / c / apart
    D -= np.diag(D.sum(axis=1))
    return (x + 1) / 2, 2 * D


def _clenshaw_curtis(n: int) -> Array:
    """Weights (n + 1,) of the integral over those points, n even."""
    angle = np.pi * np.arange(n + 1) / n
    k = np.arange(1, n // 2 + 1)
    share = np.where(k == n // 2, 1.0, 2.0) / (4 * k**2 - 1)
    w = (1 - np.cos(2 * np.outer(angle, k)) @ share) / n
    w[[0, -1]] /= 2
    return np.asarray(w)
