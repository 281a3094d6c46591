"""The adjoint map of a printed unit, whose parts are tied, against solutions with some of it stiffened."""

import attrs
import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design import load_preset
from mu_addon.design.anchors import anchor_points
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import BODY_NEWTON
from mu_addon.fem.trajectory import simulate, whole_body
from mu_addon.meshing.mesh import LATTICE, mirror
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.sensitivity_map import influence_map, loaded, parities

UNIT = load_preset("mu-1.0x")
UNIT = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))
POINTS = anchor_points(UNIT)
TIGHT = attrs.evolve(BODY_NEWTON, tolerance=1e-12)


def materials(factor):
    return Materials.neo_hooke(2.5 * factor, np.full(len(factor), 0.45))


def solve(model, factor):
    solver = Equilibrium(model, materials(factor), TIGHT)
    return simulate(solver, np.arange(2.0), np.array([0.0, 3.0]))


def moved(mesh, trajectory):
    return probe(mesh, POINTS).displacement(loaded(trajectory)[0].u)


@pytest.fixture(scope="module")
def half():
    mesh = mesh_printed(UNIT, MeshSettings(refine=0.6))
    return mesh, Model(mesh)


@pytest.fixture(scope="module")
def found(half):
    mesh, model = half
    still = np.ones(len(mesh.tets))
    baseline = solve(model, still)
    return influence_map(model, materials(still), baseline, probe(mesh, POINTS)).displacement[0]


def part(mesh, name):
    """Elements of a strut that dips into the wall, of one beside the anchors, or of a patch of the wall."""
    centre = mesh.nodes[mesh.corners].mean(axis=1)
    cell, lattice = UNIT.printed.cell, mesh.region == LATTICE
    octant = np.floor(centre / (cell / 2.0)).astype(int)
    if name == "wall":
        return ~lattice & (np.linalg.norm(centre - [9.0, 9.0, 6.25], axis=1) < 3.0)
    return lattice & (octant == {"at the wall": [0, 2, 1], "beside": [0, 4, 1]}[name]).all(axis=1)


NIGHTLY = pytest.mark.nightly("test_a_part_made_stiffer_moves_the_points_as_the_map_says")


@pytest.mark.parametrize(
    "name",
    [
        "at the wall",
        pytest.param("wall", marks=NIGHTLY),
        pytest.param("beside", marks=NIGHTLY),
    ],
)
def test_a_part_made_stiffer_moves_the_points_as_the_map_says(half, found, name):
    """Central differences at 3 kPa of a symmetric unit: what is stiffened, and its image."""
    mesh, model = half
    stiffened = part(mesh, name)
    assert stiffened.any()
    ends = []
    for sign in (1, -1):
        factor = np.ones(len(mesh.tets))
        factor[stiffened] += 0.01 * sign
        ends.append(moved(mesh, solve(model, factor)))
    slope = (ends[0] - ends[1]) / 0.02
    expected = 2.0 * found[:, :, stiffened].sum(axis=2)
    expected[:, 0] = 0.0
    np.testing.assert_allclose(slope, expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.nightly("tests/placement/test_sensitivity_map.py::test_a_whole_mesh_gives_the_map_of_its_half")
def test_a_whole_unit_gives_the_map_of_its_half(half, found):
    mesh, model = half
    whole = mirror(mesh, "x")
    body, still = Model(whole), np.ones(len(whole.tets))
    baseline = solve(model, np.ones(len(mesh.tets)))
    both = whole_body(mesh, baseline)[1]
    same = influence_map(body, materials(still), both, probe(whole, POINTS), sides=parities(body))
    scale = np.abs(found).max()
    np.testing.assert_allclose(same.displacement[0][..., : len(mesh.tets)], found, atol=1e-6 * scale)
