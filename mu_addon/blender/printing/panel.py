"""The panel Print of the sidebar tab MU: the solid, its printability check, and the files."""

from __future__ import annotations

import json
import math

import bpy

from ...design.printing.finding import counted
from ...run.child import FAILED
from ..jobs.panel import job_state
from ..shared.panels import alert, fold, large_button, plain_row, wrapped
from ..shared.wording import in_panel, path_symbol
from ..unit import object as unit_object
from ..unit.base_classes import DONE, OUTDATED, UnitPanel, parameters
from . import layer, marks
from . import state as printing
from .properties import OWN_PRINTER

ICONS = {"error": "CANCEL", "warning": "ERROR", "info": "INFO", "pass": "CHECKMARK"}
DIRECTIONS = 3
"""Number of build directions that are shown; the report has them all."""
TRADE = "None of these is best in all: choose what matters most. Rough figures; a check is finer"
INSIDE = "supports there cannot be removed"
NOT_PRINTABLE = 6
"""Exit status of a completed check that found an error."""


class MU_PT_print(UnitPanel, bpy.types.Panel):
    """The printable solid, its check and its files"""

    bl_label = "Print"
    place = ("print",)

    @classmethod
    def mark(cls, root):
        if printing.PRINTING.is_running(root):
            return "TIME"
        files = printing.EXPORT.found(root)
        return "" if files is None else OUTDATED if files.stale else DONE

    def show(self, layout, context, root):
        large_button(layout, "mu.solid", "MESH_DATA", root=root)
        solid = root.mu_unit.solid
        if solid is None:
            wrapped(layout, "No solid built yet", "INFO")
        else:
            _gates(layout, root, solid)


def _state(layout, root, job) -> None:
    """Draw the progress and the end of a job for the printer below its button."""
    child = job.child(root)
    if child is not None and child.state == FAILED and (child.error or {}).get("status") == NOT_PRINTABLE:
        of_file = job is printing.FILE_CHECK
        words = in_panel(str(child.error["what"])) if of_file else "Checked: not printable, as found below"
        alert(layout, words).operator("mu.print_dismiss")
    else:
        job_state(layout, job.child(root), "see below", printing.PRINTING.prefix)


def _gates(layout, root, solid) -> None:
    box = layout.box()
    if not unit_object.solid_is_current(root):
        wrapped(box, "Built from earlier parameters: build it again", "ERROR")
    g, column = json.loads(solid["mu_gates"]), box.column(align=True)
    for text in (
        f"Lattice whole: its {g['lattice_genus']} loops are there",
        f"{g['components']} body, {g['bad_edges_after_stl']} open edges in its STL",
        f"{g['inner_shells']} cavity of {g['inner_volume_mm3'] / 1000:.2f} cm³",
        f"{g['volume_mm3'] / 1000:.2f} cm³ of resin, {g['triangles']} triangles",
    ):
        column.label(text=text, icon="CHECKMARK")
    if solid["mu_path"]:
        column.label(text=f"Waveguide along {path_symbol(solid['mu_path'])}", icon="CHECKMARK")


class _OfPrint(UnitPanel):
    bl_parent_id = "MU_PT_print"


class MU_PT_print_check(_OfPrint, bpy.types.Panel):
    """Printability check: findings with their locations, and the best build directions"""

    bl_label = "Check"
    bl_options = set()

    def show(self, layout, context, root):
        settings = root.mu_print
        layout.prop(settings, "printer")
        if settings.printer == OWN_PRINTER:
            layout.prop(settings, "printer_file")
        layout.prop(settings, "limits_file")
        layout.prop(settings, "up")
        words = printing.CHECK.label(root, "Check Print")
        large_button(layout, "mu.print_check", "VIEWZOOM", root=root, text=words)
        _state(layout, root, printing.CHECK)
        found = printing.CHECK.found(root)
        if found is None:
            wrapped(layout, "Not checked yet", "INFO")
            return
        if found.stale:
            alert(layout, f"Stale: {found.stale}. Check again")
        column = layout.column()
        column.active = not found.stale
        _verdict(column, found, "mend before printing")
        _findings(column, settings, found)
        row = layout.row(align=True)
        row.operator("mu.print_marks", icon="EMPTY_AXIS")
        row.operator("mu.print_clear", text="", icon="X")
        if marks.mark_objects(root):
            layout.prop(settings, "marker")
            if marks.marked(root) != found.digest:
                wrapped(layout, "The marks are from an earlier check: mark again", "INFO")
        _directions(layout, settings, found)
        layout.operator("mu.print_open", text="Report", icon="URL").what = "report"


def _findings(layout, settings, found) -> None:
    """Draw a line for every error and warning, the chosen one in full; then how many passed."""
    passed = []
    for number, finding in enumerate(found.content["findings"]):
        if finding["severity"] == "pass":
            passed.append(finding)
            continue
        chosen = number == settings.finding
        count = finding["count"]
        times = f"  ({count})" if count > 1 else ""
        text = f"{finding['check'].capitalize()}{times}{_measure(finding)}"
        icon = ICONS[finding["severity"]]
        layout.operator("mu.print_show", text=text, icon=icon, depress=chosen).finding = number
        if chosen:
            _in_full(layout.box(), number, settings.place, finding)
    body = fold(layout, "MU_passed", f"{len(passed)} checks passed", icon="CHECKMARK")
    if body:
        for finding in passed:
            wrapped(body, finding["what"])


def _in_full(box, number, place, finding) -> None:
    wrapped(box, finding["what"])
    places = finding["places"]
    if len(places):
        row = box.row(align=True)
        before = row.operator("mu.print_show", text="", icon="TRIA_LEFT")
        before.finding, before.place = number, (place - 1) % len(places)
        row.label(text=f"place {place % len(places) + 1} of {len(places)}")
        after = row.operator("mu.print_show", text="", icon="TRIA_RIGHT")
        after.finding, after.place = number, (place + 1) % len(places)
        x, y, z = places[place % len(places)]
        box.label(text=f"at {x:.1f}, {y:.1f}, {z:.1f} mm")
    if finding["remedy"]:
        wrapped(box, finding["remedy"].capitalize())
    if finding["assumed"]:
        wrapped(box, "This limit is assumed, not published: set your own", "INFO")


def _measure(finding) -> str:
    """Value and limit of a finding, where it has both and they are more than a count."""
    value, limit, unit = finding["value"], finding["limit"], finding["unit"]
    if value is None or limit is None or not unit or not math.isfinite(value):
        return ""
    return f":  {value:.3g} / {limit:.3g} {unit}"


def _directions(layout, settings, found) -> None:
    """Draw the best build directions of the check and the chosen one, with their costs and a button."""
    builds = found.content["orientation"]
    if not builds:
        return
    body = fold(layout, "MU_directions", "Build Directions")
    if not body:
        return
    chosen = [build for build in builds if _is_up(build, settings)]
    choice = [build for build in builds if build["best_among"]][:DIRECTIONS]
    if len(choice) > 1:
        wrapped(body, TRADE, "INFO")
    for build in choice + [build for build in chosen if build not in choice]:
        box = body.box()
        row = box.split(factor=0.66)
        row.label(text=direction_words(build["direction"]).capitalize(), icon="SORT_DESC")
        same = build in chosen
        button = row.operator("mu.print_up", text="Chosen" if same else "Use", depress=same)
        button.direction = build["direction"]
        column = box.column(align=True)
        cups = _ml(build["cup_ml"])
        column.label(text=f"{build['islands']} islands, cups {cups if 'below' in cups else f'of {cups}'}")
        column.label(text=f"{build['support_mm2']:.0f} mm² to support")
        if build["inner_mm2"] >= 0.5:
            wrapped(column, f"{build['inner_mm2']:.0f} mm² of it in chambers: {INSIDE}", "ERROR")


def _ml(volume: float) -> str:
    """A volume in ml as text; a negligible one has no digits."""
    return f"{volume:.2g} ml" if volume >= 0.01 else "below 0.01 ml"


def direction_words(direction) -> str:
    """A build direction (3,) in the unit's frame as text: "tilted 35° to +x +y"."""
    length = math.hypot(*direction)
    if not length:
        return "none is set"
    x, y, z = (value / length for value in direction)
    angle = math.degrees(math.acos(max(-1.0, min(1.0, z))))
    if angle < 1.0 or angle > 179.0:
        return "upright" if z > 0.0 else "upside down"
    aside = math.hypot(x, y)
    signs = [f"{'+' if s > 0 else '-'}{axis}" for axis, s in (("x", x), ("y", y)) if abs(s) > 0.38 * aside]
    toward = " ".join(signs)
    return f"lying, {toward} up" if abs(angle - 90.0) < 1.0 else f"tilted {angle:.0f}° to {toward}"


def _is_up(build, settings) -> bool:
    return sum(a * b for a, b in zip(build["direction"], settings.up, strict=True)) > 0.9999


class MU_PT_print_layers(_OfPrint, bpy.types.Panel):
    """Layers of the solid, one at a time in the 3D view"""

    bl_label = "Layers"
    bl_options = {"DEFAULT_CLOSED"}

    def show(self, layout, context, root):
        settings = root.mu_print
        shown = layer.layer_object(root)
        if shown is None:
            layout.operator("mu.print_layer", icon="ALIGN_MIDDLE")
            wrapped(layout, "Layers are those of the solid, built along Up", "INFO")
            return
        row = layout.row(align=True)
        row.prop(settings, "layer", slider=True)
        row.operator("mu.print_layer_clear", text="", icon="X")
        if not unit_object.solid_is_current(root):
            alert(layout, "Of an earlier solid: build it again")
            return
        found = layer.facts(shown)
        column = layout.column(align=True)
        column.label(text=f"{found['height_mm']:.1f} of {found['whole_mm']:.1f} mm")
        column.label(text=f"Material (yellow): {found['area_mm2']:.0f} mm²")
        column.label(text=f"Enclosed (blue): {found['enclosed_mm2']:.0f} mm²")


class MU_PT_print_files(_OfPrint, bpy.types.Panel):
    """Files for printer and CAD, each read back and compared, and specimens to measure"""

    bl_label = "Files"
    bl_options = set()
    place = ("print",)

    def show(self, layout, context, root):
        settings, found = root.mu_print, printing.CHECK.found(root)
        plain_row(layout).prop(settings, "formats")
        layout.prop(settings, "quality")
        layout.prop(settings, "compensate")
        if settings.compensate == "gauge":
            layout.prop(settings, "gauge")
        if settings.compensate != "none" and settings.formats & {"3mf-beams", "step"}:
            wrapped(layout, "Beams and STEP keep their nominal size", "INFO")
        layout.prop(settings, "vents")
        if settings.vents:
            wrapped(layout, f"Build direction: {direction_words(settings.up)}", "INFO")
            if settings.formats & {"3mf-beams", "step"}:
                wrapped(layout, "Beams and STEP have no vents", "INFO")
        path = root.mu_unit.path
        along = f"Waveguide along {path_symbol(path)}" if path else "Without a waveguide: no path chosen"
        wrapped(layout, along, "INFO")
        if found is None or found.stale:
            wrapped(layout, f"Not checked: {found.stale}" if found else "Not checked", "QUESTION")
        else:
            _verdict(layout, found, "export asks first")
        words = printing.EXPORT.label(root, "Export")
        large_button(layout, "mu.print_export", "EXPORT", root=root, text=words)
        _state(layout, root, printing.EXPORT)
        _written(layout, printing.EXPORT.found(root))
        layout.operator("mu.export_stl", text="Export STL As ...", icon="FILE_FOLDER")
        body = fold(layout, "MU_specimens", "Specimens")
        if body:
            row = body.row(align=True)
            row.operator("mu.print_specimens", icon="OUTLINER_OB_LATTICE")
            row.operator("mu.print_open", text="", icon="FILE_FOLDER").what = "specimens"
            _state(body, root, printing.SPECIMENS)
        parameters(layout, root, "print")


class MU_PT_print_file(_OfPrint, bpy.types.Panel):
    """Printability check of an STL file, with a repair before it"""

    bl_label = "STL File"
    bl_options = {"DEFAULT_CLOSED"}

    def show(self, layout, context, root):
        settings = root.mu_print
        layout.prop(settings, "stl_file")
        layout.prop(settings, "repair")
        layout.prop(settings, "against_unit")
        large_button(layout, "mu.print_check_file", "VIEWZOOM")
        _state(layout, root, printing.FILE_CHECK)
        shown = printing.FILE_CHECK.found(root)
        if shown is None or shown.stale:
            return
        box, found = layout.box(), shown.content
        for finding in found["findings"]:
            if finding["severity"] in marks.FAULTS:
                words = f"{finding['check'].capitalize()}: {finding['what']}"
                wrapped(box, words, ICONS[finding["severity"]])
        if found["verdict"] == "pass":
            wrapped(box, "Every check passed", ICONS["pass"])
        if "repair" in found:
            changes = found["repair"]["changes"]
            done = "; ".join(f"{change['count']} {change['what']}" for change in changes)
            wrapped(box, f"Repaired: {done or 'nothing was changed'}", "TOOL_SETTINGS")
        row = layout.row(align=True)
        row.operator("mu.print_open", text="Report", icon="URL").what = "file_report"
        row.operator("mu.print_open", text="", icon="FILE_FOLDER").what = "check-file"


def _verdict(layout, found, then: str) -> None:
    """Draw what a check found, in a line; then: what follows from errors."""
    errors, words = printing.faults(found.content)
    if errors:
        alert(layout, f"The check found {words}: {then}", "CANCEL")
    else:
        wrapped(layout, f"Checked: {words}{' to decide on' if 'warning' in words else ''}", "CHECKMARK")


def _written(layout, found) -> None:
    """The files of the latest export."""
    if found is None:
        return
    box = layout.box()
    row = box.row()
    resin = found.content["resin"]
    row.label(text=f"{resin['ml']:.2f} ml, {resin['g']:.1f} g")
    row.operator("mu.print_open", text="", icon="FILE_FOLDER").what = "export"
    if found.stale:
        wrapped(box, f"Stale: {found.stale}", "ERROR")
    column = box.column(align=True)
    column.active = not found.stale
    for entry in found.content["files"]:
        column.label(text=f"{entry['file']}, {entry['bytes'] / 1e6:.2f} MB", icon="CHECKMARK")
    if vented := found.content["vents"]:
        count = len(vented["vents"])
        before, after = (vented[f"trapped_{when}_ml"] for when in ("before", "after"))
        words = f"{counted(count, 'vent', 'vents')}: {_ml(before)} trapped before, {_ml(after)} after"
        wrapped(column, words if count else f"No vent is needed: {_ml(before)} trapped at most", "INFO")
    for entry in found.content["refused"]:
        wrapped(column, f"Not written: {entry['format']}: {entry['why']}", "ERROR")
