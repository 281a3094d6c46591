"""The report of a run that was asked to stop, written at once from the files in its folder."""

from __future__ import annotations

import csv
import itertools
from html import escape
from pathlib import Path
from typing import Any

from ..files import write_text
from ..reading import file_bytes, file_text, parse_json
from ..run.context import STOPPED
from ..run.progress import spell
from ..run.summary import SUMMARY
from .html_parts import facts_table, note, page, table

REPORT = "report.html"
MOST_ROWS = 20
NO_PICTURES = "This report has no pictures: they take most of its time, and this run was asked to stop."


def write_stopped_report(folder: Path, why: str) -> None:
    """Write report.html of a run that stopped early, from its summary, tables and other files.

    why: as text. The run's next start removes it. Raises InputError, OSError and OutputError.
    """
    summary = _summary(folder)
    seconds = {stage: spell(float(s)) for stage, s in summary.get("seconds", {}).items()}
    files = sorted(f for f in folder.iterdir() if f.is_file() and f.name not in (REPORT, "run.lock"))
    tables = "".join(_table(path) for path in files if path.suffix == ".csv")
    links = "".join(f'<li><a href="{escape(f.name, quote=True)}">{escape(f.name)}</a></li>' for f in files)
    sections = [
        ("stages", "Stages until then", facts_table("stage", "time", seconds)),
        ("tables", "Tables so far", tables),
        ("files", "Files in the folder", f"<ul>{links}</ul>"),
        ("versions", "Versions", facts_table("program", "version", summary.get("versions", {}))),
    ]
    words = [
        f"This run is partial: {why}. The results below are from before the stop, and are not final.",
        NO_PICTURES,
        "The same command, or `run.py resume` with this folder, continues from the finished stages.",
    ]
    whole = page(f"Stopped run: {folder.resolve().name}", "", note(words), "", sections)
    write_text(folder / REPORT, f"{whole}{STOPPED}\n")


def _summary(folder: Path) -> dict[str, Any]:
    found = parse_json(file_bytes(folder / SUMMARY), SUMMARY)
    return found if isinstance(found, dict) else {}


def _table(path: Path) -> str:
    """HTML of the first rows of a table, and how many follow."""
    rows = list(csv.reader(line for line in file_text(path).splitlines() if not line.startswith("#")))
    shown = [(row, False) for row in itertools.islice(rows, 1, MOST_ROWS + 1) if len(row) == len(rows[0])]
    more = f", and {len(rows) - 1 - MOST_ROWS} rows more" if len(rows) - 1 > MOST_ROWS else ""
    return table(f"{path.name}{more}", [(name, "") for name in rows[0]], shown) if shown else ""
