"""The twin: the simulated unit, next to the design, bent to the angle of the real sensor.

It moves between the simulated states and never beyond them. A signal outside the calibration or the simulated
motion leaves the last pose, in red, with the reason above it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...report.motion_files import Motion
from ...simulate_and_place.poses import Poses, poses
from ..preview import materials
from ..results import bodies
from ..results import motion as motion_parts
from ..shared import displays
from ..shared.displays import TWIN
from ..shared.registration import at_end, handler
from ..simulate import study_folder as studies
from ..unit import object as unit_object

LIVE, OUTSIDE, WAITING = "live", "outside", "waiting"
_LOOKS = {LIVE: {"membrane": "MU Twin", "lattice": "MU Lattice"}}
_COLOURS = {OUTSIDE: "MU Out of Range", WAITING: "MU Twin Waiting"}


@attrs.frozen(eq=False)
class _Shape:
    """Data of the twin of one motion: its poses, and vertices (s, v, 3) of each region by state."""

    motion: Motion
    poses: Poses
    vertices: dict[str, Any]
    triangles: dict[str, Any]


_shapes: dict[tuple[Path, bool], _Shape] = {}
_status: dict[str, tuple[str, str]] = {}
"""By unit: state of its twin, and a text on it."""


def parts(root: Any) -> list[Any]:
    """The objects of a unit's twin: one a region."""
    return displays.parts(root, TWIN)


def status(root: Any) -> tuple[str, str]:
    """State of the unit's twin, LIVE, OUTSIDE or WAITING, and a text on it."""
    return _status.get(root.mu_unit.uuid, (WAITING, "no signal"))


def _shape(root: Any) -> _Shape:
    motion = motion_parts.motion_of(root)
    if motion is None:
        raise InputError(
            "there is no simulated motion to bend the twin by",
            str(studies.results_folder(root)),
            "simulate first",
        )
    cut = bool(root.mu_motion.cut and motion.halved)
    kept = _shapes.get((motion.folder, cut))
    if kept is None or kept.motion is not motion:
        shapes = bodies.of_motion(motion, bodies.skins_of(motion, cut))
        kept = _shapes[motion.folder, cut] = _Shape(motion, poses(motion), *shapes)
    return kept


def show(root: Any) -> None:
    """Put the twin next to the unit, on the side that it bends to, at rest. Raises InputError."""
    shape = _shape(root)
    hide(root)
    wide = float(np.ptp(shape.motion.mesh.nodes[:, 1]))
    rest = int(np.argmin(np.abs(shape.motion.state_kPa)))
    at_rest = {region: vertices[rest] for region, vertices in shape.vertices.items()}
    for part in bodies.put(root, TWIN, "Twin", at_rest, shape.triangles):
        part.location = (0.0, 1.5 * wide, 0.0)
    _status.pop(root.mu_unit.uuid, None)
    _colour(root, WAITING)


def hide(root: Any) -> None:
    """Remove the twin from the scene."""
    displays.clear(root, TWIN)


def set_pose(root: Any, reading: Any, fresh: bool) -> bool:
    """Bend the twin to the angle of a reading; return True if its state has changed.

    reading: angle_deg, low_deg, high_deg and possible, or None; fresh: True if samples are arriving.
    """
    if not parts(root):
        return False
    state, words = WAITING, "no signal"
    if fresh and reading is not None:
        try:
            state, words = _bend(root, _shape(root), reading)
        except InputError as error:
            words = error.what
    before = _status.get(root.mu_unit.uuid)
    _status[root.mu_unit.uuid] = state, words
    _colour(root, state)
    return before is None or before[0] != state


def _bend(root: Any, shape: _Shape, reading: Any) -> tuple[str, str]:
    if not np.isfinite(reading.angle_deg):
        return WAITING, "not calibrated"
    if not reading.possible:
        return OUTSIDE, f"{reading.light_V:.3f} V cannot come from the calibration"
    place = shape.poses.at(reading.angle_deg)
    if place is None:
        low, high = shape.poses.range_deg
        return OUTSIDE, f"{reading.angle_deg:.1f}°: simulated are {low:.1f} to {high:.1f}° only"
    first, second, share = place
    for part in parts(root):
        moved = shape.vertices[part[TWIN]]
        if not bodies.move(part, moved[first] + np.float32(share) * (moved[second] - moved[first])):
            return WAITING, "the simulation has changed: show the twin again"
    pressure = shape.poses.pressure_at(reading.angle_deg)
    half = (reading.high_deg - reading.low_deg) / 2
    return LIVE, f"{reading.angle_deg:.1f} ± {half:.1f}°, simulated at {pressure:.1f} kPa"


def _colour(root: Any, state: str) -> None:
    """Colours of a state; written only where they change."""
    for part in parts(root):
        name = _COLOURS.get(state) or _LOOKS[state][part[TWIN]]
        materials.wear(part.data, materials.material(name))


@handler("load_post")
def _loaded(*_: Any) -> None:
    """Mark a twin loaded from a file as without signal, unless its session still runs."""
    _forget()
    for root in unit_object.roots():
        _colour(root, WAITING)


@at_end
def _forget() -> None:
    _shapes.clear()
    _status.clear()
