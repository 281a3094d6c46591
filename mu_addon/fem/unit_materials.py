"""Materials of a unit's mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array
from ..design.printed import skin_stiffening
from ..design.quantity import in_MPa
from ..design.strut_cell import StrutCell, depth_below_surface
from ..meshing.mesh import LATTICE
from .elements import even_points, shape_functions
from .materials import Layer, Materials
from .wall_law import wall_layers

if TYPE_CHECKING:
    from ..design.dimensions import Dimensions
    from ..design.parameters import Unit
    from ..meshing.mesh import Mesh


# An element of a strut is divided this often along each edge to tell how much of it is skin.
_SKIN_STEPS = 4
# Of a graded strut's diameter, logarithmic, in which depths below its surface are looked up.
_FACTOR = 0.02


def materials_of(unit: Unit, mesh: Mesh) -> Materials:
    """Materials of a unit's mesh: neo-Hookean resin, or the law that the unit's [wall] names.

    Of the wall and of struts alike, stiffened by each element's share of the skin: in the wall the skin is
    spread evenly over the thickness (`skin_stiffening`), exact where it stretches, too soft where it bends.
    """
    m = unit.material
    count = len(mesh.tets)
    stiffer = _skin_stiffening(unit, mesh)
    resin_MPa = in_MPa(m.membrane_modulus_kPa)
    if not unit.wall.names:
        return Materials.neo_hooke(resin_MPa * stiffer, np.full(count, m.membrane_poisson))
    layers = wall_layers(unit.wall, np.arange(count), resin_MPa, m.membrane_poisson)
    return Materials(tuple(Layer(f.law, f.elements, f.parameters, f.weight * stiffer) for f in layers))


def _skin_stiffening(unit: Unit, mesh: Mesh) -> Array:
    """Modulus (m,) of each element of a printed mesh over the core's, by the skin's share of its volume."""
    p, d = unit.print, unit.printed
    walls, _ = d.wall_at(mesh.nodes[mesh.tets[:, :4], 2].mean(axis=1))
    found = skin_stiffening(walls, p.skin_depth_mm, p.skin_factor)
    if p.skin_depth_mm == 0.0 or p.skin_factor == 1.0:
        return found
    struts = np.flatnonzero(mesh.region == LATTICE)
    shape = shape_functions(even_points(_SKIN_STEPS), mesh.order)
    points = np.einsum("qn,mnd->mqd", shape, mesh.nodes[mesh.tets[struts]]).reshape(-1, 3)
    corner = np.array([d.cell / 2.0, d.cell / 2.0, 0.0])
    depth = _depths(d, points, corner).reshape(len(struts), -1)
    found[struts] = 1.0 + (depth < p.skin_depth_mm).mean(axis=1) * (p.skin_factor - 1.0)
    return found


def _depths(d: Dimensions, points: Array, corner: Array) -> Array:
    """Depths (n,) in mm below the struts' surface of points (n, 3) in mm; corner (3,): from cells' corners.

    In graded struts those of an infinite lattice of the point's factor, in steps of _FACTOR.
    """
    if d.grading is None:
        cell = StrutCell(d.kind, d.cell, d.junction_diameter / 2.0, d.midspan_diameter / 2.0)
        return depth_below_surface(cell, points + corner)
    found = np.zeros(len(points))
    steps = np.rint(np.log(d.strut_factors(points)) / _FACTOR).astype(int)
    for step in np.unique(steps):
        radii = (
            (diameter - d.strut_growth) * math.exp(step * _FACTOR) / 2.0 + d.strut_growth / 2.0
            for diameter in (d.junction_diameter, d.midspan_diameter)
        )
        own = steps == step
        found[own] = depth_below_surface(StrutCell(d.kind, d.cell, *radii), points[own] + corner)
    return found
