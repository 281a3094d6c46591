"""Geometry as typed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...measured import Experiment
from .declaration import Declaration

Array = np.ndarray[Any, Any]


def _strained(experiment: Experiment, strain: Array, values: Mapping[str, float], largest: float) -> Array:
    """Strain (n,) of a specimen higher than typed by a share, which was strained less."""
    return strain / (1.0 + values["height"]) if values["height"] else strain


EFFECT = Declaration(
    mechanism="a specimen's height differs from the entered one, which scales its strain",
    reveals="the specimen measured with a calliper",
    remedy="measure the specimen and correct the height that was entered",
    strain=_strained,
)
