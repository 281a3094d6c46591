"""The printed body as a finite-element mesh, strut by strut.

`mesh_printed` meshes struts and wall separately and ties them where they meet. See
docs/engineering/method.md.

    >>> from mu_addon.body import strut_mesh
    >>> from mu_addon.design import load_preset
    >>> len(strut_mesh(load_preset("mu-1.0x").printed, rings=1, layers=5).tets)
    90
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .candidates import PrintedWaveguides
    from .printed_mesh import mesh_printed
    from .strut import strut_mesh
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
