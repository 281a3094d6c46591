"""`graph`: a node tree, of which only the requested nodes are computed, and of these only uncached ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs

from ..design.quantity import described
from ..errors import InputError
from ..graph.check import faults
from ..graph.tree import NodeTree, with_absolute_paths
from ..graph.tree_file import FORMAT, HEADER, STATES, tree_keys, tree_of_keys
from ..run.context import RunContext
from ..run.study import Found, Input, Study, Written, given, setting
from .inputs import WordsInput


@attrs.frozen
class TreeInput(Input):
    """A node tree."""

    kind: str = "tree"

    def write(self, name: str, value: NodeTree) -> Written:
        """Its name and nodes."""
        return Written(tree_keys(value))

    def read(self, name: str, found: Found) -> NodeTree:
        """The tree of the file, with names of files relative to its folder; raises InputError."""
        from ..nodes.definitions import definitions

        tree = tree_of_keys(found.table)
        found.keys.clear()
        return with_absolute_paths(tree, definitions(), found.path.absolute().parent)


@attrs.frozen(kw_only=True, eq=False)
class Graph(Study):
    """Evaluate a node tree: units by their steps, simulations, rankings, prints, data and their comparison.
    Only nodes without a result in DIR are computed.
    """

    name = "graph"
    version = FORMAT
    header = HEADER
    example = "graph assets/graphs/three-walls.toml --out out/walls"
    from_file = (
        "Node tree, a TOML file as Blender's node editor writes it.",
        "give the TOML file of a node tree",
    )
    streams = True
    # Folders of the nodes' runs do not count as results, as their inputs' hashes name them.
    files = {STATES: "state of every node", "compare-*.csv": "comparisons"}

    tree: NodeTree = given(TreeInput())
    wanted: tuple[str, ...] = given(
        WordsInput(
            descriptions=(
                described(
                    "node",
                    "",
                    "evaluate this node and those that it needs; repeat the option for more (default: all "
                    "nodes)",
                ),
            ),
            many=False,
            repeated=True,
            decides=False,
            metavar="NAME",
        ),
        default=(),
    )
    node_reports: bool = setting(
        described("node_reports", False, "also write the full report of every run within the tree"),
        decides=False,
    )

    def __attrs_post_init__(self) -> None:
        for name in self.wanted:
            if name not in self.tree.nodes:
                known = ", ".join(self.tree.nodes)
                raise InputError(f"there is no node {name!r}", self.tree.name, f"choose from {known}")

    def require_sound(self) -> None:
        """Raise InputError for the first fault of a node to be evaluated."""
        from ..nodes.definitions import definitions

        needed = self.tree.upstream(self.wanted or self.tree.nodes)
        found = [fault for fault in faults(self.tree, definitions()) if fault.node in needed]
        if found:
            error = found[0].error()
            more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
            raise InputError(error.what + more, error.where, error.remedy)

    def work(self, folder: Path, context: RunContext) -> Any:
        """Evaluate the tree; the work of its nodes is that of studies in folders of their own."""
        from ..nodes.run import evaluate

        return evaluate(self, folder, context)
