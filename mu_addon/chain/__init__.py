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
    from .chain import Chain as Chain
    from .chain import ChainState as ChainState
    from .chain import Link as Link
    from .chain import Loads as Loads
    from .inverse import Reach as Reach
    from .inverse import reach_point as reach_point
    from .joint import Joint as Joint
    from .joint_learning import Learned as Learned
    from .joint_learning import Sampling as Sampling
    from .joint_learning import learn as learn
    from .motion import Motion as Motion
    from .motion import move as move
    from .pressures import Pressures as Pressures
    from .pressures import read_pressures as read_pressures
    from .shape import Shape as Shape
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
