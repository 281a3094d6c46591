"""Laws that remember, and the march through time, against closed forms."""

import itertools

import numpy as np
import pytest
from scipy.optimize import brentq

from mu_addon.errors import ConvergenceError, InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import Friction, NeoHooke, OgdenRoxburgh, Prony, Yeoh
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.fem.trajectory import simulate
from mu_addon.meshing.mesh import Mesh, boundary_faces

from . import bodies
from .points import drive, evaluate

YEOH = np.array([0.3, -0.02, 0.004, 5.0])
BETA, TAU = np.array([0.5, 0.3, 0.0]), np.array([1.0, 10.0, 1.0])


def stretched(stretch):
    """Gradients (n, 3, 3) of uniaxial stretches (n,) at constant volume."""
    s = np.asarray(stretch, float)
    F = np.zeros((len(s), 3, 3))
    F[:, 0, 0], F[:, 1, 1], F[:, 2, 2] = s, s**-0.5, s**-0.5
    return F


def axial(F, P):
    """Uniaxial Cauchy stress (n,) of a free side, of gradients and stresses (n, 3, 3) at constant volume."""
    return F[:, 0, 0] * P[:, 0, 0] - F[:, 1, 1] * P[:, 1, 1]


def prony_row(beta=BETA):
    return np.concatenate([YEOH, np.stack([beta, TAU], axis=1).ravel()])


def everywhere(mesh, *layers):
    count = len(mesh.tets)
    return Materials(
        tuple(
            Layer(law, np.arange(count), np.tile(np.asarray(row, float), (count, 1))) for law, row in layers
        )
    )


@pytest.mark.parametrize("stretch", [1.001, 1.8])
def test_stress_relaxes_as_its_series_says(stretch):
    """Held from t = 0, whatever the steps: (1 + sum of beta e^(-t/tau)) times the long-term stress."""
    time = np.concatenate([[0.0], np.geomspace(0.01, 100, 15)])
    F = stretched(np.full(16, stretch))
    _, P = drive(Prony, prony_row(), F, time)
    elastic = axial(F, evaluate(Yeoh, F, YEOH)[1])
    factor = 1 + (BETA * np.exp(-time[:, None] / TAU)).sum(axis=1)
    np.testing.assert_allclose(axial(F, P), factor * elastic, rtol=1e-10)


def test_a_ramp_of_stress_is_followed_exactly_and_a_ramp_of_stretch_to_second_order():
    """Under a steady strain rate, small: s = E rate (t + sum of beta tau (1 - e^(-t/tau))), E = 6 c1."""
    time = np.linspace(0, 2, 5)
    rate = 1e-6
    F = stretched(1 + rate * time)
    _, P = drive(Prony, prony_row(), F, time)
    grown = time + (BETA * TAU * (1 - np.exp(-time[:, None] / TAU))).sum(axis=1)
    np.testing.assert_allclose(axial(F, P), 6 * YEOH[0] * rate * grown, rtol=1e-5, atol=1e-16)

    def after(steps):
        t = np.linspace(0, 2, steps + 1)
        F = stretched(1 + 0.5 * t)
        return axial(F, drive(Prony, prony_row(), F, t)[1])[-1]

    exact = after(320)
    assert abs(after(20) - exact) < 0.3 * abs(after(10) - exact)
    assert after(10) == pytest.approx(exact, rel=2e-3)


def test_very_slow_and_very_fast_loading_are_elastic():
    F = stretched([1.0, 1.5])
    elastic = axial(F, evaluate(Yeoh, F, YEOH)[1])[1]
    for duration, factor in ((0.0, 1 + BETA.sum()), (1e-12, 1 + BETA.sum()), (1e12, 1.0)):
        _, P = drive(Prony, prony_row(), F, [0.0, duration])
        assert axial(F, P)[1] == pytest.approx(factor * elastic, rel=1e-9)


def pressed_box(n=1):
    """A unit cube between three mirror planes, its top z = 1 pressed as if it were a cavity's wall."""
    mesh = bodies.box((n, n, n), symmetry=("x", "y", "z"))
    faces, _ = boundary_faces(mesh.tets)
    top = faces[(mesh.nodes[faces][:, :, 2] == 1).all(axis=1)]
    quadratic = []
    for face in top:
        tet = mesh.tets[np.isin(mesh.tets[:, :4], face).sum(axis=1) == 3][0]
        ends = {frozenset(tet[list(e)]): tet[4 + i] for i, e in enumerate(EDGES)}
        quadratic.append([*face, *(ends[frozenset(face[[i, (i + 1) % 3]])] for i in range(3))])
    return Mesh(mesh.nodes, mesh.tets, mesh.region, quadratic, [], [], mesh.symmetry)


EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


def test_creep_under_a_held_pressure_follows_its_closed_form():
    """Strain = p [1/(9 kappa) + (1 - b/(1 + b) e^(-t/(tau (1 + b))))/(3 G)] of one branch, G = 2 c1."""
    mesh = pressed_box()
    beta, tau, pressure = 0.5, 1.0, 1e-5
    row = [*YEOH, beta, tau, 0, 1, 0, 1]
    equilibrium = Equilibrium(Model(mesh), everywhere(mesh, (Prony, row)))
    time = np.concatenate([[0.0], np.linspace(0, 4, 41)])
    held = np.full(42, pressure * 1e3)
    path = simulate_in_time(equilibrium, time, held)
    top = mesh.nodes[:, 2] == 1
    strain = np.array([-s.u[top, 2].mean() for s in path.solved])
    G, kappa = 2 * YEOH[0], YEOH[3]
    creep = 1 - beta / (1 + beta) * np.exp(-time / (tau * (1 + beta)))
    np.testing.assert_allclose(strain, pressure * (1 / (9 * kappa) + creep / (3 * G)), rtol=3e-4)
    # Steps of 0.1 s were asked for by the instants; larger ones can be cut instead.
    coarse = simulate_in_time(equilibrium, [0.0, 0.0, 4.0], [0.0, held[0], held[0]], max_step_s=0.1)
    assert -coarse.states[-1].u[top, 2].mean() == pytest.approx(strain[-1], rel=1e-9)


def test_softening_follows_its_closed_form_through_cycles():
    """s = eta s_Yeoh, eta = 1 - erf((W_m - W)/(m + beta W_m))/r, W_m the largest W so far."""
    from scipy.special import erf

    r, m, beta = 1.5, 0.05, 0.1
    stretch = np.concatenate(
        [
            np.linspace(1, 2, 9),
            np.linspace(2, 1, 9)[1:],
            np.linspace(1, 2.5, 13)[1:],
            np.linspace(2.5, 1, 7)[1:],
        ]
    )
    F = stretched(stretch)
    _, P = drive(OgdenRoxburgh, np.array([*YEOH, r, m, beta]), F, np.arange(len(F)))
    W, elastic, _ = evaluate(Yeoh, F, YEOH)
    largest = np.maximum.accumulate(W)
    eta = 1 - erf((largest - W) / (m + beta * largest)) / r
    np.testing.assert_allclose(axial(F, P), eta * axial(F, elastic), rtol=1e-10, atol=1e-14)
    assert eta.min() < 0.6


def test_sliding_dissipates_what_the_closed_form_says():
    """A loop of amplitude t_a in the strain deviator's length loses 4 k (t_a - t_y), k = sqrt(2/3) yield.

    Uniaxial stretch at constant volume keeps the deviator's direction, so that this is exact; t_y = k/(2 mu).
    """
    mu, limit, amplitude = 0.4, 0.1, 0.25
    k = np.sqrt(2 / 3) * limit
    turns = [0, amplitude, -amplitude, amplitude]
    length = np.concatenate([np.linspace(a, b, 101)[1:] for a, b in itertools.pairwise(turns)])
    # The deviator's length is sqrt(2/3) (C11 - C22)/2.
    stretch = [brentq(lambda s, d=d: s * s - 1 / s - d, 0.2, 5) for d in 2 * length / np.sqrt(2 / 3)]
    F = stretched(stretch)
    _, P = drive(Friction, np.array([mu, limit]), F, np.zeros(len(F)))
    loop = slice(-201, None)
    S = np.linalg.solve(F, P)[loop]
    C = np.einsum("nji,njk->nik", F, F)[loop]
    work = np.einsum("nij,nij->", (S[1:] + S[:-1]) / 2, np.diff(C, axis=0) / 2)
    assert work == pytest.approx(4 * k * (amplitude - k / (2 * mu)), rel=1e-3)


def test_several_sliding_layers_add_up():
    mesh = pressed_box()
    rows = [(NeoHooke, [0.2, 5.0]), (Friction, [0.4, 0.02]), (Friction, [0.2, 0.05])]
    model = Model(mesh)
    u = 0.03 * np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    together = model.parameters(everywhere(mesh, *rows))
    apart = [model.parameters(everywhere(mesh, row)) for row in rows]
    for step in (0.5, 1.0, -1.0):
        total = model.residual(step * u, 0.0, together)
        np.testing.assert_allclose(total, sum(model.residual(step * u, 0.0, m) for m in apart), atol=1e-14)
        for m in (together, *apart):
            model.commit(step * u, m)


def test_an_elastic_body_marches_where_its_path_goes():
    mesh = bodies.hollow_box(2, n=3)
    materials = bodies.uniform(mesh, 0.3, 0.4)
    time, pressure = np.arange(6.0), np.array([0.0, 10, 25, -5, -5, 0])
    equilibrium = Equilibrium(Model(mesh), materials)
    a, b = simulate(equilibrium, time, pressure), simulate_in_time(equilibrium, time, pressure)
    for p, one, other in zip(pressure, a.states, b.states, strict=True):
        assert one.pressure_MPa == other.pressure_MPa == p / 1e3
        np.testing.assert_allclose(other.u, one.u, atol=1e-8)
    np.testing.assert_array_equal(b.index, np.arange(6))


def test_a_body_with_friction_stays_where_it_slid_and_forgets_when_it_starts_anew():
    mesh = bodies.hollow_box(2, n=3)
    materials = everywhere(mesh, (NeoHooke, [0.1, 0.5]), (Friction, [0.2, 0.004]))
    equilibrium = Equilibrium(Model(mesh), materials)
    time, pressure = np.arange(3.0), np.array([0.0, 25, 0])
    first = simulate_in_time(equilibrium, time, pressure)
    largest = np.abs(first.states[1].u).max()
    assert np.abs(first.states[2].u).max() > 0.02 * largest
    again = simulate_in_time(equilibrium, 60 * time, pressure)
    np.testing.assert_allclose(again.states[2].u, first.states[2].u, atol=1e-9)


def test_failures_are_named():
    mesh = bodies.sphere_octant(10, 12, 2)
    equilibrium = Equilibrium(Model(mesh), bodies.uniform(mesh, 0.02, 0.45))
    with pytest.raises(ConvergenceError, match="no equilibrium at") as error:
        simulate_in_time(equilibrium, [0.0, 10.0], [0.0, 50.0])
    assert "the last converged state is at" in error.value.where
    with pytest.raises(InputError, match="backward"):
        simulate_in_time(equilibrium, [0.0, 2.0, 1.0], [0.0, 1.0, 1.0])
