"""What the data decide, by which rule, and the answer that decides otherwise: the table of the guide."""

from __future__ import annotations

import attrs


@attrs.frozen
class Decision:
    """A property of a table that is decided by its content: the rule, and the answer that overrides it."""

    of: str
    rule: str
    override: str


DECISIONS = {
    one.of: one
    for one in (
        Decision(
            "decimal sign",
            "the one that reads most cells of a column; `1,234` alone as the other columns, else asked; "
            "signs that alternate are refused",
            "decimal=,",
        ),
        Decision(
            "quantity",
            "the title; where title and unit disagree, the unit; a strain that begins at 1 is asked for, a "
            "stretch that begins at 0 is a strain",
            "column.TITLE=force",
        ),
        Decision(
            "unit",
            "the title, the row of units or the text behind each number; asked without one; a load in g is "
            "a weight; kPa abs, psia and bar(a) are absolute",
            "unit.TITLE=N",
        ),
        Decision(
            "time",
            "a clock or a date counts from its first row; a counter that begins again at 2^16, 2^31 or 2^32 "
            "is counted on; any other step back is refused",
            "interval_s=0.1",
        ),
        Decision(
            "sign",
            "of a load the course of the whole record, less jumps of one column alone, which are named: "
            "positive in tension of a coupon, in compression of a block",
            "sign=as_read",
        ),
        Decision("zero", "a displacement that begins away from 0 is a place of the machine", "zero=as_read"),
        Decision("kind", "the quantities; tension or compression by the file's words", "kind=coupon"),
        Decision("mode", "never by the data: asked", "mode=uniaxial"),
        Decision("size", "the lines above the table", "section_mm=12.5x3"),
    )
}


def kept_by(of: str) -> str:
    """Remark behind a conclusion: the answer that overrides it."""
    return f"({DECISIONS[of].override} keeps it)"
