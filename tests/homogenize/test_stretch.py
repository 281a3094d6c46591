"""The periodic cell at finite strain: its own law, its energy, its neighbours, and where it must stop."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from mu_addon.design.lattice_kinds import kind
from mu_addon.design.strut_cell import Facets, StrutCell
from mu_addon.errors import InputError
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.homogenize.specimen import repeated
from mu_addon.homogenize.stretch import Stretching, stretch_lattice
from mu_addon.meshing.tiling import tiled
from tests.fem import bodies
from tests.homogenize.tiled_motion import tiled_displacement

from . import cells

STRAINS = (-0.4, -0.2, -0.01, 0.01, 0.2, 0.4)


def nominal(along, across, mu, kappa):
    """Nominal stresses along and across in MPa of W = mu/2 (J^-2/3 I1 - 3) + kappa/2 (J - 1)^2."""
    J, I1 = along * across**2, along**2 + 2 * across**2
    return tuple(mu * J ** (-2 / 3) * (x - I1 / (3 * x)) + kappa * (J - 1) * J / x for x in (along, across))


@pytest.fixture(scope="module")
def lattice():
    """A coarse octant of the paper's cell, with its materials and box."""
    cell = StrutCell(kind("body-centred"), 12.5, 0.75, 1.0)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=1.0, facets=Facets(12, 6), tolerance=0.05))
    return mesh, cell_materials(cell, mesh, 2.5, 0.45), (6.25,) * 3


def test_a_homogeneous_cell_returns_its_own_law():
    size = (1.0, 2.0, 1.5)
    mesh = bodies.box((2, 2, 2), size, 2, jiggle=0.2)
    K, G = cells.bulk_and_shear(2.5, 0.45)
    found = stretch_lattice(mesh, bodies.uniform(mesh, 2.5, 0.45), STRAINS)
    assert found.stopped == ""
    assert found.curve.strain == pytest.approx(sorted((*STRAINS, 0.0)), abs=1e-15)
    for along, stress, lateral in zip(
        found.curve.stretch, found.curve.stress_MPa, found.curve.lateral, strict=True
    ):
        across = brentq(lambda b, a=along: nominal(a, b, G, K)[1], 0.3, 3, xtol=1e-15)
        assert lateral == pytest.approx([across, across], abs=1e-8)
        assert stress == pytest.approx(nominal(along, across, G, K)[0], abs=1e-8 * K)


def test_it_starts_as_the_tensor_says_and_the_search_ends_quadratically(lattice):
    mesh, materials, _ = lattice
    small = effective_tensor(mesh, materials)
    compliance = np.linalg.inv(small.C)
    found = stretch_lattice(mesh, materials, (-1e-4, 1e-4))
    slope = np.diff(found.curve.stress_MPa[[0, 2]])[0] / 2e-4
    assert slope == pytest.approx(1 / compliance[2, 2], rel=1e-6)
    ratio = -np.diff(found.curve.lateral[[0, 2]], axis=0)[0] / 2e-4
    assert ratio == pytest.approx(-compliance[2, :2] / compliance[2, 2], rel=1e-6)

    far = Stretching(mesh, materials)
    levels = np.array(far.equilibrium(-0.1, *far.predicted([far.rest], -0.1)).residuals)
    # Each of the last steps squares what the one before left, up to a constant.
    last = levels[levels > 1e-11][-3:]
    assert (last[1:] < 30 * last[:-1] ** 2).all()


def test_stress_is_the_slope_of_the_energy(lattice):
    mesh, materials, _ = lattice
    body = Stretching(mesh, materials)
    model, volume = body.octant.model, body.octant.volume
    strains = (-0.301, -0.3, -0.299)
    (*_, middle) = body.reach(-0.3, body.reach(-0.15, [body.rest]))
    ends = [body.equilibrium(s, *body.predicted([middle], s)) for s in (strains[0], strains[2])]
    low, high = (model.potential(p.u, 0.0, body.octant.parameters) / volume for p in ends)
    stress = middle.stress_MPa
    assert stress[2] == pytest.approx((high - low) / 2e-3, rel=1e-5)
    assert stress[:2] == pytest.approx([0, 0], abs=1e-8 * abs(stress[2]))


def test_its_images_are_in_equilibrium_as_a_periodic_body(lattice):
    mesh, materials, box = lattice
    box = np.array(box)
    point = stretch_lattice(mesh, materials, (-0.2,)).points[0]
    whole = tiled(mesh, (2, 2, 2), box)
    whole = attrs.evolve(whole, base=whole.base[:0])
    u = tiled_displacement(mesh, point.u, (2, 2, 2), box, box * point.stretch)
    model = Model(whole)
    force = model.residual(u, 0.0, model.parameters(repeated(materials, len(mesh.tets), 8)))
    tied = np.zeros_like(force)
    np.add.at(tied, cells.ties(whole.nodes, 2 * box), force)
    assert np.abs(force).max() > 1e-3 * np.abs(point.stress_MPa).max() * box[0] ** 2
    assert np.linalg.norm(tied) < 1e-8 * model.force_scale()


def test_walls_that_meet_end_the_curve():
    # A stiff plate on a soft foot, whose edge hangs down to a twentieth above its mirror image.
    def keep(c):
        foot = (c[:, :2] < 0.25).all(axis=1)
        edge = (c[:, 0] > 0.75) & (c[:, 2] > 0.05)
        return foot | edge | (c[:, 2] > 0.4)

    mesh = cells.carved((4, 4, 20), (1.0, 1.0, 1.0), keep, 1)
    soft = mesh.nodes[mesh.corners].mean(axis=1)[:, 2] < 0.35
    foot = soft & (mesh.nodes[mesh.corners].mean(axis=1)[:, 0] < 0.5)
    materials = Materials.neo_hooke(np.where(foot, 1.0, 1e4), np.full(len(mesh.tets), 0.3))
    strains = (-0.01, -0.02, -0.03, -0.04, -0.06, -0.08, 0.02)
    found = stretch_lattice(mesh, materials, strains)
    assert "walls touch at a strain of -0.050" in found.stopped
    assert "across z" in found.stopped
    assert found.curve.strain[0] == pytest.approx(-0.04)
    assert found.curve.strain[-1] == pytest.approx(0.02)


def test_a_strut_that_buckles_ends_the_curve():
    # A slender strut between stiff plates: from its mirror image to the plate it is free to lean.
    def keep(c):
        return (np.abs(c[:, :2] - 0.5) < 0.1).all(axis=1) | (c[:, 2] > 0.8)

    mesh = cells.carved((5, 5, 10), (1.0, 1.0, 1.0), keep)
    plate = mesh.nodes[mesh.corners].mean(axis=1)[:, 2] > 0.8
    materials = Materials.neo_hooke(np.where(plate, 1e3, 1.0), np.zeros(len(mesh.tets)))
    strains = tuple(-np.arange(0.005, 0.1, 0.005))
    found = stretch_lattice(mesh, materials, strains)
    assert "no equilibrium beyond a strain of -0.0" in found.stopped
    assert "buckl" in found.stopped
    # Euler's strain of a clamped strut 1.6 long and 0.2 thick, times its share of the height.
    euler = 4 * np.pi**2 * (0.2**2 / 12) / 1.6**2 * 0.8
    assert -found.curve.strain[0] == pytest.approx(euler, rel=0.15)


def test_a_cell_that_cannot_be_crushed_further_says_so():
    mesh = bodies.box((1, 1, 2), (1.0, 1.0, 1.0), 2)
    found = stretch_lattice(mesh, bodies.uniform(mesh, 1.0, 0.3), (-0.2, -0.9999))
    assert "no equilibrium beyond a strain of -0." in found.stopped
    assert found.curve.strain == pytest.approx([-0.2, 0])


def test_what_cannot_be_asked_is_refused(lattice):
    with pytest.raises(InputError, match="above -1"):
        stretch_lattice(*lattice[:2], (-1.0,))
