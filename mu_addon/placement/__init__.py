"""Placement: where to thread the waveguide so that it disturbs the unit least.

`candidate_paths` are the paths through the anchors; `evaluate` solves one as a stiff inclusion and compares
backbones (Algorithm 1 of the paper), `CandidateBatch` many of them with one factorisation; `rank` orders
them by their mean deviation J_hat. `lattice_graph` and `search_paths` look for paths in the whole lattice,
guided by the adjoint `influence_map`.

    >>> from mu_addon.placement import rank
    >>> rank([0.3, 0.1, 0.2]).tolist()
    [3, 1, 2]
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .batch import CandidateBatch as CandidateBatch
    from .candidates import Candidate as Candidate
    from .candidates import Evaluation as Evaluation
    from .candidates import candidate_paths as candidate_paths
    from .candidates import evaluate as evaluate
    from .candidates import with_sensor as with_sensor
    from .deviation import Deviation as Deviation
    from .deviation import centreline as centreline
    from .deviation import centreline_deviation as centreline_deviation
    from .deviation import rank as rank
    from .graph import Graph as Graph
    from .graph import Limits as Limits
    from .graph import lattice_graph as lattice_graph
    from .inclusion import Inclusion as Inclusion
    from .inclusion import straight_inclusion as straight_inclusion
    from .polyline import polyline_inclusion as polyline_inclusion
    from .response import Response as Response
    from .response import reduced_response as reduced_response
    from .search import Search as Search
    from .search import SearchSettings as SearchSettings
    from .search import search_paths as search_paths
    from .sensitivity_map import Influence as Influence
    from .sensitivity_map import deviation_map as deviation_map
    from .sensitivity_map import influence_map as influence_map
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
