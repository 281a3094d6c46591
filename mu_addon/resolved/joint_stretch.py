"""Stretch in joints of struts that are beams, from their ends' loads and the joint's strain concentration."""

from __future__ import annotations

import numpy as np

from ..design.dimensions import Dimensions
from ..design.lattice import lattice_of
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.stress import PeakStretch
from ..meshing.mesh import LATTICE, Array
from .joints import concentration_factors, zones_of

# Distance from a joint in cells within which a beam's end is at it.
_AT = 1e-6


def joint_stretch(model: Model, materials: Materials, d: Dimensions, u: Array) -> PeakStretch | None:
    """The largest stretch in a joint under displacements u (n, 3) in mm; None where no beam ends in a joint.

    d: dimensions of the lattice's box. Of each strut's end, of small strain: 1 + Ka N/(E A) + Kb M r/(E I)
    with its `concentration_factors`, where the strut leaves the joint's rigid zone. exceeded: by 1 % of the
    ends.
    """
    from scipy.spatial import cKDTree

    mesh, beams = model.mesh, model.beams_of(materials)
    if beams is None:
        return None
    lattice, factors = lattice_of(d), concentration_factors(d)
    ends = mesh.beams[:, 0::2]
    away, joint = cKDTree(lattice.nodes).query(mesh.nodes[ends])
    beam, side = np.nonzero(away < _AT * d.cell)
    if not len(beam):
        return None
    axial, moments = beams.end_loads(model.unknowns_of_beams(u))
    young = materials.small_strain(len(mesh.tets))[0][mesh.region == LATTICE].mean()
    node = joint[beam, side]
    radius = lattice.node_radii[node]
    meeting = np.bincount(lattice.struts.ravel(), minlength=len(lattice.nodes))
    zone = zones_of(d).lengths(2.0 * radius, meeting[node])[1] / beams.length[beam]
    moment = (1.0 - zone)[:, None] * moments[beam, side] + zone[:, None] * moments[beam, 1 - side]
    pulled = factors.stretched * np.maximum(axial[beam], 0.0)
    bent = factors.bent * 4.0 * np.linalg.norm(moment, axis=1) / radius
    local = 1.0 + (pulled + bent) / (np.pi * young * radius**2)
    most = int(local.argmax())
    place = mesh.nodes[ends[beam[most], side[most]]]
    return PeakStretch(float(local[most]), place, float(np.quantile(local, 0.99)))
