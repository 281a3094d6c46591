"""Texts on the results of live bending, in the panel and over the viewport."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs import start_child
from ..results import field_colours, legend
from ..shared.panels import plain_row
from ..shared.registration import overlay
from ..unit import object as unit_object
from . import state

BESIDE = 180
LEAST_DEG = 0.1
"""Least stated error of an angle."""


def draw(layout: Any, root: Any) -> None:
    """Draw the switch, the slider next to it, and the result, with the same height in every state.

    Behind the solid, a result or candidates the switch is grey: it would change nothing that is seen.
    """
    layout, reason = layout.column(), behind(root)
    layout.enabled = not reason
    row = plain_row(layout)
    row.prop(root.mu_live, "on", toggle=True, icon="MOD_SIMPLEDEFORM", text=f"Bend{reason}")
    if not reason:
        right = row.row(align=True)
        right.active = root.mu_live.on
        right.prop(root.mu_live, "pressure_kPa", text="kPa", slider=True)
    if root.mu_live.on:
        layout.label(text=words(root), icon="MOD_SIMPLEDEFORM")
        plain_row(layout).prop(root.mu_live, "colour", expand=True)


def behind(root: Any) -> str:
    """Where the bend of a unit that is switched on waits to be seen again; "" if it is seen."""
    if not root.mu_live.on:
        return ""
    if root.mu_unit.show != "preview":
        return ": in Preview"
    return ": candidates are at rest" if root.mu_unit.candidates else ""


def words(root: Any) -> str:
    """Angle with its error, or the current action."""
    live = state.of(root)
    if live is None:
        return ""
    if root.mu_unit.trouble:
        return "A design rule is broken"
    if live.trouble:
        return live.trouble[:1].upper() + live.trouble[1:]
    shape = live.current
    if shape is None:
        doing = "After the running job" if start_child.is_busy() else "Bending..."
        dim = "" if live.shape is None else "the shape before" if live.shape.design else "a unit like it"
        return f"{doing} (dim: {dim})" if dim else doing
    kPa = min(root.mu_live.pressure_kPa, float(shape.pressure_kPa[-1]))
    angle = state.angle_at(shape, kPa)
    if shape.finished:
        return f"{angle:.1f}° at {kPa:.4g} kPa, as simulated"
    error = max(shape.error * abs(angle), LEAST_DEG)
    then = "finer after the job" if start_child.is_busy() else "refining"
    return f"{angle:.1f} ± {error:.1f}° at {kPa:.4g} kPa, {then}"


@overlay
def _draw() -> None:
    root = unit_object.active_root(bpy.context)
    live = None if root is None else state.of(root)
    if root is None or live is None or behind(root):
        return
    place = legend.room(bpy.context, 1)
    legend.write(words(root), place.left, place.foot - 25 * place.scale, round(14 * place.scale))
    ends = None if live.current is None else live.current.ends(root.mu_live.colour)
    if ends is not None and state.is_seen(root):
        # Beside the legend of motions that stand apart.
        place = place if legend.subject(bpy.context) is None else place.beside(BESIDE)
        legend.field_ramp(root, ends, place)
        legend.above([field_colours.BY_NAME[root.mu_live.colour].title], place)
