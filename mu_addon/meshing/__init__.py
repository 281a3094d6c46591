"""Geometry to labelled tetrahedra."""

from .mesh import LATTICE, MEMBRANE, Mesh, mirror
from .quality import Quality, quality
from .settings import MeshSettings
from .surface import VOID, Surface, mesh_surface
from .unit import MeshingWarning, mesh_unit

__all__ = [
    "LATTICE",
    "MEMBRANE",
    "VOID",
    "Mesh",
    "MeshSettings",
    "MeshingWarning",
    "Quality",
    "Surface",
    "mesh_surface",
    "mesh_unit",
    "mirror",
    "quality",
]
