"""An eighth of a periodic cell with three mirror planes: conditions on its six sides, and its tangent.

Under normal strains the lattice is its own mirror image, so the sides stay plane and free of shear. A shear
of x against y changes sign under the mirrors across x and y, and is unchanged by the mirror across z. On the
sides across x and across y the displacement in the plane is that of the mean shear; on the sides across z
only the normal displacement is. So the eighth carries the periodic problem exactly.
"""

from __future__ import annotations

import itertools
from functools import cached_property

import attrs
import numpy as np
from scipy import sparse

from ..arrays import Array
from ..errors import InputError, MeshingError
from ..fem.factor import Cholesky, IndefiniteError, SuperLU, make_factor
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.sparsity import Pattern
from ..meshing.mesh import AXES, Mesh, pieces
from ..meshing.tiling import box_of

# Voigt's order, and the axes each shear is of.
SHEARS = ((1, 2), (0, 2), (0, 1))


@attrs.frozen(eq=False)
class Part:
    """Some of a model's unknowns: their numbers (f,), and the factor of the tangent between them.

    entries: positions of their values among the tangent's (nnz,).
    """

    free: Array
    entries: Array
    factor: Cholesky | SuperLU

    def factorise(self, values: Array) -> None:
        """Factorise the part of a tangent's values (nnz,), all in N/mm.

        Raises IndefiniteError where it is not positive definite.
        """
        self.factor.factor(values[self.entries])

    def solve(self, force: Array) -> Array:
        """Displacements (3n,) or (3n, k) in mm of forces of the same shape in N, 0 at all other unknowns.

        Forces on other unknowns do not count. After `factorise`.
        """
        u = np.zeros_like(force)
        u[self.free] = self.factor.solve(np.ascontiguousarray(force[self.free]))
        return u


def part(pattern: Pattern, free: Array) -> Part:
    """A solver of the unknowns `free` (f,), ascending, of a tangent's pattern; not factorised so far."""
    count = len(pattern.indptr) - 1
    number = np.full(count, -1)
    number[free] = np.arange(len(free))
    columns = np.repeat(np.arange(count), np.diff(pattern.indptr))
    entries = np.flatnonzero((number[columns] >= 0) & (number[pattern.indices] >= 0))
    indptr = np.zeros(len(free) + 1, dtype=np.int64)
    np.cumsum(np.bincount(number[columns[entries]], minlength=len(free)), out=indptr[1:])
    order = number[pattern.order]
    return Part(free, entries, make_factor(indptr, number[pattern.indices[entries]], order[order >= 0]))


class Octant:
    """An eighth of a periodic cell as a model without supports, and its materials.

    box: (3,) mm, from the origin to the mesh's far sides. Laws must be symmetric under mirrors across x, y
    and z, as isotropic ones are. Raises InputError for a mesh with nodes below 0 or a clamped one,
    MeshingError if it does not reach its sides or a piece of it touches no side.
    """

    def __init__(self, mesh: Mesh, materials: Materials, threads: int = 2) -> None:
        self.mesh = mesh
        self.box = np.array(box_of(mesh), float)
        if mesh.symmetry or len(mesh.base):
            raise InputError(
                "an eighth of a cell must have neither mirror planes nor a clamped base of its own",
                "periodic cell",
                "leave them out: its sides are its supports",
            )
        if (mesh.nodes < 0).any():
            raise InputError("the mesh extends beyond its cell", "periodic cell", "put its corner at 0")
        self.sides = np.stack([mesh.nodes == 0.0, mesh.nodes == self.box])
        bare = [AXES[k] for k in range(3) if not self.sides[:, :, k].any(axis=1).all()]
        if bare:
            raise MeshingError(
                f"a cell's mesh does not reach both of its sides across {' and '.join(bare)}",
                "periodic cell",
                "put its nodes exactly on the planes",
            )
        label = pieces(mesh)
        held = np.zeros(label.max() + 1, bool)
        held[label[self.sides.any(axis=(0, 2))]] = True
        if not held.all():
            place = tuple(float(c) for c in mesh.nodes[held[label].argmin()].round(2))
            raise MeshingError(
                "a piece of a cell's mesh is not connected",
                f"near {place} mm",
                "connect its struts, or refine it",
            )
        self.model = Model(mesh, threads=threads)
        self.materials = materials
        self.parameters = self.model.parameters(materials)
        self.volume = float(np.prod(self.box))
        self.relative_density = float(self.model.volumes.sum()) / self.volume

    @cached_property
    def across(self) -> Array:
        """Mask (n, 3) of nodes on a side across x, y, z."""
        return np.asarray(self.sides.any(axis=0))

    @cached_property
    def stretching(self) -> Part:
        """The unknowns under normal strains: all but the normal displacements of the sides."""
        return self._part(self.across)

    def shearing(self, axes: tuple[int, int]) -> Part:
        """The unknowns under a shear of two axes, numbered 0 to 2.

        Fixed are displacements in the plane of sides across these axes, and the normal one of those across
        the third.
        """
        return self._part(self._kept_by(np.tile(np.isin(range(3), axes), (2, 1))))

    def affine(self, gradient: Array) -> Array:
        """Displacements (3n,) in mm of a uniform displacement gradient (3, 3)."""
        return np.asarray((self.mesh.nodes @ np.asarray(gradient).T).ravel())

    def tangent(self, u: Array) -> tuple[Array, sparse.csc_matrix]:
        """The tangent in N/mm at u (n, 3) in mm: its values (nnz,), and whole (3n, 3n), without supports."""
        values = self.model.tangent(u, 0.0, self.parameters)
        return values, self.model.matrix(values)

    def _kept_by(self, odd: Array) -> Array:
        """Displacements (n, 3), bool, that vanish in motions odd (2, 3) or even under each side's mirror."""
        fixed = np.zeros_like(self.across)
        for side, axis in itertools.product(range(2), range(3)):
            normal = np.arange(3) == axis
            fixed[self.sides[side, :, axis]] |= ~normal if odd[side, axis] else normal
        return fixed

    def _part(self, fixed: Array) -> Part:
        return part(self.model.pattern, np.flatnonzero(~fixed.ravel()))


def require_factor(part: Part, values: Array) -> None:
    """Factorise a part of the tangent's values (nnz,) at rest.

    Raises MeshingError where it is not positive definite, for instance where a piece of the mesh is loose.
    """
    try:
        part.factorise(values)
    except IndefiniteError:
        raise MeshingError(
            "the undeformed cell is not stable",
            "periodic cell",
            "correct its material, or connect its struts",
        ) from None
