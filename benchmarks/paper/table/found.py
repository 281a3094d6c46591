"""What a reproduction of the paper's table found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from .agreement import Agreement, Statement, agreement, statements
from .published import Published
from .settings import Settings
from .table_columns import TableColumn

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class OtherTableColumn:
    """A column beside the three units: J_hat (paths,) in mm by rule, and on a coarser mesh where known."""

    J_hat: Mapping[str, Array]
    coarser: Mapping[str, Array] = attrs.field(factory=dict)
    remark: str = ""


@attrs.frozen(eq=False)
class Found:
    """All that a reproduction found. samples: pressure in kPa at the protocol's instants (k,)."""

    settings: Settings
    paper: Published
    columns: tuple[TableColumn, ...]
    others: Mapping[str, OtherTableColumn]
    samples_kPa: Array

    def table(self, rule: str) -> dict[str, Array]:
        """J_hat (paths,) in mm by column."""
        own = {c.name: c.fine.J_hat(rule) for c in self.columns}
        return own | {name: o.J_hat[rule] for name, o in self.others.items() if rule in o.J_hat}

    def coarser(self, rule: str) -> dict[str, Array]:
        """J_hat (paths,) in mm on a coarser mesh, by column, as far as known."""
        own = {c.name: c.coarse.J_hat(rule) for c in self.columns}
        return own | {name: o.coarser[rule] for name, o in self.others.items() if rule in o.coarser}

    def uncertainty_mm(self, rule: str) -> dict[str, float]:
        """By column, how far the coarser mesh moves the J_hat that it moves most; nan where not known."""
        coarser = self.coarser(rule)
        return {
            name: float(np.abs(J - coarser[name]).max()) if name in coarser else float("nan")
            for name, J in self.table(rule).items()
        }

    def agreements(self, rule: str) -> dict[str, Agreement]:
        """Each column against the paper's."""
        coarser = self.coarser(rule)
        return {
            name: agreement(J, self.paper.like(name), self.paper.paths, coarser.get(name))
            for name, J in self.table(rule).items()
        }

    def statements(self, rule: str) -> list[Statement]:
        """The paper's statements, judged in those of our columns whose doubt by the mesh is known."""
        coarser = self.coarser(rule)
        known = {name: J for name, J in self.table(rule).items() if name in coarser}
        return statements(known, coarser, self.paper.paths)
