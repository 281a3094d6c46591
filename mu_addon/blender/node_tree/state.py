"""Values of the file's trees: a refresh after every change, and the run of a tree in a process.

A refresh computes parameters and the steps' geometry, in milliseconds, and reads the rest from the records of
runs in the tree's folder.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import bpy

from ...errors import InputError, MuError
from ...graph.evaluation import FAILED, Evaluation, Kept, State
from ...graph.records import FOLDER, read_records
from ...graph.records import NAME as RECORDS
from ...graph.tree import Source
from ...graph.tree_file import file_name
from ...nodes.definitions import definitions
from ...nodes.plan import plan_of
from ...nodes.templates import steps_of
from ...nodes.tree_study import Graph
from ...studies.starting import write_study
from ..jobs.start_child import INTERVAL_S, JOB_ENDED, JobKind
from ..shared import landing, viewports
from ..shared.file_cache import FileCache
from ..shared.registration import RESTORED, at_end, connected, handler, timer
from ..simulate.study_folder import default_folder, relative
from ..unit import object as unit_object
from ..unit.properties import PARAMETERS_CHANGED, to_unit
from . import classes, conversion, following
from .classes import CHANGED, TREE

WAIT_S = 0.05
SCENE_KEY = "mu_node_trees"
"""Custom property of the scene that points to its trees: Blender evaluates drivers only of reachable data."""

_kept = Kept()
_records: FileCache[dict[str, State]] = FileCache()
_pending: set[int] = set()
_refreshed: dict[int, float] = {}
_written: dict[int, int] = {}
_states: dict[int, dict[str, State]] = {}
_designs: dict[int, dict[str, Any]] = {}
"""By tree: the units of its nodes, by name, as of the latest refresh."""


def trees() -> Iterator[Any]:
    """Our node trees in the file, without linked ones, which are evaluated in theirs."""
    return (g for g in bpy.data.node_groups if g.bl_idname == TREE and g.library is None)


def _is_group(tree: Any) -> bool:
    """Return True if a tree is a group's, for use in others."""
    return any(node.bl_idname in ("NodeGroupInput", "NodeGroupOutput") for node in tree.nodes)


def uuid_of(tree: Any) -> str:
    """Identifier of a tree; a copy is distinguished by its name."""
    return f"{_number(tree)}:{tree.name}"


def folder_of(tree: Any) -> Path:
    """Folder of a tree's runs: the one it names, else next to the .blend file, else the user's."""
    return default_folder(tree.mu_folder, tree.name, _number(tree))


def _number(tree: Any) -> str:
    """UUID of a tree, created on the first call that is not of a panel's drawing, which has none yet."""
    if not tree.mu_uuid:
        # Blender lets nothing be written while it draws.
        with suppress(AttributeError):
            tree.mu_uuid = uuid.uuid4().hex
    return str(tree.mu_uuid)


RUN = JobKind("graph", uuid_of, folder_of, "evaluation", outlives=True, prefix="tree_")
"""The evaluation of a tree."""


def refresh(tree: Any) -> dict[str, State]:
    """Evaluate the fast part of a tree; mark its links, show states, update followers."""
    conversion.sync_groups(tree)
    try:
        core = conversion.to_tree(tree)
    except InputError as error:
        found = {node.name: State(FAILED, error=error) for node in tree.nodes if hasattr(node, "definition")}
        classes.set_states(tree, found)
        return found
    folder = folder_of(tree)
    records = _records.read([folder / FOLDER / RECORDS], lambda: read_records(folder)) or {}
    evaluation = Evaluation(core, definitions(), kept=_kept, records=records)
    found = evaluation.run()
    refused: dict[tuple[str, str], set[Source]] = {}
    for fault in evaluation.faults:
        if fault.source is not None:
            refused.setdefault((fault.node, fault.input), set()).add(fault.source)
    conversion.mark_links(tree, {key: frozenset(sources) for key, sources in refused.items()})
    classes.set_states(tree, {**found, **_of_groups(tree, found)})
    _states[tree.session_uid] = found
    outputs = {name: values.get("unit") for name, values in evaluation.outputs.items()}
    _designs[tree.session_uid] = {name: unit for name, unit in outputs.items() if unit is not None}
    _follow(tree, evaluation)
    _keep_reachable(tree)
    return found


def _of_groups(tree: Any, found: dict[str, State]) -> dict[str, State]:
    """First error inside each group node; sets the states of the nodes in the groups."""
    shown = {}
    for node in tree.nodes:
        if node.bl_idname == classes.GROUP and node.node_tree is not None:
            prefix = f"{node.name}/"
            inside = {name.removeprefix(prefix): s for name, s in found.items() if name.startswith(prefix)}
            classes.set_states(node.node_tree, inside)
            failed = next((s for s in inside.values() if s.error is not None), None)
            if failed is not None:
                shown[node.name] = failed
    return shown


def _follow(tree: Any, evaluation: Evaluation) -> None:
    """Give units in the scene the parameters of the nodes that they follow."""
    for node in tree.nodes:
        root = getattr(node, "follower", None)
        design = evaluation.outputs.get(node.name, {}).get("unit")
        # Changes in the sidebar are written to the tree first, which is then refreshed again.
        if root is None or not root.mu_unit.uuid or following.give_back(root) or design is None:
            continue
        try:
            same = to_unit(root.mu_unit) == design.unit and root.mu_unit.path == design.path
        except MuError:
            same = False
        following.agree(root) if same else following.take(root, design)


def show_units(context: Any, tree: Any) -> list[Any]:
    """Put the units of a tree that nothing shows into the scene, to follow their nodes; return the objects.

    A unit that another node changes is shown as that node leaves it.
    """
    designs, made = _designs.get(tree.session_uid, {}), []
    for node in list(tree.nodes):
        design = designs.get(node.name)
        shown = getattr(node, "source", None) or getattr(node, "follower", None)
        if design is None or not hasattr(node, "follower") or shown is not None:
            continue
        after = (link.to_node for out in node.outputs for link in out.links)
        if any(hasattr(other, "follower") and other.name in designs for other in after):
            continue
        root = unit_object.create(context, design.unit)
        root.mu_unit.path = design.path
        landing.land(context, root)
        following.agree(root)
        node.follower = root
        made.append(root)
    if made:
        viewports.frame(made)
    return made


def _keep_reachable(tree: Any) -> None:
    """Let the scene point to the tree, so that its drivers are evaluated and it is saved."""
    scene = bpy.context.scene
    if scene is None or _is_group(tree):
        return
    known = dict(scene[SCENE_KEY].items()) if SCENE_KEY in scene else {}
    wanted = {found.name: found for found in trees() if not _is_group(found)}
    if known != wanted:
        scene[SCENE_KEY] = wanted


@connected(CHANGED)
def schedule(tree: Any) -> None:
    """Schedule a refresh of a tree, to run after Blender has finished the present change."""
    _pending.add(tree.session_uid)
    _refresh_pending.soon(WAIT_S)


@timer()
def _refresh_pending() -> None:
    pending = set(_pending)
    _pending.clear()
    groups = any(tree.session_uid in pending and _is_group(tree) for tree in trees())
    for tree in list(trees()):
        # A group's nodes are evaluated where it is used.
        if not _is_group(tree) and (groups or tree.session_uid in pending):
            refresh(tree)
    redraw()


def redraw() -> None:
    """Redraw every node editor."""
    manager = bpy.context.window_manager
    for window in manager.windows if manager else ():
        for area in window.screen.areas:
            if area.type == "NODE_EDITOR":
                area.tag_redraw()


def job_of(tree: Any, wanted: tuple[str, ...] = ()) -> Graph:
    """Job that evaluates a tree; raises InputError for a fault of a node."""
    job = Graph(tree=conversion.to_tree(tree), wanted=wanted, node_reports=tree.mu_reports)
    job.require_sound()
    return job


def start(tree: Any, wanted: tuple[str, ...] = ()) -> Any:
    """Evaluate a tree in a separate process; raises MuError."""
    job = job_of(tree, wanted)
    folder = folder_of(tree)
    if not tree.mu_folder:
        tree.mu_folder = relative(folder)
    expected = plan_of(job.tree, _states.get(tree.session_uid, {}), wanted, folder)
    kind = attrs.evolve(RUN, plan_of=lambda _: expected)
    child = kind.start(tree, folder, lambda place: write_study(job, place))
    _redraw_running.soon(INTERVAL_S)
    return child


@timer(lasts=True)
def _redraw_running() -> float | None:
    """Show the running node, and those finished since."""
    running = [tree for tree in trees() if RUN.is_running(tree)]
    for tree in running:
        child = RUN.child(tree)
        found = child.progress if child is not None else {}
        node, _, stage = str(found.get("stage", "")).rpartition(": ")
        classes.set_running(tree, node, stage, found.get("fraction"))
        path = folder_of(tree) / FOLDER / RECORDS
        written = path.stat().st_mtime_ns if path.is_file() else 0
        if written != _written.get(tree.session_uid):
            _written[tree.session_uid] = written
            schedule(tree)
    redraw()
    return INTERVAL_S if running else None


def tree_of_unit(root: Any, steps: bool = False) -> Any:
    """A new tree with a unit of the scene: one node that shows its fields, or the steps that it follows."""
    unit = to_unit(root.mu_unit)
    if steps:
        tree = conversion.from_tree(steps_of(unit, root.mu_unit.path))
        for node in tree.nodes:
            if hasattr(node, "follower"):
                node.follower = root
        return tree
    tree = bpy.data.node_groups.new(unit.name, TREE)
    tree.nodes.new(classes.node_class("unit")).source = root
    return tree


def places(node: Any) -> tuple[str, ...]:
    """Results of a node that can be opened: its run's folder and report, its table."""
    found = classes.state_of(node)
    if found is not None and found.folder is not None:
        return "folder", "report"
    return ("table",) if any(o.type == "table" for o in node.definition.outputs) else ()


def place_of(tree: Any, node: Any, what: str) -> Path | None:
    """Path of a node's result, or None without one."""
    found = classes.state_of(node)
    if what == "table":
        return folder_of(tree) / f"compare-{file_name(node.name)}.csv"
    if found is None or found.folder is None:
        return None
    return found.folder / "report.html" if what == "report" else found.folder


@connected(PARAMETERS_CHANGED)
def _of_object(root: Any) -> None:
    """Refresh the trees that show a unit of the scene."""
    for tree in trees():
        if any(getattr(node, "source", None) == root for node in tree.nodes):
            schedule(tree)


@connected(JOB_ENDED)
def _job_ended(key: str) -> None:
    for tree in trees():
        if RUN.key(tree) == key:
            schedule(tree)


@handler(*RESTORED)
def _all(*_: Any) -> None:
    following.forget()
    for tree in trees():
        schedule(tree)


@handler("frame_change_post", "depsgraph_update_post")
def _driven(scene: Any, *_: Any) -> None:
    """Refresh the trees with drivers or animation, whose values may have changed."""
    now = time.monotonic()
    for tree in trees():
        data = tree.animation_data
        if data is None or not (data.drivers or data.action):
            continue
        # A refresh may itself make Blender evaluate the scene: do not loop.
        if now - _refreshed.get(tree.session_uid, 0.0) > 2 * WAIT_S:
            _refreshed[tree.session_uid] = now
            schedule(tree)


@at_end
def _forget() -> None:
    _pending.clear()
    following.forget()
