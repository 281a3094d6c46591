"""The page that shows what was understood of laboratory files: a picture and a table for each experiment."""

from __future__ import annotations

from html import escape

import numpy as np

from ...lab_files.proposal import Proposal
from ...report import charts
from ...report.html import facts_table, figure, note, page, table
from .understood import Understood

# What is drawn against what, the first that is there.
_PICTURES = (
    ("displacement_mm", "force_N"),
    ("strain", "stress_kPa"),
    ("displacement_mm", "stress_kPa"),
    ("strain", "force_N"),
    ("angle_deg", "voltage_V"),
    ("added_mass_g", "tip_deflection_mm"),
    ("time_s", "pressure_kPa"),
    ("time_s", "angle_deg"),
    ("time_s", "force_N"),
    ("time_s", "stress_kPa"),
)
_MOST_POINTS = 2000


def page_of(found: Understood, name: str) -> str:
    """HTML of the page."""
    open_questions = [f"{p.name}: {question.text}" for p, question in found.open]
    notes = [f"Not imported yet. {len(open_questions)} question(s) are open:", *open_questions]
    sections = [(f"e{i}", p.name, _section(p)) for i, p in enumerate(found.proposals)]
    return page(
        f"Import into {name}",
        "What was understood of the files",
        note(notes if open_questions else []),
        "",
        [*sections, ("left", "Left out", note(found.left_out))],
    )


def _section(p: Proposal) -> str:
    """Picture, keys, columns and what was concluded, of one experiment."""
    ranges = [
        ([name, p.origin[name], f"{np.nanmin(v):.6g}", f"{np.nanmax(v):.6g}", str(len(v))], False)
        for name, v in p.columns.items()
    ]
    head = [("column", ""), ("from", ""), ("least", "n"), ("most", "n"), ("rows", "n")]
    concluded = "".join(f"<li>{escape(words)}</li>" for words in p.concluded)
    unread = f"<p>Not read: {escape(', '.join(p.unread))}.</p>" if p.unread else ""
    return (
        _picture(p)
        + facts_table("key", "value", {**p.keys, "from": p.place})
        + table("", head, ranges)
        + (f"<ul>{concluded}</ul>" if concluded else "")
        + unread
    )


def _picture(p: Proposal) -> str:
    pairs = [pair for pair in _PICTURES if set(pair) <= set(p.columns)]
    over_time = [pair for pair in pairs if pair[0] == "time_s"]
    # One curve, and what was recorded over time; of a unit the latter alone.
    pairs = (
        over_time[:2]
        if p.keys.get("kind") in ("unit_pressure", "pressure_step", "blocked_force")
        else [*pairs[:1], *over_time[:1]]
    )
    pairs = list(dict.fromkeys(pairs))
    if not pairs:
        return ""
    with charts.canvas(8.8, 2.8) as (drawing, svg):
        for i, (x, y) in enumerate(pairs, 1):
            axes = drawing.add_subplot(1, len(pairs), i)
            step = max(1, len(p.columns[x]) // _MOST_POINTS)
            axes.plot(p.columns[x][::step], p.columns[y][::step], color="#0072B2", linewidth=1.0)
            axes.set(xlabel=_titled(x), ylabel=_titled(y))
        drawing.tight_layout()
    words = ", ".join(f"{_titled(y)} against {_titled(x)}" for x, y in pairs)
    return figure(svg(), "", f"{p.name}: {words}")


def _titled(column: str) -> str:
    """A column's name as the title of an axis."""
    head, _, unit = column.rpartition("_")
    return f"{head.replace('_', ' ')}, {unit}" if head else column
