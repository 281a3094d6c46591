"""A hollow square finger in the place of a printed unit: it bends, and is solved in a twentieth of a second.

What evidence makes of a unit's simulations does not depend on the body that is simulated.
"""

from contextlib import contextmanager

import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.evidence import unit_body
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, boundary_faces, mirror
from tests.fem.bodies import _grid, make

UNIT = load_preset("mu-1.0x").evolve(membrane_modulus_kPa=400.0)


def finger(unit, settings=None, *_, half_width=0.6, **__):
    """Half mesh as long as the unit, by default of 15 x 15 mm at scale 1; at +y half of it is wall.

    half_width: in cells.
    """
    d = unit.printed
    refine = 0.35 if settings is None else settings.refine
    half, wall, cap = half_width * d.cell, 2.0 * d.wall, 0.3 * d.cell
    thick, across = 0.9 * half, max(2, round(4 * refine))
    xs = [*np.linspace(0.0, half - wall, across + 1), half]
    ys = [-half, *np.linspace(wall - half, half - thick, across + 1), half]
    zs = [0.0, *np.linspace(cap, d.height - cap, max(4, round(14 * refine)) + 1), d.height]
    cells = [len(a) - 1 for a in (xs, ys, zs)]
    at, tets = _grid(cells, cells)
    middle = at[tets].mean(axis=1)
    inside = (middle[:, 0] < across) & (middle[:, 1] > 1) & (middle[:, 1] < 1 + across)
    tets = tets[~(inside & (middle[:, 2] > 1) & (middle[:, 2] < cells[2] - 1))]
    used, tets = np.unique(tets, return_inverse=True)
    tets = tets.reshape(-1, 4)
    at = at[used].round().astype(int)
    nodes = np.column_stack([np.array(a)[at[:, i]] for i, a in enumerate((xs, ys, zs))])
    faces, _ = boundary_faces(tets)
    within = (at[faces] > [-1, 0, 0]) & (at[faces] < cells)
    flat = (at[faces][:, :, 0] == 0).all(axis=1)
    cavity = faces[within.all(axis=(1, 2)) & ~flat]
    mesh = make(nodes, tets, 2, cavity, (lambda p: p[2] == 0.0,), symmetry=("x",))
    region = np.where(mesh.nodes[mesh.corners].mean(axis=1)[:, 1] > half - thick, LATTICE, MEMBRANE)
    tip = np.flatnonzero(mesh.nodes[:, 2] == d.height)
    mesh = type(mesh)(mesh.nodes, mesh.tets, region, mesh.cavity, mesh.base, tip, mesh.symmetry)
    return mirror(mesh, "x") if settings is not None and settings.fraction == "full" else mesh


STIFF = UNIT.evolve(membrane_modulus_kPa=1e5)
"""Unit of a beam."""


def beam(unit, settings=None, *_, **__):
    """Half mesh of a solid beam, eight times as thick as the unit's wall, pressed on its face at -y.

    It bends far, to either side alike.
    """
    d = unit.printed
    counts = (1, 2, 10 if settings is None else round(28 * settings.refine))
    nodes, tets = _grid(counts, (0.6 * d.cell, 8.0 * d.wall, d.height))
    nodes -= [0.0, 4.0 * d.wall, 0.0]
    faces, _ = boundary_faces(tets)
    pressed = faces[(nodes[faces][:, :, 1] == nodes[:, 1].min()).all(axis=1)]
    mesh = make(nodes, tets, 2, pressed, (lambda p: p[2] == 0.0,), symmetry=("x",))
    tip = np.flatnonzero(mesh.nodes[:, 2] == mesh.nodes[:, 2].max())
    return type(mesh)(mesh.nodes, mesh.tets, mesh.region, mesh.cavity, mesh.base, tip, mesh.symmetry)


@contextmanager
def in_place_of_units(made=finger):
    """Let evidence simulate such bodies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mu_addon.body.printed_mesh.mesh_printed", made)
        patch.setattr("mu_addon.evidence.unit_plan.mesh_printed", made)
        unit_body._mesh_kept.cache_clear()
        yield
    unit_body._mesh_kept.cache_clear()
