"""Remaining part of a run's plan, in a folder where the same inputs ran before."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError
from ..reading import file_bytes, parse_json
from .progress_estimate import Plan

LOADED, LOADED_S = 0.2, 1.5
"""Largest share of a stage's seconds, and largest seconds, in which its finished work is loaded."""


def shares_done(folder: Path) -> dict[str, float]:
    """Largest share done of each stage, 0..1, that log.ndjson of a folder holds; empty without one.

    Of these inputs alone: with others the log is set aside.
    """
    done: dict[str, float] = {}
    try:
        lines = file_bytes(folder / "log.ndjson").splitlines()
    except (OSError, InputError):
        return done
    for line in lines:
        try:
            message = parse_json(line, "log.ndjson")
        except InputError:
            # Cut short by a kill.
            continue
        if isinstance(message, dict) and message.get("type") == "progress":
            share = message.get("fraction")
            stage = str(message.get("stage"))
            if isinstance(share, int | float):
                done[stage] = max(done.get(stage, 0.0), min(float(share), 1.0))
    return done


def remaining(plan: Plan, done: dict[str, float], kept: Iterable[str]) -> Plan:
    """The plan's stages, with the seconds of what is not done yet.

    kept: beginnings of the names of stages whose finished work a folder's cache holds; the others run again.
    """
    beginnings = tuple(kept)

    def left(name: str, seconds: float) -> float:
        if not name.startswith(beginnings):
            return seconds
        return max((1.0 - done.get(name, 0.0)) * seconds, min(LOADED * seconds, LOADED_S))

    return [(name, left(name, seconds)) for name, seconds in plan]
