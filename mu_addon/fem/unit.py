"""What a unit's mesh is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..meshing.mesh import LATTICE
from .materials import Materials

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..meshing.mesh import Mesh


def materials_of(unit: Unit, mesh: Mesh) -> Materials:
    """Materials of a unit's mesh: neo-Hookean membrane and lattice, as the unit's parameters have them."""
    m = unit.material
    lattice = mesh.region == LATTICE
    return Materials.neo_hooke(
        np.where(lattice, m.lattice_modulus_kPa, m.membrane_modulus_kPa) / 1e3,
        np.where(lattice, m.lattice_poisson, m.membrane_poisson),
    )
