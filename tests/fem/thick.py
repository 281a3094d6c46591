"""Thick-walled sphere and tube under pressure inside."""

from __future__ import annotations

import numpy as np

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.state import rest

from . import bodies
from .radial import inner_stretch

INNER, OUTER = 10.0, 12.0
# Where kappa is 1e3 mu and more, a step's second-order volume change makes the tangent far from definite.
STIFF = NewtonSettings(regularisation=(0.03, 0.3, 3.0, 30.0))
# The pressures that stretch incompressible walls of mu = 1 MPa by 1.1 and 1.15 inside; closed forms from
# div sigma = 0 under the deformation that incompressibility leaves.


def sphere_pressure(stretch=1.1):
    """p = 2 mu [1/b + 1/(4 b^4) - 1/a - 1/(4 a^4)], b^3 = 1 + (a^3 - 1)(A/B)^3, in MPa."""
    outside = (1 + (stretch**3 - 1) * (INNER / OUTER) ** 3) ** (1 / 3)
    return 2 * ((1 / outside + 1 / (4 * outside**4)) - (1 / stretch + 1 / (4 * stretch**4)))


def tube_pressure(stretch=1.15):
    """p = mu [ln(a/b) + (1/b^2 - 1/a^2)/2], b^2 = 1 + (a^2 - 1)(A/B)^2, in MPa."""
    outside = np.sqrt(1 + (stretch**2 - 1) * (INNER / OUTER) ** 2)
    return np.log(stretch / outside) + (outside**-2 - stretch**-2) / 2


def _radial_growth(mesh, model, pressure, poisson):
    equilibrium = Equilibrium(
        model, bodies.uniform(mesh, 2 * (1 + poisson), poisson), NewtonSettings(max_step_MPa=0.05)
    )
    return equilibrium.path([pressure], rest(mesh))[-1].u


def sphere(around, order, poisson, **options):
    """Mean radial displacement in mm of the inner surface of a thick sphere under pressure."""
    mesh = bodies.sphere_octant(INNER, OUTER, around, through=max(1, around // 4), order=order)
    model = Model(mesh, **options)
    u = _radial_growth(mesh, model, sphere_pressure(), poisson)
    inside = np.unique(mesh.cavity)
    return np.linalg.norm((mesh.nodes + u)[inside], axis=1).mean() - INNER, len(model.free)


def tube(around, order, poisson, **options):
    """Mean radial displacement in mm of the inner surface of a thick tube of constant length."""
    mesh = bodies.cylinder_quarter(
        INNER, OUTER, height=16 / around, around=around, through=max(1, around // 4), order=order
    )
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = mesh.nodes[:, 2] == mesh.nodes[:, 2].max()
    model = Model(mesh, supports=held, **options)
    u = _radial_growth(mesh, model, tube_pressure(), poisson)
    inside = np.unique(mesh.cavity)
    return np.linalg.norm((mesh.nodes + u)[inside, :2], axis=1).mean() - INNER, len(model.free)


def radial_growth(pressure, poisson, turns):
    """What `sphere` (turns 2) and `tube` (1) converge to, in mm."""
    kappa = 2 * (1 + poisson) / (3 * (1 - 2 * poisson))
    return INNER * (inner_stretch(pressure, INNER, OUTER, 1.0, kappa, turns) - 1)
