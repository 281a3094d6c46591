"""The steps by which a table becomes an experiment, each a function from a proposal to the next one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import attrs
import numpy as np

from ..measured.kinds import KINDS, may_be_missing
from ..table_cells.notation import OTHER, number
from .blocks import Block
from .keys import with_keys
from .kind import require_curve, with_kind, with_needed
from .proposal import NoExperiment, Proposal
from .quantities import free_columns, read_columns
from .signs import with_signs, with_zero
from .times import with_interval, with_rising_time

# A column that is missing in a larger share of the rows is left out instead of them, where it may be.
_SPARSE = 0.1
# Answers about a column begin so, and hold its title.
_OWN = ("unit.", "column.")


def propose(file: Path, block: Block, name: str, answers: Mapping[str, str]) -> Proposal:
    """Make an experiment of a table.

    name: of the experiment; answers: by key, as text, of this experiment. Raises InputError for an invalid
    answer, for a time that does not increase, and NoExperiment where columns are missing.
    """
    draft = with_kind(read_columns(Proposal.of(file, block, name, answers)))
    if not draft.kind:
        return free_columns(attrs.evolve(draft, keys={"name": name}))
    for step in _STEPS:
        draft = step(draft)
    return free_columns(draft)


def answers_for(name: str, given: Mapping[str, str]) -> dict[str, str]:
    """Answers for an experiment: those under its name before those for all."""
    general = {key: value for key, value in given.items() if "." not in key or key.startswith(_OWN)}
    own = {key[len(name) + 1 :]: value for key, value in given.items() if key.startswith(name + ".")}
    return general | own


def _of_kind(draft: Proposal) -> Proposal:
    """The draft with the columns that its kind may have."""
    for name in draft.columns:
        if not KINDS[draft.kind].knows(name):
            draft = draft.without_column(name, f"{name} is not a column of {draft.kind}")
    return draft


def _with_complete_rows(draft: Proposal) -> Proposal:
    """Rows without missing required values; the others are listed with the reason."""
    kind = KINDS[draft.kind]
    reasons: dict[str, list[int]] = {}
    keep = np.full(len(draft.rows), True)
    for name, one in draft.table.items():
        gone, place = np.isnan(one.values), one.place
        if not gone.any() or place is None:
            continue
        others = set(draft.columns) - {name}
        if gone.mean() > _SPARSE and name != "time_s" and any(others.issuperset(g) for g in kind.needs):
            draft = draft.without_column(name, f"missing in {gone.sum()} of {len(gone)} rows")
            continue
        for i in np.flatnonzero(gone):
            text = draft.block.bad.get((int(i), place))
            why = _why_missing(text, draft.title(place), draft.block.decimal)
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
    return draft.with_rows(keep)


def _why_missing(text: str | None, title: str, decimal: str) -> str:
    if text is None:
        return f"no number in {title}"
    signs = {".": "decimal point", ",": "decimal comma"}
    if number(text, OTHER[decimal]) is not None:
        return f"{text!r} in {title} has a {signs[OTHER[decimal]]}, the others have a {signs[decimal]}"
    return f"{text!r} in {title} is not a number"


_STEPS = (
    with_interval,
    require_curve,
    with_needed,
    _of_kind,
    _with_complete_rows,
    with_rising_time,
    # A place of the machine may be negative: its change tells the sign.
    with_zero,
    with_signs,
    with_keys,
)
