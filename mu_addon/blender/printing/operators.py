"""Check a unit for the printer, look at the findings, and write its files and specimens."""

from ...design.settings import UP
from ...errors import InputError
from ..jobs.operators import FILES, RUN_FILES, job_operators
from ..shared import viewports
from ..shared.blender_property import Flag, Integer, blender_property, input_of
from ..shared.operators import operator, unless
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import layer, marks
from . import state as printing

NOT_CHECKED = "Check the print first"


@operator(ValidUnitOperator, "Check Print", undo=False, trouble=printing.CHECK.trouble)
def print_check(root):
    """Check the printability and rank the build directions, in a child process"""
    printing.CHECK.start(root)


@operator(ValidUnitOperator, "Check File", undo=False, trouble=printing.FILE_CHECK.trouble)
def print_check_file(root):
    """Check the printability of an STL file, repaired first if asked"""
    printing.FILE_CHECK.start(root)


def _ask_if_wrong(operator, context, event):
    wrong = printing.errors(unit_object.active_root(context))
    if not wrong:
        return operator.execute(context)
    return context.window_manager.invoke_confirm(
        operator,
        event,
        title="Export a part that is not printable?",
        message=f"The check found errors: {wrong}",
        confirm_text="Export",
        icon="WARNING",
    )


@operator(ValidUnitOperator, "Export", undo=False, trouble=printing.EXPORT.trouble, invoke=_ask_if_wrong)
def print_export(root):
    """Write the chosen files of the unit with its path; asks first if the check found errors"""
    printing.EXPORT.start(root)


@operator(ValidUnitOperator, "Export Specimens", undo=False, trouble=printing.SPECIMENS.trouble)
def print_specimens(root):
    """Write lattice cubes, coupons and a gauge to print, a sheet of measurements, a folder for the data"""
    printing.SPECIMENS.start(root)


def _path_of(root, what):
    """File or folder by its name `what`; log and errors are of the latest job."""
    if what in FOLDERS:
        return FOLDERS[what].folder_of(root)
    if what.endswith("report"):
        job = printing.CHECK if what == "report" else printing.FILE_CHECK
        return job.folder_of(root) / FILES["report"]
    return printing.latest_folder(root) / FILES[what]


FOLDERS = {"check-file": printing.FILE_CHECK, "export": printing.EXPORT, "specimens": printing.SPECIMENS}
"""Jobs whose folders can be opened."""


class _OfCheck(UnitOperator):
    """An operator on a check's findings; greyed out without a check of the unit in its present state."""

    @classmethod
    def trouble(cls, root):
        found = printing.CHECK.found(root)
        if found is None:
            return NOT_CHECKED
        return f"The check is stale: {found.stale}" if found.stale else ""


@operator(_OfCheck, "Mark Places")
def print_marks(root):
    """Mark every place of every error (red) and warning (orange), and the build direction (arrow)"""
    marks.mark(root, printing.CHECK.found(root))


@operator(UnitOperator, "Clear Marks", trouble=unless(marks.mark_objects, "No place is marked"))
def print_clear(root):
    """Remove the marks of the check from the scene"""
    marks.clear(root)


@operator(
    _OfCheck,
    "Show Finding",
    finding=Integer("Finding", "Its number in the list, from 0", min=0, options={"SKIP_SAVE"}),
    place=Integer(
        "Place",
        "Number of the place, from 0; -1: the one after that shown",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    ),
    view=Flag("Turn the View", "Turn the 3D views to it", default=True, options={"SKIP_SAVE"}),
)
def print_show(context, root, finding, place, view):
    """Turn the view to a location of this finding; click again for the next one"""
    found, settings = printing.CHECK.found(root), root.mu_print
    if finding >= len(found.content["findings"]):
        raise InputError(f"There are {len(found.content['findings'])} findings")
    chosen = found.content["findings"][finding]
    places = chosen["places"]
    if place >= max(len(places), 1):
        raise InputError(f"{chosen['check']}: it has {len(places)} places")
    next_one = settings.place + 1 if settings.finding == finding else 0
    if marks.marked(root) != found.digest:
        marks.mark(root, found)
    settings.finding = finding
    settings.place = (next_one if place < 0 else place) % max(len(places), 1)
    marks.resize(root)
    if len(places):
        number = str(finding)
        viewports.select(context, [obj for obj in marks.mark_objects(root) if obj[marks.MARK] == number])
        if view:
            reach = to_unit(root.mu_unit).dimensions.cell
            marks.frame(root, places[settings.place], reach)


@operator(
    UnitOperator,
    "Use Direction",
    direction=blender_property(
        input_of("check", "direction"),
        options={"SKIP_SAVE"},
        name="Up",
        size=3,
        precision=3,
        subtype="XYZ",
        default=UP,
    ),
)
def print_up(root, direction):
    """Use this build direction; check again for its findings"""
    root.mu_print.up = direction


@operator(
    ValidUnitOperator, "Show Layer", trouble=unless(unit_object.solid_is_current, "Build the solid first")
)
def print_layer(root):
    """Show a layer of the solid along the build direction Up: material in yellow, enclosed areas in blue"""
    layer.put(root)


@operator(UnitOperator, "Clear Layer", trouble=unless(layer.layer_object, "No layer is shown"))
def print_layer_clear(root):
    """Remove the layer from the scene, and show the whole solid again"""
    layer.clear(root)


job_operators(
    printing.PRINTING,
    "check or export first",
    kept="files that are complete are kept",
    items=[
        ("report", "Report", "Every finding with pictures, and the build directions, in the browser"),
        ("file_report", "Report of the File", "Every finding in the STL file, in the browser"),
        ("check-file", "Checked File", "Folder of the file's check, with part.stl"),
        ("export", "Files", "Folder of the exported files"),
        ("specimens", "Specimens", "Folder of the specimens, their sheet and the folder for the data"),
        *RUN_FILES[1:3],
    ],
    path_of=_path_of,
)
