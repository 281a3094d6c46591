"""Placement: where to thread the waveguide so that it disturbs the unit least.

`candidate_paths` run through the anchors; `centreline_deviation` compares backbones with and without a sensor
(Algorithm 1 of the paper); `rank` orders paths by their mean deviation J_hat. `searching` looks for
paths in the whole lattice, a `lattice_graph`, guided by the adjoint `influence_map`.

    >>> from mu_addon.placement import rank
    >>> rank([0.3, 0.1, 0.2]).tolist()
    [3, 1, 2]
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .candidates import Candidate, candidate_paths
    from .deviation import Deviation, centreline, centreline_deviation, rank
    from .graph import Graph, Limits, lattice_graph
    from .response import Response
    from .search import Search, searching
    from .sensitivity_map import Influence, deviation_map, influence_map
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
