"""A testing machine's load cell, which reads all specimens: its largest force, and its zero."""

from __future__ import annotations

import math

from ..measured import Experiment
from .effects.declaration import MACHINE, Data, Law, largest_reading

# Length of a specimen at 1.0x whose length is not given.
LENGTH_mm = 25.0
# Of the largest load: drift of zero allowed by such cells' data sheets, and errors of zeroing by hand.
ZERO_SHARE = 0.01


def timed(data: Data) -> list[Experiment]:
    """Own experiments whose stress was recorded over time."""
    return [e for e in data.own if {"time_s", "stress_kPa"} <= set(e.columns)]


def if_timed(law: Law, data: Data) -> tuple[Law, ...]:
    """The law, if a load cell reads any of these data over time."""
    return (law,) if data.kind not in MACHINE or timed(data) else ()


def kPa_per_N(experiment: Experiment) -> float:
    """Stress by a force; a specimen whose section is not given is taken for a cube of `LENGTH_mm`."""
    section = experiment.section_mm or (LENGTH_mm * experiment.scale,) * 2
    return 1e3 / math.prod(section)


def largest_N(data: Data) -> float:
    """The largest force in N that a load cell read over time; 0 without any."""
    if data.kind not in MACHINE:
        return data.largest("force_N")
    found = (largest_reading("stress_kPa", [e]) / kPa_per_N(e) for e in timed(data))
    return max(found, default=0.0)
