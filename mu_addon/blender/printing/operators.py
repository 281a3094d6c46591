"""Check a unit for the printer, look at the findings, and write its files and specimens."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import BoolProperty, FloatVectorProperty, IntProperty

from ...design.settings import UP
from ..jobs.operators import FILES, RUN_FILES, job_operators
from ..simulate.study_job import StudyOperator
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import layer, marks
from . import state as printing

NOT_CHECKED = "Check the print first"


class MU_OT_print_check(StudyOperator, ValidUnitOperator, bpy.types.Operator):
    """Check the printability and rank the build directions, in a child process"""

    bl_idname = "mu.print_check"
    bl_label = "Check Print"
    bl_options = {"REGISTER"}
    job = printing.CHECK


class MU_OT_print_check_file(StudyOperator, ValidUnitOperator, bpy.types.Operator):
    """Check the printability of an STL file, repaired first if asked"""

    bl_idname = "mu.print_check_file"
    bl_label = "Check File"
    bl_options = {"REGISTER"}
    job = printing.FILE_CHECK


class MU_OT_print_export(StudyOperator, ValidUnitOperator, bpy.types.Operator):
    """Write the chosen files of the unit with its path; asks first if the check found errors"""

    bl_idname = "mu.print_export"
    bl_label = "Export"
    bl_options = {"REGISTER"}
    job = printing.EXPORT

    def invoke(self, context, event):
        found = printing.CHECK.found(unit_object.active_root(context))
        errors = [] if found is None or found.stale else printing.errors(found)
        if not errors:
            return self.execute(context)
        names = ", ".join(error["check"] for error in errors)
        return context.window_manager.invoke_confirm(
            self,
            event,
            title="Export a part that is not printable?",
            message=f"The check found errors: {names}",
            confirm_text="Export",
            icon="WARNING",
        )


class MU_OT_print_specimens(StudyOperator, ValidUnitOperator, bpy.types.Operator):
    """Write lattice cubes, coupons and a gauge to print, a sheet of measurements, a folder for the data"""

    bl_idname = "mu.print_specimens"
    bl_label = "Export Specimens"
    bl_options = {"REGISTER"}
    job = printing.SPECIMENS


def _path_of(root, what):
    """File or folder by its name `what`; log and errors are of the latest job."""
    if what in FOLDERS:
        return FOLDERS[what].folder_of(root)
    if what.endswith("report"):
        job = printing.CHECK if what == "report" else printing.FILE_CHECK
        return job.folder_of(root) / FILES["report"]
    return printing.latest_folder(root) / FILES[what]


FOLDERS = {
    "check-file": printing.FILE_CHECK,
    "export": printing.EXPORT,
    "specimens": printing.SPECIMENS,
}
"""Jobs whose folders can be opened."""


class _OfCheck(UnitOperator):
    """An operator on a check's findings; greyed out without a check of the unit in its present state."""

    @classmethod
    def trouble(cls, root):
        found = printing.CHECK.found(root)
        if found is None:
            return NOT_CHECKED
        return f"The check is stale: {found.stale}" if found.stale else ""


class MU_OT_print_marks(_OfCheck, bpy.types.Operator):
    """Mark every place of every error (red) and warning (orange), and the build direction (arrow)"""

    bl_idname = "mu.print_marks"
    bl_label = "Mark Places"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        marks.mark(root, printing.CHECK.found(root))


class MU_OT_print_clear(UnitOperator, bpy.types.Operator):
    """Remove the marks of the check from the scene"""

    bl_idname = "mu.print_clear"
    bl_label = "Clear Marks"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        return "" if marks.mark_objects(root) else "No place is marked"

    def act(self, context, root):
        marks.clear(root)


class MU_OT_print_show(_OfCheck, bpy.types.Operator):
    """Turn the view to a location of this finding; click again for the next one"""

    bl_idname = "mu.print_show"
    bl_label = "Show Finding"
    bl_options = {"REGISTER", "UNDO"}

    # Not kept from the last call: a click on a row concerns that row alone.
    finding: IntProperty(
        name="Finding", description="Its number in the list, from 0", min=0, options={"SKIP_SAVE"}
    )
    place: IntProperty(
        name="Place",
        description="Number of the place, from 0; -1: the one after that shown",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    )
    view: BoolProperty(
        name="Turn the View", description="Turn the 3D views to it", default=True, options={"SKIP_SAVE"}
    )

    def act(self, context, root):
        found, settings = printing.CHECK.found(root), root.mu_print
        if self.finding >= len(found.content["findings"]):
            self.report({"ERROR"}, f"There are {len(found.content['findings'])} findings")
            return {"CANCELLED"}
        chosen = found.content["findings"][self.finding]
        places = chosen["places"]
        if self.place >= max(len(places), 1):
            self.report({"ERROR"}, f"{chosen['check']}: it has {len(places)} places")
            return {"CANCELLED"}
        next_one = settings.place + 1 if settings.finding == self.finding else 0
        if marks.marked(root) != found.digest:
            marks.mark(root, found)
        settings.finding = self.finding
        settings.place = (next_one if self.place < 0 else self.place) % max(len(places), 1)
        marks.resize(root)
        if len(places):
            for obj in context.selected_objects:
                obj.select_set(False)
            for obj in marks.mark_objects(root):
                if obj[marks.MARK] == str(self.finding):
                    obj.select_set(True)
            if self.view:
                reach = to_unit(root.mu_unit).dimensions.cell
                marks.frame(root, places[settings.place], reach)
        return {"FINISHED"}


class MU_OT_print_up(UnitOperator, bpy.types.Operator):
    """Use this build direction; check again for its findings"""

    bl_idname = "mu.print_up"
    bl_label = "Use Direction"
    bl_options = {"REGISTER", "UNDO"}

    direction: FloatVectorProperty(
        name="Up",
        description="Away from the platform, in the unit's frame",
        subtype="XYZ",
        default=UP,
        options={"SKIP_SAVE"},
    )

    def act(self, context, root):
        root.mu_print.up = self.direction


class MU_OT_print_layer(ValidUnitOperator, bpy.types.Operator):
    """Show a layer of the solid along the build direction Up: material in yellow, enclosed areas in blue"""

    bl_idname = "mu.print_layer"
    bl_label = "Show Layer"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        built = unit_object.solid_is_current(root)
        return super().trouble(root) or ("" if built else "Build the solid first")

    def act(self, context, root):
        layer.put(root)


class MU_OT_print_layer_clear(UnitOperator, bpy.types.Operator):
    """Remove the layer from the scene, and show the whole solid again"""

    bl_idname = "mu.print_layer_clear"
    bl_label = "Clear Layer"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        return "No layer is shown" if layer.layer_object(root) is None else ""

    def act(self, context, root):
        layer.clear(root)


CLASSES = (
    MU_OT_print_check,
    MU_OT_print_check_file,
    MU_OT_print_export,
    MU_OT_print_specimens,
    *job_operators(
        printing.PRINTING,
        "print_",
        "check or export",
        kept="files that are complete are kept",
        first="check or export first",
        items=[
            ("report", "Report", "Every finding with pictures, and the build directions, in the browser"),
            ("file_report", "Report of the File", "Every finding in the STL file, in the browser"),
            ("check-file", "Checked File", "Folder of the file's check, with part.stl"),
            ("export", "Files", "Folder of the exported files"),
            ("specimens", "Specimens", "Folder of the specimens, their sheet and the folder for the data"),
            *RUN_FILES[1:3],
        ],
        path_of=_path_of,
    ),
    MU_OT_print_marks,
    MU_OT_print_clear,
    MU_OT_print_show,
    MU_OT_print_up,
    MU_OT_print_layer,
    MU_OT_print_layer_clear,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
