"""First contact of a compressed specimen's struts with each other or a plate, detected and not resisted."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..fem.self_intersection import first_self_intersection
from ..fem.state import State
from ..meshing.mesh import AXES, Mesh

# Nodes this share of a specimen's side beyond a plane are there by rounding.
_ROUNDING = 1e-9


@attrs.frozen(eq=False)
class StrutContact:
    """Nominal strain at which struts first meet "a plate" or "each other".

    place (3,): position in the undeformed eighth, in mm from the block's middle.
    """

    strain: float
    what: str
    place: Array

    def __str__(self) -> str:
        place = ", ".join(f"{c + 0.0:.1f}" for c in self.place)
        return f"a strut touches {self.what} at the point that was ({place}) mm from the block's middle"


@attrs.frozen(eq=False)
class _Plane:
    """A plane across an axis, met from its upper (1) or lower (-1) side, and the nodes on it."""

    what: str
    axis: int
    side: int
    level: float
    on: Array


def first_strut_contact(mesh: Mesh, strains: Sequence[float], moves: Sequence[Array]) -> StrutContact | None:
    """The first contact along displacements (n, 3) in mm of an eighth at ascending nominal strains, or None.

    The first state must be free of contact. Struts touch a plate where they pass the plane of the mesh's
    `tip`, and their own images where they pass a mirror plane. Between two states nodes move along straight
    lines.
    """
    planes = [
        _Plane("its mirror image", AXES.index(a), -1, 0.0, mesh.symmetry_nodes(a)) for a in mesh.symmetry
    ]
    planes.append(_Plane("a plate", 2, 1, mesh.nodes[mesh.tip[0], 2], mesh.tip))
    passed = [_passed(mesh, strains, moves, plane) for plane in planes]
    first = min((touch for touch in passed if touch), key=lambda touch: touch.strain, default=None)
    # Only what comes before is of interest.
    count = len(strains) if first is None else int(np.searchsorted(strains, first.strain)) + 1
    # An image is met at its mirror plane, so that an eighth is enough; the load of its states is strain.
    part = attrs.evolve(mesh, symmetry=())
    states = [State(strain, u) for strain, u in zip(strains[:count], moves, strict=False)]
    cut = first_self_intersection(part, states)
    if cut is not None and (first is None or cut.pressure_MPa < first.strain):
        return StrutContact(cut.pressure_MPa, "another", cut.crossings[0].walls[0])
    return first


def _passed(
    mesh: Mesh, strains: Sequence[float], moves: Sequence[Array], plane: _Plane
) -> StrutContact | None:
    """First passage of nodes through a plane that they did not lie on."""
    off = np.setdiff1d(np.arange(len(mesh.nodes)), plane.on)
    least = _ROUNDING * mesh.nodes.max()
    before = np.full(len(off), -np.inf)
    for k, u in enumerate(moves):
        level = plane.level + (u[plane.on[0], plane.axis] if len(plane.on) else 0.0)
        beyond = plane.side * (mesh.nodes[off, plane.axis] + u[off, plane.axis] - level)
        past = np.flatnonzero(beyond > least)
        if k and len(past):
            share = -before[past] / (beyond[past] - before[past])
            strain = strains[k - 1] + share.min() * (strains[k] - strains[k - 1])
            return StrutContact(float(strain), plane.what, mesh.nodes[off[past[share.argmin()]]])
        before = np.minimum(beyond, 0.0)
    return None
