"""Page on how laboratory files were read: a picture and a table for each experiment."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from ...lab_files.proposal import Proposal
from ...report import plots
from ...report.html import facts_table, figure, note, page, table
from .understood import Understood

# Axes of the chart, the first pair that is present.
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
# Bars of a column's course in a terminal, and their heights.
_BARS = 32
_HEIGHTS = "\u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"

Array = np.ndarray[Any, Any]


def page_of(found: Understood, name: str) -> str:
    """HTML of the page."""
    open_questions = [f"{p.name}: {question.text}" for p, question in found.open]
    notes = [f"Not imported yet. {len(open_questions)} question(s) are open:", *open_questions]
    sections = [(f"e{i}", p.name, _section(p)) for i, p in enumerate(found.proposals)]
    return page(
        f"Import into {name}",
        "How the files were read",
        note(notes if open_questions else []),
        "",
        [*sections, ("left", "Left out", note(found.left_out))],
    )


def _section(p: Proposal) -> str:
    """Picture, keys, columns and conclusions of one experiment."""
    ranges = [([name, p.origin[name], *_extent(v), str(len(v))], False) for name, v in p.columns.items()]
    head = [("column", ""), ("from", ""), ("least", "n"), ("most", "n"), ("rows", "n")]
    concluded = "".join(f"<li>{escape(words)}</li>" for words in p.concluded)
    listed = "".join(f"<li>{escape(one.words)}</li>" for one in p.unread)
    unread = f"<p>Not read:</p><ul>{listed}</ul>" if listed else ""
    return (
        _picture(p)
        + facts_table("key", "value", {**p.keys, "from": p.place})
        + table("", head, ranges)
        + (f"<ul>{concluded}</ul>" if concluded else "")
        + unread
    )


def _extent(values: Array) -> tuple[str, str]:
    """The least and the largest value as text, empty where all are missing."""
    if not np.isfinite(values).any():
        return "", ""
    return f"{np.nanmin(values):.6g}", f"{np.nanmax(values):.6g}"


def terminal_lines(found: Understood) -> list[str]:
    """Lines on a terminal: each column with its extent and a sparkline of its course."""
    lines: list[str] = []
    for p in found.proposals:
        kind = p.keys.get("kind", "kind not known yet")
        lines.append(f"{p.name}: {kind}, {len(p.lines)} rows, {p.place}")
        rows = [(name, p.origin[name], *_extent(v), _trace(v)) for name, v in p.columns.items()]
        rows.insert(0, ("column", "from", "least", "most", "curve"))
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        for row in rows:
            cells = [row[k].ljust(w) if k < 2 else row[k].rjust(w) for k, w in enumerate(widths)]
            lines.append("  " + "  ".join([*cells, row[4]]).rstrip())
        lines += [f"  concluded: {words}" for words in p.concluded]
        lines += [f"  not read: {one.words}" for one in p.unread]
    return [*lines, *(f"not read: {words}" for words in found.left_out)]


def _trace(values: Array) -> str:
    """Course of a column as a row of bars, each the mean of an equal part."""
    values = values[np.isfinite(values)]
    if not len(values):
        return ""
    means = np.array([part.mean() for part in np.array_split(values, min(_BARS, len(values)))])
    extent = float(np.ptp(means))
    heights = (means - means.min()) / extent if extent else np.zeros(len(means))
    return "".join(_HEIGHTS[int(h * (len(_HEIGHTS) - 1) + 0.5)] for h in heights)


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
    with plots.canvas(8.8, 2.8) as (drawing, svg):
        for i, (x, y) in enumerate(pairs, 1):
            axes = drawing.add_subplot(1, len(pairs), i)
            step = max(1, len(p.columns[x]) // _MOST_POINTS)
            axes.plot(p.columns[x][::step], p.columns[y][::step], color="#0072B2", linewidth=1.0)
            axes.set(xlabel=_titled(x), ylabel=_titled(y))
        drawing.tight_layout()
    words = ", ".join(f"{_titled(y)} against {_titled(x)}" for x, y in pairs)
    return figure(svg(), "", f"{p.name}: {words}")


def _titled(column: str) -> str:
    """Title of an axis from a column's name."""
    head, _, unit = column.rpartition("_")
    return f"{head.replace('_', ' ')}, {unit}" if head else column
