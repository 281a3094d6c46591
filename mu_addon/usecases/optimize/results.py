"""Result of an optimisation, for its report and summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit
from ...optimization.design_file import Design
from ...optimization.robustness import Verified
from ...optimization.search import Found, Observed

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Proposal:
    """A proposed unit: its rank from 1, its design's number, and its results.

    values (q,): on the search's mesh; checked: on a finer one; changes, reasons: in words. choice: path and
    resin, as far as they were free, by the freedom's name.
    """

    place: int
    number: int
    unit: Unit
    observed: Observed
    values: Array
    checked: Verified
    changes: tuple[str, ...]
    reasons: tuple[str, ...]
    choice: Mapping[str, str] = attrs.field(factory=dict)


@attrs.frozen(eq=False)
class Optimised:
    """Result of an optimisation: the search, its proposals, the outcome in words, and its cost.

    computed: units simulated by this run; model_a: Model A's, those of earlier runs in the folder included.
    """

    design: Design
    search: Found
    proposals: tuple[Proposal, ...]
    words: str
    computed: int
    model_a: int
    has_model: bool = False
    left_out: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the targets."""
        return [t.name for t in self.design.targets]
