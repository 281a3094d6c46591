"""Keys of an experiment in experiments.toml: answers, then facts in the file, else a question."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..measured.folder import LIKE_ABSOLUTE_kPa
from ..measured.kinds import ACCURACIES, AXES, BETWEEN, CHOICES, KINDS, MODES, ROLES, UP_TO
from .facts import length_mm, section_mm, specimen
from .proposal import Proposal

_SIZES = ("section_mm", "length_mm")
_NUMBERS = tuple(key for key in (*BETWEEN, *UP_TO, *ACCURACIES) if key not in _SIZES)
_CHOICES = CHOICES | {"orientation_axis": AXES}
# Keys that answer a question or change a conclusion, beside those on one column; others are mistakes.
ANSWERS = (
    *("kind", *_SIZES, "interval_s", "zero", "sign", "specimen", "role", "cells"),
    *_CHOICES,
    *_NUMBERS,
)


def with_keys(draft: Proposal) -> Proposal:
    """The keys; the mode of a coupon is always asked, sizes where a load follows from them."""
    kind = KINDS[draft.kind]
    keys: dict[str, Any] = {
        "name": draft.name,
        "kind": draft.kind,
        "specimen": draft.answers.get("specimen") or specimen(draft) or draft.name,
        "role": draft.choice("role", ROLES) or "fit",
        "source": draft.file.name,
        **{key: draft.numbers(key)[0] for key in _NUMBERS if key in draft.answers},
        **{key: draft.choice(key, choices) for key, choices in _CHOICES.items()},
    }
    if draft.kind == "coupon" and keys["mode"] is None:
        draft = draft.asked("mode", "how was the coupon loaded?", MODES, "uniaxial")
    if draft.kind == "blocked_force" and "gap_mm" not in keys:
        draft = draft.asked("gap_mm", "how far in mm was the load cell from the tip at rest?", (), "0")
    if "pressure" in kind.keys and keys["pressure"] is None and "pressure_kPa" in draft.columns:
        draft, keys["pressure"] = reference(draft)
    if "cells" in draft.answers and "cells" in kind.keys:
        cells = draft.numbers("cells", (1, 3), whole=True)
        keys["cells"] = cells if len(cells) == 3 else cells[0]
    draft, keys["section_mm"] = section_mm(draft)
    draft, keys["length_mm"] = length_mm(draft)
    # Section and length turn force and displacement into stress and strain.
    beam = draft.kind == "beam_deadweight"
    if keys["section_mm"] is None and (beam or _computed(draft, "stress_kPa", "force_N")):
        draft = draft.asked("section_mm", "width and thickness of the section in mm, as 12.5x3?")
    if keys["length_mm"] is None and (beam or _computed(draft, "strain", "displacement_mm")):
        words = "length in mm over which the displacement is taken (gauge length, height of a block)?"
        draft = draft.asked("length_mm", words)
    given = {key: value for key, value in keys.items() if value is not None and key in kind.keys}
    return attrs.evolve(draft, keys=given)


def _computed(draft: Proposal, wanted: str, source: str) -> bool:
    """Return True if a load's column follows from another one by a size of the specimen."""
    return KINDS[draft.kind].knows(wanted) and wanted not in draft.columns and source in draft.columns


def reference(draft: Proposal) -> tuple[Proposal, str | None]:
    """Whether pressures are gauge or absolute ones: by the column's unit or title, or asked."""
    values = draft.columns["pressure_kPa"]
    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    stated = draft.keys.get("pressure")
    if stated == "absolute" and least > 0:
        return draft.concluding(
            "pressure = absolute, by unit or title (pressure=gauge for another)"
        ), "absolute"
    low, high = LIKE_ABSOLUTE_kPa
    if stated is None and low < least and most < high:
        words = (
            f"pressures are from {least:.4g} to {most:.4g} kPa: are they absolute, or above the atmosphere's?"
        )
        draft = draft.asked("pressure", words, _CHOICES["pressure"], "absolute")
    return draft, stated if stated == "gauge" else None
