"""What panels show of a job: its button, its progress while it runs, and how it ended."""

from __future__ import annotations

from ...run.child import CANCELLED, DONE, FAILED, RUNNING
from ...run.progress import spell
from ..shared.panels import alert, large_button, wrapped


def start_button(layout, child, operator: str, icon: str) -> None:
    """The button that starts a job, unless its child runs."""
    if child is None or child.state != RUNNING:
        large_button(layout, operator, icon)


def job_state(layout, child, where: str, prefix: str = "") -> None:
    """Progress of a job's child while it runs and its end; nothing without a child.

    where: where its results are shown; prefix: what the names of its operators begin with.
    """
    if child is not None:
        _running(layout, child, prefix) if child.state == RUNNING else _ended(layout, child, where, prefix)


def _running(layout, child, prefix: str) -> None:
    """Stage, time left and Cancel of a child."""
    fraction = child.progress.get("fraction")
    text = "stopping ..." if child.stopping else _stage(child)
    layout.progress(factor=fraction or 0.0, text=text)
    if child.progress.get("detail"):
        layout.label(text=str(child.progress["detail"]))
    row = layout.row()
    row.label(text=f"running for {spell(child.seconds)}")
    row.operator(f"mu.{prefix}cancel", icon="CANCEL")
    for warning in child.warnings[-2:]:
        wrapped(layout, warning, "ERROR")


def _stage(child) -> str:
    stage = str(child.progress.get("stage", "starting"))
    left = child.progress.get("seconds_left")
    return stage if left is None else f"{stage}, {spell(float(left))} left"


def _ended(layout, child, where: str, prefix: str) -> None:
    """How a child ended, and where its results are shown."""
    if child.state == FAILED:
        error = child.error or {}
        box = alert(layout, str(error.get("what", "")))
        for key in ("where", "what_to_do"):
            if error.get(key):
                wrapped(box, str(error[key]))
    else:
        box = layout.box()
        if child.state == DONE:
            wrapped(box, f"Done in {spell(child.seconds)}: {where}", "CHECKMARK")
        elif child.state == CANCELLED:
            wrapped(box, "Cancelled. Finished stages are kept: start again to continue", "CANCEL")
    row = box.row(align=True)
    if child.state == FAILED:
        row.operator(f"mu.{prefix}open", text="Log").what = "log"
        row.operator(f"mu.{prefix}open", text="Errors").what = "errors"
    row.operator(f"mu.{prefix}dismiss")
