"""The frame of every report and its parts: one self-contained HTML page without scripts."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .plots import label, signed
from .results import Picture


def page(title: str, subtitle: str, notes: str, lead: str, sections: Sequence[tuple[str, str, str]]) -> str:
    """A whole report page as HTML text without scripts or outside files.

    title, subtitle: text; notes, lead: HTML, the notes above the lead; sections: key, title and HTML of each,
    those without HTML are left out.
    """
    css = (Path(__file__).parent / "report.css").read_text(encoding="utf-8")
    sections = [section for section in sections if section[2]]
    contents = "".join(f'<li><a href="#{key}">{escape(name)}</a></li>' for key, name, _ in sections)
    body = "".join(
        f'<section id="{key}" aria-labelledby="{key}-title">'
        f'<h2 id="{key}-title">{escape(name)}</h2>{html}</section>'
        for key, name, html in sections
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # A browser asks a server for an icon unless the page brings one.
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>\n{css}</style>\n</head>\n<body>\n"
        f'<header><h1>{escape(title)}</h1><p class="sub">{escape(subtitle)}</p>'
        f"{notes}</header>\n<main>\n{lead}"
        f'<nav aria-label="Contents"><ul>{contents}</ul></nav>\n{body}</main>\n</body>\n</html>\n'
    )


def note(paragraphs: Iterable[str], stopped: str = "") -> str:
    """HTML of a box with paragraphs of text, "" where there are none; `stopped`: why its run ended early."""
    first = [f"This run is partial: {stopped}. Missing parts were not computed."] if stopped else []
    html = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in (*first, *paragraphs))
    return f'<div class="note">{html}</div>' if html else ""


def cards(facts: Sequence[tuple[str, str]]) -> str:
    """HTML of key figures side by side, each a label and a value, both HTML."""
    html = "".join(f"<div><dt>{signed(what)}</dt><dd>{signed(value)}</dd></div>" for what, value in facts)
    return f'<dl class="facts">{html}</dl>'


def facts_table(left: str, right: str, facts: Mapping[str, Any]) -> str:
    """HTML of a table of names and values under two column titles; "" where there are none."""
    if not facts:
        return ""
    head = [(left, ""), (right, "" if right else "n")]
    return table("", head, [([key, number(value)], False) for key, value in facts.items()])


def table(
    caption: str,
    head: Sequence[tuple[str, str]],
    rows: Iterable[tuple[Sequence[Any], bool]],
    groups: Sequence[tuple[str, int]] = (),
    css: str = "",
) -> str:
    """HTML of a table that scrolls sideways; texts are escaped.

    head: title and CSS class of each column; rows: cells, and True for the best row; groups: titles over so
    many columns each; css: "stack" shows each row as a block on a phone. A cell "FAILED" is marked.
    """

    def cell(tag: str, text: Any, kind: str, scope: str = "") -> str:
        kind = "fail" if text == "FAILED" else kind
        kind = f' class="{kind}"' if kind else ""
        return f"<{tag}{scope}{kind}>{escape(str(text))}</{tag}>"

    top = "".join(cell("th", title, kind, " scope=col") for title, kind in head)
    top = f"<tr>{top}</tr>"
    if groups:
        above = "".join(
            cell("th", title, "group" if title else "", f" colspan={span} scope=colgroup")
            for title, span in groups
        )
        top = f"<tr>{above}</tr>{top}"
    body = ""
    for cells, best in rows:
        first = cell("th", cells[0], head[0][1], " scope=row")
        rest = "".join(cell("td", text, kind) for text, (_, kind) in zip(cells[1:], head[1:], strict=True))
        body += f"<tr{' class=best' if best else ''}>{first}{rest}</tr>"
    words = f'<p class="caption">{escape(caption)}</p>' if caption else ""
    name = escape(caption or head[0][0], quote=True)
    css = f' class="{css}"' if css else ""
    return (
        f'{words}<div class="scroll" role="region" tabindex="0" aria-label="{name}"><table{css}>'
        f"<thead>{top}</thead><tbody>{body}</tbody></table></div>"
    )


def figure(svg: str, caption: str, alt: str, kind: str = "") -> str:
    """HTML of a chart given as SVG text; caption: HTML, alt: text, kind: CSS class."""
    return _image("image/svg+xml", svg.encode(), caption, alt, kind)


def picture_figure(picture: Picture) -> str:
    """HTML of a PNG picture with its caption, in which names of paths are written as by `label`."""
    caption = re.sub(r"\balpha\d+\b", lambda name: label(name[0]), signed(picture.caption))
    return _image("image/png", picture.png, escape(caption), picture.alt, "")


def _image(kind: str, data: bytes, caption: str, alt: str, css: str) -> str:
    source = f"data:{kind};base64,{b64encode(data).decode()}"
    words = f"<figcaption>{caption}</figcaption>" if caption else ""
    css = f' class="{css}"' if css else ""
    return f'<figure{css}><img src="{source}" alt="{escape(alt, quote=True)}">{words}</figure>'


def number(value: Any) -> str:
    """A value as text: floats to six figures, whole numbers with spaced thousands, yes or no for flags."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | np.integer):
        return f"{int(value):,}".replace(",", "\u202f")
    if isinstance(value, float | np.floating):
        return signed(f"{float(value):.6g}")
    return str(value)
