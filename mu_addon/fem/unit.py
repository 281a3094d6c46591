"""What a unit's mesh is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..design.printed import skin_stiffening
from ..design.quantity import in_MPa
from ..meshing.mesh import LATTICE
from .laws import NeoHooke
from .materials import Layer, Materials

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..meshing.mesh import Mesh
    from .lattice_law import LatticeLaw


def materials_of(unit: Unit, mesh: Mesh, lattice: LatticeLaw | None = None) -> Materials:
    """Materials of a unit's mesh: neo-Hookean membrane and lattice, as the unit's parameters have them.

    lattice: the law of the lattice in place of that. A skin of other cure is spread over the wall, see
    `skin_stiffening`: right where the wall stretches, too soft where it bends.
    """
    m, p = unit.material, unit.print
    stiffer = skin_stiffening(unit.printed.wall, p.skin_depth_mm, p.skin_factor)
    membrane_MPa = in_MPa(stiffer * m.membrane_modulus_kPa)
    inside = mesh.region == LATTICE
    if lattice is not None:
        wall = np.flatnonzero(~inside)
        moduli = np.full(len(wall), membrane_MPa)
        membrane = Layer(NeoHooke, wall, NeoHooke.parameters(moduli, m.membrane_poisson))
        return Materials((membrane, *lattice.fill(np.flatnonzero(inside))))
    return Materials.neo_hooke(
        np.where(inside, m.lattice_modulus_MPa, membrane_MPa),
        np.where(inside, m.lattice_poisson, m.membrane_poisson),
    )
