"""Optimization: targets and freedoms of a design, gradients by adjoints, and the search for units that meet
them.

`gradients` differentiates quantities of a body in equilibrium by any number of freedoms; `evaluate` does so
for a unit; `search_units` proposes units by a surrogate that interpolates values and slopes.

    >>> from mu_addon.optimization import Freedom
    >>> Freedom("chambers.wall_mm", 0.6, 1.4).at(0.5)
    1.0
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .design_file import Design as Design
    from .design_file import read_design as read_design
    from .evaluation import Evaluated as Evaluated
    from .evaluation import evaluate as evaluate
    from .freedoms import Freedom as Freedom
    from .freedoms import changed_unit as changed_unit
    from .gradient import gradients as gradients
    from .quantities import Angle as Angle
    from .quantities import RestStiffness as RestStiffness
    from .quantities import Stretch as Stretch
    from .robust_search import unit_search as unit_search
    from .robustness import Verified as Verified
    from .robustness import verified as verified
    from .search import Found as Found
    from .search import Observed as Observed
    from .structure import Condition as Condition
    from .structure import Structure as Structure
    from .structure import solve as solve
    from .targets import Target as Target
    from .unit_body import Mechanics as Mechanics
    from .unit_body import UnitBody as UnitBody
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
