"""What must hold for every body and displacement, on a body in which every elastic law has its share."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.fem.laws import (
    Foam,
    MooneyRivlin,
    NeoHooke,
    Ogden,
    Yeoh,
)
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model

from . import bodies
from .cubic import Cubic
from .guccione import Guccione

ROWS = {
    NeoHooke: NeoHooke.parameters(np.array([0.6]), np.array([0.4])),
    MooneyRivlin: [[0.1, 0.02, 1.0]],
    Yeoh: [[0.1, -0.01, 0.004, 1.0]],
    Ogden: [[0.2, 1.8, 0.01, 5.0, -0.02, -2.0, 1.0]],
    Foam: Foam.parameters(0.3, 0.2, 3.0, 6.0),
    Guccione: Guccione.parameters(0.05, 4.0, 2.0, 3.0, 1.0, [1.0, 2.0, -0.5]),
    Cubic: Cubic.parameters(0.5, 0.3, 0.3, [1.0, 1.0, 0.2], [0.0, 1.0, 0.5]),
}

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=8)


def patchwork(mesh):
    """Two laws in every element, side by side, so that all laws meet their neighbours."""
    element = np.arange(len(mesh.tets))
    layers = []
    for k, (law, row) in enumerate(ROWS.items()):
        for shift, weight in ((0, 0.7), (3, 0.3)):
            mine = element[(element + shift) % len(ROWS) == k]
            layers.append(Layer(law, mine, np.repeat(row, len(mine), axis=0), weight))
    return Materials(tuple(layers))


def changed(materials, change):
    """The materials with parameters change(names, parameters)."""
    return Materials(
        tuple(
            attrs.evolve(x, parameters=change(x.law.parameter_names, x.parameters)) for x in materials.layers
        )
    )


def moduli_times(factor):
    """A change that multiplies every parameter in MPa."""

    def change(names, parameters):
        return parameters * [factor if n.endswith("_MPa") else 1.0 for n in names]

    return change


def turned(Q):
    """A change that turns every direction."""

    def change(names, parameters):
        parameters = parameters.copy()
        for x in (i for i, n in enumerate(names) if n.endswith("_x")):
            parameters[:, x : x + 3] = parameters[:, x : x + 3] @ Q.T
        return parameters

    return change


def rotation(rng):
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    q[:, 0] *= np.linalg.det(q)
    return q


def stirred(mesh, rng):
    """A displacement without pattern, small enough that no element inverts."""
    return 0.04 * rng.standard_normal(mesh.nodes.shape)


class Body:
    """A model with its parameters, to be asked for energy and forces."""

    def __init__(self, mesh, materials, **options):
        self.mesh, self.model = mesh, Model(mesh, **options)
        self.m = self.model.parameters(materials)

    def energy(self, u, pressure=0.0):
        return self.model.potential(u, pressure, self.m)

    def force(self, u, pressure=0.0):
        return self.model.residual(u, pressure, self.m)


@pytest.fixture(scope="module", params=[1, 2], ids=["order 1", "order 2"])
def mesh(request):
    return bodies.hollow_box(request.param, n=3, clamp=False)


@pytest.fixture(scope="module")
def body(mesh):
    return Body(mesh, patchwork(mesh))


@few
@given(seed=seeds)
def test_energy_is_objective_and_forces_turn_with_the_body(body, seed):
    """A rigid motion after any deformation, follower pressure included: a free body pulls itself nowhere."""
    rng = np.random.default_rng(seed)
    u, Q = stirred(body.mesh, rng), rotation(rng)
    v = (body.mesh.nodes + u) @ Q.T + rng.normal(size=3) - body.mesh.nodes
    assert body.energy(v, 0.03) == pytest.approx(body.energy(u, 0.03), rel=1e-10)
    np.testing.assert_allclose(body.force(v, 0.03), body.force(u, 0.03) @ Q.T, atol=1e-11)


@few
@given(seed=seeds)
def test_a_body_laid_down_otherwise_is_the_same_body(body, seed):
    """Nodes, directions of the material and displacement turned together."""
    rng = np.random.default_rng(seed)
    u, Q = stirred(body.mesh, rng), rotation(rng)
    other = Body(
        attrs.evolve(body.mesh, nodes=body.mesh.nodes @ Q.T), changed(patchwork(body.mesh), turned(Q))
    )
    assert other.energy(u @ Q.T, 0.03) == pytest.approx(body.energy(u, 0.03), rel=1e-10)
    np.testing.assert_allclose(other.force(u @ Q.T, 0.03), body.force(u, 0.03) @ Q.T, atol=1e-11)


@few
@given(seed=seeds)
def test_numbering_changes_nothing(body, seed):
    """Nodes, elements and layers renumbered: the same energy, forces and stiffness."""
    rng = np.random.default_rng(seed)
    mesh = body.mesh
    nodes, elements = rng.permutation(len(mesh.nodes)), rng.permutation(len(mesh.tets))
    new, place = np.argsort(nodes), np.argsort(elements)
    moved = type(mesh)(
        mesh.nodes[nodes], new[mesh.tets[elements]], mesh.region[elements], new[mesh.cavity], [], []
    )
    layers = [attrs.evolve(x, elements=place[x.elements]) for x in patchwork(mesh).layers]
    rng.shuffle(layers)
    other = Body(moved, Materials(tuple(layers)))
    u, d = stirred(mesh, rng), rng.standard_normal(mesh.nodes.shape)
    assert other.energy(u[nodes], 0.03) == pytest.approx(body.energy(u, 0.03), rel=1e-12)
    np.testing.assert_allclose(other.force(u[nodes], 0.03), body.force(u, 0.03)[nodes], atol=1e-13)
    here, there = (
        b.model.matrix(b.model.tangent(v, 0.03, b.m)) @ w.ravel()
        for b, v, w in ((body, u, d), (other, u[nodes], d[nodes]))
    )
    np.testing.assert_allclose(there.reshape(-1, 3), here.reshape(-1, 3)[nodes], atol=1e-11)


@few
@given(seed=seeds, factor=st.floats(0.1, 10))
def test_forces_scale_with_moduli_and_with_size(body, seed, factor):
    """Forces grow as the moduli and pressure do, and as the square of the body's size."""
    u = stirred(body.mesh, np.random.default_rng(seed))
    force = body.force(u, 0.03)
    stiffer = Body(body.mesh, changed(patchwork(body.mesh), moduli_times(factor)))
    np.testing.assert_allclose(stiffer.force(u, 0.03 * factor), factor * force, atol=1e-12 * factor)
    larger = Body(attrs.evolve(body.mesh, nodes=factor * body.mesh.nodes), patchwork(body.mesh))
    np.testing.assert_allclose(larger.force(factor * u, 0.03), factor**2 * force, atol=1e-12 * factor**2)
