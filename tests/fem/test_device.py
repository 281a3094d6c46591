"""What runs on a device: conjugate gradients in place of a factorisation, and the kernels themselves.

Everything but the kernels' own comparison runs on Warp's "cpu" too; a CUDA device joins where there is one.
"""

from __future__ import annotations

import sys

import numpy as np
import pytest
import warp as wp
from scipy.sparse.linalg import eigsh

from mu_addon.errors import ConvergenceError
from mu_addon.fem import conjugate_gradients, kernels, krylov_kernels
from mu_addon.fem.conjugate_gradients import ConjugateGradients
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import IndefiniteError
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest

from .bodies import hollow_box

NONE = pytest.param("cuda:0", marks=pytest.mark.skip(reason="Warp sees no CUDA device"))
CUDA = [str(device) for device in wp.get_cuda_devices()] or [NONE]
DEVICES = ["cpu", *CUDA]
MESH = hollow_box(n=3, size=3.0)


def by_gradients(device):
    """A model that solves by conjugate gradients, whatever its device."""
    model = Model(MESH, device=device)
    model.solver = "conjugate gradients"
    return model


def two_halves(mesh):
    """Neo-Hookean, ten times stiffer where y > 1.5."""
    upper = mesh.nodes[mesh.corners].mean(axis=1)[:, 1] > 1.5
    return Materials.neo_hooke(np.where(upper, 0.2, 0.02), np.full(len(upper), 0.45))


def bent(mesh):
    """A smooth displacement that no symmetry of the body shares."""
    x, y, z = mesh.nodes.T
    return 0.02 * z[:, None] * np.stack([np.sin(y), x * z, 0.5 * np.cos(x)], axis=1)


@pytest.fixture(scope="module")
def cpu():
    return Model(MESH)


@pytest.fixture(scope="module")
def tangent(cpu):
    return cpu.tangent(bent(MESH), 2e-4, cpu.parameters(two_halves(MESH)))


@pytest.fixture(scope="module", params=DEVICES)
def gradients(request, cpu):
    pattern = cpu.pattern
    return ConjugateGradients(pattern.indptr, pattern.indices, pattern.order, request.param)


def test_same_answer_as_a_factorisation(cpu, tangent, gradients):
    b = np.random.default_rng(1).standard_normal((len(cpu.free), 5))
    for scale in (1.0, 3.0):
        expected = cpu.factor.factor(scale * tangent).solve(b)
        gradients.factor(scale * tangent)
        limit = 1e-8 * np.abs(expected).max()
        assert np.abs(gradients.solve(b) - expected).max() < limit
        assert np.abs(gradients.solve(b[:, 1]) - expected[:, 1]).max() < limit


def test_residuals_reach_the_tolerance(cpu, tangent, gradients):
    b = np.random.default_rng(2).standard_normal((len(cpu.free), 2)) * [1e-6, 1e6]
    left = cpu.matrix(tangent) @ gradients.factor(tangent).solve(b) - b
    assert (np.linalg.norm(left, axis=0) < 2 * gradients.tolerance * np.linalg.norm(b, axis=0)).all()


def test_nothing_is_solved_by_nothing(cpu, tangent, gradients):
    assert (gradients.factor(tangent).solve(np.zeros(len(cpu.free))) == 0).all()


def shifted(cpu, tangent, shift):
    """The tangent less a multiple of the unit matrix."""
    values = tangent.copy()
    values[cpu.pattern.indptr[:-1]] -= shift
    return values


@pytest.mark.parametrize("lost", [0, 1, 2, 10])
def test_a_matrix_that_lost_modes_is_refused_and_the_next_one_is_not(cpu, tangent, gradients, lost):
    softest = np.sort(eigsh(cpu.matrix(tangent), 12, sigma=0, return_eigenvectors=False))
    edge = softest[lost - 1 : lost + 1].mean() if lost else 0.9 * softest[0]
    values = shifted(cpu, tangent, edge)
    if lost:
        with pytest.raises(IndefiniteError):
            gradients.factor(values)
        gradients.factor(tangent)
    else:
        gradients.factor(values)


def test_a_mode_is_found_lost_however_little_the_load_has_of_it(cpu, tangent, gradients):
    """Solving alone would not tell: the load is orthogonal to the mode, and its work is positive."""
    stiffness, modes = eigsh(cpu.matrix(tangent), 2, sigma=0)
    load = modes[:, np.argmax(stiffness)]
    values = shifted(cpu, tangent, stiffness.mean())
    assert load @ (cpu.matrix(values) @ load) > 0
    with pytest.raises(IndefiniteError):
        gradients.factor(values)


def test_a_negative_diagonal_is_refused(cpu, tangent, gradients):
    values = tangent.copy()
    values[cpu.pattern.indptr[7]] *= -1
    with pytest.raises(IndefiniteError):
        gradients.factor(values)


def test_a_solution_that_is_not_reached_is_not_returned(cpu, tangent, gradients, monkeypatch):
    gradients.factor(tangent)
    monkeypatch.setattr(conjugate_gradients, "MAX_ITERATIONS", 10)
    with pytest.raises(ConvergenceError):
        gradients.solve(np.ones(len(cpu.free)))
    with pytest.raises(IndefiniteError, match="close to singular"):
        gradients.factor(tangent)


@pytest.fixture(scope="module")
def path(cpu):
    return Equilibrium(cpu, two_halves(MESH)).path([2e-3, 4e-3], rest(MESH))


@pytest.mark.parametrize("device", DEVICES)
def test_equilibria_are_the_same(path, device):
    model = by_gradients(device)
    for one, other in zip(
        path, Equilibrium(model, two_halves(MESH)).path([2e-3, 4e-3], rest(MESH)), strict=True
    ):
        assert np.abs(one.u).max() > 0.02
        assert np.abs(one.u - other.u).max() < 1e-8


@pytest.mark.parametrize("device", CUDA)
@pytest.mark.parametrize("mean_dilatation", [False, True])
def test_devices_agree(device, mean_dilatation):
    u, found = bent(MESH), []
    for where in ("cpu", device):
        model = Model(MESH, device=where, mean_dilatation=mean_dilatation)
        m = model.parameters(two_halves(MESH))
        found.append((model.potential(u, 1e-3, m), model.residual(u, 1e-3, m), model.tangent(u, 1e-3, m)))
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() <= 1e-12 * np.abs(one).max()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "darwin", reason="Warp has no CUDA compiler for macOS")
def test_kernels_compile_for_cuda_where_there_is_none(tmp_path):
    law = kernels.law_kernels(NeoHooke, True)
    mine = [law.energy, law.force, law.stiffness, kernels.gather_blocks, krylov_kernels.advance]
    for kernel in (*mine, *(krylov_kernels.product_kernel(w) for w in conjugate_gradients.WIDTHS)):
        before = len(list(tmp_path.glob("*.ptx")))
        wp.compile_aot_module(kernel.module, arch=90, module_dir=tmp_path, use_ptx=True)
        assert len(list(tmp_path.glob("*.ptx"))) == before + 1


@pytest.mark.parametrize("device", CUDA)
def test_a_model_on_a_device_solves_there(device):
    assert Model(MESH, device=device).solver == "conjugate gradients"
