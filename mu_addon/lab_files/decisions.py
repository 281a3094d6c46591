"""What the data decide, by which rule and function, and the answer that decides otherwise."""

from __future__ import annotations

import attrs


@attrs.frozen
class Decision:
    """A property of a table that is decided by its content.

    rule: in words; override: the answer that decides otherwise; by: module and function of this package.
    """

    of: str
    rule: str
    override: str
    by: str


_SIGN = "a load's whole course less its jumps: positive in tension of a coupon, compression of a block"
_DECIMAL = "the one that reads most cells of a column; `1,234` alone: other columns, else asked"
_UNIT = "the title, a row or the text behind each number, else asked; a load in g is a weight"
_QUANTITY = "the title, the unit where they disagree; a stretch begins at 1"
_TIME = "a clock from its first row on; a counter that wraps is counted on"
_KIND = "the quantities, and the words tension or compression"

DECISIONS = {
    one.of: one
    for one in (
        Decision("decimal sign", _DECIMAL, "decimal=,", "cells.read_column"),
        Decision("quantity", _QUANTITY, "column.TITLE=force", "quantities.identified"),
        Decision("unit", _UNIT, "unit.TITLE=N", "units.in_unit"),
        Decision("pressure", "*abs*, psia, bar(a)", "pressure=gauge", "keys.reference"),
        Decision("time", _TIME, "interval_s=0.1", "times.with_rising_time"),
        Decision("sign", _SIGN, "sign=as_read", "signs.with_signs"),
        Decision("zero", "a displacement begins there", "zero=as_read", "signs.with_zero"),
        Decision("kind", _KIND, "kind=coupon", "kind.with_kind"),
        Decision("mode", "always asked", "mode=uniaxial", "keys.with_keys"),
        Decision("section, length", "the lines above the table", "section_mm=12.5x3", "facts.section_mm"),
    )
}


def kept_by(of: str) -> str:
    """Remark behind a conclusion: the answer that overrides it."""
    return f"({DECISIONS[of].override} keeps it)"
