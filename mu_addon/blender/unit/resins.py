"""The resin of a unit, by its name: the parameters that it sets, and whether they still are those."""

import json
from typing import Any

import attrs
import numpy as np

from ...design.assets import asset_names
from ...design.parameters import SECTIONS, Unit
from ..shared import updates
from ..shared.blender_property import Choice
from ..shared.operators import operator
from . import object as unit_object
from .base_classes import UnitOperator

OF_WALL = ("membrane_modulus_kPa", "membrane_poisson", "elongation_at_break")
NONE = "Choose a Resin"
"""In place of a name while a unit has the default constants or, with others, none by name."""


def parameters(resin: Any) -> dict[str, dict[str, Any]]:
    """Parameters of a unit that a resin of the core sets, by section and name."""
    unit = resin.in_unit(Unit())
    material = {name: getattr(unit.material, name) for name in OF_WALL}
    return {"material": material, "wall": attrs.asdict(unit.wall)}


def take(root: Any, name: str, given: dict[str, dict[str, Any]]) -> None:
    """Give a unit a resin's parameters, and remember its name with them."""
    with updates.paused():
        for section in SECTIONS:
            group = getattr(root.mu_unit, section.section)
            for key, value in given.get(section.section, {}).items():
                setattr(group, key, value)
        root.mu_unit.resin = json.dumps({"name": name, "values": given})


def name_of(root: Any) -> str:
    """Name of the unit's resin, with a note if its constants were changed; without one, what to do."""
    kept = json.loads(root.mu_unit.resin or "{}")
    for section, values in kept.get("values", {}).items():
        group = getattr(root.mu_unit, section)
        for key, value in values.items():
            now = getattr(group, key)
            if now != value and not (isinstance(value, float) and np.isclose(now, value, rtol=1e-6)):
                return f"{kept['name']}, changed"
    return str(kept.get("name", NONE))


@operator(
    UnitOperator,
    "Resin",
    name=Choice(
        "Resin",
        "Resin of the unit's wall; its file says where each constant is from",
        items=[(name, name.replace("-", " ").title(), "") for name in asset_names("materials")],
    ),
)
def resin(root, name):
    """Give the unit the constants of this resin: its wall's modulus, law and break strain"""
    # Imported late, with the solver's packages.
    from ...materials import load_material

    resin = load_material(name)
    take(root, resin.name, parameters(resin))
    unit_object.rebuild(root)
