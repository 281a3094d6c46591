"""Buckling of a compressed specimen into a shape without mirror symmetry.

A small motion of a body with three mirror planes is a sum of eight uncoupled parts, each even or odd under
each mirror. An eighth with other supports on its mirror planes therefore shows the modes that the symmetric
eighth excludes.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..fem.factor import IndefiniteError
from ..fem.model import Model
from ..fem.state import lagrange
from ..meshing.mesh import AXES
from .octant import part
from .specimen import Specimen

# By mirror across x, y and z: whether it turns the motion into its negative.
Signs = tuple[bool, bool, bool]
# In the order in which blocks of lattice were seen to lose them.
_BREAKING: tuple[Signs, ...] = (
    (False, True, True),
    (True, False, True),
    (True, True, False),
    (False, False, True),
    (True, False, False),
    (False, True, False),
    (True, True, True),
)


# Of the step between two states: to an eighth of it.
_HALVINGS = 3


@attrs.frozen
class Loss:
    """Two nominal strains, compression positive, between which an equilibrium becomes unstable.

    signs: for the mirrors across x, y and z, True if the buckled shape breaks it.
    """

    before: float
    after: float
    signs: Signs

    def __str__(self) -> str:
        broken = " and ".join(axis for axis, sign in zip(AXES, self.signs, strict=True) if sign)
        return (
            f"between {100 * self.before:.3g} and {100 * self.after:.3g} % the block starts to buckle into a "
            f"shape that is not symmetric across {broken}"
        )


class SymmetryBreakingModes:
    """The small motions of a specimen's eighth in the seven parts that break its symmetry.

    held (n, 3) bool: the supports on the plates. threads: as `Model` has them.
    """

    def __init__(self, specimen: Specimen, held: Array, threads: int = 2) -> None:
        self.mesh = attrs.evolve(specimen.mesh, symmetry=())
        self.held = held
        self.model = Model(self.mesh, threads=threads)
        self.parameters = self.model.parameters(specimen.materials)
        # The one lost last is tested first.
        self._order = list(_BREAKING)

    def lost(self, u: Array) -> Signs | None:
        """Signs of a part whose tangent is not positive definite at u (n, 3) in mm, or None."""
        values = self.model.tangent(u, 0.0, self.parameters)
        for signs in self._order:
            try:
                # Seven factors together would not fit into memory where one does.
                part(self.model.pattern, np.flatnonzero(~self._fixed(signs).ravel())).factorise(values)
            except IndefiniteError:
                self._order.sort(key=lambda other: other != signs)
                return signs
        return None

    def _fixed(self, signs: Signs) -> Array:
        nodes, tip = self.mesh.nodes, self.mesh.tip
        fixed = self.held.copy()
        for axis, negative in enumerate(signs):
            on = nodes[:, axis] == 0.0
            for k in range(3):
                fixed[on, k] |= (k == axis) != negative
        # On plates that hold nothing sideways the block may drift and turn as a whole; one node is kept.
        if not signs[2] and not self.held[tip, :2].any():
            corner = tip[nodes[tip, :2].sum(axis=1).argmax()]
            fixed[corner, 0 if signs[0] else 1] = True
        return fixed


def first_loss(
    motions: SymmetryBreakingModes, strains: Sequence[float], moves: Sequence[Array]
) -> Loss | None:
    """Strain at which displacements (n, 3) in mm at ascending strains, the first at rest, lose stability.

    None if they do not. Found by halving, first among the states and then between two, with equilibria from
    the polynomial through their neighbours. Lost stability is assumed not to return.
    """
    low, high = 0, len(strains) - 1
    signs = motions.lost(moves[high])
    if signs is None:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        found = motions.lost(moves[middle])
        if found is None:
            low = middle
        else:
            high, signs = middle, found
    near = slice(max(0, low - 1), high + 2)
    before, after = strains[low], strains[high]
    for _ in range(_HALVINGS):
        strain = (before + after) / 2
        found = motions.lost(lagrange(strains[near], moves[near], strain))
        if found is None:
            before = strain
        else:
            after, signs = strain, found
    return Loss(before, after, signs)
