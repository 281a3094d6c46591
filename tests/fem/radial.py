"""Thick sphere and tube under pressure inside, by the radial equation of their material."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp


def _stress(along, across, turns, mu, kappa):
    """Nominal radial and hoop stress of the stretches along the radius and across it.

    turns: directions around, 2 in a sphere, 1 in a tube whose length is kept.
    """
    J = along * across**turns
    I1 = along**2 + turns * across**2 + (2 - turns)
    c, pressure = mu * J ** (-2 / 3), kappa * (J - 1) * J
    return [(c * (s * s - I1 / 3) + pressure) / s for s in (along, across)]


def inner_stretch(pressure, inner, outer, mu, kappa, turns):
    """Hoop stretch of the inner surface of neo-Hookean walls.

    dP_r/dR + turns (P_r - P_t) / R = 0, with P_r = -p (r/R)^turns inside and 0 outside, solved by
    collocation to a relative residual of 1e-10. turns: see `_stress`.
    """
    h = 1e-30

    def slopes(R, y):
        r, along = y
        across = r / R
        radial, hoop = _stress(along, across, turns, mu, kappa)
        by_along = _stress(along + 1j * h, across, turns, mu, kappa)[0].imag / h
        by_across = _stress(along, across + 1j * h, turns, mu, kappa)[0].imag / h
        return np.stack([along, -(turns * (radial - hoop) / R + by_across * (along - across) / R) / by_along])

    def ends(a, b):
        load = _stress(a[1], a[0] / inner, turns, mu, kappa)[0] + pressure * (a[0] / inner) ** turns
        return np.array([load, _stress(b[1], b[0] / outer, turns, mu, kappa)[0]])

    R = np.linspace(inner, outer, 41)
    found = solve_bvp(slopes, ends, R, np.stack([R, np.ones_like(R)]), tol=1e-10, max_nodes=10**5)
    if not found.success:
        raise ArithmeticError(found.message)
    return float(found.y[0, 0] / inner)
