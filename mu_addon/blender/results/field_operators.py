"""One click from a run to a field painted on the unit, framed, at the frame of its largest value."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import numpy as np
from mathutils import Quaternion, Vector

from ...errors import InputError
from ...report.motion_files import CONTACT_PRESSURE, MODEL_A, REGIONS, SENSITIVITY
from ..shared import updates, viewports
from ..shared.blender_property import Choice, Flag
from ..shared.operators import operator
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from . import field_colours, places, run_motions
from . import motion as motion_parts
from .operators import MotionOperator

OPEN = Quaternion((0.5, 0.5, 0.5, 0.5))
"""View from +x, for a body that is cut open."""


def _field_in_words(context, properties) -> str:
    root = unit_object.active_root(context)
    reason = lacking(root, properties.field) if root is not None else ""
    text = next(f.text for f in field_colours.FIELDS if f.name == properties.field)
    return f"{text}. Not here: {reason}" if reason else f"{field_show.__doc__}: {text}"


@operator(
    MotionOperator,
    "Show on the Unit",
    tip=_field_in_words,
    field=Choice(
        "Field", "Physical quantity to show", items=[(f.name, f.label, f.text) for f in field_colours.FIELDS]
    ),
    frame=Flag("Frame in View", "Bring the unit into view", default=True),
    jump=Flag("Jump to the Largest", "Go to the frame of the field's largest value", default=True),
)
def field_show(operator, context, root, field, frame, jump):
    """Paint this field on the unit, in view, at the frame at which it is largest"""
    motion = motion_parts.motion_of(root)
    name = whose(root, motion, field)
    if field == motion_parts.DIFFERENCE:
        run_motions.apart(root, motion, name, next(iter(REGIONS)), bool(root.mu_motion.cut and motion.halved))
    for pair in motion_parts.shown(root):
        if pair != (name, motion_parts.MESH):
            motion_parts.hide(root, *pair)
    settings = root.mu_motion
    with updates.paused():
        settings.field, settings.on_unit = field, True
    # They would cover the colours, at the position of the unit at rest.
    unit_object.hide_candidates(root)
    motion_parts.show(root, name, motion_parts.MESH)
    if field == motion_parts.DIFFERENCE and (words := run_motions.difference_words(root)):
        if not any(field in part.data.attributes for part in motion_parts.parts(root)):
            raise InputError(words)
        operator.report({"INFO"}, words)
    motion_parts.to_largest(root, motion, context.scene, jump)
    if frame:
        frame_in_view(context, root)


def lacking(root, field: str) -> str:
    """Return the reason why the shown run lacks a field, or ""."""
    motion = motion_parts.motion_of(root)
    if motion is None:
        return "there is no motion yet"
    try:
        whose(root, motion, field)
    except InputError as error:
        return error.what
    return ""


def whose(root, motion, field: str) -> str:
    """Owner of the motion that shows a field: Model A or, for a deviation, the chosen or the best path.

    Raises InputError where the run has no such field.
    """
    if field == motion_parts.DEVIATION:
        found = studies.findings(root)
        ranked = [name for name, _ in found.ranking] if found else []
        wanted = [root.mu_unit.path, *ranked, *motion.paths]
        name = next((name for name in wanted if name in motion.paths), "")
        if not name:
            raise InputError(
                "this run has no sensor path, so nothing deviates",
                str(motion.folder.parent),
                "simulate with Place the Sensor, or choose another run",
            )
        return name
    if field == CONTACT_PRESSURE and not any(field in fields for fields in motion.fields.values()):
        raise InputError(
            "this run was simulated without self-contact",
            str(motion.folder.parent),
            "simulate with Self-Contact, or choose another run",
        )
    if field == SENSITIVITY and not motion.sensitivity:
        raise InputError(
            "this run has no map of the sensitivity",
            str(motion.folder.parent),
            "simulate with Place the Sensor, or choose another run",
        )
    return MODEL_A


def frame_in_view(context, root) -> None:
    """Frame the visible parts of a unit's motion in every 3D view; a cut body from its open side."""
    shown = places.seen(root)
    if not shown or context.screen is None:
        return
    points = np.concatenate(
        [vertices @ np.array(part.matrix_world.to_3x3()).T + np.array(part.matrix_world.translation)
         for part in shown
         for vertices in (motion_parts.vertices_of(part.data), places.moved(part))]
    )  # fmt: skip
    inward = root.matrix_world.to_quaternion() @ OPEN
    for area in viewports.areas():
        view = area.spaces.active.region_3d
        toward = root.matrix_world.to_quaternion().inverted() @ (view.view_rotation @ Vector((0, 0, 1)))
        if root.mu_motion.cut and toward.x < 0.5:
            view.view_rotation = inward
        viewports.frame_points(area, points)
