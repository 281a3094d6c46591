"""Expected duration of a tree's run: a stage for each node that starts a run, with its seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from ..errors import MuError
from ..graph.evaluation import WAITING, Order, State
from ..graph.tree import NodeTree
from ..graph.tree_file import STATES
from ..reading import file_text, is_number, parse_json
from ..run.progress_estimate import Plan
from .definitions import definitions

SECONDS = {
    "simulate": 110.0,
    "place": 320.0,
    "homogenize": 120.0,
    "grip": 900.0,
    "solid": 10.0,
    "sweep": 600.0,
    "calibrate": 2.0,
    "measure": 1.0,
}
"""Expected seconds of a kind of node on two cores, if it never ran in the folder and has no plan."""
OTHER_S = 30.0


def plan_of(
    tree: NodeTree,
    states: Mapping[str, State],
    wanted: Iterable[str],
    folder: Path,
    order_of: Callable[[str], Order | None] = lambda name: None,
) -> Plan:
    """Nodes still to be run, in order, with the seconds of each.

    states: of the tree's latest refresh; wanted: requested nodes, all if empty; folder: of the tree's runs,
    with each node's seconds; order_of: order of a node if known, for its plan.
    """
    order, _ = tree.ordered()
    needed = tree.upstream(tuple(wanted) or tree.nodes)
    taken = _taken(folder)
    return [
        (
            name,
            taken.get(name) or _planned(order_of, name) or SECONDS.get(tree.nodes[name].kind, OTHER_S),
        )
        for name in order
        if name in needed and name in states and states[name].state == WAITING and _runs(tree, name)
    ]


def _runs(tree: NodeTree, name: str) -> bool:
    node = tree.nodes[name]
    return definitions()[node.kind].runs and not node.muted


def _planned(order_of: Callable[[str], Order | None], name: str) -> float:
    """Seconds of the stages that a node's job plans, 0 where none are known."""
    with suppress(MuError):
        order = order_of(name)
        if order is not None:
            job = order.study
            return sum(job.expected().values()) + (job.report_s if job.page else 0.0)
    return 0.0


def _taken(folder: Path) -> dict[str, float]:
    """Seconds of the nodes when they were last computed in a folder, by name."""
    path = folder / STATES
    try:
        nodes = parse_json(file_text(path), str(path))["nodes"]
        return {name: float(n["cost_s"]) for name, n in nodes.items() if is_number(n.get("cost_s"))}
    except (OSError, MuError, KeyError, TypeError, ValueError, AttributeError):
        return {}
