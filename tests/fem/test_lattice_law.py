"""A lattice of several laws in parallel: one body of all of them, alone and with sensors."""

import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.lattice_law import LatticeLaw, deformation_gradients, stretches
from mu_addon.fem.laws import CubicShear, DiagonalStretch, Foam, NeoHooke
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.candidates import candidate_paths, roi, with_sensor
from mu_addon.placement.sensitivity_map import influence_map, loaded

from .cubic import Cubic

UNIT = load_preset("mu-1.0x")
FOAM = np.array([0.006, 5.0, 0.006, 4.0, 0.01, -2.0])
LAW = LatticeLaw("test", ((Foam, FOAM), (CubicShear, np.array([0.02])), (DiagonalStretch, np.array([0.02]))))


@pytest.fixture(scope="module")
def mesh():
    return mesh_unit(UNIT, MeshSettings(refine=0.4, order=1))


@pytest.fixture(scope="module")
def baseline(mesh):
    equilibrium = Equilibrium(Model(mesh), materials_of(UNIT, mesh, LAW))
    return simulate(equilibrium, np.arange(2.0), np.array([0.0, 15.0]))


def moved(mesh, size, seed=0):
    return size * np.random.default_rng(seed).standard_normal(mesh.nodes.shape)


def test_the_units_own_law_given_as_the_lattices_is_the_same_body(mesh):
    m = UNIT.material
    own = NeoHooke.parameters(m.lattice_modulus_kPa / 1e3, m.lattice_poisson)[0]
    # In halves side by side, since moduli add.
    for rows in ([own], [own / 4, own * 0.75]):
        law = LatticeLaw("own", tuple((NeoHooke, row) for row in rows))
        model, u = Model(mesh), moved(mesh, 0.02)
        a, b = (model.parameters(materials_of(UNIT, mesh, one)) for one in (None, law))
        assert model.potential(u, 0.01, a) == pytest.approx(model.potential(u, 0.01, b), rel=1e-12)
        np.testing.assert_allclose(model.residual(u, 0.01, a), model.residual(u, 0.01, b), atol=1e-12)
        np.testing.assert_allclose(model.tangent(u, 0.01, a), model.tangent(u, 0.01, b), atol=1e-11)
        for found, expected in zip(
            materials_of(UNIT, mesh, law).small_strain(len(mesh.tets)),
            materials_of(UNIT, mesh).small_strain(len(mesh.tets)),
            strict=True,
        ):
            np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_foam_and_struts_side_by_side_are_at_small_strain_a_cubic_body(mesh):
    """Tangents at rest, element by element, against one cubic law of C11, C12 and C44 added up."""
    mu, lame = FOAM[0], FOAM[4]
    C = [lame + 0.02 + 2 * mu, lame + 0.02, mu + 0.02]
    law = LatticeLaw("cubic", ((Cubic, np.array([*C, 1, 0, 0, 0, 1, 0])),))
    model = Model(mesh)
    a, b = (
        model.tangent(np.zeros_like(mesh.nodes), 0.0, model.parameters(materials_of(UNIT, mesh, one)))
        for one in (LAW, law)
    )
    np.testing.assert_allclose(a, b, atol=1e-11 * np.abs(a).max())
    expected = Cubic.small_strain(law.layers[0][1][None])[0]
    found = sum(one.small_strain(row[None])[0] for one, row in LAW.layers)
    assert found == pytest.approx(expected)


def test_a_sensor_takes_its_share_of_every_layer(mesh):
    materials = materials_of(UNIT, mesh, LAW)
    every = {c.name: c for c in candidate_paths(anchor_points(UNIT), windows(6))}
    share = roi(mesh, every["alpha2"], 1.0).share
    stiff = with_sensor(materials, share, 2.5)
    total = np.zeros(len(mesh.tets))
    by_law = {}
    for layer in stiff.layers:
        np.add.at(total, layer.elements, layer.weight)
        by_law.setdefault(layer.law, np.zeros(len(total)))[layer.elements] += layer.weight
    lattice = mesh.region == LATTICE
    for law, _ in LAW.layers:
        np.testing.assert_allclose(by_law[law][lattice], 1 - share[lattice], atol=1e-15)
    assert np.count_nonzero(share) > 5


def test_sensors_in_lockstep_find_what_each_finds_alone(mesh, baseline):
    materials = materials_of(UNIT, mesh, LAW)
    points = anchor_points(UNIT)
    every = {c.name: c for c in candidate_paths(points, windows(6))}
    shares = [roi(mesh, every[n], 1.0).touched.astype(float) for n in ("alpha2", "alpha10")]
    sweep = CandidateBatch(Model(mesh), materials, (points, probe(mesh, points)), shares, 2.5)
    together = sweep.at(baseline.solved[-1])
    for number, found in enumerate(together):
        alone = sweep.alone(number, np.array([0.015]))[0]
        np.testing.assert_allclose(found, alone, atol=1e-6)
    assert np.abs(together[0] - together[1]).max() > 1e-2


def test_the_map_is_the_derivative_by_all_layers_of_an_element(mesh, baseline):
    """The first-order map against Model A with every layer of one lattice element a little heavier."""
    points = anchor_points(UNIT)
    monitor = probe(mesh, points)
    materials = materials_of(UNIT, mesh, LAW)
    found = influence_map(Model(mesh), materials, baseline, monitor).displacement[0]
    centre = mesh.nodes[mesh.corners].mean(axis=1)
    near = np.linalg.norm(centre - [1.0, 22.0, 40.0], axis=1)
    element = int(np.argmin(np.where(mesh.region == LATTICE, near, np.inf)))
    state = loaded(baseline)[0]
    ends = []
    for step in (0.02, -0.02):
        layers = [
            layer.kept(
                np.arange(len(layer.elements)), layer.weight * (1 + step * (layer.elements == element))
            )
            for layer in materials.layers
        ]
        heavier = Equilibrium(Model(mesh), type(materials)(tuple(layers)))
        ends.append(monitor.displacement(heavier.newton(state.u, state.pressure_MPa).u))
    slope = (ends[0] - ends[1]) / 0.04
    # In a half mesh an element comes with its mirror image: twice the even part.
    even = 2 * found[:, 1:, element]
    np.testing.assert_allclose(slope[:, 1:], even, atol=2e-3 * np.abs(even).max())


def test_more_shear_stiffness_bends_the_unit_less(mesh, baseline):
    soft = LatticeLaw("soft", LAW.layers[:1])
    path = Equilibrium(Model(mesh), materials_of(UNIT, mesh, soft)).path([0.015], rest(mesh))
    stiff = bending_angle_deg(mesh, baseline.solved[-1].u)
    assert 0 < stiff < 0.97 * bending_angle_deg(mesh, path[-1].u)


def test_principal_stretches_of_a_homogeneous_deformation(mesh):
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    F = Q @ np.diag([0.7, 1.1, 1.3]) @ Q.T
    u = mesh.nodes @ (F - np.eye(3)).T
    found, volume = deformation_gradients(mesh, u, np.arange(5))
    np.testing.assert_allclose(stretches(found), np.broadcast_to([0.7, 1.1, 1.3], (5, found.shape[1], 3)))
    assert volume.shape == found.shape[:2]


def test_a_lattice_without_a_law_or_with_an_inadmissible_one_is_named():
    with pytest.raises(InputError, match="no layer"):
        LatticeLaw("none", ())
    with pytest.raises(InputError, match="lambda_MPa"):
        LatticeLaw("bad", ((Foam, np.array([0.006, 5.0, 0.006, 4.0, -0.01, -2.0])),))
