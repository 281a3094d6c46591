"""Stiffness of a homogenised lattice of graded struts, relative to struts of factor 1.

An element gets the moduli of the infinite lattice with the strut diameters at its position: the diameters are
assumed to vary slowly between cells. Moduli of the periodic body-centred cell were computed once from its
quadratic solid (`benchmarks.grading`, resin of Poisson's ratio 0.45) over the diameters at junctions and
at mid-span. Polynomials in their logarithms fit them within 1.6 %, and cells left out of the fit within 3 %.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..design.lattice_kinds import constant, sin_squared
from ..errors import InputError
from ..meshing.mesh import LATTICE
from .laws import CubicShear, DiagonalStretch, Foam, NeoHooke

if TYPE_CHECKING:
    from ..design.dimensions import Dimensions
    from ..meshing.mesh import Mesh

Array = np.ndarray[Any, Any]

REFERENCE = 0.12
DEGREE = 4
RANGE = (0.05, 0.32)
"""Diameters, as shares of the cell's edge, between which the polynomials hold."""


class Moduli(NamedTuple):
    """E[100], C12 and C44 of a lattice, or a value for each of them; (n,)."""

    E100: Array
    C12: Array
    C44: Array


_COEFFICIENTS = Moduli(
    # by i and j as `design_matrix` has them
    np.array(
        [
            -7.10348,
            1.19739,
            -0.23756,
            0.73935,
            -0.32248,
            4.38588,
            0.345,
            1.1809,
            0.30474,
            0.21954,
            0.86043,
            1.34839,
            0.02628,
            0.95916,
            0.01555,
        ]
    ),
    np.array(
        [
            -4.57043,
            1.21141,
            -0.08214,
            0.13324,
            -0.0522,
            2.17069,
            0.19067,
            0.29726,
            0.0554,
            0.07881,
            0.2326,
            0.29962,
            0.02498,
            0.21635,
            0.01822,
        ]
    ),
    np.array(
        [
            -4.69687,
            1.04875,
            -0.1163,
            0.07706,
            -0.0153,
            2.05395,
            0.03489,
            0.22009,
            0.05024,
            0.02723,
            0.169,
            0.2404,
            0.01266,
            0.19622,
            0.01813,
        ]
    ),
)


def design_matrix(junction: Array, midspan: Array) -> Array:
    """Terms (n, 15) of the polynomials, x^i y^j, for diameters (n,) as shares of the cell's edge.

    x: logarithm of the junction's over REFERENCE; y: of mid-span over junction.
    """
    x, y = _logarithms(junction, midspan)
    return np.stack([x**i * y**j for i, j in _powers()], axis=-1)


def relative_moduli(d: Dimensions, factors: Array) -> Moduli:
    """Moduli (n,) of lattices with struts of these factors (n,) of a grading, over those of factor 1.

    d: dimensions as printed. Raises InputError for a kind of lattice other than body-centred half diagonals,
    and for struts outside RANGE.
    """
    f = np.asarray(factors, float)
    _require_known(d, np.append(f, 1.0))
    nominal, graded = design_matrix(*_shares(d, np.ones(1))), design_matrix(*_shares(d, f))
    return Moduli(*(np.exp((graded - nominal) @ c) for c in _COEFFICIENTS))


def element_factors(d: Dimensions, mesh: Mesh) -> Array:
    """Factors (m,) of a grading at the middles of a mesh's lattice elements, 1 in all others."""
    found = np.ones(len(mesh.tets))
    if d.grading is not None:
        inside = np.flatnonzero(mesh.region == LATTICE)
        found[inside] = d.grading.at(mesh.nodes[mesh.tets[inside, :4]].mean(axis=1))
    return found


def law_weight(law: Any, moduli: Moduli) -> Array:
    """Factor (n,) on the stiffness of one law of a homogenised lattice, by `relative_moduli`.

    In a law from `homogenize` the foam represents struts in bending and follows E[100]; cubic shear and
    diagonal stretch represent struts in tension and follow C44 and C12. A unit's single isotropic modulus was
    measured on a block between plates. Such blocks follow the geometric mean of E[100] and C44, within 6 %
    over print offsets of 0.12 and 0.17 mm (docs/engineering/method.md).
    """
    return {
        Foam: moduli.E100,
        CubicShear: moduli.C44,
        DiagonalStretch: moduli.C12,
        NeoHooke: np.sqrt(moduli.E100 * moduli.C44),
    }[law]


def _powers() -> list[tuple[int, int]]:
    return [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]


def _logarithms(junction: Array, midspan: Array) -> tuple[Array, Array]:
    first, second = np.asarray(junction, float), np.asarray(midspan, float)
    return np.log(first / REFERENCE), np.log(second / first)


def _shares(d: Dimensions, factors: Array) -> tuple[Array, Array]:
    """Diameters (n,) at junctions and at mid-span over the cell's edge."""
    junction, midspan = (
        ((diameter - d.strut_growth) * factors + d.strut_growth) / d.cell
        for diameter in (d.junction_diameter, d.midspan_diameter)
    )
    return (midspan if d.kind.radius is constant else junction), midspan


def _require_known(d: Dimensions, factors: Array) -> None:
    if not d.kind.is_half_diagonals or d.kind.radius not in (sin_squared, constant):
        raise InputError(
            f"how the stiffness of lattice {d.kind.name!r} depends on its struts' diameters is not known",
            "[grading], [lattice] kind",
            "choose body-centred or body-centred-straight, or leave the grading out",
        )
    low, high = RANGE
    for part, shares in zip(("junctions", "mid-span"), _shares(d, factors), strict=True):
        if shares.min() < low or shares.max() > high:
            raise InputError(
                f"struts of {d.cell * shares.min():.3g} to {d.cell * shares.max():.3g} mm at their {part} "
                f"are outside the {low * d.cell:.3g} to {high * d.cell:.3g} mm for which "
                "the homogenised stiffness of graded struts is known",
                "[grading]",
                'choose factors nearer to 1, or fidelity "resolved"',
            )
