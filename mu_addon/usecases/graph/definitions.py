"""Every kind of node by name, in the order in which menus list them."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

from ...graph.definition import Definition, Definitions
from .bench_nodes import bench_nodes
from .design_nodes import design_nodes
from .evidence_nodes import evidence_nodes
from .study_nodes import study_nodes
from .sweep_nodes import sweep_nodes


@cache
def definitions() -> Definitions:
    """Definitions of all kinds of nodes; made once."""
    found: dict[str, Definition] = {}
    for definition in (*design_nodes(), *study_nodes(), *sweep_nodes(), *evidence_nodes(), *bench_nodes()):
        found[definition.kind] = definition
    return MappingProxyType(found)
