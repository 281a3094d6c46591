"""Cook's membrane in plane strain: a panel one cell thick that cannot move across its plane."""

from __future__ import annotations

import numpy as np

from mu_addon.errors import ConvergenceError
from mu_addon.fem.dead_loads import traction
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model

from . import bodies
from .thick import STIFF


def under_dead_load(equilibrium, load, step=0.25, smallest=1e-3):
    """Displacement (n, 3) under nodal forces (n, 3), raised in steps that are halved where Newton fails."""
    share, u = 0.0, np.zeros_like(load)
    slope = np.zeros_like(load)
    while share < 1:
        step = min(step, 1 - share)
        equilibrium.model.load = (share + step) * load
        try:
            reached = equilibrium.newton(u + step * slope, 0.0).u
        except ConvergenceError:
            step /= 2
            if step < smallest:
                raise
            continue
        slope = (reached - u) / step
        share, u, step = share + step, reached, 2 * step
    return u


def _panel(n, order, options):
    mesh = bodies.cook(n, order)
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = True
    return mesh, Model(mesh, supports=held, **options)


def _edge_rise(mesh, u, height):
    """u_y of the loaded edge at a height, the mean of the panel's two faces."""
    at = (np.abs(mesh.nodes[:, :2] - [48, height]) < 1e-9).all(axis=1)
    return float(u[at, 1].mean())


def small(n, order, modulus, poisson, stress, height, **options):
    """u_y in mm of Cook's panel in plane strain at (48, height), of the linearised problem."""
    mesh, model = _panel(n, order, options)
    u = np.zeros_like(mesh.nodes)
    model.factor.factor(model.tangent(u, 0.0, model.parameters(bodies.uniform(mesh, modulus, poisson))))
    load = traction(mesh, mesh.cavity, [0, stress, 0])
    u.ravel()[model.free] = model.factor.solve(load.ravel()[model.free])
    return _edge_rise(mesh, u, height), len(model.free)


def finite(n, order, modulus=3.0, poisson=0.4999, stress=0.05, **options):
    """u_y in mm of Cook's panel in plane strain at its upper corner, at finite strain."""
    mesh, model = _panel(n, order, options)
    equilibrium = Equilibrium(model, bodies.uniform(mesh, modulus, poisson), STIFF)
    u = under_dead_load(equilibrium, traction(mesh, mesh.cavity, [0, stress, 0]))
    return _edge_rise(mesh, u, 60.0), len(model.free)
