"""Joints of uniform beams: their potential is quadratic in the constant strain, and known in closed form."""

import numpy as np

from mu_addon.chain.joint import EXPONENTS, Joint

PAIRS = [(i, j) for i in range(6) for j in range(i, 6)]


def beam(
    length, bending, torsion=1e3, shear=1e6, axial=1e6, mass_g=0.0, curvature=0.0, range_=3.0, error=None
):
    """A joint of a beam: EI, GJ in N mm^2, GA and EA in N; free curvature about x in 1/mm at 10 kPa.

    Its centre of mass is in the middle, to first order as of a beam of constant strain.
    """
    size = np.array([range_] * 3 + [range_ * length] * 3)
    stiffness = np.diag([bending, bending, torsion, shear, shear, axial]) / length
    scaled = stiffness * np.outer(size, size)
    coefficients = np.zeros((2, len(EXPONENTS)))
    for n, (i, j) in enumerate(PAIRS):
        coefficients[:, n] = scaled[i, j] / (2 if i == j else 1)
    eta0 = np.array([[0, 0, 0, 0, 0, length], [curvature * length, 0, 0, 0, 0, length]])
    centre = np.tile([0.0, 0.0, length / 2], (2, 1))
    slope = np.zeros((2, 3, 6))
    # Of t -> exp(t eta), the mean over its length: 1/6 of what turns, half of what is stretched or sheared.
    slope[:, 1, 0], slope[:, 0, 1] = -length / 6, length / 6
    slope[:, 0, 3] = slope[:, 1, 4] = slope[:, 2, 5] = 0.5
    return Joint(
        "beam",
        np.array([0.0, 10.0]),
        eta0,
        size,
        coefficients,
        centre,
        slope * size,
        np.zeros((2, 3, len(PAIRS))),
        mass_g,
        np.zeros((6, 6)) if error is None else error,
    )
