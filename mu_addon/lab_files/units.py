"""Unit that a column is read in: by an answer, its title or its row of units, else asked."""

from __future__ import annotations

import re

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .columns import READ_IN, Column, known_in, plain
from .proposal import Proposal

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
