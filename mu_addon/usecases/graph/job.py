"""Inputs of an evaluation of a node tree: the tree, and which of its nodes."""

from __future__ import annotations

import re
from pathlib import Path

import attrs

from ...errors import InputError
from ...graph.check import faults
from ...graph.runs import FOLDER
from ...graph.tree import NodeTree, with_absolute_paths
from ...graph.tree_file import HEADER, read_tree, tree_of, tree_text
from ...run.folder import FolderLayout
from ...toml_reader import read_toml
from .definitions import definitions

NAME, STATES, REPORT = "graph.toml", "nodes.json", "report.html"
LAYOUT = FolderLayout(NAME, HEADER, results=(STATES, REPORT, "compare-*.csv"))
"""Folders of the nodes' runs do not count as results, as their inputs' hashes name them."""
NODES = FOLDER


@attrs.frozen
class Job:
    """A tree to evaluate. wanted: names of nodes, all ends if empty; node_reports: of every run."""

    tree: NodeTree
    wanted: tuple[str, ...] = ()
    node_reports: bool = False

    def __attrs_post_init__(self) -> None:
        for name in self.wanted:
            if name not in self.tree.nodes:
                known = ", ".join(self.tree.nodes)
                raise InputError(f"there is no node {name!r}", self.tree.name, f"choose from {known}")

    def require_sound(self) -> None:
        """Raise InputError for the first fault of a node to be evaluated."""
        needed = self.tree.upstream(self.wanted or self.tree.nodes)
        found = [fault for fault in faults(self.tree, definitions()) if fault.node in needed]
        if found:
            error = found[0].error()
            more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
            raise InputError(error.what + more, error.where, error.remedy)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; graph.toml is the only one."""
        run = {"wanted": list(self.wanted)} if self.wanted else {}
        reports = {"node_reports": True} if self.node_reports else {}
        return {NAME: tree_text(self.tree, {**run, **reports})}


def file_name(node: str) -> str:
    """A node's name as part of a file's: letters, digits, dots, hyphens and underscores."""
    return re.sub(r"[^\w.-]+", "_", node)


def job_of_file(path: Path, wanted: tuple[str, ...] = (), node_reports: bool = False) -> Job:
    """The job of a tree's file, with file names relative to its folder; raises InputError."""
    tree = with_absolute_paths(read_tree(path), definitions(), path.absolute().parent)
    return Job(tree, wanted, node_reports)


def read_job(folder: Path) -> Job:
    """The job that a folder of `graph` describes; raises InputError."""
    path = folder / NAME
    document = read_toml(path)
    run = document.inner("run")
    tree = with_absolute_paths(tree_of(document), definitions(), folder.absolute())
    return Job(tree, run.words("wanted"), run.take("node_reports", bool, False))
