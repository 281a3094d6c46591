"""The report of a study, of the parts that it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from ..files import write_bytes, write_text
from ..run.parts import Beside, Chart, Fact, Part, Pictures, Sentence, Table, flat
from ..run.progress import spell
from ..run.shown import Shown
from ..run.versions import package_versions
from .html_parts import cards, facts_table, figure, note, number, page, picture_figure, table
from .plots import seconds as seconds_chart
from .plots import signed
from .stopped import NO_PICTURES

_ALWAYS = {"summary.json": "all results of this run as numbers", "log.ndjson": "log of this run"}


def write_page(work: Shown, stopped: str = "") -> None:
    """Draw the pictures and write report.html; stopped: why an incomplete run stopped."""
    if work.study.joins and not any(parts for _, parts in work.shown):
        return
    with work.context.progress.stage("report"):
        work.open()
        versions = package_versions()
        work.context.summary["versions"] = versions
        write_text(work.folder / work.study.page, page_of(work, versions, stopped))


def page_of(work: Shown, versions: Mapping[str, str], stopped: str = "") -> str:
    """The whole report as HTML text, of all results that there are."""
    study, seconds = work.study, work.context.seconds
    lead = ""
    titles: dict[str, str] = {}
    found: dict[str, str] = {}
    for shown, (one, parts) in enumerate(work.shown):
        html = _html(work, parts)
        if not one.title:
            lead += html
        else:
            titles[one.key] = one.title
            found[one.key] = found.get(one.key, "") + html
        work.context.progress.update((shown + 1) / (len(work.shown) + 1))
    sections = [
        *((key, titles[key], html) for key, html in found.items()),
        ("time", "Computing time of each stage", _time(seconds) if seconds else ""),
        ("files", "Files of this run", facts_table("file", "content", _files(work))),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    listed = [
        part for _, parts in work.shown for part in flat(parts) if isinstance(part, Sentence) and part.note
    ]
    notes = [*work.context.summary.get("warnings", []), *(part.text for part in listed)]
    notes += [*_of_model(work.context.summary), *([NO_PICTURES] if work.context.hurried else [])]
    title, words = study.heading()
    return page(title, signed(words), note(notes, stopped), lead, sections)


def _time(stages: Mapping[str, float]) -> str:
    words = f"Seconds per stage; {spell(sum(stages.values()))} in all."
    return figure(seconds_chart(stages), words, "Bar chart of seconds per stage.", "chart")


def _of_model(summary: Mapping[str, Any]) -> list[str]:
    """Changes that an extended model made to the unit, and those that were left out, as text."""
    model = summary.get("model", {})
    doubt = model.get("doubt")
    return [
        *([f"The extended model's {doubt}."] if doubt else []),
        *(f"Applied from the extended model: {words}." for words in model.get("applied", ())),
        *(f"Not applied from the extended model: {words}." for words in model.get("left_out", ())),
    ]


def _html(work: Shown, parts: Sequence[Part]) -> str:
    """HTML of parts; neighbouring figures become one row of cards."""
    html = ""
    facts: list[tuple[str, str]] = []
    for part in [*parts, None]:
        if isinstance(part, Fact):
            facts += [(escape(part.name), escape(part.shown))] if part.shown else []
            continue
        html += cards(facts) if facts else ""
        facts = []
        html += "" if part is None else _one(work, part)
    return html


def _one(work: Shown, part: Part) -> str:
    if isinstance(part, Sentence) and part.page and not part.note:
        words = signed(escape(part.text))
        strong = signed(escape(part.strong))
        words = words.replace(strong, f"<strong>{strong}</strong>", 1) if strong else words
        if part.heading:
            return f"<h3>{words}</h3>"
        return f'<p class="answer">{words}</p>' if part.answer else f"<p>{words}</p>"
    if isinstance(part, Table):
        rows = [([*map(number, cells)], i in part.best) for i, cells in enumerate(part.rows)]
        return table(part.caption, part.head, rows, part.groups, "stack" if part.stacked else "")
    if isinstance(part, Beside):
        stacks = [one if isinstance(one, list) else [one] for one in part.parts]
        cells = [_html(work, stack) for stack in stacks]
        if part.across > 3:
            return f'<div class="many">{"".join(cells)}</div>'
        columns = "".join(f"<div>{cell}</div>" for cell in cells)
        return f'<div class="{"pair" if part.across < 3 else "triple"}">{columns}</div>'
    # A run that was asked to stop leaves out what takes long to draw.
    if work.context.hurried:
        return ""
    if isinstance(part, Chart):
        svg = part.make()
        if part.file:
            write_text(work.folder / part.file, svg)
        return figure(svg, escape(part.caption), part.alt or part.caption, part.kind)
    if isinstance(part, Pictures):
        found = part.make()
        for name, picture in found:
            if name:
                write_bytes(work.folder / name, picture.png)
        if not (found and part.shown):
            return ""
        scale = "" if part.scale is None else _one(work, part.scale)
        shown = "".join(picture_figure(picture) for _, picture in found)
        return f'{scale}<div class="{"pair" if len(found) < 3 else "triple"}">{shown}</div>'
    return ""


def _files(work: Shown) -> dict[str, Any]:
    """Content of each file that the folder has, inputs first."""
    inputs = dict.fromkeys(work.study.texts(), "inputs of this run")
    known = {**inputs, **work.study.files, **_ALWAYS}
    return {name: what for name, what in known.items() if any(work.folder.glob(name))}
