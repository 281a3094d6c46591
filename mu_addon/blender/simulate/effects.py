"""Effects named by a diagnosis that are no parameters, kept with the unit for its next simulation.

They are stored as a model.toml of these effects alone, with the interval of each parameter. It is a text on
the unit's root, so that undo, copies and the .blend file need no handling. It is read without the simulator's
packages, which a Blender may lack.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import InputError
from ...reading import parse_toml
from ..shared.blender_property import exact
from ..shared.wording import readable

if TYPE_CHECKING:
    from ...simulate_and_place.named_effects import NamedEffects

WEIGHT = "gravity"
"""The effect that depends on the direction of gravity."""


def keep(root: Any, text: str) -> None:
    """Give the unit's next simulation the effects of a model.toml's text, replacing earlier ones."""
    root.mu_unit.study.effects = text


def _tables(root: Any) -> dict[str, dict[str, dict[str, Any]]]:
    try:
        found: dict[str, Any] = parse_toml(root.mu_unit.study.effects, "").get("effect", {})
    except InputError:
        return {}
    return found


def has_gravity(root: Any) -> bool:
    """Return True if the direction of gravity matters to the unit's simulation."""
    return WEIGHT in _tables(root)


def lines(root: Any) -> list[str]:
    """A line for each parameter: its effect, its value and its 95 % bounds."""
    found = []
    for effect, parameters in _tables(root).items():
        for name, table in parameters.items():
            unit = str(table.get("unit", ""))
            known = ""
            if "low95" in table and "high95" in table:
                known = f" ({table['low95']:.4g} to {table['high95']:.4g})"
            # A parameter's name ends with its unit.
            bare = name.removesuffix("_" + unit.replace("/", "_")) if unit else name
            label = readable(f"{effect}, {bare}")
            found.append(f"{label}: {table['value']:.4g}{' ' * bool(unit)}{unit}{known}")
    return found


def inputs(root: Any) -> dict[str, Any]:
    """Entries of study.toml for a study of the unit: effects and orientation_deg, or none."""
    effects = {
        name: {p: float(table["value"]) for p, table in parameters.items()}
        for name, parameters in _tables(root).items()
    }
    turn = exact(root.mu_unit.study.orientation_deg) % 360.0
    turned = {"orientation_deg": turn} if WEIGHT in effects else {}
    return {**turned, "effects": effects} if effects else {}


def named_effects(root: Any) -> NamedEffects:
    """The effects as inputs of the simulation; raises InputError."""
    from ...simulate_and_place.named_effects import NamedEffects

    found = inputs(root)
    return NamedEffects(found.get("effects", {}), found.get("orientation_deg", 0.0), "effects of the unit")
