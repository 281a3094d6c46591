"""Rigid motions: the exponential against scipy's, its inverse, and its slope against differences."""

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from mu_addon.chain.rigid_motion import (
    exponential,
    inverse,
    logarithm,
    rotation_vector,
    slope,
)
from mu_addon.fem.rotations import rotation, skew

RNG = np.random.default_rng(5)
ETA = RNG.normal(size=(20, 6)) * [0.8, 0.8, 0.8, 40, 40, 40]


def generator(eta):
    found = np.zeros((4, 4))
    found[:3, :3], found[:3, 3] = skew(eta[:3]), eta[3:]
    return found


def test_exponential_is_that_of_the_matrix():
    for eta, g in zip(ETA, exponential(ETA), strict=True):
        np.testing.assert_allclose(g, expm(generator(eta)), atol=1e-11)


def test_logarithm_inverts_the_exponential_also_near_zero_and_near_half_a_turn():
    near = np.array([np.zeros(6), [1e-12, 0, 0, 1, 2, 3], [0, 3.1, 0, 1, 2, 3], [1e-5, 1e-6, 0, 0, 0, 75]])
    for eta in np.vstack([ETA, near]):
        np.testing.assert_allclose(logarithm(exponential(eta)), eta, atol=1e-10)


def test_rotations_are_scipys():
    w = ETA[:, :3]
    np.testing.assert_allclose(rotation(w), Rotation.from_rotvec(w).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(rotation_vector(rotation(w)), w, atol=1e-13)


def test_slope_is_the_spatial_twist_of_a_change():
    for eta in ETA[:5]:
        for change in np.eye(6):
            h = 1e-5
            rate = (exponential(eta + h * change) - exponential(eta - h * change)) / (2 * h)
            twist = rate @ inverse(exponential(eta))
            wanted = [twist[2, 1], twist[0, 2], twist[1, 0], *twist[:3, 3]]
            np.testing.assert_allclose(slope(eta) @ change, wanted, atol=1e-7)
