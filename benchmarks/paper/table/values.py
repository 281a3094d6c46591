"""The units of the table: values that the paper does not print, and each column's scale and modulus."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from mu_addon.design.parameters import Unit
from mu_addon.fem.protocol import Protocol
from mu_addon.usecases.parameter_study.variable import Inputs, changed_inputs

from ..inclusion_rules import VOLUME_FRACTION

# The rule that keeps the sensor's volume: what the other gives is its mesh's.
RULE = VOLUME_FRACTION
_REST = Protocol(np.array([0.0, 1.0]), np.array([0.0, 1.0]))


def with_values(unit: Unit, values: Mapping[str, Any]) -> Unit:
    """The unit with some values of other than its own, named as in unit.toml. Raises InputError."""
    return changed_inputs(Inputs(unit, _REST, {}), values, Path()).unit


def unit_of_table_column(unit: Unit, scale: float, lattice_modulus_kPa: float) -> Unit:
    """A unit at a column's scale, with the modulus that the paper measured there."""
    material = attrs.evolve(unit.material, lattice_modulus_kPa=lattice_modulus_kPa)
    return attrs.evolve(unit, name=f"mu-{scale:g}x", scale=scale, material=material)
