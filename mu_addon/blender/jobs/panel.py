"""A job in panels: its button, its progress, and its result."""

from __future__ import annotations

import textwrap

from ...run.child import CANCELLED, DONE, FAILED, RUNNING, WAITING
from ...run.progress import spell
from ..shared.panels import CHARACTERS, alert, large_button, wrapped
from ..shared.wording import in_panel

STAGE_LETTERS = 20
"""Letters of a stage that fit into a panel's bar with number and time; a longer one is only numbered."""


STAGES = {"Model A": "motion"}
"""Stages whose names are those of the paper, in plain words."""


def start_button(layout, child, operator: str, icon: str, **settings) -> None:
    """Draw the button that starts a job, unless its child runs or waits."""
    if child is None or child.state not in (RUNNING, WAITING):
        large_button(layout, operator, icon, **settings)


def draw_job(
    layout, root, kind, operator: str, icon: str, text: str, top: bool = False, where: str = "see below"
) -> None:
    """Draw the button that starts a root's job, and its progress or its end; where: its results are shown.

    top: the top of the sidebar may offer it in its place.
    """
    child = kind.child(root)
    start_button(layout, child, operator, icon, root=root if top else None, text=text)
    job_state(layout, child, where, kind.prefix)


def open_buttons(layout, kind) -> None:
    """Draw the buttons that open report and folder of a kind of job."""
    row = layout.row(align=True)
    row.operator(f"mu.{kind.prefix}open", text="Report", icon="URL").what = "report"
    row.operator(f"mu.{kind.prefix}open", text="Folder", icon="FILE_FOLDER").what = "folder"


def rounded(seconds: float) -> str:
    """A duration to about a tenth: "40 s", "9 min", "3 h 30 min"."""
    if seconds < 90.0:
        return f"{max(10 * round(seconds / 10.0), 10)} s"
    minutes = round(seconds / 60.0)
    if minutes >= 20:
        minutes = 5 * round(minutes / 5.0)
    hours = f"{minutes // 60} h " if minutes >= 60 else ""
    return f"{hours}{minutes % 60} min".removesuffix(" 0 min")


def timed(name: str, announced: tuple[float, bool] | None) -> str:
    """Label of a button with its job's expected seconds, if known: "about" if measured on this machine."""
    if announced is None:
        return name
    seconds, measured = announced
    return f"{name}, {'about' if measured else 'perhaps'} {rounded(seconds)}"


def job_state(layout, child, where: str, prefix: str = "") -> None:
    """Draw the progress and the end of a job's child; nothing without a child.

    where: name of the panel with the results; prefix: of the names of its operators.
    """
    if child is None:
        return
    if child.state in (RUNNING, WAITING):
        _running(layout, child, prefix)
    else:
        _ended(layout, child, where, prefix)


def whole(child, width: int = 0) -> tuple[float, str]:
    """Finished share of a whole job, 0..1, and a text on share, stage, number of stages and time left.

    A stage without a known fraction shows no share. width: largest number of letters of the stage's name, 0
    for any; a longer one is only numbered.
    """
    if child.state == WAITING:
        return 0.0, "waiting for the job before it"
    estimate = child.estimate
    if child.stopping:
        return estimate.fraction, "stopping ..."
    stage = str(child.progress.get("stage", "starting"))
    stage = STAGES.get(stage, stage)
    long = width and len(stage) > width
    if estimate.count:
        number = f"{estimate.number} of {estimate.count}"
        stage = f"stage {number}" if long else f"{stage} ({number})"
    elif long:
        stage = shortened(stage, width)
    left = estimate.seconds_left
    # Without a plan the bar is the stage's own, and so is the time.
    fraction = estimate.fraction if estimate.count else child.progress.get("fraction")
    share = "" if fraction is None else f"{fraction:.0%}, "
    return fraction or 0.0, f"{share}{stage}" + ("" if left is None else f", {spell(left)} left")


def shortened(text: str, width: int) -> str:
    """A text of one line in at most so many letters, cut between words if longer."""
    return textwrap.shorten(text, width, placeholder=" ...")


def _running(layout, child, prefix: str) -> None:
    """Draw Cancel, stage and time left of a child: Cancel first, since the rows below it change."""
    row = layout.row()
    words = spell(child.seconds) if child.state == RUNNING else "Not started"
    row.label(text=words, icon="TIME")
    row.operator(f"mu.{prefix}cancel", icon="CANCEL")
    fraction, text = whole(child, STAGE_LETTERS)
    layout.progress(factor=fraction, text=text)
    doing = child.progress.get("waits_for") or child.progress.get("detail", "")
    details = [str(doing), child.estimate.why and f"Longer: {child.estimate.why}"]
    latest = textwrap.wrap(next((text for text in reversed(details) if text), ""), CHARACTERS)
    # Always two lines, so that nothing below them moves.
    wrapped(layout, "\n".join([*latest, "", ""][:2]))
    for warning in child.warnings[-2:]:
        wrapped(layout, in_panel(warning), "ERROR")


def _ended(layout, child, where: str, prefix: str) -> None:
    """Draw how a child ended, and where its results are shown."""
    if child.state == FAILED:
        error = child.error or {}
        box = alert(layout, in_panel(str(error.get("what", ""))))
        for key in ("where", "what_to_do"):
            if error.get(key):
                wrapped(box, in_panel(str(error[key])))
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
