from __future__ import annotations

import pytest

from mu_addon.design.parameters import Unit, load_preset
from mu_addon.meshing import Mesh, MeshSettings, mesh_unit


@pytest.fixture(scope="session")
def unit() -> Unit:
    return load_preset("mu-1.0x")


@pytest.fixture(scope="session")
def half(unit: Unit) -> Mesh:
    return mesh_unit(unit, MeshSettings())


@pytest.fixture(scope="session")
def coarse(unit: Unit) -> Mesh:
    return mesh_unit(unit, MeshSettings(refine=0.5, order=1))
