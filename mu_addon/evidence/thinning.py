"""Very long records reduced to means of a few readings each."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..measured import Experiment
from .readings import STAYS, dwell
from .simulator import Composite

# Most rows of a record: thirty for each block of readings in a fit (`record.BLOCKS`).
MOST = 20_000


def thinned(experiments: Sequence[Experiment], simulator: Composite) -> tuple[list[Experiment], list[str]]:
    """The experiments with at most `MOST` rows if they have a clock, and a text on the longer ones.

    Equal numbers of consecutive rows are averaged, in all columns. That is exact for quantities linear within
    them, as nearly holds over a twenty-thousandth of a record, and loses no information in white noise. A
    missing reading is left out of its mean. Where a predicted channel stays on the steps of a display,
    several readings hold no more information than one, and rows are sampled instead.
    """
    found, words = [], []
    for e in experiments:
        if len(e) <= MOST or "time_s" not in e.columns or not simulator.knows(e):
            found.append(e)
            continue
        each = -(-len(e) // MOST)
        stays = any(dwell(e[c]) > STAYS for c in simulator.channels(e))
        of = _every if stays else _means
        columns = {name: of(values, each) for name, values in e.columns.items()}
        found.append(attrs.evolve(e, columns=columns, rows=e.rows[::each]))
        how = f"every {each}th is taken" if stays else f"means of {each} are taken"
        words.append(f"{e.name}: {len(e)} rows are more than are needed; {how}")
    return found, words


def _every(values: Array, each: int) -> Array:
    return values[::each]


def _means(values: Array, each: int) -> Array:
    """Means (m,) of so many values (n,) each, the last of the remaining ones; nan if all are nan."""
    first = np.arange(0, len(values), each)
    seen = np.isfinite(values)
    count = np.add.reduceat(seen.astype(float), first)
    total = np.add.reduceat(np.where(seen, values, 0.0), first)
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
