"""Second-order elements beside a curved surface, bent with it so that they do not intersect it."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from .harmonic import harmonic
from .mesh import LATTICE, MEMBRANE, TET_EDGES, Array, Mesh
from .quality import GAUSS, folded_corners, shapes

# Corners flatter than this, as a share of the element's largest det J, are relieved.
_FLAT = 0.25


def relieved(mesh: Mesh, bounds: Any) -> Mesh:
    """The mesh with lattice elements bent along with the membrane, where its curvature would fold one.

    bounds (3, 2): the envelope's box, (low, high) in mm for x, y and z; its faces and the mirror planes keep
    their nodes in plane, and the membrane keeps all of its own. Meshes of order 1 are returned as they are.
    """
    lattice = mesh.region == LATTICE
    if mesh.order == 1 or folded_corners(mesh)[lattice].min() > _FLAT:
        return mesh
    tets = mesh.tets[lattice]
    straight = mesh.nodes.copy()
    straight[tets[:, 4:]] = straight[tets[:, :4][:, TET_EDGES]].mean(axis=2)
    of_membrane = np.zeros(len(mesh.nodes), bool)
    of_membrane[mesh.tets[mesh.region == MEMBRANE]] = True
    prescribed = of_membrane[:, None] | np.any(
        [straight == planes for planes in (0.0, *np.transpose(bounds))], axis=0
    )
    moved = np.where(of_membrane[:, None], mesh.nodes - straight, 0.0)
    bent = straight + _harmonic(straight, tets, moved, prescribed)
    return attrs.evolve(mesh, nodes=np.where(of_membrane[:, None], mesh.nodes, bent))


def _harmonic(nodes: Array, tets: Array, moved: Array, prescribed: Array) -> Array:
    """Displacements (n, 3) in mm, prescribed as `moved` where `prescribed` (n, 3) and harmonic elsewhere.

    tets (m, 10) are straight-sided. The medium is stiffer where elements are small, as in Persson and
    Peraire, AIAA 2009-949.
    """
    _, gradient = shapes(GAUSS, TET_EDGES, 2)
    x = nodes[tets[:, :4]]
    slopes = np.einsum("qnr,mrd->mqnd", gradient, np.linalg.inv((x[:, 1:] - x[:, :1]).transpose(0, 2, 1)))
    # Not weighed by the elements' volumes, so that small ones are the stiff ones.
    local = np.einsum("mqad,mqbd->mab", slopes, slopes)
    return harmonic(len(nodes), tets, local, moved, prescribed)
