"""The sidebar tab MU, in the order of work. Panels show state and call operators; they decide nothing."""

from __future__ import annotations

import textwrap

import bpy

from ...design.anchors import windows
from ...design.parameters import SECTIONS
from ...design.quantity import describe
from ...design.wall import Wall, offered
from ...run.child import CANCELLED, DONE, FAILED, RUNNING
from ...run.progress import spell
from ..body import state as bodies
from ..gripper import object as gripper_object
from ..path.operators import selected_candidate
from ..shared.acting import NO_UNIT
from ..simulate import effects
from ..simulate import state as simulation
from ..simulate import study_folder as studies
from . import object as unit_object
from .operators import in_millimetres

# Where a section's parameters are shown. A section that the core gains appears under Design by itself.
PLACES = {
    "chambers": "design",
    "lattice": "lattice",
    "waveguide": "path",
    "material": "simulate",
    "wall": "simulate",
    "print": "print",
}
CHARACTERS = 34
"""Letters in one line of a panel of usual width: labels do not wrap."""


def wrapped(layout, text: str, icon: str = "NONE", width: int = CHARACTERS) -> None:
    """Labels that show a text in several lines."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for paragraph in text.split("\n"):
        for line in textwrap.wrap(paragraph, width) or [""]:
            column.label(text=line, icon=icon)
            icon = "BLANK1" if icon != "NONE" else "NONE"


def parameters(layout, props, place: str) -> None:
    """Fields of every section that belongs to a place."""
    for section in SECTIONS:
        if PLACES.get(section.section, "design") == place:
            group = getattr(props, section.section)
            column = layout.column(align=True)
            shown = offered(group.law, group.friction_share) if section is Wall else None
            for d in describe(section):
                if shown is None or d.name in shown:
                    column.prop(group, d.name)


class InTab:
    """A panel in the sidebar tab MU."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "MU"


class OfOne(InTab):
    """A panel of what `seek` finds active; `show(layout, context, root)` fills it."""

    @classmethod
    def poll(cls, context):
        return cls.seek(context) is not None

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.show(layout, context, self.seek(context))


class OfUnit(OfOne):
    """A panel of the active unit."""

    bl_parent_id = "MU_PT_unit"
    bl_options = {"DEFAULT_CLOSED"}
    seek = staticmethod(unit_object.active_root)


class MU_PT_unit(InTab, bpy.types.Panel):
    """The unit that is worked on"""

    bl_idname = "MU_PT_unit"
    bl_label = "Monolithic Unit"

    @classmethod
    def poll(cls, context):
        # Where only a gripper is there, its own panel has the word.
        return unit_object.active_root(context) is not None or gripper_object.active(context) is None

    def draw(self, context):
        layout = self.layout
        root = unit_object.active_root(context)
        if root is None:
            wrapped(layout, NO_UNIT, "INFO")
            layout.operator("mu.add", text="Add Monolithic Unit", icon="ADD")
            layout.menu("MU_MT_more", icon="DOWNARROW_HLT")
            return
        if not in_millimetres(context.scene):
            box = layout.box()
            wrapped(box, "The scene is not in millimetres: lengths here read wrong", "ERROR")
            box.operator("mu.millimetres")
        row = layout.row(align=True)
        row.menu("MU_MT_presets", text=root.mu_unit.title, icon="PRESET")
        row.operator("mu.preset_save", text="", icon="ADD")
        row.menu("MU_MT_more", text="", icon="DOWNARROW_HLT")
        layout.row(align=True).prop(root.mu_unit, "show", expand=True)
        row = layout.row()
        row.enabled = root.mu_unit.show != unit_object.SOLID
        row.prop(root.mu_unit, "cut", icon="MOD_BOOLEAN", toggle=True)
        if root.mu_unit.trouble:
            box = layout.box()
            box.alert = True
            wrapped(box, root.mu_unit.trouble, "ERROR")
            wrapped(layout, "The preview shows the last design that was possible", "INFO")


class MU_PT_design(OfUnit, bpy.types.Panel):
    """Chambers: number, profile, wall, caps and inlet"""

    bl_idname = "MU_PT_design"
    bl_label = "Design"
    bl_options = set()

    def show(self, layout, context, root):
        layout.prop(root.mu_unit, "title")
        layout.prop(root.mu_unit, "scale")
        parameters(layout, root.mu_unit, "design")


class MU_PT_lattice(OfUnit, bpy.types.Panel):
    """Cells of the lattice and its struts"""

    bl_idname = "MU_PT_lattice"
    bl_label = "Lattice"

    def show(self, layout, context, root):
        envelope = unit_object.part(root, bodies.ENVELOPE)
        parameters(layout, root.mu_unit, "lattice")
        if envelope is not None:
            wrapped(layout, f"The lattice fills {envelope.name}; counts of cells are not used", "INFO")
        header, body = layout.panel("MU_own_body", default_closed=True)
        header.label(text="Body of Your Own")
        if body:
            row = body.row(align=True)
            row.operator("mu.body_check", icon="VIEWZOOM")
            row.operator("mu.body", icon="MESH_MONKEY")
            if envelope is not None or unit_object.part(root, bodies.FLAWS):
                body.operator("mu.body_remove", icon="X")


class MU_PT_path(OfUnit, bpy.types.Panel):
    """Candidate paths and the waveguide along the chosen one"""

    bl_idname = "MU_PT_path"
    bl_label = "Sensor Paths"

    def show(self, layout, context, root):
        props = root.mu_unit
        found = studies.findings(root)
        ranking = dict(found.ranking(found.rule)) if found and not found.stale else {}
        ranks = {name: number for number, name in enumerate(sorted(ranking, key=ranking.get), 1)}
        row = layout.row()
        row.use_property_split = False
        row.prop(props, "candidates", toggle=True, icon="HIDE_OFF" if props.candidates else "HIDE_ON")
        column = layout.column(align=True)
        for window in windows(props.chambers.count):
            chosen = props.path == window.name
            text = f"{window.name}    P{window.start} to P{window.start + window.length - 1}"
            if window.name in ranking:
                text += f"    J {ranking[window.name]:.3f} mm, no. {ranks[window.name]}"
            icon = "RADIOBUT_ON" if chosen else "RADIOBUT_OFF"
            column.operator("mu.path", text=text, icon=icon, depress=chosen).name = (
                "none" if chosen else window.name
            )
        name = selected_candidate(context)
        if name and name != props.path:
            layout.operator(
                "mu.path", text=f"Use {name}, selected in the view", icon="RESTRICT_SELECT_OFF"
            ).name = name
        if not ranking:
            wrapped(layout, "Simulate to rank them: Place the Sensor", "INFO")
        parameters(layout, props, "path")


class MU_PT_simulate(OfUnit, bpy.types.Panel):
    """Motion and ranking of paths, in a process of its own"""

    bl_idname = "MU_PT_simulate"
    bl_label = "Simulate"

    def show(self, layout, context, root):
        missing = simulation.missing()
        if missing:
            box = layout.box()
            wrapped(
                box,
                f"Cannot simulate: {', '.join(missing)} not found in this Blender. Design, solid and export "
                "work without. Install the extension built for this Blender and system.",
                "ERROR",
            )
        study = root.mu_unit.study
        layout.prop(study, "command")
        if study.command == "place":
            layout.prop(study, "paths")
        layout.prop(study, "detail")
        layout.prop(study, "protocol")
        _effects(layout, root)
        child = simulation.of(root.mu_unit.uuid)
        start(layout, child, "mu.simulate", "PLAY")
        told(layout, child, "see Results")
        others = [uuid for uuid in simulation.running() if uuid != root.mu_unit.uuid]
        if others:
            wrapped(layout, f"{len(others)} other simulation(s) running", "INFO")
        header, body = layout.panel("MU_material", default_closed=True)
        header.label(text="Material")
        if body:
            parameters(body, root.mu_unit, "simulate")
            body.prop(study, "folder")


def _effects(layout, root) -> None:
    """What a diagnosis named beside the unit's parameters, and the direction of gravity where it matters."""
    lines = effects.said(root)
    if not lines:
        return
    box = layout.box()
    row = box.row()
    row.label(text="With what was found", icon="LIGHT")
    row.operator("mu.evidence_remove", text="", icon="X")
    for line in lines:
        wrapped(box, line)
    if effects.has_gravity(root):
        box.prop(root.mu_unit.study, "orientation_deg")


def start(layout, child, operator: str, icon: str) -> None:
    """The button that starts a job, unless its child runs."""
    if child is None or child.state != RUNNING:
        row = layout.row()
        row.scale_y = 1.4
        row.operator(operator, icon=icon)


def told(layout, child, where: str, job: str = "") -> None:
    """What a job's child says, if there is one, while it runs and when it has ended.

    where: where its results are shown; job: what the names of its operators begin with.
    """
    if child is not None:
        _running(layout, child, job) if child.state == RUNNING else _ended(layout, child, where, job)


def _running(layout, child, job: str) -> None:
    """Stage, time left and Cancel of a child."""
    fraction = child.progress.get("fraction")
    text = "stopping ..." if child.stopping else simulation.spell_left(child)
    layout.progress(factor=fraction or 0.0, text=text)
    if child.progress.get("detail"):
        layout.label(text=str(child.progress["detail"]))
    row = layout.row()
    row.label(text=f"running for {spell(child.seconds)}")
    row.operator(f"mu.{job}cancel", icon="CANCEL")
    for warning in child.warnings[-2:]:
        wrapped(layout, warning, "ERROR")


def _ended(layout, child, where: str, job: str) -> None:
    """How a child ended, and where its results are shown."""
    box = layout.box()
    if child.state == DONE:
        wrapped(box, f"Done in {spell(child.seconds)}: {where}", "CHECKMARK")
    elif child.state == CANCELLED:
        wrapped(box, "Cancelled. What was finished is kept: start it again to go on", "CANCEL")
    elif child.state == FAILED:
        box.alert = True
        error = child.error or {}
        wrapped(box, str(error.get("what", "")), "ERROR")
        for key in ("where", "what_to_do"):
            if error.get(key):
                wrapped(box, str(error[key]))
    row = box.row(align=True)
    if child.state == FAILED:
        row.operator(f"mu.{job}open", text="Log").what = "log"
        row.operator(f"mu.{job}open", text="Errors").what = "errors"
    row.operator(f"mu.{job}dismiss")


class MU_PT_results(OfUnit, bpy.types.Panel):
    """What the study has found"""

    bl_idname = "MU_PT_results"
    bl_label = "Results"

    def show(self, layout, context, root):
        found = studies.findings(root)
        if found is None:
            wrapped(layout, "Nothing simulated yet", "INFO")
            return
        if found.stale:
            box = layout.box()
            box.alert = True
            wrapped(box, "Stale: these results belong to other parameters. Simulate again", "ERROR")
        if found.status != "complete":
            wrapped(layout, f"The run is {found.status or 'not finished'}", "INFO")
        if found.quick:
            wrapped(layout, "A quick look: linear elements lock, so that angles come out too small", "ERROR")
        column = layout.column(align=True)
        column.active = not found.stale
        for pressure, angle in found.angles:
            if pressure in (found.angles[0][0], found.angles[-1][0]):
                column.label(text=f"{angle:+.1f} deg at {pressure:g} kPa")
        for touch in studies.touches(root):
            most = int(touch.force_N.argmax())
            words = (
                f"{touch.force_N[most]:.2f} N at {touch.time_s[most]:.1f} s"
                if touch.force_N[most]
                else "not met"
            )
            column.label(text=f"{touch.name}: {words}", icon="CUBE")
        ranking = found.ranking(found.rule)
        if ranking:
            best, j = ranking[0]
            tied = (found.summary.get("tied_with_chosen") or {}).get(found.rule) or []
            column.label(text=f"Best path {best}, J {j:.4f} mm")
            if tied:
                column.label(text=f"tied with {', '.join(tied)}")
            if root.mu_unit.path == best:
                column.label(text="It is the chosen one", icon="CHECKMARK")
            elif not found.stale:
                layout.operator("mu.path", text=f"Use {best}", icon="CON_FOLLOWPATH").name = best
        search = found.summary.get("search")
        if search:
            best = search["best"]
            column.label(text=f"Whole lattice: {best['name']}, J {best['J_hat_mm']:.4f} mm")
            column.label(
                text=f"{best['length_mm']:.0f} mm long, {search['checked']} of {search['paths']} solved"
            )
        row = layout.row(align=True)
        row.operator("mu.open", text="Report", icon="URL").what = "report"
        row.operator("mu.open", text="Folder", icon="FILE_FOLDER").what = "folder"


CLASSES = (
    MU_PT_unit,
    MU_PT_design,
    MU_PT_lattice,
    MU_PT_path,
    MU_PT_simulate,
    MU_PT_results,
)


def register() -> None:
    """All panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """All panels."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
