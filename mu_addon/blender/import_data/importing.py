"""Import of measured files: properties, operators, and the questions that the panel asks."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty

from ...design.printing.finding import counted
from ...errors import InputError, MuError
from ...files import make_folder
from ..jobs import prepared, start_child
from ..jobs.here import run_here
from ..shared import viewports
from ..shared.blender_property import Text
from ..shared.operators import choose_file, open_file, operator
from ..shared.panels import wrapped
from ..shared.registration import property_of
from ..simulate import study_folder as studies
from ..unit.base_classes import UnitOperator


def _offered(self, context, typed):
    """Answers that a question offers."""
    return [choice for choice in self.choices.split("\n") if typed.casefold() in choice.casefold()]


class MU_PG_import_answer(bpy.types.PropertyGroup):
    """An open question of an import, and its answer."""

    key: StringProperty(options={"HIDDEN"})
    words: StringProperty(options={"HIDDEN"})
    choices: StringProperty(options={"HIDDEN"})
    experiment: StringProperty(options={"HIDDEN"})
    answered: BoolProperty(options={"HIDDEN"})
    value: Text(
        "Answer", "Open questions of the file", search=_offered, search_options={"SORT", "SUGGESTION"}
    )


@property_of(bpy.types.Object, "mu_import")
class MU_PG_import(bpy.types.PropertyGroup):
    """Files being imported into a folder of measured data."""

    files: StringProperty(options={"HIDDEN"})
    answers: CollectionProperty(type=MU_PG_import_answer, options={"HIDDEN"})


FOLDER = "measured"
"""Folder of imported data in the unit's study folder, if no folder of measured data is chosen."""
ENDINGS = "*.csv;*.txt;*.tsv;*.dat;*.tra;*.xlsx;*.xls;*.xlsm;*.xlsb;*.ods"


@operator(
    UnitOperator,
    "Import Files...",
    invoke=choose_file,
    directory=StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"}),
    files=CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}),
    filter_glob=StringProperty(default=ENDINGS, options={"HIDDEN"}),
)
def import_files(operator, root, directory, files):
    """Read files exported by test machines and data loggers into the unit's measured data"""
    chosen = [str(Path(directory) / one.name) for one in files if one.name]
    if not chosen:
        raise InputError("No file was chosen: choose one or more files of measured data")
    root.mu_import.answers.clear()
    root.mu_import.files = "\n".join(chosen)
    return _import(operator, root)


@operator(UnitOperator, "Import with These Answers")
def import_answers(operator, root):
    """Import the files with these answers"""
    answers = root.mu_import.answers
    lacking = [one for one in answers if not one.value.strip()]
    if lacking:
        raise InputError(f"Not answered: {lacking[0].words}")
    for one in answers:
        one.answered = True
    try:
        return _import(operator, root)
    except MuError:
        # Rejected answers can be corrected.
        for one in answers:
            one.answered = False
        raise


@operator(UnitOperator, "Do Not Import")
def import_cancel(root):
    """Leave these files out"""
    _forget(root)


@operator(UnitOperator, "What Was Understood", undo=False)
def import_page(context, root):
    """Open the page that shows how the files were read"""
    from ...studies.import_ import PAGE

    if start_child.runs(_page_job(root)):
        raise InputError("The page is being drawn: press again in a moment")
    page = next((place / PAGE for place in (_drawn(root), _folder(root)) if (place / PAGE).exists()), None)
    if page is None:
        raise InputError("Nothing was imported into this folder: choose Import Files first")
    open_file(context, page)


def _folder(root):
    """The unit's folder of measured data, or a new one for imported files."""
    given = root.mu_evidence.folder
    return Path(bpy.path.abspath(given)) if given else studies.assign_folder(root) / FOLDER


def _page_job(root) -> str:
    return f"{root.mu_unit.uuid}:import page"


def _drawn(root) -> Path:
    """Folder of the page that a process drew."""
    return studies.folder_of(root) / "import"


def _draw_page(root, work) -> None:
    """Draw the page on an import, in a window by a process of its own, which its charts would hold."""
    if prepared.at_once():
        from ...report.study_report import write_page

        write_page(work)
        return
    answers = [f"--set={key}={value}" for key, value in work.study.answers.items()]
    line = ["import", *map(str, work.study.paths), *answers, "--dry-run", "--json"]
    child = start_child.start([*line, "--out", str(_drawn(root))], _drawn(root), ends_with_parent=True)
    start_child.watch(_page_job(root), child)


def _import(operator, root):
    """Import the experiments without open questions; the panel shows the questions left."""
    from ...studies.import_ import Import

    state = root.mu_import
    given = {one.key: one.value.strip() for one in state.answers if one.answered}
    files, folder = tuple(map(Path, state.files.split("\n"))), _folder(root)
    make_folder(folder)
    work, warnings = run_here(Import(paths=files, answers=given), folder)
    _draw_page(root, work)
    found = work.results.value(("understood", None))
    if work.fault is not None:
        for p, question in found.asked:
            one = state.answers.add()
            one.key, one.words, one.experiment = question.key, question.words, p.name
            one.choices, one.value = "\n".join(question.choices), question.proposed
        # No warning: its popup would cover the fields, and hold the mouse.
        asked = counted(len(found.asked), "question", "questions")
        operator.report({"INFO"}, f"{asked} in the panel Evidence")
        viewports.redraw()
        return {"FINISHED"}
    root.mu_evidence.folder = str(folder)
    _forget(root)
    for warning in warnings[:3]:
        operator.report({"WARNING"}, f"{warning['what']} ({warning['where']})")
    operator.report({"INFO"}, counted(len(found.proposals), "experiment", "experiments") + " imported")
    return {"FINISHED"}


def _forget(root):
    root.mu_import.files = ""
    root.mu_import.answers.clear()
    viewports.redraw()


def draw_import(layout, root):
    """Draw the button that imports files, and the questions of an import in progress."""
    state = root.mu_import
    if not state.files:
        layout.operator("mu.import_files", icon="IMPORT")
        return
    box = layout.box()
    names = [Path(name).name for name in state.files.split("\n")]
    wrapped(box, f"Import {', '.join(names[:3])}{' ...' if len(names) > 3 else ''}", "IMPORT")
    for one in state.answers:
        if not one.answered:
            wrapped(box, f"{one.experiment}: {one.words}", "QUESTION")
            box.prop(one, "value", text="", placeholder=one.choices.replace("\n", ", "))
    box.operator("mu.import_answers", icon="CHECKMARK")
    row = box.row(align=True)
    row.operator("mu.import_page", icon="URL")
    row.operator("mu.import_cancel", text="", icon="X")
