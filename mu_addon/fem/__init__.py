"""Finite elements: quasi-static equilibria of soft bodies under pressure, weight and contact.

A `Model` is a discretised body, `Materials` are its laws, and `Equilibrium` finds its states by Newton's
method: `simulate` along a pressure protocol, `simulate_in_time` where a law or friction remembers,
`bending_angle_deg` and `probe` read results off a deformed mesh. Units: mm, N, MPa, s; kPa and degrees only
with these units in the name.

    >>> from mu_addon.fem import NeoHooke
    >>> NeoHooke.parameter_names
    ('mu_MPa', 'kappa_MPa')
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .bending_angle import TipSection, bending_angle_deg
    from .dead_loads import gravity, traction
    from .embedding import Embedding, Probe, embed
    from .equilibrium import Equilibrium
    from .kinematics import probe
    from .lattice_law import LatticeLaw
    from .laws import Foam, Friction, Law, Layered, MooneyRivlin, NeoHooke, Ogden, OgdenRoxburgh, Prony, Yeoh
    from .materials import Layer, Materials
    from .model import Model
    from .newton_settings import NewtonSettings
    from .obstacle import Obstacle, ObstacleContact
    from .protocol import Protocol, read_protocol
    from .rigid import Box, Plane, Pose, Sphere
    from .self_intersection import crossings, first_self_intersection
    from .state import State, rest
    from .stress import cauchy, von_mises
    from .time_stepping import Instant, simulate_in_time
    from .trajectory import Trajectory, simulate
    from .unit_materials import materials_of
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
