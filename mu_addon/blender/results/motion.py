"""A study's motion in the scene: objects that deform on the timeline and carry its fields.

The first one replaces the unit's design, the others are next to it. Positions come from point caches in the
study folder, which Blender plays; the fields of the frame are written before it is drawn. An object is a
child of the unit's root and identified by two custom properties: `mu_motion_part` "NAME|BODY", with NAME a
path or model_a and BODY one of `REGIONS` or `PRINT`; and `mu_run`, its run.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np

from ...errors import InputError, MuError
from ...report.motion_files import (
    MODEL_A,
    PLAYED,
    REGIONS,
    SENSITIVITY,
    Motion,
    Skin,
)
from ...report.pc2 import read_pc2, write_pc2
from ..jobs.prepared import NotPrepared
from ..jobs.start_child import JOB_ENDED, JOB_NEWS
from ..preview import skeletons
from ..printing.state import solid_of
from ..shared import displays, timeline, updates, viewports
from ..shared.displays import MOTION
from ..shared.registration import at_end, connected, handler
from ..shared.updates import Signal
from ..shared.wording import path_symbol
from ..simulate import study_folder as studies
from ..simulate.job import SIMULATION
from ..unit import object as unit_object
from ..unit.properties import VIEW_CHANGED, to_unit
from . import field_colours, run_motions
from .run_motions import motion_of

PRINT = "print"
MESH = "mesh"
"""The analysis mesh: both its regions."""
DISPLACEMENT, DEVIATION = "displacement_mm", "deviation_mm"
DIFFERENCE = "run_difference_mm"
RUN, REACHED = "mu_run", "mu_reached"
"""Of a shown object: its run, and how many samples of the protocol had their state."""


@attrs.frozen(eq=False)
class Played:
    """Data of one played object: fields by name, (s, v) at every state or (v,) at all, and its motion."""

    motion: Motion
    fields: dict[str, Any]


COLOURED = Signal()
"""Sent with the root whose motion was recoloured."""

_peaks: dict[str, int] = {}
"""Frame of the field's largest value that was gone to, by UUID of the unit."""
_played: dict[tuple[Path, str, bool], Played] = {}
"""By folder, motion and cut, without the printed bodies, which have `_prints`."""


def parts(root: Any) -> list[Any]:
    """Objects that show a unit's motion."""
    return displays.parts(root, MOTION)


def owner(name: str) -> str:
    """Owner of a motion in words: the unit without a sensor, or with a path."""
    return "Without a sensor" if name == MODEL_A else path_symbol(name)


def shown(root: Any) -> list[tuple[str, str]]:
    """Pairs (name, `mesh` or `print`) that are shown side by side, Model A first."""
    found = {_pair(part) for part in parts(root)}
    return sorted(found, key=lambda pair: (pair[0] != MODEL_A, len(pair[0]), pair[0], pair[1]))


def _what(part: Any) -> tuple[str, str]:
    name, _, body = part[MOTION].partition("|")
    return name, body


def _pair(part: Any) -> tuple[str, str]:
    name, body = _what(part)
    return name, PRINT if body == PRINT else MESH


def one(root: Any, name: str, what: str) -> Any:
    """The object that shows a motion, or the first of its two."""
    return next(part for part in parts(root) if _pair(part) == (name, what))


def show(root: Any, name: str, what: str) -> None:
    """Show the motion of Model A or a path, of the analysis mesh or of the print. Raises MuError."""
    motion = motion_of(root)
    if motion is None:
        raise InputError(
            "there is no motion to show",
            str(studies.results_folder(root)),
            "simulate first, or simulate again",
        )
    if what == PRINT:
        _show_print(root, motion, name)
    else:
        for region in REGIONS:
            _show_region(root, motion, name, region)
    arrange(root)
    refresh(root)


def hide(root: Any, name: str, what: str) -> None:
    """Remove a motion from the scene; its files stay."""
    for part in parts(root):
        if _pair(part) == (name, what):
            displays.remove(part)
    arrange(root)


def rebuild(root: Any) -> None:
    """Rebuild the shown motions from the present files of the shown run. Raises MuError."""
    for part in parts(root):
        part.modifiers.clear()
    for name, what in shown(root):
        show(root, name, what)


@connected(unit_object.REBUILT)
def follow(root: Any) -> None:
    """Update the shown motions to the shown run, after a change of parameters, run, choice or states.

    A motion that this run lacks is removed, and the panel reports it. A view of the largest value stays one.
    """
    studies.remember(root)
    key, motion, wrong = root.mu_unit.study.run, motion_of(root), ""
    same = all(part.get(RUN, key) == key for part in parts(root))
    if same and not any(_is_behind(part, motion) for part in parts(root)):
        return
    scene = bpy.context.scene
    follows = same or (motion is not None and motion.so_far)
    stays = follows and scene.frame_current == _peaks.get(root.mu_unit.uuid)
    for name, what in shown(root):
        try:
            show(root, name, what)
        except NotPrepared as wanted:
            wanted.begin(_later(root, follow))
        except MuError as error:
            hide(root, name, what)
            wrong = error.what
    root.mu_motion.trouble = wrong
    if stays and motion is not None:
        to_largest(root, motion, scene)


def _is_behind(part: Any, motion: Motion | None) -> bool:
    """Return True if a motion has states that a part of it does not play yet."""
    return motion is not None and bool(part.get(REACHED, len(motion.time_s)) < motion.reached.sum())


def _later(root: Any, act: Callable[[Any], None]) -> Callable[[], None]:
    """A call of a function with a unit, if that is still there by then."""
    uuid = root.mu_unit.uuid

    def call() -> None:
        found = unit_object.by_uuid(uuid)
        if found is not None:
            act(found)

    return call


def arrange(root: Any) -> None:
    """Put the first motion in the unit's place, the others next to it, opposite to the bending direction.

    With `on_unit` off, all of them are next to the design.
    """
    motion = motion_of(root)
    if motion is None:
        return
    settings = root.mu_motion
    low, high = motion.mesh.nodes.min(axis=0), motion.mesh.nodes.max(axis=0)
    step = settings.apart * float(high[1] - low[1])
    pairs = shown(root)
    places = {pair: number for number, pair in enumerate(pairs, 0 if settings.on_unit else 1)}
    for part in parts(root):
        place = places[_pair(part)]
        part.location = (0.0, -step * place, 0.0)
        part[displays.ON_UNIT] = place == 0
        part.hide_viewport = part.hide_render = place == 0
    _see(root)


def _see(root: Any) -> None:
    """Let a unit show its result if there is one in its place, else its design."""
    there = bool(displays.on_unit(root))
    # Candidates lie on the unit at rest: while they are visible, the unit is shown at rest.
    if there and root.mu_unit.show != unit_object.RESULT and not root.mu_unit.candidates:
        root.mu_unit.show = unit_object.RESULT
    elif not there and root.mu_unit.show == unit_object.RESULT:
        root.mu_unit.show = "preview"
    unit_object.show(root)


def is_seen(root: Any, part: Any) -> bool:
    """Return True if a part is visible, as an object or in the unit's place."""
    if part.get(displays.ON_UNIT):
        return bool(unit_object.shows_result(root) and root.visible_get())
    return bool(part.visible_get())


def _show_region(root: Any, motion: Motion, name: str, region: str) -> None:
    cut = root.mu_motion.cut and motion.halved
    skin = motion.skin(region, cut)
    file = motion.folder / PLAYED / f"{name}-{region}{'-cut' if cut else ''}.pc2"
    old = displays.part(root, MOTION, f"{name}|{region}")
    if old is not None and _plays(old, file) and not _is_behind(old, motion):
        return
    rest = skin.of_nodes(motion.mesh.nodes)
    _write_cache(file, motion, rest, skin.of_nodes(*motion.sides(name)))
    part = _part(root, motion, name, region, file)
    skeletons.write(part.data, skeletons.Skeleton(rest, faces=(skin.triangles,)))


def _show_print(root: Any, motion: Motion, name: str) -> None:
    """The printable solid, rebuilt if of other parameters, moved with the mesh."""
    found = studies.findings(root)
    if found is None or found.stale:
        raise InputError(
            "the motion belongs to other parameters than the unit has now",
            remedy="simulate again, or go back to those parameters",
        )
    if not unit_object.solid_is_current(root):
        core = to_unit(root.mu_unit)
        unit_object.put_solid(root, solid_of(root, core), core)
        root.mu_unit.show = "preview"
    solid = root.mu_unit.solid
    rest = vertices_of(solid)
    carried = run_motions.embedded(root, motion, rest)
    still = motion.carried(MODEL_A, carried)
    moved = still if name == MODEL_A else motion.carried(name, carried)
    file = motion.folder / PLAYED / f"{name}-{PRINT}.pc2"
    _write_cache(file, motion, rest, moved)
    part = _part(root, motion, name, PRINT, file)
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


_prints: dict[tuple[str, str], Played] = {}
"""Fields of printed bodies, by object and unit: they depend on a solid, which may change."""


def vertices_of(mesh: Any) -> Any:
    """Vertices (v, 3) of a Blender mesh."""
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", found)
    return found.reshape(-1, 3).astype(float)


def _part(root: Any, motion: Motion, name: str, body: str, file: Path) -> Any:
    """The object that shows a motion, new or not; it plays the point cache of its vertices."""
    part = displays.part(root, MOTION, f"{name}|{body}")
    if part is None:
        title = f"{'Model A' if name == MODEL_A else name} {body}"
        part = displays.add(root, MOTION, f"{name}|{body}", bpy.data.meshes.new(title))
        displays.lock(part, location=False)
    run = studies.shown_run(root)
    part[RUN] = "" if run is None else run.key
    part[REACHED] = int(motion.reached.sum())
    play(part, file, float(motion.time_s[1] - motion.time_s[0]))
    return part


def _write_cache(file: Path, motion: Motion, rest: Any, displacement: Any) -> None:
    """Write rest (v, 3) + displacement (s, v, 3) in mm at the protocol's samples. Raises OutputError."""
    step = float(motion.time_s[1] - motion.time_s[0])
    write_pc2(file, rest + displacement[motion.state], float(motion.time_s[0]), step)


def _plays(part: Any, file: Path) -> bool:
    modifier = part.modifiers.get("Motion")
    return modifier is not None and modifier.filepath == studies.relative(file) and file.is_file()


def play(part: Any, file: Path, step_s: float) -> None:
    """Let an object play a point cache of its vertices, samples `step_s` apart, in its time."""
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
    """Let a part play its cache in its time at the scene's frame rate.

    Blender takes sample number `frame_scale` frame - `frame_start`; its mode in seconds divides by the rate
    twice.
    """
    modifier = part.modifiers.get("Motion")
    samples = timeline.step_s(scene) / step_s
    wanted = np.float32(samples), np.float32(samples * scene.frame_start)
    if modifier is not None and (modifier.frame_scale, modifier.frame_start) != wanted:
        modifier.frame_scale, modifier.frame_start = wanted


def time_of(motion: Motion, scene: Any) -> float:
    """Time of the protocol in s at the scene's frame."""
    return float(motion.time_s[0] + timeline.seconds_at(scene))


def moment(motion: Motion, scene: Any) -> str:
    """Time of the protocol and its pressure at the scene's frame, as text."""
    time = float(np.clip(time_of(motion, scene), motion.time_s[0], motion.time_s[-1]))
    pressure = float(np.interp(time, motion.time_s, motion.pressure_kPa))
    return f"{time:.2f} s, {pressure + 0.0:.1f} kPa"


def frame_of(motion: Motion, time_s: float, scene: Any) -> int:
    """The scene's first frame at or after a time of the protocol."""
    return int(np.ceil(timeline.frames_at(scene, time_s - float(motion.time_s[0])) - 1e-6))


def last_frame(motion: Motion, scene: Any) -> int:
    """The scene's frame at which the protocol ends."""
    return frame_of(motion, float(motion.time_s[-1]), scene)


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


def played(root: Any, part: Any, motion: Motion | None = None) -> Played | None:
    """Data of a played part, from memory or from the files; None if they are gone or of another mesh.

    motion: that of the root, if the caller has it already.
    """
    motion = motion or motion_of(root)
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
    if root.mu_motion.field != DIFFERENCE:
        return kept
    try:
        apart = run_motions.apart(root, motion, name, body, cut)
    except NotPrepared as wanted:
        wanted.begin(_later(root, refresh))
        return kept
    return kept if apart is None else attrs.evolve(kept, fields={**kept.fields, DIFFERENCE: apart})


def _replayed(root: Any, part: Any, motion: Motion) -> Played | None:
    """Fields of a printed body; after a file was loaded, from its vertices."""
    key = part.name_full, root.mu_unit.uuid
    kept = _prints.get(key)
    if kept is None or kept.motion is not motion:
        try:
            carried = run_motions.embedded(root, motion, vertices_of(part.data))
            moved, still = (motion.carried(whose, carried) for whose in (_what(part)[0], MODEL_A))
        except (InputError, NotPrepared):
            return None
        kept = _prints[key] = Played(motion, _distances(moved, still))
    return kept


def refresh(root: Any) -> None:
    """Write the fields of the scene's frame to the shown objects, and colour them by the chosen one."""
    motion = motion_of(root)
    if motion is None:
        return
    settings = root.mu_motion
    if not settings.lock:
        low, high = extent(root, settings.field)
        if (settings.low, settings.high) != (np.float32(low), np.float32(high)):
            with updates.paused():
                settings.low, settings.high = low, high
    colour(root)
    viewports.show_colours()


def colour(root: Any) -> None:
    """Write the fields of the scene's frame, and their colours by the present range."""
    _write(root, bpy.context.scene)
    COLOURED.send(root)
    field = root.mu_motion.field
    field_colours.paint(root, [(part, field in part.data.attributes) for part in parts(root)])


def extent(root: Any, field: str) -> tuple[float, float]:
    """Range of a field in the shown objects over the motion, without its rarest values; else (0, 1)."""
    motion = motion_of(root)
    every = (played(root, part, motion) for part in parts(root))
    found = [p.fields[field] for p in every if p and field in p.fields]
    if not found:
        return 0.0, 1.0
    ends = np.array([field_colours.BY_NAME[field].ends(values) for values in found])
    low, high = float(np.nanmin(ends[:, 0])), float(np.nanmax(ends[:, 1]))
    if root.mu_motion.symmetric:
        high = max(abs(low), abs(high))
        low = -high
    return low, high if high > low else low + 1.0


def peak_frame(root: Any, scene: Any) -> int | None:
    """Frame at which the chosen field is largest in the shown objects, without its rarest values.

    None if it is unknown, or constant.
    """
    field, best = root.mu_motion.field, None
    for part in parts(root):
        found = played(root, part)
        values = found.fields.get(field) if found else None
        if found is None or values is None or values.ndim == 1 or np.isnan(values).all():
            continue
        largest = np.nanpercentile(values, 100.0 - field_colours.RARE, axis=1)[found.motion.state]
        largest[~found.motion.reached] = -np.inf
        sample = int(largest.argmax())
        if best is None or largest[sample] > best[0]:
            best = largest[sample], frame_of(found.motion, float(found.motion.time_s[sample]), scene)
    return None if best is None else best[1]


def _write(root: Any, scene: Any) -> None:
    """Write the fields of the scene's frame as point attributes, in their units."""
    motion = motion_of(root)
    for part in parts(root):
        found = played(root, part, motion)
        if found is None:
            continue
        _keep_time(part, float(found.motion.time_s[1] - found.motion.time_s[0]), scene)
        time = time_of(found.motion, scene)
        first, second, share = found.motion.at(time)
        for name, values in found.fields.items():
            now = values if values.ndim == 1 else (1 - share) * values[first] + share * values[second]
            if len(now) != len(part.data.vertices):
                continue
            if values.ndim > 1 and not found.motion.is_reached(time):
                now = np.full_like(now, np.nan)
            attribute = part.data.attributes.get(name) or part.data.attributes.new(name, "FLOAT", "POINT")
            attribute.data.foreach_set("value", np.ascontiguousarray(now, np.float32))
            if name == root.mu_motion.field:
                field_colours.write_colours(root, part.data, now)
        if root.mu_motion.field not in found.fields:
            left = part.data.attributes.get(root.mu_motion.field)
            if left is not None:  # of the run shown before
                part.data.attributes.remove(left)
            field_colours.write_colours(root, part.data, None)
        part.data.update()


@handler("frame_change_pre")
def _before_frame(scene, *_):
    # Before Blender evaluates the frame, so that positions and fields belong to the same one.
    for root in unit_object.roots():
        if parts(root) and root.mu_motion.live:
            _write(root, scene)


@at_end
def _forget() -> None:
    for kept in (_peaks, _played, _prints, run_motions):
        kept.clear()


@handler("load_post")
def _loaded(*_):
    _forget()
    for root in unit_object.roots():
        if parts(root):
            _write(root, bpy.context.scene)


def _forget_trouble(root: Any) -> None:
    # What is empty is left: each write is an update of the scene.
    if root.mu_motion.trouble:
        root.mu_motion.trouble = ""


@connected(JOB_NEWS)
def _job_news(key: str) -> None:
    for root in unit_object.roots():
        if key == SIMULATION.key(root) and parts(root):
            follow(root)


@connected(JOB_ENDED)
def _job_ended(_key: str) -> None:
    for root in unit_object.roots():
        _forget_trouble(root)
        follow(root)


@connected(VIEW_CHANGED)
def _chosen(root: Any) -> None:
    """Show a result: if none is in the unit's place yet, that of Model A."""
    if updates.are_paused():
        return
    _forget_trouble(root)
    if root.mu_unit.show != unit_object.RESULT:
        return
    # They lie on the unit at rest, which is shown with them.
    unit_object.hide_candidates(root)
    if displays.on_unit(root):
        viewports.show_colours()
        return
    motion = motion_of(root)
    if motion is None:
        fall_back(root)
        return
    root.mu_motion.on_unit = True
    if not parts(root):
        show(root, MODEL_A, MESH)
        to_largest(root, motion, bpy.context.scene)


def fall_back(root: Any) -> None:
    """Show the preview of a unit that has no result to show, and say so in the panel."""
    root.mu_motion.trouble = "No result of its own to show: simulate this unit first"
    with updates.paused():
        root.mu_unit.show = "preview"
    unit_object.show(root)


def to_largest(root: Any, motion: Motion, scene: Any, jump: bool = True) -> None:
    """End the timeline with the protocol and go to the frame of the field's largest value, if known."""
    scene.frame_end = last_frame(motion, scene)
    peak = peak_frame(root, scene) if jump else None
    if peak is not None:
        scene.frame_set(peak)
        _peaks[root.mu_unit.uuid] = peak
