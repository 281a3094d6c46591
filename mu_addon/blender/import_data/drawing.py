"""The part of the panel Evidence that imports files."""

from __future__ import annotations

from pathlib import Path

from ..shared.panels import wrapped


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
