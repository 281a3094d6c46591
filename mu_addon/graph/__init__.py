"""Node trees: nodes, trees and their files, faults, and evaluation.

This package is independent of units and simulations: `nodes` defines the nodes.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .check import Fault as Fault
    from .check import faults as faults
    from .definition import Call as Call
    from .definition import Definition as Definition
    from .definition import Input as Input
    from .definition import Output as Output
    from .definition import Setting as Setting
    from .evaluation import CACHED as CACHED
    from .evaluation import COMPUTED as COMPUTED
    from .evaluation import FAILED as FAILED
    from .evaluation import MADE as MADE
    from .evaluation import Evaluation as Evaluation
    from .evaluation import Kept as Kept
    from .evaluation import Order as Order
    from .evaluation import State as State
    from .tree import Node as Node
    from .tree import NodeTree as NodeTree
    from .tree import Source as Source
    from .tree_file import parse_tree as parse_tree
    from .tree_file import read_tree as read_tree
    from .tree_file import tree_text as tree_text
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
