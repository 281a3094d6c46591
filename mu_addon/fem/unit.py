"""What a unit's mesh is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..design.printed import skin_stiffening
from ..design.quantity import in_MPa
from ..meshing.mesh import LATTICE
from .laws import NeoHooke
from .materials import Layer, Materials
from .wall_law import wall_layers

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..meshing.mesh import Mesh
    from .lattice_law import LatticeLaw

Array = np.ndarray[Any, Any]


def materials_of(unit: Unit, mesh: Mesh, lattice: LatticeLaw | None = None) -> Materials:
    """Materials of a unit's mesh: neo-Hookean membrane and lattice, or the law that the unit's [wall] names.

    lattice: a homogenised lattice law in place of the neo-Hookean one. A skin of other cure is spread
    evenly over the wall's thickness (`skin_stiffening`): exact where the wall stretches, too soft where it
    bends.
    """
    m, p = unit.material, unit.print
    stiffer = skin_stiffening(unit.printed.wall, p.skin_depth_mm, p.skin_factor)
    membrane_MPa = in_MPa(stiffer * m.membrane_modulus_kPa)
    inside = mesh.region == LATTICE
    if unit.wall.names or lattice is not None:
        wall = wall_layers(unit.wall, np.flatnonzero(~inside), membrane_MPa, m.membrane_poisson)
        return Materials((*wall, *_lattice_layers(unit, np.flatnonzero(inside), lattice)))
    return Materials.neo_hooke(
        np.where(inside, m.lattice_modulus_MPa, membrane_MPa),
        np.where(inside, m.lattice_poisson, m.membrane_poisson),
    )


def _lattice_layers(unit: Unit, elements: Array, law: LatticeLaw | None) -> tuple[Layer, ...]:
    if law is not None:
        return law.fill(elements)
    m = unit.material
    row = NeoHooke.parameters(m.lattice_modulus_MPa, m.lattice_poisson)
    return (Layer(NeoHooke, elements, np.tile(row, (len(elements), 1))),)
