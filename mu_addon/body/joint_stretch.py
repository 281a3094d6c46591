"""The largest stretch in the joints of struts that are beams."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, lattice_of
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.stress import PeakStretch
from ..meshing.mesh import LATTICE
from .frame import frame_zones, joint_factors, place_in_cell
from .joints import Zones, concentration_factors, zones_of
from .strut import is_half_diagonal

# Distance from a joint in cells within which a beam's end is at it.
_AT = 1e-6


def joint_stretch(
    model: Model, materials: Materials, d: Dimensions, u: Array, cache: Path | None = None
) -> PeakStretch | None:
    """The largest stretch in a joint under displacements u (n, 3) in mm; None where no beam ends in a joint.

    d: dimensions of the lattice's box; cache: folder that keeps cells that are not swept. For each strut's
    end where it leaves the joint's rigid zone, at small strain: 1 + Ka N/(E A) + Kb M r/(E I) with the
    joint's concentration factors. exceeded: by 1 % of the ends.
    """
    from scipy.spatial import cKDTree

    mesh, beams = model.mesh, model.beams_of(materials)
    if beams is None:
        return None
    lattice = lattice_of(d)
    ends = mesh.beams[:, 0::2]
    away, joint = cKDTree(lattice.nodes).query(mesh.nodes[ends])
    beam, side = np.nonzero(away < _AT * d.cell)
    if not len(beam):
        return None
    zones, by_pull, by_bending = _laws(d, lattice, cache)
    axial, moments = beams.end_loads(model.unknowns_of_beams(u))
    if "x" in mesh.symmetry:
        # Of struts in the mirror plane a half mesh has a half.
        halved = np.where((mesh.nodes[ends][..., 0] == 0.0).all(axis=1), 2.0, 1.0)
        axial, moments = halved * axial, halved[:, None, None] * moments
    young = materials.small_strain(len(mesh.tets))[0][mesh.region == LATTICE].mean()
    node = joint[beam, side]
    radius = lattice.node_radii[node]
    meeting = np.bincount(lattice.struts.ravel(), minlength=len(lattice.nodes))
    zone = zones.lengths(2.0 * radius, meeting[node])[1] / beams.length[beam]
    moment = (1.0 - zone)[:, None] * moments[beam, side] + zone[:, None] * moments[beam, 1 - side]
    pulled = by_pull[node] * np.maximum(axial[beam], 0.0)
    bent = by_bending[node] * 4.0 * np.linalg.norm(moment, axis=1) / radius
    local = 1.0 + (pulled + bent) / (np.pi * young * radius**2)
    most = int(local.argmax())
    place = mesh.nodes[ends[beam[most], side[most]]]
    return PeakStretch(float(local[most]), place, float(np.quantile(local, 0.99)))


def _laws(d: Dimensions, lattice: Lattice, cache: Path | None) -> tuple[Zones, Array, Array]:
    """Rigid zones, and both factors (N,) of a lattice's joints."""
    if is_half_diagonal(d):
        alike = concentration_factors(d)
        one = np.ones(len(lattice.grid))
        return zones_of(d), alike.stretched * one, alike.bent * one
    factors = joint_factors(d, cache)
    places = place_in_cell(d.kind, lattice.grid - lattice.cells[0])
    row = (places[:, None] == factors.places).all(axis=2).argmax(axis=1)
    return frame_zones(d, cache), factors.stretched[row], factors.bent[row]
