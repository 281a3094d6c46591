"""`graph`: evaluates the requested nodes and computes only those that are not cached."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MuError
from ..files import write_json
from ..graph.evaluation import CACHED, COMPUTED, FAILED, MADE, Evaluation, State
from ..graph.records import read_records, record_of, write_records
from ..graph.tree_file import STATES, file_name
from ..run.context import RunContext
from .comparison import Comparison, write_comparison
from .definitions import definitions
from .plan import plan_of
from .report import write_report
from .runs import FolderRuns, Stopped

if TYPE_CHECKING:
    from ..studies.graph import Graph


def evaluate(job: Graph, folder: Path, context: RunContext) -> Evaluation:
    """Evaluate a tree; writes nodes.json, compare-NODE.csv and report.html.

    A node that fails does not keep others from being evaluated. Raises InputError for a tree with a fault,
    and at the end the first error of a node.
    """
    job.require_sound()
    context.console_summary = console_summary
    runs = FolderRuns(folder, context.progress, job.node_reports)
    found = Evaluation(job.tree, definitions(), runs)
    records = read_records(folder)

    def report(name: str, state: State) -> None:
        write_json(folder / STATES, {"format": 1, "nodes": states_as_plain(found)})
        if state.state in MADE and name in found.outputs:
            records.pop(state.key, None)
            definition = definitions()[job.tree.nodes[name].kind]
            records[state.key] = record_of(definition, found.outputs[name], state)
            write_records(folder, records)
        if state.state == FAILED and state.error is not None:
            context.progress.warning(f"{name}: {state.error.what}", state.error.where, state.error.remedy)

    # What is known without a run says which nodes need one.
    refreshed = Evaluation(job.tree, definitions(), records=records)
    known = refreshed.run(job.wanted)
    context.progress.plan(plan_of(job.tree, known, job.wanted, folder, refreshed.order))
    found.report = report
    context.report = lambda stopped: write_report(found, folder, context, stopped)
    try:
        found.run(job.wanted)
    except Stopped as stopped:
        raise stopped.error from stopped
    finally:
        context.summary |= summary(found)
    for name, outputs in found.outputs.items():
        for value in outputs.values():
            if isinstance(value, Comparison):
                write_comparison(value, folder / f"compare-{file_name(name)}.csv")
    failed = [(name, s.error) for name, s in found.states.items() if s.state == FAILED and s.error]
    if failed:
        name, first = failed[0]
        more = f" (and {len(failed) - 1} more nodes)" if len(failed) > 1 else ""
        error = MuError(first.what + more, f"node {name!r}: {first.where}".rstrip(": "), first.remedy)
        error.status = first.status
        raise error
    return found


def states_as_plain(found: Evaluation) -> dict[str, Any]:
    """Every node's state for nodes.json and summary.json."""
    plain: dict[str, Any] = {}
    for name, state in found.states.items():
        table: dict[str, Any] = {
            "kind": found.tree.nodes[name].kind,
            "state": state.state,
            "seconds": round(state.seconds, 4),
            "cost_s": round(state.cost_s, 4),
            "key": state.key,
        }
        if state.remark:
            table["remark"] = state.remark
        if state.folder is not None:
            table["folder"] = f"{state.folder.parent.name}/{state.folder.name}"
        if state.because:
            table["because"] = state.because
        if state.error is not None:
            e = state.error
            table["error"] = {"what": e.what, "where": e.where, "what_to_do": e.remedy}
        plain[name] = table
    return plain


def summary(found: Evaluation) -> dict[str, Any]:
    """Every node's state, and how many were computed and cached."""
    states = [state.state for state in found.states.values()]
    return {
        "nodes": states_as_plain(found),
        "computed": states.count(COMPUTED),
        "cached": states.count(CACHED),
        "failed": states.count(FAILED),
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """A line for each node: its state, its seconds, its result."""
    nodes = summary.get("nodes", {})
    width = max(map(len, nodes), default=0)
    return [
        f"{name:<{width}}  {n['state']:<8}  {n['seconds']:8.3f} s  {n.get('remark', '')}".rstrip()
        for name, n in nodes.items()
    ]
