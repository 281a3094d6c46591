"""Simulations that this session started: one child a unit, read by a timer, ended with the session.

What runs is kept here, in Python, and never in the .blend file: a file that is loaded later has no button
stuck at "running". Nothing here writes to Blender's data.
"""

from __future__ import annotations

import atexit
import importlib.util
from pathlib import Path
from typing import Any

import bpy

from ...design.parameters import Unit, write_unit
from ...errors import InputError
from ...run.child import RUNNING, Child
from ...run.interpreter import environment, worker_command
from ..unit import live_update as live

INTERVAL_S = 0.2
WORKER = Path(__file__).with_name("worker.py")
NEEDED = ("warp", "scipy", "cvxopt", "meshio", "matplotlib")
"""Modules that a simulation cannot do without."""

_children: dict[str, Child] = {}


def missing() -> list[str]:
    """Names of the modules that a simulation needs and this Blender does not find."""
    return [name for name in NEEDED if importlib.util.find_spec(name) is None]


def of(uuid: str) -> Child | None:
    """The latest simulation of a unit in this session, running or ended, or None."""
    return _children.get(uuid)


def running() -> list[str]:
    """UUIDs of the units that are being simulated."""
    return [uuid for uuid, child in _children.items() if child.state == RUNNING]


def start(uuid: str, unit: Unit, folder: Path, arguments: list[str]) -> Child:
    """Start `arguments` of the command line for a unit, results in `folder`; raises MuError."""
    if uuid in running():
        raise InputError("this unit is being simulated already", str(folder), "wait for it or cancel it")
    own = folder / "blender"
    write_unit(unit, own / "unit.toml")
    command, *options = arguments
    line = [command, "--unit", str(own / "unit.toml"), "--out", str(folder), "--json", *options]
    return launch(uuid, of_worker(line), own)


def of_worker(line: list[str]) -> list[str]:
    """The command that runs a line of the core's command line in a process of its own; raises InputError."""
    return worker_command(WORKER, line, bpy.app.binary_path)


def launch(uuid: str, command: list[str], folder: Path) -> Child:
    """Start any command as a unit's simulation; what it says is kept in `folder`. Raises MuError."""
    child = Child(command, folder, environment())
    _children[uuid] = child
    if not bpy.app.timers.is_registered(_poll):
        # Persistent: loading another file does not end a simulation.
        bpy.app.timers.register(_poll, first_interval=INTERVAL_S, persistent=True)
    return child


def forget(uuid: str) -> None:
    """Drop an ended simulation from the panel."""
    child = _children.get(uuid)
    if child is not None and child.state != RUNNING:
        del _children[uuid]


def poll() -> bool:
    """Read what every child has said; returns whether one said anything."""
    heard = [child.poll() for child in _children.values()]
    return any(heard)


def _poll() -> float | None:
    before = running()
    if poll():
        live.redraw()
    if running() != before:
        # What the study has found shows on the candidate paths.
        live.catch_up()
    return INTERVAL_S if running() else None


def _end_all() -> None:
    for child in _children.values():
        child.kill()


def register() -> None:
    """Children end with the session that started them."""
    atexit.register(_end_all)


def unregister() -> None:
    """End every child and its timer."""
    atexit.unregister(_end_all)
    _end_all()
    _children.clear()
    if bpy.app.timers.is_registered(_poll):
        bpy.app.timers.unregister(_poll)


def spell_left(child: Child) -> str:
    """Stage and time left of a running child, for a panel."""
    from ...run.progress import spell

    stage = str(child.progress.get("stage", "starting"))
    left: Any = child.progress.get("seconds_left")
    return stage if left is None else f"{stage}, {spell(float(left))} left"
