"""The two-level solver: the same answers as a factorisation, and the same refusals."""

from __future__ import annotations

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import IndefiniteError
from mu_addon.fem.iterative import TwoLevel, interpolation
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest

from .bodies import box, hollow_box


def system(mesh, pressure=1e-3, poisson=0.45):
    """A body's model, tangent and load; every other element ten times stiffer."""
    model = Model(mesh)
    modulus = np.where(np.arange(len(mesh.tets)) % 2, 0.02, 0.2)
    m = model.parameters(Materials.neo_hooke(modulus, np.full(len(modulus), poisson)))
    u = np.zeros_like(mesh.nodes)
    return model, model.tangent(u, pressure, m), model.residual(u, pressure, m).ravel()[model.free]


def two_level(model, **options):
    return TwoLevel(model.pattern.indptr, model.pattern.indices, model.mesh, model.free, **options)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_same_answer_as_a_factorisation(threads):
    model, values, b = system(hollow_box(n=5, size=5.0))
    expected = model.factor.factor(values).solve(b)
    solver = two_level(model, threads=threads, tolerance=1e-11).factor(values)
    assert np.linalg.norm(solver.solve(b) - expected) < 1e-9 * np.linalg.norm(expected)
    assert 0 < solver.iterations < 60


def test_several_right_hand_sides_and_new_values():
    model, values, b = system(hollow_box())
    solver = two_level(model).factor(values)
    many = np.stack([b, np.arange(len(b), dtype=float)], axis=1)
    assert np.linalg.norm(model.matrix(values) @ solver.solve(many) - many) < 1e-7 * np.linalg.norm(many)
    solver.factor(3 * values)
    assert np.linalg.norm(3 * model.matrix(values) @ solver.solve(b) - b) < 1e-7 * np.linalg.norm(b)


def test_iterations_hardly_grow_with_the_mesh():
    counts = []
    for n in (4, 8):
        model, values, b = system(hollow_box(n=n))
        solver = two_level(model).factor(values)
        solver.solve(b)
        counts.append(solver.iterations)
    assert counts[1] < 1.5 * counts[0]


def test_linear_fields_are_interpolated_exactly():
    mesh = box((2, 2, 2), jiggle=0.2)
    down, _ = interpolation(mesh, np.arange(mesh.nodes.size))
    gradient = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 10]])
    corner = np.unique(mesh.corners)
    found = down @ (mesh.nodes[corner] @ gradient.T).ravel()
    assert np.abs(found - (mesh.nodes @ gradient.T).ravel()).max() < 1e-12


def test_an_indefinite_matrix_is_refused():
    model, values, _ = system(hollow_box())
    lowest = np.linalg.eigvalsh(model.matrix(values).toarray())[0]
    diagonal = model.pattern.indptr[:-1]
    for share in (0.9, 1.1, 3.0):
        shifted = values.copy()
        shifted[diagonal] -= share * lowest
        if share < 1:
            two_level(model).factor(shifted)
        else:
            with pytest.raises(IndefiniteError):
                two_level(model).factor(shifted)


def test_linear_elements_are_refused():
    model, _, _ = system(hollow_box(order=1))
    with pytest.raises(InputError, match="quadratic"):
        two_level(model)


def test_an_equilibrium_is_the_same_by_two_levels():
    mesh = hollow_box(n=4, size=4.0)
    states = []
    for solver in ("factorisation", "two levels"):
        model = Model(mesh)
        model.solver = solver
        materials = Materials.neo_hooke(np.full(len(mesh.tets), 0.05), np.full(len(mesh.tets), 0.45))
        states.append(Equilibrium(model, materials).reach(2e-3, [rest(mesh)]))
    assert np.abs(states[0].u).max() > 0.05
    np.testing.assert_allclose(states[1].u, states[0].u, atol=1e-7)
