"""Placement: where to thread the waveguide so that it disturbs the unit least.

`candidate_paths` are the paths through the anchors; `evaluation` compares backbones with and without a sensor
(Algorithm 1 of the paper); `rank` orders paths by their mean deviation J_hat. `lattice_graph` and
`search_paths` look for paths in the whole lattice, guided by the adjoint `influence_map`.

    >>> from mu_addon.placement import rank
    >>> rank([0.3, 0.1, 0.2]).tolist()
    [3, 1, 2]
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .candidates import Candidate as Candidate
    from .candidates import Evaluation as Evaluation
    from .candidates import candidate_paths as candidate_paths
    from .candidates import evaluation as evaluation
    from .deviation import Deviation as Deviation
    from .deviation import centreline as centreline
    from .deviation import centreline_deviation as centreline_deviation
    from .deviation import rank as rank
    from .graph import Graph as Graph
    from .graph import Limits as Limits
    from .graph import lattice_graph as lattice_graph
    from .response import Response as Response
    from .search import Search as Search
    from .search import SearchSettings as SearchSettings
    from .search import search_paths as search_paths
    from .sensitivity_map import Influence as Influence
    from .sensitivity_map import deviation_map as deviation_map
    from .sensitivity_map import influence_map as influence_map
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
