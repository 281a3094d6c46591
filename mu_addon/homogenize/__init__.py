"""Homogenisation of a lattice of struts to a continuum.

`mesh_cell` meshes an eighth of a printed cell, `effective_tensor` gives its elasticity at small strain,
`stretch_lattice` its response at finite strain, `compress` a finite block between plates, and `fit_foam` a
law for the analysis mesh that follows all of these.

    >>> from mu_addon.homogenize import hashin_shtrikman
    >>> low, high = hashin_shtrikman([0.5, 0.5], bulk=[2.0, 0.0], shear=[1.0, 0.0])
    >>> low.bulk, round(high.bulk, 3)
    (0.0, 0.571)
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .bounds import hashin_shtrikman
    from .cell_mesh import CellMeshSettings, cell_materials, mesh_cell
    from .compression import (
        STRAINS,
        Compression,
        Friction,
        Limits,
        Plates,
        Reached,
        compress,
        compression_of,
        limits_of,
    )
    from .effective_file import effective_text
    from .elasticity import Elasticity, effective_tensor, young_modulus
    from .foam_fit import FoamFit, fit_foam, lattice_law
    from .specimen import Specimen, block_specimen
    from .stress_strain_curve import DEFAULT, Curve, moduli
    from .stretch import Stretched, stretch_lattice
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
