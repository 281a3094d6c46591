"""A joint's polynomial: derivatives, and a fit that finds a potential from its gradients and stiffness."""

import attrs
import numpy as np

from mu_addon.chain.joint import EXPONENTS, Joint, fitted
from mu_addon.chain.unit_between_plates import MIRROR, PlateState

RNG = np.random.default_rng(11)
SIZE = np.array([0.4, 0.4, 0.3, 4.0, 4.0, 3.0])
ETA0 = np.array([-0.2, 0.0, 0.0, 0.0, 0.5, 75.0])


def symmetric_coefficients():
    """Coefficients of a potential that its mirror image shares, its quadratic part positive."""
    found = RNG.normal(size=len(EXPONENTS)) * 0.3
    odd = EXPONENTS[:, MIRROR < 0].sum(axis=1) % 2 == 1
    found[odd] = 0.0
    squares = (EXPONENTS.max(axis=1) == 2) & (EXPONENTS.sum(axis=1) == 2)
    found[squares] = 8.0
    return found


def joint_of(coefficients):
    two = np.ones((2, 1))
    return Joint(
        "polynomial",
        np.array([0.0, 10.0]),
        two * ETA0,
        SIZE,
        two * coefficients,
        np.zeros((2, 3)),
        np.zeros((2, 3, 6)),
        np.zeros((2, 3, 21)),
        1.0,
    )


def test_gradient_and_stiffness_are_derivatives():
    at = joint_of(symmetric_coefficients()).at(3.0)
    for scale in (0.5, 1.8):  # within the range, and beyond it, where the wall stands
        eta = ETA0 + scale * SIZE * RNG.uniform(-1, 1, 6)
        steps = 1e-5 * np.diag(SIZE)
        slope = (at.potential(eta + steps) - at.potential(eta - steps)) / (2e-5 * SIZE)
        np.testing.assert_allclose(at.gradient(eta)[0], slope, rtol=1e-6, atol=1e-6)
        bend = (at.gradient(eta + steps) - at.gradient(eta - steps)) / (2e-5 * SIZE)[:, None]
        np.testing.assert_allclose(at.hessian(eta), bend, rtol=1e-5, atol=1e-5)


def test_a_fit_finds_the_potential_its_states_came_from():
    coefficients = symmetric_coefficients()
    at = joint_of(coefficients).at(0.0)

    def state(eta):
        return PlateState(0.0, eta, at.gradient(eta)[0], at.hessian(eta), np.zeros(3), np.zeros((3, 6)))

    free = state(ETA0)
    ways = [sign * np.eye(6)[k] for k in range(6) for sign in ((1, -1) if k in (0, 4, 5) else (1,))]
    found = fitted([state(ETA0 + SIZE * way) for way in ways], free, SIZE)["coefficients"]
    learned = joint_of(found).at(0.0)
    # Products of four different variables are seen by no such state.
    seen = (EXPONENTS > 0).sum(axis=1) < 4
    np.testing.assert_allclose(found[seen], coefficients[seen], atol=2e-4)
    np.testing.assert_allclose(learned.hessian(ETA0), at.hessian(ETA0), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(learned.gradient(ETA0), 0.0, atol=1e-12)


def test_the_centre_of_mass_has_its_products_though_states_lie_along_the_axes():
    """Fitted to places alone, states a hair off the axes made a hundredfold curvature of rounding."""
    bend = RNG.normal(size=(3, 21))
    odd = EXPONENTS[:21, MIRROR < 0].sum(axis=1) % 2 == 1
    bend[0, ~odd], bend[1:, odd] = 0.0, 0.0
    slope = RNG.normal(size=(3, 6))
    slope[0, MIRROR > 0], slope[1:, MIRROR < 0] = 0.0, 0.0
    made = attrs.evolve(
        joint_of(symmetric_coefficients()),
        centre_slope=np.array([slope] * 2),
        centre_bend=np.array([bend] * 2),
    ).at(0.0)

    def state(eta):
        where = made.centre_of_mass(eta)[0] + 1e-7 * RNG.normal(size=3)
        return PlateState(
            0.0, eta, made.gradient(eta)[0], made.hessian(eta), where, made.centre_gradient(eta)[0]
        )

    nearly = np.eye(6) + 1e-5 * RNG.normal(size=(6, 6))
    ways = [sign * nearly[k] for k in range(6) for sign in ((1, -1) if k in (0, 4, 5) else (1,))]
    found = fitted([state(ETA0 + SIZE * way) for way in ways], state(ETA0), SIZE)
    np.testing.assert_allclose(found["centre_bend"], bend, atol=1e-5)
