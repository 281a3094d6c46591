"""Errors of the core as shown in panels: with labels of fields in place of names in files."""

from __future__ import annotations

import re

from ...design.parameters import SECTIONS
from ...design.quantity import describe
from ...errors import MuError
from ..unit.fields import label

_LABELS = {d.name: label(d) for section in SECTIONS for d in describe(section)}
_OPTIONS = {"channel": "Light"}
"""Options of the command line whose fields have other names here."""


_PHRASES = {
    r"simulate with --model model\.toml, which has it": "apply the extended model",
    r"export --compensate( \S+\.csv)?": "Compensate, in the panel Print",
    r"with --orientation": "with Gravity, in the panel Simulate",
    r"with --obstacle": "with Use as Obstacle",
    r"with a finer mesh, --refine": "with a larger Refinement",
}
"""Actions that differ here from the command line."""


def in_panel(text: str) -> str:
    """A text with its parameters and options replaced by the labels of their fields.

    "[chambers] wall_mm" becomes "Wall", "--known-deg" becomes "Known Deg".
    """
    for phrase, here in _PHRASES.items():
        text = re.sub(phrase, lambda m, here=here: _as_in(m[0], here), text, flags=re.IGNORECASE)
    text = re.sub(r"\[\w+\] ", "", text)
    text = re.sub(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)", _option, text)
    return re.sub(r"\b[a-z]+(?:_[a-zA-Z]+)+\b", lambda m: _LABELS.get(m[0], m[0]), text)


def _as_in(found: str, here: str) -> str:
    return here[:1].upper() + here[1:] if found[:1].isupper() else here


def _option(found: re.Match[str]) -> str:
    return _OPTIONS.get(found[1], found[1].replace("-", " ").title())


def error_text(error: MuError) -> str:
    """The error, its location, and the remedy, a line each."""
    return "\n".join(in_panel(text) for text in (error.what, error.where, error.remedy) if text)
