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
            "the one that reads most cells of a column; `1,234` alone: other columns, else asked",
            "decimal=,",
        ),
        Decision(
            "quantity",
            "the title, the unit where they disagree; a stretch begins at 1",
            "column.TITLE=force",
        ),
        Decision(
            "unit",
            "the title, a row or the text behind each number, else asked; a load in g is a weight",
            "unit.TITLE=N",
        ),
        Decision("pressure", "*abs*, psia, bar(a)", "pressure=gauge"),
        Decision(
            "time",
            "a clock from its first row on; a counter that wraps is counted on",
            "interval_s=0.1",
        ),
        Decision(
            "sign",
            "a load's whole course less its jumps: positive in tension of a coupon, compression of a block",
            "sign=as_read",
        ),
        Decision("zero", "a displacement begins there", "zero=as_read"),
        Decision("kind", "the quantities, and the words tension or compression", "kind=coupon"),
        Decision("mode", "always asked", "mode=uniaxial"),
        Decision("section, length", "the lines above the table", "section_mm=12.5x3"),
    )
}


def kept_by(of: str) -> str:
    """Remark behind a conclusion: the answer that overrides it."""
    return f"({DECISIONS[of].override} keeps it)"
