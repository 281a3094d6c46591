"""Result of a sweep: a row for each point."""

from __future__ import annotations

import attrs

from .csv_columns import Row
from .plan import Plan


@attrs.frozen(eq=False)
class Found:
    """Rows of a sweep, one a point: `number`, `status`, its inputs and figures, or why it failed.

    inputs, outputs: names of the columns varied and computed.
    """

    plan: Plan
    rows: tuple[Row, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def done(self) -> list[Row]:
        """Rows of the points that were solved."""
        return [row for row in self.rows if row["status"] == "done"]

    @property
    def failed(self) -> list[Row]:
        """Rows of the points that were not."""
        return [row for row in self.rows if row["status"] == "failed"]
