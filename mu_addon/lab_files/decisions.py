"""What the data decide, by which rule and function, and the answer that decides otherwise."""

from __future__ import annotations

_SIGN = "a load's whole course less its jumps: positive in tension of a coupon, compression of a block"
_DECIMAL = "the one that reads most cells of a column; `1,234` alone: other columns, else asked"
_UNIT = "the title, a row or the text behind each number, else asked; a load in g is a weight"
_QUANTITY = "the title, the unit where they disagree; a stretch begins at 1; set points come last"
_TIME = "a clock from its first row on; a counter that wraps is counted on"
_KIND = "the quantities, and the words tension or compression; shear and oscillation are refused"

DECISIONS = {
    "decimal sign": (_DECIMAL, "decimal=,", "cells.read_column"),
    "quantity": (_QUANTITY, "column.TITLE=force", "quantities.identified"),
    "unit": (_UNIT, "unit.TITLE=N", "quantities.in_unit"),
    "pressure": ("*abs*, psia, bar(a)", "pressure=gauge", "keys.reference"),
    "time": (_TIME, "interval_s=0.1", "times.with_rising_time"),
    "sign": (_SIGN, "sign=as_read", "signs.with_signs"),
    "zero": ("a displacement begins there", "zero=as_read", "signs.with_zero"),
    "kind": (_KIND, "kind=coupon", "kind.with_kind"),
    "mode": ("always asked", "mode=uniaxial", "keys.with_keys"),
    "section, length": ("the lines above the table", "section_mm=12.5x3", "facts.section_mm"),
}
"""A property of a table: its rule in words, the answer that overrides it, and the function here."""


def kept_by(of: str) -> str:
    """Remark behind a conclusion: the answer that overrides it."""
    return f"({DECISIONS[of][1]} keeps it)"
