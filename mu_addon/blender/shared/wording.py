"""Errors of the core as shown in panels: with labels of fields in place of names in files."""

from __future__ import annotations

import re

from ...design.anchors import Window
from ...design.parameters import SECTIONS
from ...design.quantity import Description, describe
from ...errors import MuError

UNITS = ("mm", "kPa", "s")
_NAMES = {
    "count": "Chambers",
    "bladder_diameter_mm": "Bladder Ø",
    "neck_diameter_mm": "Neck Ø",
    "inlet_diameter_mm": "Inlet Ø",
    "junction_diameter_mm": "Junction Ø",
    "midspan_diameter_mm": "Midspan Ø",
    "row": "Anchor Row",
    "cells_y_minus": "Cells -Y",
    "cells_y_plus": "Cells +Y",
    "allow_symmetric": "Allow Symmetry",
    "minus_y": "-Y Side",
    "plus_y": "+Y Side",
    "beside_x": "X Sides",
    "lattice_modulus_kPa": "Lattice E (kPa)",
    "membrane_modulus_kPa": "Wall E (kPa)",
    "membrane_poisson": "Wall Poisson",
    "elongation_at_break": "Break Strain",
    "offset_xy_mm": "Offset XY",
    "inclusion_radius_mm": "Inclusion R",
    "law": "Wall's Law",
    "c2_over_c1": "Yeoh C2/C1",
    "c3_over_c1": "Yeoh C3/C1",
    "layers_excess": "Layers Stiffer by",
    "friction_share": "Dry Friction",
    "friction_yield_kPa": "Slides at (kPa)",
}
"""Parameters whose own names are too vague beside a field, or too long for it."""


_CHOICES = {"neo-hooke": "Neo-Hooke", "yeoh": "Yeoh", "prony": "Prony", "ogden-roxburgh": "Ogden-Roxburgh"}
"""Choices that are people's names."""


def choice_label(name: str) -> str:
    """Name of a choice of a parameter for a panel."""
    return _CHOICES.get(name, name.replace("-", " ").capitalize())


def label(d: Description) -> str:
    """Name of a parameter for a panel: `tip_cap_mm` becomes "Tip Cap"."""
    if d.name in _NAMES:
        return _NAMES[d.name]
    words = d.name.split("_")
    unit = words.pop() if words[-1] in UNITS else ""
    text = " ".join(word if word.isupper() else word.capitalize() for word in words)
    return f"{text} ({unit})" if unit and unit != "mm" else text


def tooltip(d: Description) -> str:
    """Description, bounds and source of a parameter; Blender adds the last full stop."""
    allowed = f". {d.allowed} {d.unit}".rstrip() if d.allowed else ""
    fixed = ". The same at every scale" if d.fixed else ""
    source = f".\nSource: {d.source}" if d.source else ""
    return f"{sentence(d.text)}{allowed}{fixed}{source}"


def readable(name: str) -> str:
    """The name of an effect or quantity with spaces: "mullins_softening" becomes "mullins softening"."""
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """A text with its first letter as a capital, the others as they are."""
    return text[:1].upper() + text[1:]


def heading(text: str) -> str:
    """A text as the head of a fold: "caps and inlet" becomes "Caps and Inlet"."""
    words = (word if word in ("and", "of", "the", "through") else sentence(word) for word in text.split())
    return sentence(" ".join(words))


def path_symbol(name: str) -> str:
    """The name of a sensor path with its Greek letter: "alpha4" becomes "α4"."""
    return name.replace("alpha", "α")


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


def anchors_of(window: Window) -> str:
    """First and last anchor of a sensor path in words: "P4 to P6"."""
    return f"P{window.start} to P{window.start + window.length - 1}"
