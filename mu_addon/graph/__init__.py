"""Node trees: nodes, trees and their files, faults, and evaluation.

This package is independent of units and simulations: `nodes` defines the nodes.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .check import Fault, faults
    from .definition import Call, Definition, Input, Output, Setting
    from .evaluation import CACHED, COMPUTED, FAILED, MADE, Evaluation, Kept, Order, State
    from .tree import Node, NodeTree, Source
    from .tree_file import parse_tree, read_tree, tree_text
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
