"""Problems whose answers are published or known in closed form, and where to find our answers to them."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import attrs

from . import cook, land, thick


@attrs.frozen
class PointResult:
    """What one mesh gave: the quantity asked for, free unknowns, seconds."""

    value: float
    unknowns: int
    seconds: float


@attrs.frozen
class Case:
    """A quantity with a known value: solve(size, order, **options of the model) -> value, unknowns.

    sizes: of the meshes of order 1 and of order 2, coarse to fine, in cells along the body's side.
    """

    title: str
    quantity: str
    known: float
    source: str
    sizes: dict[int, tuple[int, ...]]
    solve: Callable[..., tuple[float, int]]

    def answer(self, size: int, order: int, **options: object) -> PointResult:
        """Solve on one mesh."""
        start = time.perf_counter()
        value, unknowns = self.solve(size, order, **options)
        return PointResult(value, unknowns, time.perf_counter() - start)

    def error(self, answer: PointResult) -> float:
        """Relative error of an answer."""
        return answer.value / self.known - 1


def cases():
    """Every case, by the name its rows carry in the tables."""
    flat = {1: (4, 8, 16, 32), 2: (4, 8, 16, 32)}
    found = {}
    for nu in (0.45, 0.4999):
        for solve, pressure, turns in (
            (thick.sphere, thick.sphere_pressure(), 2),
            (thick.tube, thick.tube_pressure(), 1),
        ):
            found[f"{solve.__name__} {nu:g}"] = Case(
                f"Thick {solve.__name__}, nu = {nu:g}",
                "u_r inside, mm",
                thick.radial_growth(pressure, nu, turns),
                "radial equation of the same law, collocation",
                {1: (4, 8, 12), 2: (4, 8, 12)} if turns == 2 else {1: (4, 8, 16), 2: (4, 8, 16)},
                partial(solve, poisson=nu),
            )
    found["cook"] = Case(
        "Cook's membrane, linear, E = 70, nu = 1/3, traction 6.25 MPa",
        "u_y(48, 60), mm",
        32.27,
        "CoFEA benchmark 002: CalculiX 32.27, code_aster 32.20, Elmer 32.27",
        flat,
        partial(cook.small, modulus=70.0, poisson=1 / 3, stress=6.25, height=60.0),
    )
    # The source states the material by Lame's constants.
    stiff, shear = 7500.0, 0.375
    modulus, poisson = shear * (3 * stiff + 2 * shear) / (stiff + shear), stiff / (2 * (stiff + shear))
    found["cook incompressible"] = Case(
        "Cook's membrane, linear, lambda = 7500, G = 0.375 MPa, force 1 N/mm",
        "u_y(48, 52), mm",
        16.4326,
        "FinEALE, NICE-T6 with Richardson's extrapolation",
        flat,
        partial(cook.small, modulus=modulus, poisson=poisson, stress=1 / 16, height=52.0),
    )
    found["cook finite"] = Case(
        "Cook's membrane, finite strain, E = 3, nu = 0.4999, traction 0.05 MPa",
        "u_y(48, 60), mm",
        4.7011,
        "Müller's thesis (incompressible), as Elmer's 3-D test quotes it",
        flat,
        cook.finite,
    )
    source = "Land et al., Proc. R. Soc. A 471 (2015) 20150641, about 0.5 % apart; digits by Taylor-Hood"
    found["beam"] = Case(
        "Land 1, pressed beam, kappa = 10 MPa",
        "z of the tip, mm",
        4.1631,
        source,
        {1: (2, 4), 2: (2, 4, 6)},
        land.beam,
    )
    for side, known in (("inside", -26.595), ("outside", -28.262)):
        found[f"ventricle {side}"] = Case(
            f"Land 2, blown ellipsoid, {side}, kappa = 10 MPa",
            "z of the apex, mm",
            known,
            source,
            {1: (4, 8, 12), 2: (2, 4, 8, 12)},
            partial(land.ventricle, outside=side == "outside"),
        )
    return found
