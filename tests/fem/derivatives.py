"""What ties energy, force and tangent of a model together, by central differences."""

import numpy as np
import pytest


def assert_consistent(model, m, u, random, tangent):
    """The force is the energy's slope at u to 1e-7, along a random direction, the tangent the force's."""
    v = random.standard_normal(u.shape)
    v.ravel()[np.setdiff1d(np.arange(v.size), model.free)] = 0.0
    h = 1e-6
    plus, minus = (model.potential(u + s * h * v, 0.0, m) for s in (1, -1))
    force = model.residual(u, 0.0, m)
    assert (plus - minus) / (2 * h) == pytest.approx(float((force * v).sum()), rel=1e-7)
    plus, minus = (model.residual(u + s * h * v, 0.0, m).ravel()[model.free] for s in (1, -1))
    along = model.matrix(model.tangent(u, 0.0, m)) @ v.ravel()[model.free]
    np.testing.assert_allclose((plus - minus) / (2 * h), along, atol=tangent * np.abs(along).max())
