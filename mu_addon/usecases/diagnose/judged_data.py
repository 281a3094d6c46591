"""Result of a diagnosis, and its curves: measured and predicted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit
from ...evidence.extended import ExtendedModel
from ...evidence.simulator import Composite
from ...evidence.verdict import Verdict
from ...measured import Experiment, Measured

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class JudgedData:
    """A verdict with its simulator and data.

    remarks: of the reader. body: how the unit was modelled, as text; empty without a unit.
    """

    measured: Measured
    simulator: Composite
    verdict: Verdict
    model: ExtendedModel
    unit: Unit | None
    remarks: tuple[str, ...]
    body: str = ""

    @property
    def before(self) -> Mapping[str, float]:
        """Values of the base model."""
        return self.verdict.selection.base.values

    @property
    def after(self) -> Mapping[str, float]:
        """Values of the extended model, or of the best attempt if no cause was named."""
        return self.verdict.selection.chosen.values

    @property
    def extends(self) -> bool:
        """True if any effect was added to the base model, named or not."""
        return bool(self.verdict.selection.chosen.effects)


@attrs.frozen(eq=False)
class Curve:
    """One channel of an experiment: measured, and predicted by the base and the extended model, all (n,)."""

    experiment: Experiment
    channel: str
    measured: Array
    before: Array
    after: Array

    @property
    def spread(self) -> Array | None:
        """Standard deviation (n,) of the channel, where the data give it."""
        head, _, unit = self.channel.rpartition("_")
        return self.experiment.columns.get(f"{head}_sd_{unit}")


def curves(found: JudgedData) -> list[Curve]:
    """Every predicted channel of every experiment, in the order of the folder."""
    simulator = found.simulator
    listed = []
    for e, judged in zip(found.measured.experiments, found.verdict.experiments, strict=True):
        if not simulator.knows(e):
            continue
        before = simulator.predict(judged, found.before)
        after = simulator.predict(judged, found.after)
        for row, channel in enumerate(simulator.channels(e)):
            # A long record was judged by means of its rows, and is shown by them.
            shown = e if len(e) == len(judged) else judged
            listed.append(Curve(shown, channel, shown[channel], before[row], after[row]))
    return listed
