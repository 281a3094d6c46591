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
    from .bounds import hashin_shtrikman as hashin_shtrikman
    from .cell_mesh import CellMeshSettings as CellMeshSettings
    from .cell_mesh import cell_materials as cell_materials
    from .cell_mesh import mesh_cell as mesh_cell
    from .compression import STRAINS as STRAINS
    from .compression import Compression as Compression
    from .compression import Friction as Friction
    from .compression import Limits as Limits
    from .compression import Plates as Plates
    from .compression import Reached as Reached
    from .compression import compress as compress
    from .compression import compression_of as compression_of
    from .compression import limits_of as limits_of
    from .effective_file import effective_text as effective_text
    from .elasticity import Elasticity as Elasticity
    from .elasticity import effective_tensor as effective_tensor
    from .elasticity import young_modulus as young_modulus
    from .foam_fit import FoamFit as FoamFit
    from .foam_fit import fit_foam as fit_foam
    from .foam_fit import lattice_law as lattice_law
    from .specimen import Specimen as Specimen
    from .specimen import block_specimen as block_specimen
    from .stress_strain_curve import DEFAULT as DEFAULT
    from .stress_strain_curve import Curve as Curve
    from .stress_strain_curve import moduli as moduli
    from .stretch import Stretched as Stretched
    from .stretch import StretchSettings as StretchSettings
    from .stretch import stretch_lattice as stretch_lattice
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
