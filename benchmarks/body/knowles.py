"""A generalised neo-Hookean law that softens: a plastic resin on its loading branch, by deformation theory.

W = mu b/(2 n) ((1 + (I1 - 3)/b)^n - 1) + kappa/2 (J - 1)^2 with I1 at constant volume; elliptic for n >= 1/2.
Source: J. K. Knowles, Int. J. Fracture 13 (1977) 611.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from mu_addon.fem.laws.invariants import of_invariants, slopes
from mu_addon.fem.laws.isochoric import split
from mu_addon.fem.laws.law import Law
from mu_addon.fem.laws.tensors import f64
from mu_addon.fem.laws.valid import require, require_positive


@wp.func
def knowles_energy(I1: wp.float64, I2: wp.float64, m: Any) -> wp.float64:
    x = f64(1.0) + (I1 - f64(3.0)) / m[1]
    return f64(0.5) * m[0] * m[1] / m[2] * (wp.pow(x, m[2]) - f64(1.0))


@wp.func
def knowles_slope(I1: wp.float64, I2: wp.float64, m: Any) -> slopes:
    x = f64(1.0) + (I1 - f64(3.0)) / m[1]
    first = f64(0.5) * m[0] * wp.pow(x, m[2] - f64(1.0))
    return slopes(first, f64(0.0), first * (m[2] - f64(1.0)) / (x * m[1]), f64(0.0), f64(0.0))


class Knowles(Law):
    """Parameters mu and kappa in MPa, b and n without unit."""

    name = "Knowles"
    parameter_names = ("mu_MPa", "b", "n", "kappa_MPa")
    split_volume = True
    bulk = 3
    energy, stress, tangent = map(staticmethod, split(*of_invariants(knowles_energy, knowles_slope), bulk))

    @staticmethod
    def small_strain(parameters):
        return parameters[:, [0, 3]]

    @staticmethod
    def valid(parameters):
        require_positive(Knowles, parameters, "mu_MPa", "b", "kappa_MPa")
        require(parameters[:, 2] >= 0.5, Knowles, "n", parameters[:, 2], "0.5 or more", "else no ellipticity")


def pulled_MPa(stretch, mu, b, n, kappa):
    """Nominal stress (k,) in MPa of a free bar at stretches (k,), by Newton's method on its width."""
    stretch = np.asarray(stretch, float)
    width = stretch**-0.4
    for _ in range(60):
        stress, across, slope = _bar(stretch, width, mu, b, n, kappa)
        step = across / slope
        width = width - step
        if np.abs(step).max() < 1e-13:
            break
    return stress


def _bar(a, w, mu, b, n, kappa):
    """Stress along a bar and across it in MPa, and the slope of that across by the width."""

    def across(w):
        J = a * w * w
        x = 1 + (J ** (-2 / 3) * (a * a + 2 * w * w) - 3) / b
        first = 0.5 * mu * x ** (n - 1)
        # dI1/dw at constant volume, over two sides.
        dw = J ** (-2 / 3) * (4 * w - 2 / 3 * (a * a + 2 * w * w) * 2 / w)
        da = J ** (-2 / 3) * (2 * a - 2 / 3 * (a * a + 2 * w * w) / a)
        return first * da + kappa * (J - 1) * w * w, first * dw + kappa * (J - 1) * 2 * a * w

    h = 1e-6
    along, here = across(w)
    return along, here, (across(w + h)[1] - across(w - h)[1]) / (2 * h)
