"""Names of the core in panels."""

from __future__ import annotations


def readable(name: str) -> str:
    """The name of an effect or quantity with spaces: "mullins_softening" becomes "mullins softening"."""
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """A text with its first letter as a capital, the others as they are."""
    return text[:1].upper() + text[1:]


def path_symbol(name: str) -> str:
    """The name of a sensor path with its Greek letter: "alpha4" becomes "α4"."""
    return name.replace("alpha", "α")
