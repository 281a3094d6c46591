"""Experiments in the tables of laboratory files, the conclusions drawn, and the open questions.

An experiment is made in steps, each a function from a draft to the next one.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..measured.folder import LIKE_ABSOLUTE_kPa
from ..measured.kinds import ACCURACIES, AXES, KINDS, MODES, PLATES, VALVES, may_be_missing
from ..table_cells.notation import DECIMALS, number
from . import facts
from .blocks import Block, Unread
from .decisions import kept_by
from .draft import Draft, NoExperiment, Question
from .kind import require_curve, with_kind, with_needed
from .quantities import free_columns, read_columns
from .signs import LOADS, jumps, turned
from .times import with_interval, with_rising_time

Array = np.ndarray[Any, Any]

# A displacement that begins farther from zero than this share of its range is a place of the machine.
_OFFSET = 0.02
# A column that is missing in a larger share of the rows is left out instead of them, where it may be.
_SPARSE = 0.1
# Jumps of a column that are named at most.
_MOST_JUMPS = 3
_KEYS_OF_NUMBERS = (
    "temperature_C",
    "scale",
    "orientation_deg",
    "mass_g",
    "strut_mm",
    "chamber_volume_mm3",
    "gap_mm",
    *ACCURACIES,
)
_KEYS_OF_CHOICE = {
    "plates": PLATES,
    "axis": AXES,
    "valve": VALVES,
    "orientation_axis": AXES,
    "mode": MODES,
    "pressure": ("gauge", "absolute"),
}


@attrs.frozen(eq=False)
class Proposal:
    """One experiment, as far as it was read.

    file, sheet: its source; lines (n,): of the rows read; keys: of experiments.toml; columns: arrays (n,) by
    their names in a folder of measured data; origin: source of each column; concluded: changes and
    assumptions; unread: lines and columns that are not read; questions: those still open; titles: of all
    columns of the table, and their numbers.
    """

    file: Path
    sheet: str
    lines: Array
    keys: dict[str, Any]
    columns: dict[str, Array]
    origin: dict[str, str]
    concluded: tuple[str, ...]
    unread: tuple[Unread, ...]
    questions: tuple[Question, ...]
    titles: tuple[str, ...]

    @property
    def name(self) -> str:
        """The experiment's name."""
        return str(self.keys["name"])

    @property
    def place(self) -> str:
        """Name of the file, sheet and lines, in words."""
        sheet = f", sheet {self.sheet!r}" if self.sheet else ""
        return f"{self.file.name}{sheet}, lines {self.lines[0]} to {self.lines[-1]}"

    @property
    def where(self) -> str:
        """The same with the file's path."""
        return f"{self.file}{self.place.removeprefix(self.file.name)}"


def propose(path: Path, block: Block, name: str, answers: Mapping[str, str]) -> Proposal:
    """Make an experiment of a table.

    name: of the experiment; answers: by key, as text, of this experiment. Raises InputError for an invalid
    answer, for a time that does not increase, and NoExperiment where columns are missing.
    """
    draft = with_kind(read_columns(Draft.of(path, block, name, answers)))
    for step in _STEPS if draft.kind else ():
        draft = step(draft)
    draft = free_columns(draft)
    return Proposal(
        file=path,
        sheet=block.sheet,
        lines=draft.lines,
        keys=dict(draft.keys) if draft.kind else {"name": name},
        columns=dict(draft.columns),
        origin={column: draft.origin[column] for column in draft.columns},
        concluded=draft.concluded,
        unread=draft.unread,
        questions=draft.questions,
        titles=tuple(title for c in block.columns for title in dict.fromkeys((c.name, str(c.place)))),
    )


def answers_for(name: str, given: Mapping[str, str]) -> dict[str, str]:
    """Answers for an experiment: those under its name before those for all."""
    general = {key: value for key, value in given.items() if "." not in key or key.startswith(_OWN)}
    own = {key[len(name) + 1 :]: value for key, value in given.items() if key.startswith(name + ".")}
    return general | own


# Answers about a column begin so, and hold its title.
_OWN = ("unit.", "column.")


def _of_kind(draft: Draft) -> Draft:
    """The draft with the columns that its kind may have."""
    for name in draft.columns:
        if not KINDS[draft.kind].knows(name):
            draft = draft.without_column(name, f"{name} is not a column of {draft.kind}")
    return draft


def _with_complete_rows(draft: Draft) -> Draft:
    """Rows without missing required values; the others are listed with the reason."""
    kind = KINDS[draft.kind]
    reasons: dict[str, list[int]] = {}
    keep = np.full(len(draft.rows), True)
    for name, values in draft.columns.items():
        gone = np.isnan(values)
        if not gone.any() or name not in draft.places:
            continue
        others = set(draft.columns) - {name}
        if gone.mean() > _SPARSE and name != "time_s" and any(others.issuperset(g) for g in kind.needs):
            draft = draft.without_column(name, f"missing in {gone.sum()} of {len(gone)} rows")
            continue
        for i in np.flatnonzero(gone):
            text = draft.block.bad.get((int(i), draft.places[name]))
            why = _why_missing(text, draft.title(draft.places[name]), draft.block.decimal)
            if may_be_missing(name) and text is not None:
                reasons.setdefault(f"{why}: left empty", []).append(int(draft.lines[i]))
            elif not may_be_missing(name) and keep[i]:
                reasons.setdefault(why, []).append(int(draft.lines[i]))
                keep[i] = False
    for why, lines in reasons.items():
        draft = draft.left("", why, lines)
    if keep.sum() < kind.fewest:
        raise NoExperiment(
            f"{keep.sum()} rows have all that {kind.name} needs, at least {kind.fewest} must: "
            + "; ".join(one.words for one in draft.unread[-3:]),
            draft.where,
            "correct these cells, or leave a column out with column.TITLE=none",
        )
    columns = {name: values[keep] for name, values in draft.columns.items()}
    return attrs.evolve(draft, columns=columns, rows=draft.rows[keep])


def _why_missing(text: str | None, title: str, decimal: str) -> str:
    if text is None:
        return f"no number in {title}"
    (other,) = (sign for sign in DECIMALS if sign != decimal)
    signs = {".": "decimal point", ",": "decimal comma"}
    if number(text, other) is not None:
        return f"{text!r} in {title} has a {signs[other]}, the others have a {signs[decimal]}"
    return f"{text!r} in {title} is not a number"


def _with_zero(draft: Draft) -> Draft:
    """Shift a displacement that begins at a position of the machine to begin at zero."""
    found = draft.columns.get("displacement_mm")
    if found is None or draft.choice("zero", ("as_read",)):
        return draft
    first = float(found[0])
    if abs(first) <= _OFFSET * float(np.ptp(found)):
        return draft
    return draft.with_column("displacement_mm", found - first).concluding(
        f"displacement_mm: minus its first value, {first:g} mm, the machine's position {kept_by('zero')}"
    )


def _with_signs(draft: Draft) -> Draft:
    """The loads with their signs; jumps of one column alone are named."""
    if draft.kind not in ("coupon", "lattice_compression"):
        return draft
    loads = [name for name in LOADS if name in draft.columns]
    for name in loads:
        for row in jumps(draft.columns, name)[:_MOST_JUMPS]:
            by = draft.columns[name][row] - draft.columns[name][row - 1]
            line = draft.lines[row]
            draft = draft.concluding(
                f"{name}: jumps by {by:.4g} at line {line} while the test goes on; check it"
            )
    pressed = draft.kind == "lattice_compression"
    found = () if draft.choice("sign", ("as_read",)) else turned(draft.columns, pressed)
    for name in found:
        draft = draft.with_column(name, 0.0 - draft.columns[name]).concluding(
            f"{name}: sign turned, positive in {'compression' if pressed else 'tension'} {kept_by('sign')}"
        )
    if not pressed and not found and all(np.mean(draft.columns[name]) < 0 for name in loads):
        draft = draft.concluding("force and displacement are negative: read as compression of the coupon")
    return draft


def _with_keys(draft: Draft) -> Draft:
    """Keys of experiments.toml: answers, then facts in the file, else a question."""
    kind, block = KINDS[draft.kind], draft.block
    keys: dict[str, Any] = {"name": draft.name, "kind": draft.kind}
    keys["specimen"] = draft.answers.get("specimen") or facts.named(block.facts, facts.NAME) or draft.name
    keys["role"] = draft.choice("role", ("fit", "held_out")) or "fit"
    keys["source"] = draft.path.name
    keys |= {key: draft.numbers(key)[0] for key in _KEYS_OF_NUMBERS if key in draft.answers}
    keys |= {key: draft.choice(key, choices) for key, choices in _KEYS_OF_CHOICE.items()}
    if draft.kind == "coupon" and keys["mode"] is None:
        draft = draft.asked("mode", "how was the coupon loaded?", MODES, "uniaxial")
    if draft.kind == "blocked_force" and "gap_mm" not in keys:
        draft = draft.asked("gap_mm", "how far in mm was the load cell from the tip at rest?", (), "0")
    if "pressure" in kind.keys and keys["pressure"] is None and "pressure_kPa" in draft.columns:
        draft, keys["pressure"] = _reference(draft)
    if "cells" in draft.answers and "cells" in kind.keys:
        cells = draft.numbers("cells", (1, 3), whole=True)
        keys["cells"] = cells if len(cells) == 3 else cells[0]
    draft, keys["section_mm"] = _section(draft)
    draft, keys["length_mm"] = _length(draft)
    # Section and length turn force and displacement into stress and strain.
    beam = draft.kind == "beam_deadweight"
    if keys["section_mm"] is None and (beam or _computed(draft, "stress_kPa", "force_N")):
        draft = draft.asked("section_mm", "width and thickness of the section in mm, as 12.5x3?")
    if keys["length_mm"] is None and (beam or _computed(draft, "strain", "displacement_mm")):
        words = "length in mm over which the displacement is taken (gauge length, height of a block)?"
        draft = draft.asked("length_mm", words)
    given = {key: value for key, value in keys.items() if value is not None and key in kind.keys}
    return attrs.evolve(draft, keys=given)


def _computed(draft: Draft, wanted: str, source: str) -> bool:
    """Return True if a load's column follows from another one by a size of the specimen."""
    return KINDS[draft.kind].knows(wanted) and wanted not in draft.columns and source in draft.columns


def _reference(draft: Draft) -> tuple[Draft, str | None]:
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
        draft = draft.asked("pressure", words, _KEYS_OF_CHOICE["pressure"], "absolute")
    return draft, stated if stated == "gauge" else None


def _section(draft: Draft) -> tuple[Draft, list[float] | None]:
    """Width and thickness in mm by an answer or the file; a round section as a square of equal area."""
    lines, decimal = draft.block.facts, draft.block.decimal
    if "section_mm" in draft.answers:
        return draft, draft.numbers("section_mm", (2,))
    width, thickness, diameter, area = (
        facts.size_mm(lines, pattern, decimal)
        for pattern in (facts.WIDTH, facts.THICKNESS, facts.DIAMETER, facts.AREA)
    )
    pair = [width, thickness] if width and thickness else facts.pair_mm(lines, facts.SECTION, decimal)
    if pair:
        return draft.concluding(f"section of {pair[0]:g} x {pair[1]:g} mm, as the file says"), pair
    side = facts.square_mm(area, diameter)
    if side:
        words = f"of {area:g} mm2" if area else f"round, {diameter:g} mm"
        return draft.concluding(f"section {words}, as the file says: given as a square of that area"), [
            side,
            side,
        ]
    return draft, None


def _length(draft: Draft) -> tuple[Draft, float | None]:
    """Length in mm by an answer or the file."""
    answered = draft.positive("length_mm")
    length = answered or facts.size_mm(draft.block.facts, facts.LENGTH, draft.block.decimal)
    if length and not answered:
        draft = draft.concluding(f"length of {length:g} mm, as the file says")
    return draft, length


_STEPS = (
    with_interval,
    require_curve,
    with_needed,
    _of_kind,
    _with_complete_rows,
    with_rising_time,
    # A place of the machine may be negative: its change tells the sign.
    _with_zero,
    _with_signs,
    _with_keys,
)
