"""Expected duration of a tree's run: a stage for each node that starts a run, with its seconds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from ...graph.evaluation import WAITING, State
from ...graph.tree import NodeTree
from ...reading import file_text, is_number, parse_json
from ...run.progress_estimate import Plan
from ...usecases.graph.definitions import definitions
from ...usecases.graph.job import STATES
from ..shared.file_cache import UNREADABLE

SECONDS = {
    "simulate": 110.0,
    "place": 320.0,
    "homogenize": 120.0,
    "grip": 900.0,
    "diagnose": 120.0,
    "solid": 10.0,
    "sweep": 600.0,
    "calibrate": 2.0,
    "measure": 1.0,
}
"""Expected seconds of a kind of node on two cores, if it never ran in the tree's folder."""
OTHER_S = 30.0


def plan_of(tree: NodeTree, states: Mapping[str, State], wanted: Iterable[str], folder: Path) -> Plan:
    """Nodes still to be run, in order, with the seconds of each.

    states: of the tree's latest refresh; wanted: nodes asked for, all if empty; folder: of the tree's runs,
    whose last evaluation has each node's seconds.
    """
    order, _ = tree.ordered()
    needed = tree.upstream(tuple(wanted) or tree.nodes)
    taken = _taken(folder)
    return [
        (name, taken.get(name) or SECONDS.get(tree.nodes[name].kind, OTHER_S))
        for name in order
        if name in needed and name in states and states[name].state == WAITING and _runs(tree, name)
    ]


def _runs(tree: NodeTree, name: str) -> bool:
    node = tree.nodes[name]
    return definitions()[node.kind].runs and not node.muted


def _taken(folder: Path) -> dict[str, float]:
    """Seconds of the nodes when they were last computed in a folder, by name."""
    path = folder / STATES
    try:
        nodes = parse_json(file_text(path), str(path))["nodes"]
        return {name: float(n["cost_s"]) for name, n in nodes.items() if is_number(n.get("cost_s"))}
    except (*UNREADABLE, AttributeError):
        return {}
