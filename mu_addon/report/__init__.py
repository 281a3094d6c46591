"""Parts of reports: HTML, charts, pictures of meshes, VTK and point-cache files."""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .html_parts import page as page
    from .html_parts import table as table
    from .pc2 import read_pc2 as read_pc2
    from .pc2 import write_pc2 as write_pc2
    from .render import Camera as Camera
    from .render import Part as Part
    from .render import png as png
    from .vtk import write_mesh as write_mesh
    from .vtk import write_trajectory as write_trajectory
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
