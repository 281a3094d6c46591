"""A printed body moved to another wall: its tangent is that of a model made anew."""

import numpy as np
import pytest

from mu_addon.body.morph import PrintedMorph
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError
from mu_addon.fem.model import Model
from mu_addon.fem.moved_nodes import relocated
from mu_addon.fem.state import rest
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings

UNIT = Unit().evolve(count=3)
SETTINGS = MeshSettings(refine=0.35)


def test_the_tangent_of_a_moved_wall_is_that_of_a_new_model():
    mesh = mesh_printed(UNIT, SETTINGS)
    thicker = UNIT.evolve(wall_mm=1.1)
    moved = PrintedMorph(mesh, UNIT, SETTINGS).to(thicker)
    assert (moved.tied_weights != mesh.tied_weights).any()
    near, anew = relocated(Model(mesh), moved), Model(moved)
    materials, u = materials_of(thicker, moved), rest(moved).u
    found, wanted = (m.matrix(m.tangent(u, 0.01, m.parameters(materials))) for m in (near, anew))
    assert abs(found - wanted).max() < 1e-9 * abs(wanted).max()
    # A node that follows one it did not follow before has no place in the pattern.
    weights = moved.tied_weights.copy()
    row, column = np.argwhere(mesh.tied_weights == 0.0)[0]
    weights[row, column] = 0.1
    object.__setattr__(moved, "tied_weights", weights)
    with pytest.raises(InputError, match="other ties"):
        relocated(Model(mesh), moved).tangent(u, 0.0, near.parameters(materials))
