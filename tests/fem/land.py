"""The first two problems of Land et al., Proc. R. Soc. A 471 (2015) 20150641, nearly incompressible."""

from __future__ import annotations

from functools import cache

import attrs
import numpy as np

from mu_addon.errors import ConvergenceError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import IndefiniteError
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest

from . import bodies
from .guccione import Guccione
from .thick import STIFF


def under_open_pressure(model, materials, pressures, tolerance=1e-9):
    """Displacement (n, 3) under a follower pressure on a face that closes no cavity.

    Such a load has no potential, so a step is taken where it shrinks the residual's work along itself
    (Crisfield's line search), not an energy. The tangent lacks what the face's rim contributes: the last
    digits converge linearly instead of quadratically, to the same state, for the residual lacks nothing.
    """
    m, free = model.parameters(materials), model.free
    u = np.zeros_like(model.mesh.nodes)
    stiffness = model.tangent(u, 0.0, m)
    last, before = (0.0, u), (-1.0, u)
    for pressure in pressures:
        u = last[1] + (pressure - last[0]) / (last[0] - before[0]) * (last[1] - before[1])
        for _ in range(40):
            force = model.residual(u, pressure, m).ravel()[free]
            if np.linalg.norm(force) < tolerance * model.force_scale():
                break
            _factorise(model, model.tangent(u, pressure, m), stiffness)
            step = -model.factor.solve(force)
            for length in 0.5 ** np.arange(10):
                trial = u.copy()
                trial.ravel()[free] += length * step
                after = model.residual(trial, pressure, m).ravel()[free]
                if abs(after @ step) < 0.8 * abs(force @ step):
                    break
            u = trial
        else:
            raise ConvergenceError(f"no equilibrium at {pressure * 1e3:.4g} kPa")
        last, before = (pressure, u), last
    return u


def _factorise(model, tangent, stiffness):
    for share in (0.0, *STIFF.regularisation):
        try:
            model.factor.factor(tangent + share * stiffness)
            return
        except IndefiniteError:
            continue
    raise ConvergenceError("the tangent is far from definite")


def beam(n, order, kappa=10.0, **options):
    """z in mm of the deformed tip of Land's beam, n cells high: C = 2, b = (8, 2, 4), 0.004 kPa below."""
    mesh = bodies.cantilever((10 * n, max(1, n // 2), n), order=order)
    model = Model(mesh, **options)
    materials = bodies.everywhere(mesh, Guccione, 2e-3, 8, 2, 4, kappa, 1, 0, 0)
    u = under_open_pressure(model, materials, np.linspace(0, 4e-6, 11)[1:])
    tip = (mesh.nodes == [10, 0, 1]).all(axis=1)
    return float((mesh.nodes + u)[tip, 2][0]), len(model.free)


@cache
def _apexes(around, order, kappa, **options):
    mesh = bodies.ventricle_quarter(around, max(1, around // 4), order)
    model = Model(mesh, **options)
    settings = attrs.evolve(STIFF, max_step_MPa=1e-3, min_step_MPa=1e-6)
    materials = bodies.everywhere(mesh, Guccione, 1e-2, 1, 1, 1, kappa, 0, 0, 1)
    u = Equilibrium(model, materials, settings).path([1e-2], rest(mesh))[-1].u
    axis = np.flatnonzero((mesh.nodes[:, :2] == 0).all(axis=1))
    heights = mesh.nodes[axis, 2]
    return [(mesh.nodes + u)[axis[pick], 2] for pick in (heights.argmax(), heights.argmin())], len(model.free)


def ventricle(around, order, kappa=10.0, outside=False, **options):
    """z in mm of the deformed apex of Land's ellipsoid, inside or outside: C = 10, b = 1, 10 kPa inside."""
    heights, unknowns = _apexes(around, order, kappa, **options)
    return float(heights[outside]), unknowns
