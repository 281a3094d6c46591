"""Remedy for each cause, for those at the bench and at the printer."""

from __future__ import annotations

from ...evidence.effects import DECLARED


def in_the_simulation(effect: str) -> bool:
    """Return True if a cause is physics that a simulation should have, not an instrument's fault."""
    return not DECLARED[effect].instrument


def what_to_do(effects: tuple[str, ...], sure: bool = True) -> str:
    """Remedies for these causes, a sentence each; empty without any.

    sure: nothing inside the simulation would do as well; only then is it said to be right.
    """
    right = "; the simulation is not at fault"
    sentences = (DECLARED[n].remedy + right * (sure and DECLARED[n].instrument) for n in effects)
    return " ".join(f"{text[:1].upper()}{text[1:]}." for text in dict.fromkeys(sentences))
