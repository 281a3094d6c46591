"""Meshing: labelled tetrahedra of a unit, or of any closed surface.

`mesh_unit` gives the analysis mesh of a unit, half of it by default: deterministic, with conforming
interfaces between membrane and lattice (gmsh). `mesh_surface` fills any closed surface (pytetwild). A `Mesh`
is plain arrays: nodes, tetrahedra of order 1 or 2, the region of each, and the surfaces that loads act on.

    >>> from mu_addon.meshing import MeshSettings
    >>> MeshSettings(order=1, refine=0.5).order
    1
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .homogenised_unit import MeshingWarning as MeshingWarning
    from .homogenised_unit import mesh_unit as mesh_unit
    from .lattice_region import GmshUnavailable as GmshUnavailable
    from .mesh import LATTICE as LATTICE
    from .mesh import MEMBRANE as MEMBRANE
    from .mesh import Mesh as Mesh
    from .mesh import mirror as mirror
    from .quality import Quality as Quality
    from .quality import mesh_quality as mesh_quality
    from .settings import MeshSettings as MeshSettings
    from .surface import VOID as VOID
    from .surface import Surface as Surface
    from .surface import mesh_surface as mesh_surface
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
