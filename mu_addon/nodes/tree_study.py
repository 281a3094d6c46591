"""`graph`: a node tree, of which only the requested nodes are computed, and of these only uncached ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs

from .. import graph as trees
from ..design.quantity import described
from ..errors import InputError, MuError
from ..files import json_text
from ..graph.tree import NodeTree, with_absolute_paths
from ..graph.tree_file import FORMAT, HEADER, STATES, file_name, tree_keys, tree_of_keys
from ..run.context import RunContext
from ..run.parts import Fact, Fault, File, Part, Sentence, Table, Warn, echo, recorded
from ..run.progress import spell
from ..run.study import Found, Input, Study, Written, given, section, setting
from ..studies.inputs import WordsInput, asked


@attrs.frozen
class TreeInput(Input):
    """A node tree."""

    kind: str = "tree"

    def write(self, name: str, value: NodeTree) -> Written:
        """Its name and nodes."""
        return Written(tree_keys(value))

    def read(self, name: str, found: Found) -> NodeTree:
        """The tree of the file, with names of files relative to its folder; raises InputError."""
        from .definitions import definitions

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
    wanted: tuple[str, ...] = asked(
        WordsInput,
        "node",
        "evaluate this node and those that it needs; repeat the option for more (default: all nodes)",
        empty=(),
        many=False,
        repeated=True,
        decides=False,
        metavar="NAME",
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
        from .definitions import definitions

        needed = self.tree.upstream(self.wanted or self.tree.nodes)
        found = [fault for fault in trees.faults(self.tree, definitions()) if fault.node in needed]
        if found:
            error = found[0].error()
            more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
            raise InputError(error.what + more, error.where, error.remedy)

    def work(self, folder: Path, context: RunContext) -> trees.Evaluation:
        """Evaluate the tree; the work of its nodes is that of studies in folders of their own.

        A node that fails does not keep others from being evaluated. Raises InputError for a tree with a
        fault, and at the end the first error of a node.
        """
        from ..graph.records import read_records, write_records
        from ..report.study_report import write_page
        from ..run.shown import Shown
        from .definitions import definitions
        from .plan import plan_of
        from .runs import FolderRuns, Stopped

        self.require_sound()
        runs = FolderRuns(folder, context.progress, self.node_reports)
        found = trees.Evaluation(self.tree, definitions(), runs)
        records, shown = read_records(folder), Shown(self, folder, context)

        def show() -> None:
            shown.put([(one, shown.made(one.method(self, found))) for one in self.sections()])

        def report(name: str, state: trees.State) -> None:
            if state.state in trees.MADE and name in found.outputs:
                records.pop(state.key, None)
                records[state.key] = state
                write_records(folder, records)
            show()

        # What is known without a run says which nodes need one.
        refreshed = trees.Evaluation(self.tree, definitions(), records=records)
        known = refreshed.run(self.wanted)
        context.progress.plan(plan_of(self.tree, known, self.wanted, folder, refreshed.order))
        found.report = report
        context.report = lambda stopped: write_page(shown, stopped)
        context.console_summary = lambda summary: shown.lines
        try:
            found.run(self.wanted)
        except Stopped as stopped:
            raise stopped.error from stopped
        finally:
            show()
        if shown.fault is not None:
            raise shown.fault
        return found

    def heading(self) -> tuple[str, str]:
        """Title of the report."""
        return f"Node tree {self.tree.name}", ""

    @section()
    def answer(self, found: trees.Evaluation) -> Iterator[Part]:
        """How many nodes are evaluated, and the errors of those that failed."""
        states = found.states
        yield Fact("nodes evaluated", "", f"{len(states)} of {len(self.tree.nodes)}")
        for name in (trees.COMPUTED, trees.CACHED, trees.FAILED):
            count = sum(state.state == name for state in states.values())
            yield Fact(name, count, str(count), name)
        yield Fact("time", "", spell(sum(state.seconds for state in states.values())))
        failed = {name: state.error for name, state in states.items() if state.error is not None}
        for name, e in failed.items():
            yield Warn(f"{name}: {e.what}", e.where, e.remedy, repeated=False)
            yield Sentence(f"{name}: {e}", note=True)
        if failed:
            name, first = next(iter(failed.items()))
            more = f" (and {len(failed) - 1} more nodes)" if len(failed) > 1 else ""
            error = MuError(first.what + more, f"node {name!r}: {first.where}".rstrip(": "), first.remedy)
            error.status = first.status
            yield Fault(error)

    @section("compare", "Side by side")
    def compared(self, found: trees.Evaluation) -> Iterator[Part]:
        """Every comparison of the tree."""
        from .comparison import Comparison

        for name, outputs in found.outputs.items():
            for value in outputs.values():
                if isinstance(value, Comparison):
                    yield Sentence(name, heading=True)
                    yield from value.parts(f"compare-{file_name(name)}.csv")

    @section("nodes", "Nodes")
    def listed(self, found: trees.Evaluation) -> Iterator[Part]:
        """Every node's state, its seconds and its result."""
        from .definitions import definitions

        plain = {name: self._plain(name, state) for name, state in found.states.items()}
        yield recorded("nodes", plain)
        yield File(STATES, lambda path: json_text({"format": 1, "nodes": plain}))
        width = max(map(len, plain), default=0)
        rows = []
        for name, n in plain.items():
            remark = n.get("remark", "")
            yield from echo(f"{name:<{width}}  {n['state']:<8}  {n['seconds']:8.3f} s  {remark}".rstrip())
            label = definitions()[n["kind"]].label if n["kind"] in definitions() else n["kind"]
            words = "FAILED" if n["state"] == trees.FAILED else n["state"]
            rows.append([name, label, words, f"{n['seconds']:.3f}", remark, n.get("folder", "")])
        head = ["node", "kind", "state", ("seconds", "n"), "found", "folder"]
        yield Table("", head, rows)

    def _plain(self, name: str, state: trees.State) -> dict[str, Any]:
        """A node's state for nodes.json and summary.json."""
        e, folder = state.error, state.folder
        more = {
            "remark": state.remark,
            "folder": folder and f"{folder.parent.name}/{folder.name}",
            "because": state.because,
            "error": e and {"what": e.what, "where": e.where, "what_to_do": e.remedy},
        }
        return {
            "kind": self.tree.nodes[name].kind,
            "state": state.state,
            "seconds": round(state.seconds, 4),
            "cost_s": round(state.cost_s, 4),
            "key": state.key,
            **{key: value for key, value in more.items() if value},
        }
