"""Who may have an effect alone: experiments by their specimen, session or name."""

from __future__ import annotations

from collections.abc import Sequence

from ..measured import Experiment


def by_specimen(experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Names of experiments by "specimen B"."""
    found: dict[str, list[str]] = {}
    for e in experiments:
        if e.specimen:
            found.setdefault(f"specimen {e.specimen}", []).append(e.name)
    return found


def by_session(experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Names of experiments by "session 2"."""
    found: dict[str, list[str]] = {}
    for e in experiments:
        if e.session:
            found.setdefault(f"session {e.session}", []).append(e.name)
    return found
