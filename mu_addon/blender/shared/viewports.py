"""The 3D views of every window: framing, redraws, and drawing over them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

LOWER, SENSOR_MM = 0.6, 72.0
"""Usual ratio of a 3D view's height to its width, and the width in mm of its camera's sensor."""
ROOM = 1.2
"""Factor on the framed size, for headers that cover a view, and for a unit that bends."""


def areas() -> Iterator[Any]:
    """The areas of every window that show a 3D view."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield area


def corners(objects: Iterable[Any]) -> Any:
    """Corners (8 n, 3) of the boxes of n objects as they are drawn, in the scene."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = [obj.evaluated_get(depsgraph) for obj in objects]
    return np.array([obj.matrix_world @ Vector(c) for obj in evaluated for c in obj.bound_box])


def in_window() -> Any:
    """Context of the first window, for what a timer does; without a window, as in background, of none."""
    windows = bpy.context.window_manager.windows
    return bpy.context.temp_override(window=windows[0]) if windows else bpy.context.temp_override()


def frame(objects: Iterable[Any], only: Any | None = None) -> None:
    """Frame objects in every 3D view or in one, from its present side; also in background."""
    points = corners(objects)
    for area in areas() if only is None else (only,):
        frame_points(area, points)


def frame_points(area: Any, points: Any) -> None:
    """Frame points (n, 3) of the scene in a 3D view, from its present side."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = ROOM * float(np.linalg.norm(points - middle, axis=1).max())
    region = next(region for region in area.regions if region.type == "WINDOW")
    # The narrower side; unknown in background.
    known = min(region.height, region.width) > 1
    share = min(region.height / region.width, between_sides(area)) if known else LOWER
    space = area.spaces.active
    view = space.region_3d
    view.view_location = middle
    # Half the angle of the view is that of its width.
    view.view_distance = radius / (share * SENSOR_MM / (2.0 * space.lens))
    space.clip_start = min(space.clip_start, view.view_distance / 100.0)
    space.clip_end = max(space.clip_end, 10.0 * view.view_distance)


def keep_in_view(before: Any, after: Any) -> None:
    """Frame points (m, 3) in those 3D views that held others (n, 3) whole and do not hold these."""
    for area in areas():
        if holds(area, before) and not holds(area, after):
            frame_points(area, after)


def between_sides(area: Any) -> float:
    """Share of a view's width, about its middle, that toolbar and sidebar leave clear."""
    region = next(region for region in area.regions if region.type == "WINDOW")
    over = [other.width for other in area.regions if other.type in ("TOOLS", "UI") and other.width > 1]
    # Beside the view, and not over it, they take nothing of it.
    over = over if region.width >= area.width > 1 else []
    return max(1.0 - 2.0 * max(over, default=0.0) / max(region.width, 1), 0.3)


def below_headers(area: Any) -> float:
    """Share of a view's height, about its middle, that the headers over it leave clear."""
    region = next(region for region in area.regions if region.type == "WINDOW")
    over = [other.height for other in area.regions if other.type in ("HEADER", "TOOL_HEADER")]
    return max(1.0 - 2.0 * sum(over) / region.height, 0.3) if region.height >= area.height > 1 else 1.0


def holds(area: Any, points: Any) -> bool:
    """Return True if all points (n, 3) are within a view, clear of toolbar, sidebar and headers over it."""
    projected = (
        np.column_stack([points, np.ones(len(points))])
        @ np.array(area.spaces.active.region_3d.perspective_matrix).T
    )
    limits = np.array([between_sides(area), below_headers(area)])
    return bool((np.abs(projected[:, :2]) <= limits * projected[:, 3:]).all())


def scale(factor: float) -> None:
    """Scale every 3D view's distances from the scene's origin by a factor."""
    for area in areas():
        space = area.spaces.active
        view = space.region_3d
        view.view_location *= factor
        view.view_distance *= factor
        space.clip_start, space.clip_end = space.clip_start * factor, space.clip_end * factor


def object_mode(context: Any) -> None:
    """Leave the mode of editing or painting that the active object is in."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def select(context: Any, objects: Iterable[Any], active: Any | None = None) -> None:
    """Select objects, no other ones, and make one of them the active object if it is given."""
    for other in context.selected_objects:
        other.select_set(False)
    for obj in objects:
        obj.select_set(True)
    if active is not None:
        context.view_layer.objects.active = active


def frame_selected(context: Any) -> None:
    """Frame the selection in the 3D view: a scene may be metres wide, and a unit is 75 mm tall."""
    if bpy.app.background:
        return
    area = context.area if context.area and context.area.type == "VIEW_3D" else None
    area = area or next((a for a in context.screen.areas if a.type == "VIEW_3D"), None)
    if area is not None:
        frame(context.selected_objects, area)


def shows_colours(context: Any) -> bool:
    """Return True if a 3D view's shading shows the colours of fields, by attribute or by material."""
    shading = context.space_data.shading
    if shading.type == "RENDERED" and context.scene.render.engine == "BLENDER_WORKBENCH":
        return bool(context.scene.display.shading.color_type == "VERTEX")
    return shading.type in ("MATERIAL", "RENDERED") or (shading.type, shading.color_type) == (
        "SOLID",
        "VERTEX",
    )


def show_colours() -> None:
    """Let 3D views in solid shading show colour attributes; what has none keeps its material's colour."""
    for area in areas():
        if area.spaces.active.shading.type == "SOLID":
            area.spaces.active.shading.color_type = "VERTEX"


def redraw() -> None:
    """Redraw every 3D view and its panels."""
    for area in areas():
        area.tag_redraw()


def redraw_regions(*kinds: str) -> None:
    """Redraw regions of every 3D view by their types: the scene is "WINDOW", the sidebar "UI"."""
    for area in areas():
        for region in area.regions:
            if region.type in kinds:
                region.tag_redraw()


def redraw_status() -> None:
    """Redraw the status bar of every window, and the headers that replace a hidden one.

    The status bar is no area that Python can reach: Blender redraws it when its text is set, which belongs to
    a running tool while there is one.
    """
    for window in bpy.context.window_manager.windows:
        if window.screen.show_statusbar and not len(window.modal_operators):
            with bpy.context.temp_override(window=window):
                window.workspace.status_text_set(None)
    redraw_regions("HEADER")


def extend_status_bar(draw: Callable[[Any, Any], None]) -> None:
    """Append a function to what the status bar draws, for good.

    Blender keeps what the bar draws at its first status text, such as that of an installation, and draws it
    again after each text: that is extended, too.
    """
    bar = bpy.types.STATUSBAR_HT_header
    bar.draw = getattr(bar, "_draw_orig", bar.draw)
    bar.append(draw)
    bar._draw_orig = bar.draw


def reduce_status_bar(draw: Callable[[Any, Any], None]) -> None:
    """Undo `extend_status_bar`."""
    bar = bpy.types.STATUSBAR_HT_header
    bar.draw = bar._draw_orig
    bar.remove(draw)
