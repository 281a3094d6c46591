"""The grasp of a cube by a gripper of two units: its phases, contact with friction, and the lift.

`grasp` closes a finger on a `Cube` along the pressures of `Phases`; a `Grasp` is what was found at each
instant.

    >>> from mu_addon.grasp import Cube
    >>> round(Cube(10.0).mass_g, 2)
    1.24
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .hand import Grasp, Lift, grasp
    from .phases import MEANING, NAMES, Phases, read_phases, shipped_phases
    from .settings import Contact, Cube
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
