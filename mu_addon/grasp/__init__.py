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
    from .hand import Grasp as Grasp
    from .hand import Lift as Lift
    from .hand import grasp as grasp
    from .phases import MEANING as MEANING
    from .phases import NAMES as NAMES
    from .phases import Phases as Phases
    from .phases import read_phases as read_phases
    from .phases import shipped_phases as shipped_phases
    from .settings import Contact as Contact
    from .settings import Cube as Cube
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
