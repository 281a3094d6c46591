"""Every kind of node by name, in the order in which menus list them."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

from ..graph.definition import Definition, Definitions
from ..studies import STUDIES, study
from .bench_nodes import bench_nodes
from .design_nodes import design_nodes
from .evidence_nodes import evidence_nodes
from .studies import node_of
from .study_nodes import study_nodes
from .sweep_nodes import sweep_nodes


@cache
def definitions() -> Definitions:
    """Definitions of all kinds of nodes; made once."""
    found: dict[str, Definition] = {}
    for made in (design_nodes, study_nodes, sweep_nodes, evidence_nodes, bench_nodes):
        found |= {definition.kind: definition for definition in made()}
    found |= {name: node_of(name) for name in STUDIES if name not in found and study(name).node_of(name)}
    return MappingProxyType(found)
