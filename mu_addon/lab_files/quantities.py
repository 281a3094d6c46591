"""Quantity and unit of each column of a table: by answer, title, unit and first reading, else asked."""

from __future__ import annotations

import re
from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..measured.kinds import KINDS
from .columns import Column, column
from .proposal import Proposal
from .units import READ_IN, known_in, plain, unit_of

# A stretch at rest is 1, a strain 0, within this.
_AT_REST = 0.1
# Columns of one quantity are read in the order of the table, but these after others.
_LAST = re.compile(
    r"\b(min|max|minimum|maximum|std|stdev|peak|set|setpoint|target|desired|command|true|wahre|shear)\b|^soll"
)
# More degrees than a full turn in radians.
_NO_RADIANS = 7.0
# A date that a spreadsheet has as a number counts days from 1900: here of 1968 to 2091.
_DATE = re.compile(r"\bdat(e|um|a)\b|fecha|\u65e5")
_DAYS = 25_000, 70_000
# Units that a question offers, the usual one first.
_OFTEN = {
    "s": ("s", "ms", "us", "min", "h", "d"),
    "mm": ("mm", "um", "cm", "m", "in"),
    "N": ("N", "kN", "mN", "lbf", "kgf", "gf"),
    "kPa": ("MPa", "kPa", "Pa", "bar", "mbar", "psi"),
    "deg": ("deg", "rad"),
    "": ("1", "%"),
    "V": ("V", "mV"),
    "mm3": ("mm3", "ml"),
    "g": ("g", "kg"),
}


def read_columns(draft: Proposal) -> Proposal:
    """The draft with the columns of known quantity; of several of one quantity the first is read."""
    found: dict[str, list[tuple[int, Column]]] = {}
    for k in range(len(draft.block.columns)):
        draft, one = identified(draft, k)
        if one is not None:
            found.setdefault(one.reads, []).append((k, one))
    taken = [min(group, key=_rank) for group in found.values()]
    for group, (first, _) in zip(found.values(), taken, strict=True):
        for k, one in group:
            if k != first:
                draft = draft.left(draft.title(k), f"another {one.quantity}: {draft.title(first)} is read")
    for k, one in sorted(taken, key=lambda held: held[0]):
        draft = _with_values(draft, k, one)
    return draft


def _with_values(draft: Proposal, k: int, one: Column) -> Proposal:
    """The draft with column k as a column of this quantity, its unit asked for where it is not known."""
    draft, one = in_unit(*_strain_or_stretch(draft, k, one), k)
    if one.stated and one.stated != one.quantity:
        draft = draft.concluding(f"{draft.title(k)} is read as {one.quantity}, by its unit")
    values = draft.block.values[:, k] * (one.factor or 1.0) - (one.quantity == "stretch")
    read = f" [{one.unit}]" if one.unit else ""
    origin = f"{one.title or f'column {one.place}'!r}{read}"
    if one.reference:
        draft = attrs.evolve(draft, keys={**draft.keys, "pressure": one.reference})
    return draft.with_column(one.reads, values[draft.rows], origin, k)


def ask_column(
    draft: Proposal, k: int, quantities: Sequence[str], why: str = "", sure: bool = False
) -> Proposal:
    """Ask for the quantity of column k; sure: the first of the quantities is likely."""
    one = draft.block.columns[k]
    proposed = one.likely if one.likely in quantities else quantities[0] if sure else ""
    if not one.title and "time" in quantities and k == 0 and (np.diff(draft.block.values[:, k]) > 0).all():
        proposed = "time"
    return draft.asked(
        f"column.{draft.key(one)}",
        f"what does {draft.title(k)}{draft.extent(k)} hold{why}?",
        (*quantities, "none"),
        proposed,
    )


def may_hold(draft: Proposal, k: int, quantities: Sequence[str]) -> bool:
    """Return True if a column that is not read may hold one of these quantities, by its unit."""
    one = draft.block.columns[k]
    if draft.answer_on("column", one)[1] is not None or one.quantity == "count":
        return False
    return unit_of(one.unit) is None or any(known_in(q, one.unit) is not None for q in quantities)


def free_columns(draft: Proposal) -> Proposal:
    """The draft with the columns that nothing was taken from listed, with the reason."""
    for k in draft.free:
        one = draft.block.columns[k]
        why = f"its quantity is not known; set it by column.{draft.key(one)}=QUANTITY"
        if one.quantity == "count":
            why = "not a quantity that is read" + (f", in {one.unit!r}" if one.unit else "")
        draft = draft.left(draft.title(k), why)
    return attrs.evolve(draft, free=())


def _rank(held: tuple[int, Column]) -> tuple[bool, bool, bool, int]:
    """Order in which columns of one quantity are preferred.

    A clock beside a numeric time adds nothing; nor does a machine's position beside an extension, or a weight
    in grams beside a force.
    """
    k, one = held
    return (
        one.unit == "clock" or (one.quantity == "force" and (unit_of(one.unit) or "")[:1] == ("g",)),
        one.quantity == "position",
        _LAST.search(plain(one.title).replace("_", " ")) is not None,
        k,
    )


def identified(draft: Proposal, k: int) -> tuple[Proposal, Column | None]:
    """Column k with its quantity, by an answer or its title; None for one that is not read."""
    one = draft.block.columns[k]
    key, answer = draft.answer_on("column", one)
    unit = draft.answer_on("unit", one)[1]
    if answer == "none":
        return draft.left(draft.title(k), "left out by the answer 'none'"), None
    if answer is not None and answer not in READ_IN:
        raise InputError(
            f"{key} = {answer!r} is not a quantity",
            draft.where,
            f"choose one of {', '.join(READ_IN)}, or none",
        )
    if answer is not None and not (one.unit == "clock" and answer == "time"):
        factor = known_in(answer, one.unit)
        one = attrs.evolve(one, quantity=answer, factor=1.0 if answer == "stretch" else factor, stated="")
    elif answer is None and not one.quantity and not any(c.title for c in draft.block.columns):
        draft = ask_column(draft, k, [q for q in READ_IN if q != "count"])
    elif answer is None and unit is not None and unit_of(unit):
        # The unit that is given may say that a title means another quantity.
        again = attrs.evolve(column(one.title, unit), place=one.place)
        if not one.quantity or again.stated == "strain":
            one = attrs.evolve(again, quantity=again.quantity or again.likely)
    if not one.quantity or one.quantity == "count":
        return attrs.evolve(draft, free=(*draft.free, k)), None
    return _weight(draft, k, one)


def _weight(draft: Proposal, k: int, one: Column) -> tuple[Proposal, Column]:
    """A load in grams as the weight of that mass, or as the mass that bends a beam."""
    unit = unit_of(one.unit)
    if unit is None or unit[0] != "g" or one.quantity not in ("force", "added_mass"):
        return draft, one
    others = {other.quantity for other in draft.block.columns}
    kind = draft.answers.get("kind", "beam_deadweight" if "tip_deflection" in others else "")
    forced = kind in KINDS and "force_N" in KINDS[kind].columns and "force" not in others
    if kind == "beam_deadweight" or not (one.quantity == "force" or forced):
        return draft, attrs.evolve(one, quantity="added_mass", factor=unit[1])
    factor = known_in("force", one.unit)
    words = f"{draft.title(k)} is read as a force, the weight of that mass: 1 {one.unit} is {factor:.6g} N"
    return draft.concluding(words), attrs.evolve(one, quantity="force", factor=factor)


def _strain_or_stretch(draft: Proposal, k: int, one: Column) -> tuple[Proposal, Column]:
    """A stretch, 1 or 100 % at rest, and a strain, 0 at rest, told apart by the first reading."""
    values = draft.block.values[:, k]
    if one.quantity not in ("stretch", "strain") or not np.isfinite(values).any():
        return draft, one
    first = float(values[np.isfinite(values)][0]) * (one.factor or 1.0)
    percent = not unit_of(one.unit) and abs(first - 100.0) < 100.0 * _AT_REST
    key, answer = draft.answer_on("column", one)
    if one.quantity == "stretch" and answer is None and abs(first) < _AT_REST:
        words = f"{draft.title(k)} is read as a strain: it begins at {first:g}, not at 1"
        return draft.concluding(words), attrs.evolve(
            one, quantity="strain", factor=one.factor if one.unit else None
        )
    if one.quantity == "stretch":
        words = f"{draft.title(k)} is read as a stretch: the strain is its value less 1"
        return draft.concluding(words), attrs.evolve(one, unit="%", factor=0.01) if percent else one
    if percent or abs(first - 1.0) < _AT_REST:
        words = f"{draft.title(k)} begins at {first:g}, as a stretch does, and a strain at 0"
        if answer is not None:
            return draft.concluding(f"{words}: {key}=stretch if it is one"), one
        draft = draft.asked(f"column.{draft.key(one)}", words, ("strain", "stretch"), "stretch")
    return draft, one


def in_unit(draft: Proposal, one: Column, k: int) -> tuple[Proposal, Column]:
    """A column with its unit from an answer, `unit.TITLE=N`; asked for where it has none."""
    wanted = READ_IN[one.quantity]
    key, answer = draft.answer_on("unit", one)
    if answer is not None and one.unit != "clock":
        factor = 1.0 if answer in ("", wanted) else known_in(one.quantity, answer)
        if factor is None:
            raise InputError(
                f"{key} = {answer!r} is not a unit of {one.quantity}",
                draft.where,
                f"choose one of {', '.join(_OFTEN[wanted])}; column.{draft.key(one)}=QUANTITY says that "
                f"it is no {one.quantity}",
            )
        return draft, attrs.evolve(one, unit=answer, factor=factor)
    if one.factor is not None:
        return draft, one
    if (
        wanted == "deg"
        and not one.unit
        and np.nanmax(np.abs(draft.block.values[:, k]), initial=0) > _NO_RADIANS
    ):
        words = f"in degrees{draft.extent(k)}: {draft.title(k)}"
        return draft.concluding(words), attrs.evolve(one, unit="deg", factor=1.0)
    shown = f"{one.unit!r}, which is not known" if one.unit else "not given"
    title = repr(one.title) if one.title else f"column {one.place}"
    words = f"the unit of {title}{draft.extent(k)} is {shown}"
    if one.quantity == "time" and one.unit == "" and draft.block.clock == k:
        return draft.asked(key, words, ("h:min", "min:s")), attrs.evolve(one, factor=1.0)
    likely = _likely(one, draft.block.values[:, k])
    return draft.asked(key, words, _OFTEN[wanted], likely), attrs.evolve(one, factor=1.0)


def _likely(one: Column, values: Array) -> str:
    """The likely unit: of strain and of time by the size of the values; none beside an unknown one."""
    if one.quantity == "strain":
        # A stretch that is answered as a strain begins at 1.
        return "%" if np.nanmax(np.abs(values - values[0]), initial=0) > 1.5 else "1"
    if one.quantity == "time":
        if _DATE.search(plain(one.title)) and ((values > _DAYS[0]) & (values < _DAYS[1])).all():
            return "d"
        # Boards count milliseconds and microseconds in whole numbers, clocks of computers whole seconds.
        steps = np.abs(np.diff(values[np.isfinite(values)]))
        step = float(np.median(steps)) if len(steps) else 0.0
        whole = bool((values[np.isfinite(values)] % 1 == 0).all())
        return "us" if whole and step >= 1000 else "ms" if whole and step >= 5 else "s"
    wanted = READ_IN[one.quantity]
    return _OFTEN[wanted][0] if wanted in ("mm", "N", "deg") and not one.unit else ""
