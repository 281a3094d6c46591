"""Meshing: tetrahedra of any closed surface, and the grid of a unit's wall.

`WallGrid` places the elements of a unit's wall; `mesh_surface` fills any closed surface (pytetwild). A `Mesh`
is plain arrays: nodes, tetrahedra of order 1 or 2, the region of each, and the surfaces that loads act on.

    >>> from mu_addon.meshing import MeshSettings
    >>> MeshSettings(refine=0.5).fraction
    'half'
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .gmsh_model import GmshUnavailable
    from .mesh import LATTICE, MEMBRANE, Mesh, mirror
    from .quality import Quality, mesh_quality
    from .settings import MeshSettings
    from .surface import mesh_surface
    from .wall_and_cavity import WallGrid
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
