"""Optimization: targets and freedoms of a design, gradients by adjoints, and the search for units that meet
them.

`gradients` differentiates quantities of a body in equilibrium by any number of freedoms; `evaluate` does so
for a unit; `unit_search` proposes units by a surrogate that interpolates values and slopes.

    >>> from mu_addon.optimization import Freedom
    >>> Freedom("chambers.wall_mm", 0.6, 1.4).at(0.5)
    1.0
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .design_file import Design, read_design
    from .evaluation import Evaluated, evaluate
    from .freedoms import Freedom, changed_unit
    from .gradient import gradients
    from .quantities import Angle, RestStiffness, Stretch
    from .robust_search import unit_search
    from .robustness import Verified, verified
    from .search import Found, Observed
    from .structure import Condition, Structure, solve
    from .targets import Target
    from .unit_body import Mechanics, UnitBody
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
