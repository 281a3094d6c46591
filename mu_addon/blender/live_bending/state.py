"""A unit bent while it is designed: the process that finds its shapes, and the objects that show them.

The process (`studies.live`) waits between changes. A timer sends a request once the parameters rest,
and shows the answer in the unit's place. It ends while a job that takes the machine runs. Until its first
answer a shape is shown that was found before, in any session: the unit's own, else, dim, that of one like it.
"""

from __future__ import annotations

import shutil
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np

from ...design.assets import asset_root
from ...errors import InputError, MuError
from ...placement.sampling import polynomials
from ...reading import file_bytes, parse_json
from ...report.motion_files import Motion, read_motion
from ...run.child import RUNNING, Child
from ..jobs import start_child
from ..obstacles import state as obstacles
from ..results import bodies
from ..shared import displays, viewports
from ..shared.compat import user_folder
from ..shared.displays import LIVE
from ..shared.registration import RESTORED, at_end, connected, handler, timer
from ..simulate import effects
from ..simulate import job as simulation
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.properties import to_unit
from . import colours
from .properties import COLOURED, PLAIN, PRESSED, SWITCHED

RESTS_S = 0.35
"""Seconds without a change after which the unit is bent again."""
TICK_S = 0.1
SHAPES = "bent"
"""Folder of shapes that were found before: of the user's, and of the assets."""


@attrs.frozen(eq=False)
class Shape:
    """The unit's shapes (s, v, 3) in mm by region at pressures (s,), its triangles, and its angles (s,).

    fields: by region and name, (s, v), where they were asked for; design: that it is a shape of.
    """

    design: str
    cut: bool
    motion: Motion
    answer: dict[str, Any]
    pressure_kPa: Any
    angle_deg: Any
    vertices: dict[str, Any]
    triangles: dict[str, Any]
    fields: dict[str, dict[str, Any]]
    error: float
    finished: bool
    _ends: dict[str, tuple[float, float] | None] = attrs.field(factory=dict, init=False)

    def ends(self, field: str) -> tuple[float, float] | None:
        """Range of a field over all pressures, or None where it was not asked for."""
        if field not in self._ends:
            self._ends[field] = colours.ends_of(self.fields, field)
        return self._ends[field]

    def serves(self, root: Any) -> bool:
        """Return True if nothing finer is found for what is asked of a unit of this design."""
        reached = root.mu_live.pressure_kPa <= self.pressure_kPa[-1]
        coloured = root.mu_live.colour == PLAIN or bool(self.fields)
        return bool(self.design and self.finished and reached and coloured)

    def share(self, kPa: float) -> Any:
        """Weights (s,) of the shapes at a pressure up to the largest one."""
        return polynomials(self.pressure_kPa, np.array([min(kPa, self.pressure_kPa[-1])]))[0]


@attrs.define(eq=False)
class Live:
    """A unit's live bending: its process, the design to bend, and the latest shape, maybe of an earlier one.

    arrived: a shape that is shown at the next tick, so that the window draws between its reading and that.
    """

    folder: Path
    child: Child | None = None
    number: int = 0
    design: str = ""
    due_s: float | None = None
    shape: Shape | None = None
    arrived: Shape | None = None
    trouble: str = ""
    _read_ns: int = 0

    @property
    def current(self) -> Shape | None:
        """The shape of the present design, or None while it is computed."""
        return self.shape if self.shape is not None and self.shape.design == self.design else None

    def end(self) -> None:
        """End the process."""
        if self.child is not None:
            self.child.kill()
        self.child, self._read_ns = None, 0


_every: dict[str, Live] = {}
"""By UUID of the unit."""


def of(root: Any) -> Live | None:
    """Live bending of a unit, or None where it is off."""
    return _every.get(root.mu_unit.uuid)


def parts(root: Any) -> list[Any]:
    """The objects of a unit's live shape: one a region."""
    return displays.parts(root, LIVE)


def angle_at(shape: Shape, kPa: float) -> float:
    """Bending angle in degrees at a pressure."""
    return float(shape.share(kPa) @ shape.angle_deg)


def is_seen(root: Any) -> bool:
    """Return True if a unit is shown bent live."""
    return root.mu_unit.show == "preview" and bool(displays.on_unit(root, LIVE)) and of(root) is not None


def most_kPa(root: Any) -> float:
    """Largest pressure of a unit that is shown bent live; 0 where it is not."""
    live = of(root)
    if live is None or live.shape is None or not is_seen(root):
        return 0.0
    return float(live.shape.pressure_kPa[-1])


@connected(SWITCHED)
def _switched(root: Any) -> None:
    uuid = root.mu_unit.uuid
    if not uuid:
        return
    if root.mu_live.on:
        # Solid and result have shapes of their own, and candidates lie on the unit at rest.
        root.mu_unit.show = "preview"
        unit_object.hide_candidates(root)
        _begin(root)
        return
    found = _every.pop(uuid, None)
    if found is not None:
        found.end()
        shutil.rmtree(found.folder, ignore_errors=True)
    displays.clear(root, LIVE)
    unit_object.show(root)


def _begin(root: Any) -> None:
    """Bend a unit that is switched on, whatever is shown of it."""
    live = _every.setdefault(root.mu_unit.uuid, Live(studies.folder_of(root) / "live"))
    live.design = ""
    _changed(root)


@connected(unit_object.REBUILT)
def _changed(root: Any) -> None:
    """Dim the shape once the parameters have changed, and bend the unit anew as soon as they rest."""
    live = of(root)
    if live is None:
        if root.mu_live.on and root.mu_unit.uuid:  # a duplicate
            _begin(root)
        return
    design, shape = studies.design_of(root), live.shape
    if shape is not None and shape.cut != root.mu_unit.cut:
        shape = live.shape = _shape(root, shape.motion, shape.answer, shape.design)
    elif design == live.design:
        return
    if design != live.design:
        live.design, live.arrived, live.trouble = design, None, ""
        live.due_s = time.monotonic() + RESTS_S if design else None
        if design:
            _recall(root, live)
        _tick_soon()
    if shape is not None:
        place(root)


def _recall(root: Any, live: Live) -> None:
    """Show a shape that was found before: the unit's own or, where none is shown, that of one like it."""
    from ...live_bending.known import nearest

    unit = to_unit(root.mu_unit)
    if root.mu_unit.envelope or effects.inputs(root) or obstacles.inputs(root) or unit.wall.has_memory:
        return
    found = nearest(unit, user_folder(SHAPES), asset_root() / SHAPES)
    if found is None or not (found.same or live.shape is None):
        return
    live.arrived = _shape(root, found.motion, found.answer, live.design if found.same else "")
    if live.arrived.serves(root):
        live.due_s = None


@connected(PRESSED)
def _pressed(root: Any) -> None:
    """Bend the shape to another pressure; beyond its largest one it is computed again."""
    live = of(root)
    if live is None or live.shape is None:
        return
    pose(root, live)
    shape = live.current
    if shape is not None and shape.finished and not shape.serves(root):
        live.due_s = time.monotonic() + RESTS_S
        _tick_soon()


@connected(COLOURED)
def _coloured(root: Any) -> None:
    """Show the chosen colours; a field that was not found yet is asked for."""
    live, wanted = of(root), root.mu_live.colour != PLAIN
    if wanted:
        viewports.show_colours()
    if live is None:
        return
    pose(root, live)
    # A request that runs may be of before they were wanted; one that is due asks for them.
    lacking = live.current is None or not live.current.fields
    if wanted and lacking and live.design and live.due_s is None:
        live.due_s = time.monotonic()
        _tick_soon()


def _tick_soon() -> None:
    if not bpy.app.background:
        _tick.soon(TICK_S)


@timer(lasts=True)
def _tick() -> float | None:
    for uuid, live in list(_every.items()):
        root = unit_object.by_uuid(uuid)
        if root is None or not root.mu_live.on:
            # Deleted; undo may bring it back, and then it begins anew.
            live.end()
            del _every[uuid]
            continue
        try:
            _follow(root, live)
        except MuError as error:
            live.trouble, live.due_s = error.what, None
            viewports.redraw()
    if any(live.arrived for live in _every.values()):
        return 0.0
    return TICK_S if any(live.due_s or live.child for live in _every.values()) else None


def _follow(root: Any, live: Live) -> None:
    """Send the process due requests, and show its answers."""
    if live.arrived is not None:
        before = viewports.corners([root])
        live.shape, live.arrived = live.arrived, None
        place(root)
        _keep_in_view(root, before, live.shape)
        viewports.redraw()
        return
    if start_child.is_busy():
        if live.child is not None:
            live.end()
            # What was not found yet is asked for after that job.
            if live.current is None or not live.current.finished:
                live.due_s = time.monotonic()
        return
    if live.due_s is not None and time.monotonic() >= live.due_s:
        live.due_s = None
        _ask(root, live)
        viewports.redraw()
    if live.child is None:
        return
    live.child.poll()
    if live.child.state != RUNNING:
        live.trouble = (live.child.error or {}).get("what", live.child.state)
        live.child = None
        viewports.redraw()
    elif _answered(root, live):
        viewports.redraw()


def _ask(root: Any, live: Live) -> None:
    # Imported late, with the solver's packages.
    from ...live_bending import requests
    from ...studies.live import Live
    from ...studies.starting import write_study

    study = simulation.job_of(root)
    if live.child is None:
        shutil.rmtree(live.folder, ignore_errors=True)
        write_study(Live(), live.folder)
    live.number += 1
    kPa, fields = root.mu_live.pressure_kPa, root.mu_live.colour != PLAIN
    requests.ask(live.folder, live.number, study, kPa, fields, user_folder(SHAPES))
    if live.child is None:
        command = ["resume", str(live.folder), "--json"]
        live.child = start_child.start(command, live.folder, ends_with_parent=True)


def _answered(root: Any, live: Live) -> bool:
    """Read the process's latest answer and show it; return True if it is new."""
    from ...live_bending.requests import BENT

    path = live.folder / BENT
    try:
        changed = path.stat().st_mtime_ns
        if changed == live._read_ns:
            return False
        answer: Any = parse_json(file_bytes(path), BENT)
    except (OSError, InputError):
        return False
    live._read_ns = changed
    if answer["number"] != live.number:
        return False
    if answer["trouble"]:
        live.trouble = answer["trouble"]
        return True
    if live.current is not None and not _is_better(answer, live.current, root.mu_live.pressure_kPa):
        return False
    live.arrived = _shape(root, read_motion(live.folder / answer["folder"]), answer, live.design)
    return True


def _is_better(answer: dict[str, Any], kept: Shape, kPa: float) -> bool:
    """Return True if an answer may take the place of a shape: a step back in what is shown never does.

    A finer one that has not reached the pressure yet waits until it has, or ends before it.
    """
    reach, shown = min(answer["states"][-1][0], kPa), min(float(kept.pressure_kPa[-1]), kPa)
    if answer["error"] > kept.error:
        return reach > shown
    return reach >= shown or answer["finished"]


def _shape(root: Any, motion: Motion, answer: dict[str, Any], design: str) -> Shape:
    cut = bool(root.mu_unit.cut and motion.halved)
    skins = bodies.skins_of(motion, cut)
    vertices, triangles = bodies.of_motion(motion, skins)
    fields = {
        region: {name: skin.of_surface(v) for name, v in motion.fields[region].items()}
        for region, skin in skins.items()
    }
    pressure, angle = np.array(answer["states"]).T
    fields = fields if any(fields.values()) else {}
    return Shape(
        design,
        root.mu_unit.cut,
        motion,
        answer,
        pressure,
        angle,
        vertices,
        triangles,
        fields,
        answer["error"],
        answer["finished"],
    )


def place(root: Any) -> None:
    """Show a unit's latest shape in its place."""
    live = of(root)
    if live is None or live.shape is None:
        return
    first = {region: vertices[0] for region, vertices in live.shape.vertices.items()}
    for part in bodies.put(root, LIVE, "Live", first, live.shape.triangles):
        part.hide_viewport = part.hide_render = True
    pose(root, live)
    _seen(root, True)


def pose(root: Any, live: Live) -> None:
    """Bend the shown parts to the pressure of the slider; they are dim if of an earlier design."""
    shape = live.shape
    if shape is None:
        return
    share = shape.share(root.mu_live.pressure_kPa).astype(np.float32)
    field = root.mu_live.colour
    ends = shape.ends(field) if shape is live.current else None
    for part in parts(root):
        region = part[LIVE]
        if not bodies.move(part, _mean(share, shape.vertices[region])):
            continue
        if ends is not None:
            values = _mean(share, shape.fields[region][field])
            colours.coloured(root, part, field, values, ends)
        else:
            colours.plain(part, region if shape is live.current else "before")
        part.data.update()


def _keep_in_view(root: Any, before: Any, shape: Shape) -> None:
    """A view that held the unit as it was seen, its corners (8, 3), holds it bent: pressure lengthens it."""
    reached = np.concatenate([v.reshape(-1, 3) for v in shape.vertices.values()])
    low, high = reached.min(axis=0), reached.max(axis=0)
    box = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    placed = np.array(root.matrix_world)
    viewports.keep_in_view(before, box @ placed[:3, :3].T + placed[:3, 3])


def _mean(share: Any, values: Any) -> Any:
    # Not by BLAS, whose threads wait for each other on a busy machine.
    return np.einsum("s,s...->...", share, values)


def _seen(root: Any, seen: bool) -> None:
    for part in parts(root):
        part[displays.ON_UNIT] = seen
    unit_object.show(root)


@handler(*RESTORED)
def _restored(*_: Any) -> None:
    """After undo, redo or load: hide shapes of another design or without a process."""
    for root in unit_object.roots():
        if not root.mu_live.on or of(root) is None:
            if parts(root):
                _seen(root, False)
            if root.mu_live.on and root.mu_unit.uuid:
                _begin(root)
        else:
            _changed(root)
            place(root)


@connected(start_child.JOB_ENDED)
def _job_ended(_key: str) -> None:
    if _every:
        _tick_soon()


@at_end
def _end_all() -> None:
    for live in _every.values():
        live.end()
        with suppress(OSError):
            shutil.rmtree(live.folder)
    _every.clear()
