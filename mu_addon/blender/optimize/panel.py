"""The panel Optimize: targets, free parameters, progress, and the proposed units."""

from __future__ import annotations

import re

import bpy

from ...optimization.freedoms import parameters
from ...optimization.target_kinds import KINDS
from ...studies.optimize import FRONT
from ..jobs.panel import draw_job, open_buttons, timed
from ..shared.file_cache import icon_of
from ..shared.panels import alert, draw_settings, fields_of, wrapped
from ..shared.wording import in_panel, label
from ..unit.base_classes import UnitPanel
from . import state as optimization
from .properties import ASKED, FREE, NAMED, conditions, present, scale_of

_KNOWN = parameters()
BARELY = "QUESTION"
"""Sign of a target that is met, but within two standard errors of being missed."""
LABELS = 0.4
"""Share of a field's width for its name."""
FRONT_SIZE = 11.0
"""Side of the front's picture, in heights of a button."""


class MU_PT_optimize(UnitPanel, bpy.types.Panel):
    """Find units that meet targets within given ranges of parameters"""

    bl_label = "Optimize"

    def show(self, layout, context, root):
        props = root.mu_optimize
        layout.prop(props, "source")
        if props.source == "file":
            layout.prop(props, "file")
            layout.prop(props, "own_unit")
        else:
            _targets(layout, props)
            _freedoms(layout, root, props)
            draw_settings(layout, fields_of(props, () if props.has_gravity else {"orientation_deg"}))
        if root.mu_unit.study.effects:
            wrapped(layout, "With the named effects that the panel Simulate lists", "LIGHT")
        draw_job(layout, root, optimization.OPTIMIZATION, "mu.optimize", "CON_TRACKTO", start_words(root))
        found = optimization.findings(root)
        if found is not None and found.outcome:
            _results(layout, found)


def start_words(root) -> str:
    """Label of the button: the job, and its expected duration; a file states the length of its search."""
    if root.mu_optimize.source == "file" or not root.mu_optimize.freedoms:
        return "Optimize"
    found = optimization.findings(root)
    measured = found is not None and "search" in found.seconds
    seconds = sum(seconds for _, seconds in optimization.plan_of(root))
    return timed("Optimize", (seconds, measured))


def _head(layout, text: str, what: str):
    """Draw a head with a button that adds a row to a list."""
    row = layout.row()
    row.label(text=text)
    row.operator("mu.optimize_list", text="", icon="ADD").what = what


def _remove(row, what: str, index: int) -> None:
    button = row.operator("mu.optimize_unlist", text="", icon="X")
    button.what, button.index = what, index


def _targets(layout, props) -> None:
    """Draw a box for each target: the quantity, where it is read, and its goal."""
    _head(layout, "The Unit Shall Have", "targets")
    if not props.targets:
        wrapped(layout, "Press + to add a target, such as an angle at a pressure", "INFO")
    for index, target in enumerate(props.targets):
        box = layout.box()
        row = box.row(align=True)
        row.prop(target, "kind", text="")
        _remove(row, "targets", index)
        column = box.column(align=True)
        for name in conditions(target).values():
            column.prop(target, "paths" if name == "path" else name)
        if KINDS[target.kind].is_yes:
            continue
        column.prop(target, "ask")
        for name in ASKED[target.ask]:
            column.prop(target, name, text=asked_title(target, name))


def _freedoms(layout, root, props) -> None:
    """Draw a box for each free parameter: its range, and its present value."""
    _head(layout, "By Changing", "freedoms")
    if not props.freedoms:
        wrapped(layout, "Press + for each parameter that the search may change", "INFO")
    for index, freedom in enumerate(props.freedoms):
        box = layout.box()
        row = box.row(align=True)
        row.prop(freedom, "parameter", text="")
        _remove(row, "freedoms", index)
        column = box.column(align=True)
        if freedom.parameter in NAMED:
            # Without a label beside it: the names need the whole width.
            column.prop(freedom, "values", text="")
            continue
        column.prop(freedom, "how", text="")
        d = FREE[freedom.parameter]
        scale = scale_of(freedom)
        shown = {"range": ("true_low", "true_high"), "values": ("true_values",), "fixed": ("true_value",)}
        for name in shown[freedom.how]:
            title = freedom.bl_rna.properties[name].name
            column.prop(freedom, name, text=f"{title} ({d.unit})" if d.unit else title)
        words = f"now {scale * present(root, freedom.parameter):.4g} {d.unit}".rstrip()
        # Below the fields, which have their own labels beside them.
        below = column.split(factor=LABELS)
        below.label(text="")
        below.label(text=words)


def asked_title(target, name: str) -> str:
    """Label next to a field of a target: its name and unit, for a curve the units of a pair."""
    unit = KINDS[target.kind].unit
    if name == "points":
        return f"kPa: {unit or 'value'}"
    title = target.bl_rna.properties[name].name
    return f"{title} ({unit})" if unit else str(title)


def _results(layout, found) -> None:
    box = layout.box()
    wrapped(box, in_panel(found.outcome), "CHECKMARK" if found.feasible else "INFO")
    for name in found.in_the_way:
        alert(box, f"Stands in the way: {name}")
    if found.other_start:
        wrapped(box, "The search started from other parameters than the unit has now", "INFO")
    open_buttons(box, optimization.OPTIMIZATION)
    icon = icon_of(found.folder / FRONT)
    if icon is not None:
        layout.template_icon(icon, scale=FRONT_SIZE)
    for proposed in found.proposed:
        _proposed(layout, proposed)
    if any(target_icon(t) == BARELY for proposed in found.proposed for t in proposed.targets):
        wrapped(layout, "Question mark: met, but the value's error may hide that it is not", "INFO")


def _proposed(layout, proposed) -> None:
    """Draw a fold for a proposed unit: its targets, changes and actions."""
    header, body = layout.panel(f"MU_proposed_{proposed.number}", default_closed=proposed.number > 1)
    missed = [t for t in proposed.targets if not t["met"]]
    header.label(text=f"Unit {proposed.number}", icon="ERROR" if missed else "CHECKMARK")
    row = header.row(align=True)
    button = row.row(align=True)
    button.enabled = not proposed.applied
    button.operator("mu.optimize_apply").number = proposed.number
    row.operator("mu.optimize_add", text="", icon="DUPLICATE").number = proposed.number
    if not body:
        return
    icon = icon_of(proposed.file.with_suffix(".png"))
    if icon is not None:
        body.template_icon(icon, scale=6.0)
    column = body.column(align=True)
    if proposed.applied:
        wrapped(column, "The unit has its parameters", "INFO")
    for target in proposed.targets:
        wrapped(column, target_line(target), target_icon(target))
    for text in proposed.changes:
        wrapped(column, labelled(text), "FORWARD")
    if proposed.reasons:
        column.label(text="Largest influence on each target:")
    for text in proposed.reasons:
        wrapped(column, labelled(text), "BLANK1")


def labelled(text: str) -> str:
    """A text with parameters by their labels: "chambers.wall_mm" becomes "Wall"."""
    return re.sub(r"\b[a-z]+\.[a-z]\w*", lambda m: label(_KNOWN[m[0]]) if m[0] in _KNOWN else m[0], text)


def target_line(target) -> str:
    """A target in a line: its name, the value with its standard error, and the goal."""
    if target["value"] is None:
        # The print check's result, or that of a unit that cannot carry the pressure.
        return f"{target['name']}: {'yes' if target['met'] else 'no'}"
    unit = f" {target['unit']}" if target["unit"] else ""
    error = target["standard_error"]
    spread = f" ± {error:.2g}" if error else ""
    return f"{target['name']}: {target['value']:.4g}{spread}{unit}, asked: {target['asked']}"


def target_icon(target) -> str:
    """Icon of a target: met for all values within two standard errors, met, or missed, if it has a goal."""
    if target["objective"]:
        return "DRIVER_DISTANCE"
    return "CHECKMARK" if target["robust"] else BARELY if target["met"] else "ERROR"
