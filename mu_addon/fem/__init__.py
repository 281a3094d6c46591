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
    from .bending_angle import TipSection as TipSection
    from .bending_angle import bending_angle_deg as bending_angle_deg
    from .dead_loads import gravity as gravity
    from .dead_loads import traction as traction
    from .embedding import Embedding as Embedding
    from .embedding import Probe as Probe
    from .embedding import embed as embed
    from .equilibrium import Equilibrium as Equilibrium
    from .kinematics import probe as probe
    from .lattice_law import LatticeLaw as LatticeLaw
    from .laws import Foam as Foam
    from .laws import Friction as Friction
    from .laws import Law as Law
    from .laws import Layered as Layered
    from .laws import MooneyRivlin as MooneyRivlin
    from .laws import NeoHooke as NeoHooke
    from .laws import Ogden as Ogden
    from .laws import OgdenRoxburgh as OgdenRoxburgh
    from .laws import Prony as Prony
    from .laws import Yeoh as Yeoh
    from .materials import Layer as Layer
    from .materials import Materials as Materials
    from .model import Model as Model
    from .newton_settings import NewtonSettings as NewtonSettings
    from .obstacle import Obstacle as Obstacle
    from .obstacle import ObstacleContact as ObstacleContact
    from .protocol import Protocol as Protocol
    from .protocol import read_protocol as read_protocol
    from .rigid import Box as Box
    from .rigid import Plane as Plane
    from .rigid import Pose as Pose
    from .rigid import Sphere as Sphere
    from .self_intersection import crossings as crossings
    from .self_intersection import first_self_intersection as first_self_intersection
    from .state import State as State
    from .state import rest as rest
    from .stress import cauchy as cauchy
    from .stress import von_mises as von_mises
    from .time_stepping import Instant as Instant
    from .time_stepping import simulate_in_time as simulate_in_time
    from .trajectory import Trajectory as Trajectory
    from .trajectory import simulate as simulate
    from .unit_materials import materials_of as materials_of
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
