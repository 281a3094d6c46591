"""Units in series: each reduced to an elastic joint that its pressure drives, and their chain in equilibrium.

`learn` makes a `Joint` of a unit from its finite element model; `Chain` finds equilibria of several under
pressures, weight and a load at the tip, `reach_point` the pressures that bring the tip to a point. Units: mm,
N, g, kPa.

    >>> from mu_addon.chain import Loads
    >>> Loads(tip_mass_g=20.0).times(0.5).tip_mass_g
    20.0
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .chain import Chain, ChainState, Link, Loads
    from .inverse import Reach, reach_point
    from .joint import Joint
    from .joint_learning import Learned, Sampling, learn
    from .motion import Motion, move
    from .pressures import Pressures, read_pressures
    from .shape import Shape
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
