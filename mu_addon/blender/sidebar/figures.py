"""Figures of a unit, for the head of its panel: true size, resin, time to print; a fixed number of lines."""

from __future__ import annotations

import re
import textwrap
from typing import Any

from ...design import figures as core
from ...errors import MuError
from ...reading import parse_json
from ...run.progress import spell
from ..printing import state as printing
from ..shared.file_cache import UNREADABLE
from ..shared.wording import sentence
from ..unit import object as unit_object
from ..unit import stack
from ..unit.broken import broken
from ..unit.properties import to_unit

LINES = 5
"""Fixed number of lines of the box at the head of the panel, so that nothing below it moves."""

_kept: dict[str, tuple[Any, list[str]]] = {}


def lines(root: Any, width: int) -> tuple[list[str], bool]:
    """LINES lines of the box of at most `width` letters, and True if they are a broken rule."""
    found = broken(root)
    if found is not None:
        return _rule(found.text.split("\n"), width), True
    return _figures(root), False


def _rule(paragraphs: list[str], width: int) -> list[str]:
    """A broken rule and its full remedy: where both are too long, the rule is cut."""
    # The rule's name helps nobody here; the tooltip has it.
    what = textwrap.wrap(sentence(re.sub(r" \(rule: [^)]*\)", "", paragraphs[0])), width)
    remedy = textwrap.wrap(sentence(paragraphs[-1]), width)[: LINES - 1] if len(paragraphs) > 1 else []
    if len(what) + len(remedy) > LINES:
        what = what[: LINES - len(remedy)]
        what[-1] = textwrap.shorten(f"{what[-1]} {'x' * width}", width, placeholder=" ...")
    text = what + remedy
    return text + [""] * (LINES - len(text))


def _figures(root: Any) -> list[str]:
    props = root.mu_unit
    current = unit_object.solid_is_current(root)
    key = props.built, current, root.mu_print.printer
    kept = _kept.get(props.uuid)
    if kept is None or kept[0] != key:
        try:
            kept = key, _made(root, current)
        except (MuError, *UNREADABLE) as error:
            kept = key, [str(error).split("\n")[0]]
        _kept[props.uuid] = kept
    check = printing.CHECK.found(root)
    checked = [] if check is None or check.stale else [f"Checked: {printing.faults(check.content)[1]}"]
    found = [*kept[1], *checked]
    return found + [""] * (LINES - len(found))


def _made(root: Any, current: bool) -> list[str]:
    unit = to_unit(root.mu_unit)
    printer = printing.printer_of(root)
    struts = stack.STACK.value("struts", stack.given(root, unit))
    found = core.figures(unit, printer, struts, _volume(root) if current else None)
    about, limit = "about " if found.approximate else "", printer.limits["layer_s"]
    return [
        f"Size {' x '.join(f'{side:.3g}' for side in found.size_mm)} mm",
        f"Resin {about}{found.mass_g:.3g} g, {found.volume_mm3 / 1000.0:.3g} ml",
        f"Prints upright in about {spell(found.print_s)}",
        f"at {limit.value:g} s a layer{', assumed' if limit.assumed else ''}",
    ]


def _volume(root: Any) -> float:
    return float(parse_json(root.mu_unit.solid["mu_gates"], "mu_gates")["volume_mm3"])
