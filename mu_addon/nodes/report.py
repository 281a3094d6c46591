"""The report of a node tree: its nodes, their seconds, and the comparisons."""

from __future__ import annotations

from pathlib import Path

from ..files import write_text
from ..graph.evaluation import CACHED, COMPUTED, FAILED, Evaluation
from ..report.html_parts import cards, facts_table, note, page, table
from ..run.context import RunContext
from ..run.progress import spell
from ..run.versions import package_versions
from .comparison import Comparison, comparison_html
from .definitions import definitions


def write_report(found: Evaluation, folder: Path, context: RunContext, stopped: str = "") -> None:
    """Write report.html; raises OutputError."""
    with context.progress.stage("report", expected_s=2.0):
        write_text(folder / "report.html", report(found, stopped))


def report(found: Evaluation, stopped: str = "") -> str:
    """The report as one page of HTML."""
    states = list(found.states.values())
    count = {name: sum(s.state == name for s in states) for name in (COMPUTED, CACHED, FAILED)}
    facts = [("nodes", str(len(found.tree.nodes))), *((name, str(n)) for name, n in count.items())]
    facts.append(("time", spell(sum(s.seconds for s in states))))
    remarks = [f"Stopped: {stopped}"] if stopped else []
    remarks += [f"{name}: {s.error}" for name, s in found.states.items() if s.error is not None]
    sections = [
        (f"compare-{i}", name, comparison_html(value))
        for i, (name, outputs) in enumerate(found.outputs.items())
        for value in outputs.values()
        if isinstance(value, Comparison)
    ]
    return page(
        f"Node tree {found.tree.name}",
        f"{len(states)} of {len(found.tree.nodes)} nodes evaluated",
        note(remarks),
        cards(facts),
        [
            *sections,
            ("nodes", "Nodes", _nodes(found)),
            ("versions", "Versions", facts_table("package", "version", package_versions())),
        ],
    )


def _nodes(found: Evaluation) -> str:
    head = [("node", ""), ("kind", ""), ("state", ""), ("seconds", "n"), ("found", ""), ("folder", "")]
    rows = []
    for name, state in found.states.items():
        kind = found.tree.nodes[name].kind
        label = definitions()[kind].label if kind in definitions() else kind
        place = "" if state.folder is None else f"{state.folder.parent.name}/{state.folder.name}"
        words = "FAILED" if state.state == FAILED else state.state
        rows.append(([name, label, words, f"{state.seconds:.3f}", state.remark, place], False))
    return table("", head, rows)
