"""Several cavities in one body, each under its own pressure: forces are slopes of the potential."""

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem import Model
from mu_addon.meshing.mesh import Mesh

from . import bodies
from .bodies import hollow_box
from .cavities import CavitiesModel


@pytest.fixture(scope="module")
def hollow():
    return hollow_box(order=1)


def beside(mesh: Mesh) -> Mesh:
    """Two of one mesh side by side, not joined."""
    n = len(mesh.nodes)
    return attrs.evolve(
        mesh,
        nodes=np.vstack([mesh.nodes, mesh.nodes + np.array([100.0, 0.0, 0.0])]),
        tets=np.vstack([mesh.tets, mesh.tets + n]),
        region=np.tile(mesh.region, 2),
        cavity=np.vstack([mesh.cavity, mesh.cavity + n]),
        base=np.concatenate([mesh.base, mesh.base + n]),
        tip=np.concatenate([mesh.tip, mesh.tip + n]),
    )


def test_each_of_two_bodies_feels_its_own_share_alone(hollow):
    one, two = (
        Model(hollow, threads=1),
        CavitiesModel(beside(hollow), [len(hollow.cavity)] * 2, threads=1),
    )
    two.shares = np.array([0.3, -0.5])
    single, both = (m.parameters(bodies.uniform(m.mesh, 0.1, 0.3)) for m in (one, two))
    u = 0.05 * np.random.default_rng(1).normal(size=hollow.nodes.shape)
    whole = np.vstack([u, u])
    n = len(u)
    found = two.residual(whole, 0.02, both)
    np.testing.assert_allclose(found[:n], one.residual(u, 0.006, single), atol=1e-12)
    np.testing.assert_allclose(found[n:], one.residual(u, -0.01, single), atol=1e-12)
    energies = [one.potential(u, p, single) for p in (0.006, -0.01)]
    assert two.potential(whole, 0.02, both) == pytest.approx(sum(energies), rel=1e-12)
    np.testing.assert_allclose(two.cavity_volumes(whole), one.cavity_volume(u), rtol=1e-9)
    # Numbered body by body, the tangent is both bodies' own.
    tangent = two.matrix(two.tangent(whole, 0.02, both)).toarray()
    for rows, p in ((two.free < 3 * n, 0.006), (two.free >= 3 * n, -0.01)):
        own = one.matrix(one.tangent(u, p, single)).toarray()
        np.testing.assert_allclose(tangent[np.ix_(rows, rows)], own, atol=1e-12)


def test_cavities_that_do_not_cover_the_faces_are_refused(hollow):
    with pytest.raises(InputError, match="in a mesh with"):
        CavitiesModel(hollow, [3, 4])
