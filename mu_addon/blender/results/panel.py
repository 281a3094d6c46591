"""The panel Results: angles, ranking and contact forces; motion, colours and pictures below it."""

from __future__ import annotations

from typing import ClassVar

import bpy

from ...report.motion_files import FOLDER, MODEL_A
from ...simulate_and_place.charts import ANGLE, delta_name
from ..jobs.panel import open_buttons
from ..shared.file_cache import icon_of
from ..shared.panels import alert, plain_row, wrapped
from ..shared.wording import path_symbol, sentence
from ..simulate import study_folder as studies
from ..simulate.job import SIMULATION
from ..unit import object as unit_object
from ..unit.base_classes import UnitPanel
from . import field_colours, field_operators, legend_object, run_motions, run_panel
from . import motion as motion_parts
from .operators import NO_MOTION

BUTTONS = (
    ("deviation_mm", "Deviation"),
    ("von_mises_kPa", "Stress"),
    ("displacement_mm", "Displacement"),
    ("contact_pressure_kPa", "Self-Contact"),
)
"""Fields with a button that paints them, and its label."""
AS = {motion_parts.MESH: "Analysis mesh", motion_parts.PRINT: "Printable solid"}
"""Ways to show a motion."""
PICTURE = 13.0
"""Side of a picture, in heights of a button."""


def _of(name: str) -> str:
    """Owner of a motion, as text."""
    return ("Path " if name.startswith("alpha") else "") + motion_parts.owner(name)


class MU_PT_results(UnitPanel, bpy.types.Panel):
    """Results of the study"""

    bl_label = "Results"

    def show(self, layout, context, root):
        # First the parts of fixed height, so that a click on a run moves nothing under the mouse.
        run_panel.draw_runs(layout, root)
        found = studies.findings(root)
        if found is None:
            wrapped(layout, "Nothing simulated yet: press the button at the top", "INFO")
            return
        if found.stale:
            alert(layout, "Stale: these results belong to other parameters. Simulate again")
        if not found.run.complete:
            motion = motion_parts.motion_of(root)
            words = [found.run.state, motion.so_far if motion is not None else ""]
            wrapped(layout, sentence(": ".join(filter(None, words))), "INFO")
        if found.caveat:
            wrapped(layout, sentence(found.caveat), "INFO")
        column = layout.column(align=True)
        column.active = not found.stale
        for pressure, angle in found.angles:
            if pressure in (found.angles[0][0], found.angles[-1][0]):
                column.label(text=f"{angle:+.1f}° at {pressure:g} kPa")
        if most := found.summary.get("nearest_to_break"):
            percent, part = most["percent"], most["part"]
            column.label(text=f"{percent:.0f} % of break in {part}, {most['pressure_kPa']:g} kPa")
        for contact in studies.contact_forces(root):
            most = int(contact.force_N.argmax())
            words = (
                f"{contact.force_N[most]:.2f} N at {contact.time_s[most]:.1f} s"
                if contact.force_N[most]
                else "no contact"
            )
            column.label(text=f"{contact.name}: {words}", icon="CUBE")
        ranking = found.ranking
        if ranking:
            best, j = ranking[0]
            tied = found.summary.get("tied_with_chosen") or []
            icon = "CHECKMARK" if root.mu_unit.path == best else "NONE"
            column.label(text=f"Best path {path_symbol(best)}: deviates {j:.3f} mm", icon=icon)
            if tied:
                wrapped(column, f"as good: {path_symbol(', '.join(tied))}")
        search = found.summary.get("search")
        if search:
            best = search["best"]
            column.label(text=f"Whole lattice: {best['name']}, {best['J_hat_mm']:.3f} mm")
            column.label(
                text=f"{best['length_mm']:.0f} mm long, {search['checked']} of {search['paths']} solved"
            )
        if motion_parts.motion_of(root) is not None:
            _look_buttons(layout, root, bool(ranking))
        open_buttons(layout, SIMULATION)


def _look_buttons(layout, root, ranked: bool) -> None:
    """Draw buttons for the most used views; grey where the shown run lacks them."""
    grid = layout.grid_flow(columns=2, align=True, even_columns=True, row_major=True)
    settings = root.mu_motion
    for name, text in BUTTONS:
        on = unit_object.shows_result(root) and settings.field == name
        cell = grid.row(align=True)
        cell.active = not field_operators.lacking(root, name)
        cell.operator("mu.field_show", text=text, depress=on).field = name
    text = "Ranking beside the Unit" if ranked else "Candidates beside the Unit"
    plain_row(layout).prop(root.mu_unit, "candidates", text=text, toggle=True, icon="CURVE_PATH")


class MU_PT_warnings(UnitPanel, bpy.types.Panel):
    """Warnings about the results shown"""

    bl_label = "Warnings"
    bl_parent_id = "MU_PT_results"
    bl_options: ClassVar[set[str]] = set()
    bl_order = 0

    @classmethod
    def shows(cls, root):
        found = studies.findings(root)
        return found is not None and bool(found.summary.get("warnings"))

    def draw_header(self, context):
        """Draw the mark, also while the panel is closed."""
        self.layout.label(text="", icon="ERROR")

    def show(self, layout, context, root):
        for text in studies.findings(root).summary["warnings"]:
            wrapped(layout, text, "DOT")


class MU_MT_motion(bpy.types.Menu):
    """Motions of the run: the unit without a sensor and with each path, as mesh and as print"""

    bl_label = "Show"

    def draw(self, context):
        root = unit_object.active_root(context)
        motion = None if root is None else motion_parts.motion_of(root)
        if motion is None:
            self.layout.label(text=NO_MOTION)
            return
        on, row = motion_parts.shown(root), self.layout.row()
        for what, title in AS.items():
            column = row.column()
            column.label(text=title)
            for name in (MODEL_A, *motion.paths):
                entry = column.row()
                entry.enabled = (name, what) not in on
                button = entry.operator("mu.motion", text=_of(name))
                button.name, button.what, button.on = name, what, True


class _OfMotion(UnitPanel):
    """Base of panels that appear once there is a motion."""

    bl_parent_id = "MU_PT_results"
    bl_options: ClassVar[set[str]] = set()

    @classmethod
    def shows(cls, root):
        return motion_parts.motion_of(root) is not None


class MU_PT_motion(_OfMotion, bpy.types.Panel):
    """The motion on the timeline: the unit without a sensor and with any path, side by side"""

    bl_label = "On the Model"
    bl_order = 1

    def show(self, layout, context, root):
        motion, on = motion_parts.motion_of(root), motion_parts.shown(root)
        column = layout.column(align=True)
        for name, what in on:
            row = column.row(align=True)
            row.label(text=f"{_of(name)}, {AS[what].lower()}")
            button = row.operator("mu.motion", text="", icon="X")
            button.name, button.what, button.on = name, what, False
        layout.menu("MU_MT_motion", text="Add a Motion", icon="ADD")
        if not motion.paths:
            wrapped(layout, "Paths: simulate with Place the Sensor", "INFO")
        settings = root.mu_motion
        for part in motion_parts.parts(root):
            if part.get("mu_outside"):
                wrapped(layout, f"{part.name}: {part['mu_outside']}", "INFO")
        if not on:
            return
        row = layout.row(align=True)
        row.operator("screen.animation_play", text="Play", icon="PLAY")
        row.operator("mu.motion_update", text="", icon="FILE_REFRESH")
        row.operator("mu.motion_clear", text="", icon="X")
        column = layout.column(align=True)
        column.prop(settings, "on_unit")
        column.prop(settings, "apart")
        column.prop(settings, "live")


class MU_PT_field(_OfMotion, bpy.types.Panel):
    """The field shown by the colours, and its range"""

    bl_label = "Colours"
    bl_order = 2

    @classmethod
    def shows(cls, root):
        return super().shows(root) and bool(motion_parts.parts(root))

    def show(self, layout, context, root):
        settings = root.mu_motion
        # As wide as the panel: names of stresses are long.
        plain_row(layout).prop(settings, "field", text="")
        missing = [
            part.name for part in motion_parts.parts(root) if settings.field not in part.data.attributes
        ]
        if missing:
            wrapped(layout, f"Grey, without this field: {', '.join(missing)}", "INFO")
        if settings.field == motion_parts.DIFFERENCE and run_motions.difference_words(root):
            wrapped(layout, run_motions.difference_words(root), "INFO")
        unit = field_colours.BY_NAME[settings.field].unit
        column = layout.column(align=True)
        column.prop(settings, "low", text=f"From ({unit})" if unit else "From")
        column.prop(settings, "high", text="To")
        row = plain_row(layout)
        row.prop(settings, "lock", toggle=True, icon="LOCKED" if settings.lock else "UNLOCKED", text="Lock")
        row.prop(settings, "symmetric", toggle=True)
        row.operator("mu.motion_range", text="Fit")
        row = plain_row(layout)
        row.prop(settings, "marker", toggle=True)
        row.operator("mu.probe", icon="EYEDROPPER")
        row = plain_row(layout)
        row.prop(settings, "legend", toggle=True)
        there = legend_object.bar_of(root) is not None
        row.operator("mu.motion_legend", text="In Renders", icon="RENDER_STILL", depress=there).on = not there


class MU_PT_pictures(_OfMotion, bpy.types.Panel):
    """The angle over the pressure, and where and when the chosen path disturbs the motion"""

    bl_label = "Pictures"
    bl_order = 3

    def show(self, layout, context, root):
        folder = studies.results_folder(root) / FOLDER
        names = [ANGLE] + ([delta_name(root.mu_unit.path)] if root.mu_unit.path else [])
        found = [(name, icon_of(folder / name)) for name in names]
        for name, icon in found:
            if icon is not None:
                layout.template_icon(icon, scale=PICTURE)
                layout.operator("mu.picture", text="Enlarge", icon="FULLSCREEN_ENTER").name = name
        if all(icon is None for _, icon in found):
            wrapped(layout, "This run made no pictures: run it again for them", "INFO")
        elif not root.mu_unit.path:
            wrapped(layout, "Choose a sensor path to see its deviation", "INFO")
