"""This package: `Equilibrium.path` through the pressures."""

from __future__ import annotations

import time

import numpy as np

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.state import rest

from .problem import TOLERANCE, Result
from .process import answer


def solve(problem, folder):
    start = time.perf_counter()
    model = Model(problem.mesh)
    materials = Materials.neo_hooke(problem.modulus_MPa, problem.poisson)
    settings = NewtonSettings(tolerance=TOLERANCE / 10)
    # Kernels are compiled, or loaded, at their first launch.
    undeformed, parameters = rest(problem.mesh), model.parameters(materials)
    for call in (model.potential, model.residual, model.tangent):
        call(undeformed.u, 0.0, parameters)
    ready = time.perf_counter()
    states = Equilibrium(model, materials, settings).path(problem.pressures_MPa, undeformed)
    end = time.perf_counter()
    newton = sum(state.iterations for state in states)
    return Result("mu_addon", ready - start, end - ready, len(model.free), newton, states[-1].u)


def imbalance(problem, u):
    """Free residual over reaction forces, as Euclidean norms, of displacements (n, 3) from any code."""
    model = Model(problem.mesh)
    parameters = model.parameters(Materials.neo_hooke(problem.modulus_MPa, problem.poisson))
    force = model.residual(u, problem.pressures_MPa[-1], parameters).ravel()
    free = np.zeros(len(force), bool)
    free[model.free] = True
    return float(np.linalg.norm(force[free]) / np.linalg.norm(force[~free]))


if __name__ == "__main__":
    answer(solve)
