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


def assert_derivatives(model, m, u, d, pressure, tangent=1e-8):
    """As above to 1e-8 along d, and under a follower pressure in MPa.

    By differences of fourth order: their truncation lies far below the bounds, rounding at about 1e-10.
    """

    def slope(values, h):
        a, b, c, e = (values(u + s * h * d, pressure, m) for s in (-2, -1, 1, 2))
        return (8 * (c - b) - (e - a)) / (12 * h)

    assert slope(model.potential, 1e-4) == pytest.approx((model.residual(u, pressure, m) * d).sum(), rel=1e-8)
    product = (model.matrix(model.tangent(u, pressure, m)) @ d.ravel()).reshape(-1, 3)
    assert np.abs(slope(model.residual, 1e-5) - product).max() < tangent * np.abs(product).max()


def assert_beams_consistent(beams, x):
    """Forces (e, 12) are the slope of the beams' energies at x, stiffnesses that of the forces, to 2e-8."""
    forces, stiffness, h = beams.forces(x), beams.stiffness(x), 1e-6
    steps = h * np.eye(12)
    slope = np.stack([(beams.energy_mJ(x + s) - beams.energy_mJ(x - s)) / (2 * h) for s in steps], axis=1)
    bend = np.stack([(beams.forces(x + s) - beams.forces(x - s)) / (2 * h) for s in steps], axis=2)
    assert np.abs(forces - slope).max() < 2e-8 * max(1.0, np.abs(forces).max())
    assert np.abs(stiffness - bend).max() < 2e-8 * np.abs(stiffness).max()
    np.testing.assert_allclose(stiffness, stiffness.transpose(0, 2, 1), atol=1e-12 * np.abs(stiffness).max())
