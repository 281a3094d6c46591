"""A study's motion in the scene: objects beside the unit that deform on the timeline and carry its fields.

Positions come from point caches in the study folder, which Blender plays by itself; the fields of the frame
are written before it is drawn. An object is a child of the unit's root and knows what it shows by the custom
property `mu_motion`: "NAME|BODY", NAME a path or model_a, BODY one of `BODIES`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...errors import InputError
from ...report.pc2 import read_pc2, write_pc2
from ...usecases.simulate_and_place.motion import (
    FOLDER,
    MODEL_A,
    PLAYED,
    REGIONS,
    SENSITIVITY,
    Motion,
    Skin,
    read_motion,
)
from ..preview import skeletons
from ..shared import displays, handlers
from ..shared.displays import MOTION
from ..shared.file_cache import FileCache
from ..shared.updates import Signal
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.properties import to_unit
from . import field_colours

PRINT = "print"
BODIES = (*REGIONS, PRINT)
MESH = "mesh"
"""The analysis mesh: both its regions."""
DISPLACEMENT, DEVIATION = "displacement_mm", "deviation_mm"

_RARE = 0.2
"""Percent of the values, at either end, that do not stretch the range: at edges stress has no bound."""


@attrs.frozen(eq=False)
class Played:
    """What one object plays: fields by name, (s, v) at every state or (v,) at all, and its motion."""

    motion: Motion
    fields: dict[str, Any]


COLOURED = Signal()
"""Sent with the root whose motion was coloured anew."""

_motions: FileCache[Motion] = FileCache()
_played: dict[tuple[Path, str, bool], Played] = {}
"""By folder, what is shown and whether it is cut; not of the printed body, which has its own."""


def parts(root: Any) -> list[Any]:
    """Objects that show a unit's motion."""
    return [child for child in root.children if child.get(MOTION)]


def shown(root: Any) -> list[tuple[str, str]]:
    """Pairs (name, `mesh` or `print`) that are shown, Model A first, each beside the one before."""
    found = {(name, PRINT if body == PRINT else MESH) for name, body in (_what(p) for p in parts(root))}
    return sorted(found, key=lambda pair: (pair[0] != MODEL_A, len(pair[0]), pair[0], pair[1]))


def _what(part: Any) -> tuple[str, str]:
    name, _, body = part[MOTION].partition("|")
    return name, body


def one(root: Any, name: str, what: str) -> Any:
    """The object that shows a motion, or the first of its two."""
    return next(p for p in parts(root) if _what(p)[0] == name and (_what(p)[1] == PRINT) == (what == PRINT))


def motion_of(root: Any) -> Motion | None:
    """The motion in the unit's study folder, or None where there is none; read again when it changes."""
    folder = studies.folder_of(root)
    return _motions.read([folder / FOLDER / f"{MODEL_A}.npz"], lambda: read_motion(folder))


def show(root: Any, name: str, what: str) -> None:
    """Show the motion of Model A or a path, of the analysis mesh or of the print. Raises MuError."""
    motion = motion_of(root)
    if motion is None:
        raise InputError(
            "there is no motion to show", str(studies.folder_of(root)), "simulate first, or simulate again"
        )
    if what == PRINT:
        _show_print(root, motion, name)
    else:
        for region in REGIONS:
            _show_region(root, motion, name, region)
    arrange(root)
    refresh(root)


def hide(root: Any, name: str, what: str) -> None:
    """Take a motion out of the scene; its files stay."""
    for part in parts(root):
        if _what(part)[0] == name and (_what(part)[1] == PRINT) == (what == PRINT):
            displays.remove(part)
    arrange(root)


def rebuild(root: Any) -> None:
    """Build again what is shown, from the files as they are now. Raises MuError."""
    for name, what in shown(root):
        show(root, name, what)


def arrange(root: Any) -> None:
    """Stand what is shown side by side, beside the unit, on the side that it bends away from."""
    motion = motion_of(root)
    if motion is None:
        return
    low, high = motion.mesh.nodes.min(axis=0), motion.mesh.nodes.max(axis=0)
    step = root.mu_motion.apart * float(high[1] - low[1])
    places = {pair: number for number, pair in enumerate(shown(root), 1)}
    for part in parts(root):
        name, body = _what(part)
        part.location = (0.0, -step * places[name, PRINT if body == PRINT else MESH], 0.0)


def _show_region(root: Any, motion: Motion, name: str, region: str) -> None:
    cut = root.mu_motion.cut and motion.halved
    skin = motion.skin(region, cut)
    rest = skin.of_nodes(motion.mesh.nodes)
    file = motion.folder / PLAYED / f"{name}-{region}{'-cut' if cut else ''}.pc2"
    _write_cache(file, motion, rest, skin.of_nodes(*motion.sides(name)))
    part = _part(root, name, region)
    skeletons.write(part.data, skeletons.Skeleton(rest, faces=(skin.triangles,)))
    _play(part, motion, file)


def _show_print(root: Any, motion: Motion, name: str) -> None:
    """The printable solid, built anew where the last one is of other parameters, carried by the mesh."""
    found = studies.findings(root)
    if found is None or found.stale:
        raise InputError(
            "the motion belongs to other parameters than the unit has now",
            remedy="simulate again, or go back to those parameters",
        )
    if not unit_object.solid_is_current(root):
        core = to_unit(root.mu_unit)
        unit_object.put_solid(root, unit_object.solid_of(root, core), core)
        root.mu_unit.show = "preview"
    solid = root.mu_unit.solid
    rest = vertices_of(solid)
    carried = motion.embedding(rest)
    moved, still = (motion.carried(whose, carried) for whose in (name, MODEL_A))
    file = motion.folder / PLAYED / f"{name}-{PRINT}.pc2"
    _write_cache(file, motion, rest, moved)
    part = _part(root, name, PRINT)
    old = part.data
    part.data = solid.copy()
    part.data.name = old.name
    part.data.materials.clear()
    bpy.data.meshes.remove(old)
    outside = carried.outside_mm
    part["mu_outside"] = (
        f"{(outside > 0).mean():.0%} of it outside the mesh, by {outside.max():.2g} mm at most"
    )
    _prints[part.name_full, root.mu_unit.uuid] = Played(motion, _distances(moved, still))
    _play(part, motion, file)


_prints: dict[tuple[str, str], Played] = {}
"""The printed bodies' fields, by object and unit: they belong to a solid, which may change."""


def vertices_of(mesh: Any) -> Any:
    """Vertices (v, 3) of a Blender mesh."""
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", found)
    return found.reshape(-1, 3).astype(float)


def _part(root: Any, name: str, body: str) -> Any:
    for part in parts(root):
        if part[MOTION] == f"{name}|{body}":
            return part
    title = f"{'Model A' if name == MODEL_A else name} {body}"
    part = displays.add(root, MOTION, f"{name}|{body}", bpy.data.meshes.new(title))
    return displays.lock(part, location=False)


def _write_cache(file: Path, motion: Motion, rest: Any, displacement: Any) -> None:
    """Write rest (v, 3) + displacement (s, v, 3) in mm at the protocol's samples. Raises OutputError."""
    step = float(motion.time_s[1] - motion.time_s[0])
    write_pc2(file, rest + displacement[motion.state], float(motion.time_s[0]), step)


def _play(part: Any, motion: Motion, file: Path) -> None:
    """Have an object play a point cache of its vertices."""
    play(part, file, float(motion.time_s[1] - motion.time_s[0]))


def play(part: Any, file: Path, step_s: float) -> None:
    """Have an object play a point cache of its vertices, samples `step_s` apart, in its own time."""
    modifier = part.modifiers.get("Motion") or part.modifiers.new("Motion", "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = studies.relative(file)
    modifier.time_mode = "FRAME"
    modifier.play_mode = "SCENE"
    modifier.interpolation = "LINEAR"
    _keep_time(part, step_s, bpy.context.scene)


def step_of(file: Path) -> float:
    """Time in s between the samples of a point cache; raises InputError."""
    return read_pc2(file)[2]


def _keep_time(part: Any, step_s: float, scene: Any) -> None:
    """Have a part play its cache in its own time at the scene's frame rate.

    Blender takes sample number `frame_scale` frame - `frame_start`; its mode in seconds divides by the rate
    twice.
    """
    modifier = part.modifiers.get("Motion")
    rate = scene.render.fps / scene.render.fps_base
    samples = 1.0 / (rate * step_s)
    wanted = np.float32(samples), np.float32(samples * scene.frame_start)
    if modifier is not None and (modifier.frame_scale, modifier.frame_start) != wanted:
        modifier.frame_scale, modifier.frame_start = wanted


def time_of(motion: Motion, scene: Any) -> float:
    """The protocol's time in s at the scene's frame."""
    rate = scene.render.fps / scene.render.fps_base
    return float(motion.time_s[0] + (scene.frame_current_final - scene.frame_start) / rate)


def last_frame(motion: Motion, scene: Any) -> int:
    """The scene's frame at which the protocol ends."""
    rate = scene.render.fps / scene.render.fps_base
    return int(np.ceil(scene.frame_start + float(motion.time_s[-1] - motion.time_s[0]) * rate))


def _distances(moved: Any, still: Any) -> dict[str, Any]:
    return {
        DISPLACEMENT: np.linalg.norm(moved, axis=2).astype(np.float32),
        DEVIATION: np.linalg.norm(moved - still, axis=2).astype(np.float32),
    }


def _fields_of(motion: Motion, name: str, region: str, skin: Skin) -> dict[str, Any]:
    still = skin.of_nodes(motion.model_a)
    found = _distances(skin.of_nodes(*motion.sides(name)), still)
    for field in motion.fields[region]:
        values = motion.field(name, region, field, skin)
        if values is not None:
            found[field] = values
    if name == MODEL_A and region in motion.sensitivity:
        found[SENSITIVITY] = motion.sensitivity[region][skin.place]
    return found


def played(root: Any, part: Any) -> Played | None:
    """What a part plays, from memory or from the files; None where they are gone or of another mesh."""
    motion = motion_of(root)
    if motion is None:
        return None
    name, body = _what(part)
    if body == PRINT:
        return _replayed(root, part, motion)
    cut = bool(root.mu_motion.cut and motion.halved)
    key = motion.folder, part[MOTION], cut
    kept = _played.get(key)
    if kept is None or kept.motion is not motion:
        try:
            kept = _played[key] = Played(motion, _fields_of(motion, name, body, motion.skin(body, cut)))
        except InputError:
            return None
    return kept


def _replayed(root: Any, part: Any, motion: Motion) -> Played | None:
    """A printed body's fields; after a file was loaded, from its own vertices."""
    key = part.name_full, root.mu_unit.uuid
    kept = _prints.get(key)
    if kept is None or kept.motion is not motion:
        carried = motion.embedding(vertices_of(part.data))
        try:
            moved, still = (motion.carried(whose, carried) for whose in (_what(part)[0], MODEL_A))
        except InputError:
            return None
        kept = _prints[key] = Played(motion, _distances(moved, still))
    return kept


def refresh(root: Any) -> None:
    """Write the fields of the scene's frame to what is shown, and colour it by the chosen one."""
    motion = motion_of(root)
    if motion is None:
        return
    settings = root.mu_motion
    if not settings.lock:
        low, high = extent(root, settings.field)
        if (settings.low, settings.high) != (np.float32(low), np.float32(high)):
            settings.low, settings.high = low, high
    colour(root)


def colour(root: Any) -> None:
    """Write the fields of the scene's frame, and their colours by the range as it is."""
    _write(root, bpy.context.scene)
    COLOURED.send(root)
    field = root.mu_motion.field
    field_colours.paint(root, [(part, field in part.data.attributes) for part in parts(root)])


def extent(root: Any, field: str) -> tuple[float, float]:
    """Range of a field in what is shown, over the whole motion, without its rarest values; else (0, 1)."""
    found = [p.fields[field] for p in (played(root, part) for part in parts(root)) if p and field in p.fields]
    if not found:
        return 0.0, 1.0
    ends = np.array([np.percentile(values, (_RARE, 100.0 - _RARE)) for values in found])
    low, high = float(ends[:, 0].min()), float(ends[:, 1].max())
    if root.mu_motion.symmetric:
        high = max(abs(low), abs(high))
        low = -high
    return low, high if high > low else low + 1.0


def _write(root: Any, scene: Any) -> None:
    """The fields of the scene's frame as point attributes, in their units."""
    for part in parts(root):
        found = played(root, part)
        if found is None:
            continue
        _keep_time(part, float(found.motion.time_s[1] - found.motion.time_s[0]), scene)
        first, second, share = found.motion.at(time_of(found.motion, scene))
        for name, values in found.fields.items():
            now = values if values.ndim == 1 else (1 - share) * values[first] + share * values[second]
            if len(now) != len(part.data.vertices):
                continue
            attribute = part.data.attributes.get(name) or part.data.attributes.new(name, "FLOAT", "POINT")
            attribute.data.foreach_set("value", np.ascontiguousarray(now, np.float32))
            if name == root.mu_motion.field:
                field_colours.write_colours(root, part.data, now)
        if root.mu_motion.field not in found.fields:
            field_colours.write_colours(root, part.data, None)
        part.data.update()


@persistent
def _before_frame(scene, *_):
    # Before Blender evaluates the frame, so that positions and fields are of the same one.
    for root in unit_object.roots():
        if parts(root) and root.mu_motion.live:
            _write(root, scene)


@persistent
def _loaded(*_):
    _played.clear()
    _prints.clear()
    _motions.clear()
    for root in unit_object.roots():
        if parts(root):
            _write(root, bpy.context.scene)


_HANDLERS = {"frame_change_pre": _before_frame, "load_post": _loaded}


def register() -> None:
    """Handlers that keep the fields at the scene's frame."""
    handlers.add(_HANDLERS)


def unregister() -> None:
    """Take them out."""
    handlers.remove(_HANDLERS)
    for kept in (_played, _prints, _motions):
        kept.clear()
