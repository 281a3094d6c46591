"""Samples of a serial line: one layout of channels, numbered and timed."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

Array = np.ndarray[Any, Any]


@attrs.frozen
class Layout:
    """Layout of a sample: names of its channels, the unit of their values (or none), size of a count.

    per_count: in `unit`; raw counts of frames are multiplied by it.
    """

    channels: tuple[str, ...]
    unit: str = ""
    per_count: float = 1.0


@attrs.frozen(eq=False)
class Samples:
    """n samples of one layout with c channels, in the order they came.

    host_s (n,): seconds on the host's clock, rising; device_s (n,): the device's own in s, without wraps, or
    nan; sequence (n,): running number without wraps, counted on where the device sends none; values (n, c) in
    the layout's unit.
    """

    layout: Layout
    host_s: Array
    device_s: Array
    sequence: Array
    values: Array

    def __len__(self) -> int:
        return len(self.host_s)
