"""The effective tensor against closed forms, true periodic conditions, beams and bounds."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.lattice_kinds import kind
from mu_addon.design.strut_cell import Facets, StrutCell
from mu_addon.errors import InputError, MeshingError
from mu_addon.fem.materials import Materials
from mu_addon.homogenize.bounds import hashin_shtrikman
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.elasticity import Elasticity, effective_tensor, young_modulus
from tests.fem import bodies
from tests.fem.cubic import Cubic

from . import cells


def random_materials(count):
    random = np.random.default_rng(7)
    return Materials.neo_hooke(10 ** random.uniform(-1, 1, count), random.uniform(0.1, 0.45, count))


def test_the_shear_modulus_of_a_cubic_cell_is_hills_mean():
    """Of C11 = 3, C12 = 1, C44 = 2: Voigt's (2 + 3 * 2)/5 and Reuss's 5/(2/1 + 3/2)."""
    C = np.diag([2.0, 2.0, 2.0, 2.0, 2.0, 2.0])
    C[:3, :3] += 1.0
    assert Elasticity(C).shear == pytest.approx((8 / 5 + 10 / 7) / 2)


@pytest.mark.parametrize("order", [1, 2])
def test_a_homogeneous_cell_returns_its_own_law(order):
    size = (1.3, 0.7, 2.1)
    mesh = bodies.box((2, 2, 2), size, order, jiggle=0.2)
    found = effective_tensor(mesh, bodies.uniform(mesh, 2.5, 0.45))
    exact = cells.isotropic(*cells.bulk_and_shear(2.5, 0.45))
    assert np.allclose(found.C, exact, rtol=1e-8, atol=1e-10)
    assert found.relative_density == pytest.approx(1, rel=1e-12)
    assert np.allclose([found.E100, found.E110, found.E111], 2.5, rtol=1e-8)
    assert found.nu100 == pytest.approx(0.45, rel=1e-8)
    assert found.zener == pytest.approx(1, rel=1e-8)
    assert found.shear == pytest.approx(2.5 / 2.9, rel=1e-8)
    assert found.cubic_error < 1e-8


def test_an_anisotropic_cell_returns_its_own_law():
    mesh = bodies.box((2, 1, 2), (1.0, 1.0, 1.0), 2, jiggle=0.2)
    parameters = Cubic.parameters(0.3, 0.4, 0.5)
    found = effective_tensor(mesh, bodies.everywhere(mesh, Cubic, *np.ravel(parameters)))
    assert found.zener > 3
    assert np.allclose([found.C11, found.C12, found.C44], parameters[0, :3], rtol=1e-8)
    assert np.allclose([found.E100, found.nu100], [0.3, 0.4], rtol=1e-8)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_laminate_has_backus_tensor(axis):
    # Source: Backus, J. Geophys. Res. 67 (1962) 4427.
    counts = [2, 2, 2]
    counts[axis] = 4
    mesh = bodies.box(counts, (1.0, 1.0, 1.0), 2)
    soft = mesh.nodes[mesh.corners].mean(axis=1)[:, axis] < 0.75
    young, poisson = np.where(soft, 1.0, 40.0), np.where(soft, 0.45, 0.2)
    found = effective_tensor(mesh, Materials.neo_hooke(young, poisson)).C

    share = np.array([0.75, 0.25])
    K, G = cells.bulk_and_shear(np.array([1.0, 40.0]), np.array([0.45, 0.2]))
    c11, c12 = K + 4 / 3 * G, K - 2 / 3 * G
    normal = 1 / (share @ (1 / c11))
    coupled = share @ (c12 / c11)
    expected = np.zeros((6, 6))
    a, b = (k for k in range(3) if k != axis)
    expected[axis, axis] = normal
    for k in (a, b):
        expected[axis, k] = expected[k, axis] = coupled * normal
        expected[k, k] = share @ (c11 - c12**2 / c11) + coupled**2 * normal
        expected[3 + k, 3 + k] = 1 / (share @ (1 / G))
    expected[a, b] = expected[b, a] = share @ (c12 - c12**2 / c11) + coupled**2 * normal
    expected[3 + axis, 3 + axis] = share @ G
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("struts", [False, True])
def test_an_octant_carries_the_whole_periodic_problem(struts):
    box = (1.0, 0.8, 1.2)
    if struts:
        # Struts along the axes, of linear elements.
        mesh = cells.carved((3, 3, 3), box, lambda c: (c < np.array(box) / 3).sum(axis=1) >= 2, 1)
    else:
        mesh = bodies.box((3, 2, 2), box, 2, jiggle=0.2)
    materials = random_materials(len(mesh.tets))
    expected, _ = cells.periodic_tensor(mesh, materials, box)
    found = effective_tensor(mesh, materials)
    scale = np.abs(expected).max()
    assert np.allclose(found.C, expected, rtol=0, atol=1e-11 * scale)
    assert found.relative_density < 0.3 if struts else found.relative_density == pytest.approx(1)


def voids(radius, young, poisson, around):
    """Effective tensor of a cubic array of voids, its share of voids, and its upper bound."""
    K, G = cells.bulk_and_shear(young, poisson)
    mesh = cells.cube_with_void(radius, around=around, through=around + 1)
    found = effective_tensor(mesh, bodies.uniform(mesh, young, poisson))
    void = 1 - found.relative_density
    assert void == pytest.approx(np.pi / 6 * radius**3, rel=2e-4)
    _, most = hashin_shtrikman([1 - void, void], [K, 0], [G, 0])
    return found, void, most


@pytest.mark.parametrize("radius", [0.25, 0.6])
def test_a_cubic_array_of_voids_comes_near_its_bound(radius):
    coarse, _, most = voids(radius, 2.0, 0.3, 3)
    fine, _, _ = voids(radius, 2.0, 0.3, 4)
    # What elements are too stiff by vanishes with their size; exactly, it lies below the bound.
    excess = [max(0.0, e.bulk / most.bulk - 1) for e in (coarse, fine)]
    assert excess[1] < 0.5 * excess[0]
    assert fine.bulk == pytest.approx(most.bulk, rel=5e-4)
    assert fine.shear_voigt < most.shear * (1 + 2e-4)
    assert fine.cubic_error < 1e-3


def test_a_few_voids_take_away_what_eshelby_says():
    young, poisson = 2.0, 0.3
    K, G = cells.bulk_and_shear(young, poisson)
    found, void, _ = voids(0.2, young, poisson, 5)
    # Source: Eshelby, Proc. R. Soc. A 241 (1957) 376.
    assert (1 - found.bulk / K) / void == pytest.approx(1 + 3 * K / (4 * G), rel=0.015)
    assert (1 - found.shear_voigt / G) / void == pytest.approx(15 * 0.7 / (7 - 5 * 0.3), rel=0.015)


def slender(kind_, radii, size, cache, per_diameter=1.0):
    """Tensors of a lattice of constant struts with E = 1, nu = 0.3, at several radii."""
    found = []
    for r in radii:
        cell = StrutCell(kind_, size, r, r)
        mesh = mesh_cell(cell, CellMeshSettings(per_diameter=per_diameter, facets=Facets(12, 12)), cache)
        found.append((cell, effective_tensor(mesh, cell_materials(cell, mesh, 1.0, 0.3))))
    return found


@pytest.mark.slow
def test_a_body_centred_lattice_bends_or_stretches_with_direction(tmp_path):
    radii = np.array([0.8, 0.4, 0.2])
    runs = slender(kind("body-centred-straight"), radii, 10.0, tmp_path)
    density = np.array([e.relative_density for _, e in runs])
    E100, E111 = (np.array([getattr(e, name) for _, e in runs]) for name in ("E100", "E111"))
    beams = [Elasticity(cells.body_centred_by_beams(c, 1.0, 0.3)) for c, _ in runs]
    bending, stretching = (np.diff(np.log(E)) / np.diff(np.log(density)) for E in (E100, E111))
    # Struts merge at joints, which shortens them by about their radius: exponents are off by as much.
    assert (np.diff(bending) < 0).all()
    assert (np.diff(stretching) < 0).all()
    assert 2 * bending[1] - bending[0] == pytest.approx(2, abs=0.05)
    assert 2 * stretching[1] - stretching[0] == pytest.approx(1, abs=0.03)
    # Of struts that bend the stiffness goes with length to the power -3, of those that stretch with -1.
    for name, power, bound in (("E100", 3, 0.04), ("C11", 1, 0.03), ("C44", 1, 0.02), ("E111", 1, 0.02)):
        ratio = np.array([getattr(e, name) / getattr(b, name) for (_, e), b in zip(runs, beams, strict=True)])
        length = ratio ** (-1 / power)
        assert (length < 1).all()
        assert (np.diff(length) > 0).all()
        assert 2 * length[2] - length[1] == pytest.approx(1, abs=bound)
    # And the textbook's formula of struts that only bend.
    cell = runs[-1][0]
    length = np.sqrt(3) / 2 * cell.size_mm
    simple = 36 * np.pi / 4 * cell.midspan_radius_mm**4 / (cell.size_mm * length**3)
    assert np.isclose(beams[-1].E100, simple, rtol=0.01)


@pytest.mark.nightly("test_a_body_centred_lattice_bends_or_stretches_with_direction")
def test_a_simple_cubic_lattice_stretches(tmp_path):
    runs = slender(cells.SIMPLE_CUBIC, [0.6, 0.3], 10.0, tmp_path)
    density = np.array([e.relative_density for _, e in runs])
    E = np.array([e.E100 for _, e in runs])
    exponent = np.diff(np.log(E)) / np.diff(np.log(density))
    area = np.pi * np.array([0.6, 0.3]) ** 2 / 100
    assert exponent[0] == pytest.approx(1, abs=0.06)
    assert (E / area)[0] > (E / area)[1] > 1
    assert (E / area)[1] == pytest.approx(1, abs=0.05)


@pytest.mark.slow
@settings(max_examples=2)
@given(st.floats(0.1, 0.3), st.floats(0.7, 1.4), st.floats(0.1, 0.47))
def test_a_lattice_stays_below_its_bounds(midspan, ratio, poisson):
    cell = StrutCell(kind("body-centred"), 1.0, midspan * ratio / 2, midspan / 2)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=1.0, facets=Facets(12, 4), tolerance=0.05))
    found = effective_tensor(mesh, cell_materials(cell, mesh, 1.0, poisson))
    K, G = cells.bulk_and_shear(1.0, poisson)
    share = found.relative_density
    _, most = hashin_shtrikman([share, 1 - share], [K, 0], [G, 0])
    assert 0 < found.bulk < most.bulk
    assert 0 < found.shear_voigt < most.shear
    assert np.linalg.eigvalsh(found.C).min() > 0


def test_youngs_modulus_by_direction():
    cubic = Elasticity(np.diag([3.0, 3, 3, 2, 2, 2]) + np.pad(np.ones((3, 3)), (0, 3)))
    assert young_modulus(cubic.C, [[1, 0, 0], [0, 0, 5]]) == pytest.approx(cubic.E100)
    assert young_modulus(cubic.C, [[1, 1, 0]])[0] == pytest.approx(cubic.E110)
    assert young_modulus(cubic.C, [[2, -2, 2]])[0] == pytest.approx(cubic.E111)
    # The textbook's compliances: S11 = 5/18, S12 = -1/18, S44 = 1/2.
    surplus = 5 / 18 + 1 / 18 - 1 / 4
    expected = [5 / 18, 5 / 18 - surplus / 2, 5 / 18 - surplus * 2 / 3]
    assert np.allclose([1 / cubic.E100, 1 / cubic.E110, 1 / cubic.E111], expected)
    orthotropic = np.diag([1.0, 2, 4, 1, 1, 1])
    assert young_modulus(orthotropic, np.eye(3)) == pytest.approx([1, 2, 4])


def test_what_no_mesh_can_give_is_an_error(monkeypatch):
    mesh = bodies.box((1, 1, 1), (1.0, 1.0, 1.0), 2)
    for shift, error, words in (
        (-0.5, InputError, "extends beyond its cell"),
        (0.5, MeshingError, "does not reach both of its sides across z"),
    ):
        beside = attrs.evolve(mesh, nodes=mesh.nodes + np.array([0.0, 0.0, shift]))
        with pytest.raises(error, match=words):
            effective_tensor(beside, bodies.uniform(beside, 1.0, 0.3))
    split = cells.carved((1, 1, 4), (1.0, 1.0, 1.0), lambda c: np.abs(c[:, 2] - 0.5) > 0.25)
    with pytest.raises(MeshingError, match="not positive definite"):
        effective_tensor(split, bodies.uniform(split, 1.0, 0.3))
    loose = cells.carved((5, 5, 5), (1.0,) * 3, lambda c: np.abs(np.abs(c - 0.5).max(axis=1) - 0.2) > 0.1)
    with pytest.raises(MeshingError, match="is not connected"):
        effective_tensor(loose, bodies.uniform(loose, 1.0, 0.3))
    half = bodies.box((1, 1, 1), (1.0, 1.0, 1.0), 2, symmetry=("x",))
    with pytest.raises(InputError, match="mirror planes"):
        effective_tensor(half, bodies.uniform(half, 1.0, 0.3))
    # A box too small for its mesh makes any lattice too stiff.
    from mu_addon.homogenize import octant

    honest = octant.Octant.__init__

    def mistaken(self, *arguments, **names):
        honest(self, *arguments, **names)
        self.volume *= 0.8

    monkeypatch.setattr(octant.Octant, "__init__", mistaken)
    with pytest.raises(MeshingError, match="above Hashin and Shtrikman's"):
        effective_tensor(mesh, bodies.uniform(mesh, 1.0, 0.3))
