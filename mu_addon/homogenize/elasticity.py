"""The effective elasticity tensor of a periodic lattice, from an eighth of its cell at small strain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, float64
from ..errors import MeshingError
from ..fem.materials import Materials
from ..meshing.mesh import Mesh
from .bounds import hashin_shtrikman
from .octant import SHEARS, Octant, require_factor

# Of energies.
_ROUNDING = 1e-7
# Quadratic elements three to a void's quarter circle are too stiff by up to 4e-4, and voids nearly reach the
# bound; lattices are far below.
_COARSE = 2e-3

_NORMAL = slice(0, 3)


@attrs.frozen(eq=False)
class Elasticity:
    """Effective elasticity of a lattice with three mirror planes: C (6, 6) in MPa, in Voigt's notation.

    Order xx, yy, zz, yz, xz, xy with engineering shears; entries that vanish by symmetry are 0.
    relative_density: share of the volume that is solid. C11, C12, C44 and derived figures are those of the
    nearest cubic material, means over the axes; `cubic_error` is its relative distance.
    """

    C: Array = attrs.field(converter=float64)
    relative_density: float = 1.0

    @property
    def C11(self) -> float:
        """Mean of the three normal stiffnesses in MPa."""
        return float(np.diag(self.C)[:3].mean())

    @property
    def C12(self) -> float:
        """Mean of the three stiffnesses between two axes in MPa."""
        return float((self.C[0, 1] + self.C[0, 2] + self.C[1, 2]) / 3)

    @property
    def C44(self) -> float:
        """Mean of the three shear stiffnesses in MPa."""
        return float(np.diag(self.C)[3:].mean())

    @cached_property
    def cubic(self) -> Array:
        """The nearest cubic tensor (6, 6) in MPa, of C11, C12 and C44, in Voigt's order."""
        C = np.diag([self.C11 - self.C12] * 3 + [self.C44] * 3)
        C[_NORMAL, _NORMAL] += self.C12
        return C

    @property
    def cubic_error(self) -> float:
        """Largest relative difference of strain energies, under any strain, from the nearest cubic tensor.

        Of a lattice equal along its axes it is the mesh's noise; an offset along z alone makes it more.
        """
        root = np.linalg.inv(np.linalg.cholesky(self.cubic))
        return float(np.abs(np.linalg.eigvalsh(root @ self.C @ root.T) - 1).max())

    @property
    def zener(self) -> float:
        """Zener's ratio 2 C44/(C11 - C12), dimensionless: 1 where isotropic."""
        return 2 * self.C44 / (self.C11 - self.C12)

    @property
    def bulk(self) -> float:
        """Bulk modulus (C11 + 2 C12)/3 in MPa of the cubic tensor."""
        return (self.C11 + 2 * self.C12) / 3

    @property
    def shear(self) -> float:
        """Shear modulus in MPa, Hill's: the mean of Voigt's and Reuss's means over all directions."""
        first, second = (self.C11 - self.C12) / 2, self.C44
        return (self.shear_voigt + 5 / (2 / first + 3 / second)) / 2

    @property
    def shear_voigt(self) -> float:
        """Voigt's mean over all directions of the shear modulus, (C11 - C12 + 3 C44)/5 in MPa."""
        return (self.C11 - self.C12 + 3 * self.C44) / 5

    @property
    def E100(self) -> float:
        """Young's modulus in MPa along a cell's edge, of the cubic tensor."""
        return float(young_modulus(self.cubic, [[1, 0, 0]])[0])

    @property
    def E110(self) -> float:
        """Young's modulus in MPa along a face's diagonal, of the cubic tensor."""
        return float(young_modulus(self.cubic, [[1, 1, 0]])[0])

    @property
    def E111(self) -> float:
        """Young's modulus in MPa along the cell's diagonal, of the cubic tensor."""
        return float(young_modulus(self.cubic, [[1, 1, 1]])[0])

    @property
    def nu100(self) -> float:
        """Poisson's ratio under stress along a cell's edge, across to another edge."""
        return self.C12 / (self.C11 + self.C12)


def young_modulus(C: Array, directions: ArrayLike) -> Array:
    """Young's modulus (k,) in MPa of an elasticity tensor along directions (k, 3) of any length.

    C: (6, 6) in MPa, in Voigt's order xx, yy, zz, yz, xz, xy with engineering shears. E(n) = 1 / (n n : S :
    n n).

    >>> C = np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    >>> young_modulus(C, [[0, 0, 1]]).tolist()
    [2.0]
    """
    n = np.atleast_2d(np.asarray(directions, float))
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    pairs = np.stack([n[:, a] * n[:, b] for a, b in SHEARS], axis=1)
    stress = np.hstack([n**2, pairs])
    # Strain in engineering shears does the work of stress, component by component.
    return np.asarray(1 / np.einsum("ka,ab,kb->k", stress, np.linalg.inv(C), stress))


def effective_tensor(mesh: Mesh, materials: Materials) -> Elasticity:
    """Effective elasticity, at small strain, of a periodic body from the mesh of its eighth, from 0 on.

    The mesh and its mirror images in its six sides make up the body (`octant.Octant`). Energies are those of
    exact small-strain solutions on the mesh, so never below the true ones of the meshed shape. Raises
    MeshingError where a piece is loose, or where the result is indefinite or above the Hashin-Shtrikman
    bound, which no right mesh can give.
    """
    return strained(mesh, materials)[0]


def strained(mesh: Mesh, materials: Materials, alike: bool = False) -> tuple[Elasticity, Array]:
    """`effective_tensor`, and the displacements (6, n, 3) in mm under unit mean strains that give it.

    In Voigt's order, of engineering shears. alike: mesh and materials have cubic symmetry, so that one shear
    stands for all three and four displacements are returned. Raises MeshingError as that does.
    """
    octant = Octant(mesh, materials)
    C = np.zeros((6, 6))
    limit = np.zeros((6, 6))
    shears = SHEARS[:1] if alike else SHEARS
    moved = np.zeros((3 + len(shears), mesh.nodes.size))
    for rows, affine, force, u, work in _responses(octant, shears):
        moved[list(rows)] = u.T
        C[np.ix_(rows, rows)] = u.T @ work / octant.volume
        limit[np.ix_(rows, rows)] = affine.T @ force / octant.volume
    if alike:
        for tensor in (C, limit):
            tensor[4, 4] = tensor[5, 5] = tensor[3, 3]
    found = Elasticity((C + C.T) / 2, octant.relative_density)
    _require_possible(found, octant, (limit + limit.T) / 2)
    return found, moved.reshape(len(moved), -1, 3)


def _responses(
    octant: Octant, shears: Sequence[tuple[int, int]]
) -> Iterator[tuple[range, Array, Array, Array, Array]]:
    """Rows of Voigt's order, and of each the affine motion, its forces, the motion and its forces, by column.

    Motions (3 n, k) in mm of a unit mean strain, forces in N.
    """
    values, K = octant.tangent(np.zeros_like(octant.mesh.nodes))
    unit = np.eye(3)
    cases = [(octant.stretching, range(3), [np.outer(e, e) for e in unit])]
    for row, (a, b) in enumerate(shears):
        gradient = (np.outer(unit[a], unit[b]) + np.outer(unit[b], unit[a])) / 2
        cases.append((octant.shearing((a, b)), range(3 + row, 4 + row), [gradient]))
    for part, rows, gradients in cases:
        affine = np.stack([octant.affine(g) for g in gradients], axis=1)
        require_factor(part, values)
        force = K @ affine
        u = affine - part.solve(force)
        yield rows, affine, force, u, K @ u


def _require_possible(found: Elasticity, octant: Octant, limit: Array) -> None:
    """Raise MeshingError for a tensor that is indefinite, or above Voigt's or Hashin-Shtrikman's bound."""
    if np.linalg.eigvalsh(found.C).min() <= 0:
        raise _impossible("is not positive definite")
    scale = np.linalg.eigvalsh(limit).max()
    if np.linalg.eigvalsh(limit - found.C).min() < -_ROUNDING * scale:
        raise _impossible("exceeds Voigt's bound, the mean of its materials")
    young, poisson = octant.materials.small_strain(len(octant.mesh.tets))
    bulk, shear = young / (3 * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    share = octant.model.volumes / octant.volume
    isotropic = np.diag([2 * share @ shear] * 3 + [share @ shear] * 3)
    isotropic[_NORMAL, _NORMAL] += share @ (bulk - 2 / 3 * shear)
    if np.abs(isotropic - limit).max() > _ROUNDING * scale:
        return  # The bound below is of isotropic phases.
    # The last phase is the void; rounding must not make its share negative.
    shares = np.append(share, max(0.0, 1 - share.sum()))
    _, most = hashin_shtrikman(shares / shares.sum(), np.append(bulk, 0.0), np.append(shear, 0.0))
    if found.bulk > most.bulk * (1 + _COARSE):
        raise _impossible(
            f"has a bulk modulus of {found.bulk:.4g} MPa, above Hashin and Shtrikman's {most.bulk:.4g}"
        )
    if found.shear_voigt > most.shear * (1 + _COARSE):
        raise _impossible(
            f"has a mean shear modulus of {found.shear_voigt:.4g} MPa, above Hashin and Shtrikman's "
            f"{most.shear:.4g}"
        )


def _impossible(what: str) -> MeshingError:
    return MeshingError(
        f"the effective tensor {what}", "periodic cell", "refine its mesh, and check its box and units"
    )
