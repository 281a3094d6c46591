"""The adjoint map against real solutions with one element stiffened."""

import attrs
import numpy as np
import pytest

from mu_addon.errors import MeshingError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import IndefiniteError
from mu_addon.fem.kinematics import probe
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import Trajectory, simulate, whole_body
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, mirror
from mu_addon.placement.deviation import centreline, centreline_deviation
from mu_addon.placement.sensitivity_map import (
    centreline_gradient,
    deviation_map,
    gradients_of,
    influence_map,
    loaded,
    mean_deviation,
    parities,
    representative_pressures,
    shares_of_time,
    stable_part,
)

from ..fem import bodies

# In the mirror plane, along the stiff wall's outside.
POINTS = np.column_stack([np.zeros(6), np.full(6, 3.6), np.linspace(0.4, 3.6, 6)])
TIGHT = NewtonSettings(tolerance=1e-12)
PRESSURES = np.array([0.0, -10.0, 20.0, 20.0])


def materials(mesh, factor=1.0):
    """Stiff where the region is the lattice's; everywhere two laws in parallel, whose moduli add."""
    modulus = factor * np.where(mesh.region == LATTICE, 0.6, 0.2)
    rows = NeoHooke.parameters(modulus, np.full(len(mesh.tets), 0.3))
    return Materials.neo_hooke(modulus, np.full(len(mesh.tets), 0.3)).blended(
        np.full(len(mesh.tets), 0.4), NeoHooke, rows
    )


def solve(mesh, model, factor=1.0):
    solver = Equilibrium(model, materials(mesh, factor), TIGHT)
    return simulate(solver, np.arange(4.0), PRESSURES)


@pytest.fixture(scope="module")
def half():
    """Half a cube under pressure, clamped at z = 0, stiffer on its +y side, so that it bends."""
    mesh = bodies.half_hollow_cube()
    model = Model(mesh)
    return mesh, model, solve(mesh, model)


@pytest.fixture(scope="module")
def found(half):
    mesh, model, baseline = half
    return influence_map(model, materials(mesh), baseline, probe(mesh, POINTS))


def moved(mesh, trajectory):
    monitor = probe(mesh, POINTS)
    return np.array([monitor.displacement(state.u) for state in loaded(trajectory)])


@pytest.fixture(scope="module")
def elements(half):
    """One element of either region, both off the mirror plane."""
    mesh = half[0]
    centre = mesh.nodes[mesh.corners].mean(axis=1)
    off_plane = mesh.nodes[mesh.corners][:, :, 0].min(axis=1) > 0.5
    near = (np.linalg.norm(centre - place, axis=1) for place in ([1.5, 3.5, 2.0], [1.5, 0.5, 3.0]))
    regions = (LATTICE, MEMBRANE)
    return [
        int(np.argmin(np.where(off_plane & (mesh.region == region), distance, np.inf)))
        for region, distance in zip(regions, near, strict=True)
    ]


def test_one_element_of_the_whole_body_made_stiffer_moves_the_points_as_the_map_says(half, found, elements):
    """Central differences of whole-mesh solutions; the map comes from the half mesh's two parities."""
    whole = mirror(half[0], "x")
    model = Model(whole)
    step = 0.02
    for element in elements:
        factor = np.ones(len(whole.tets))
        ends = []
        for sign in (1, -1):
            factor[element] = 1 + sign * step
            ends.append(moved(whole, solve(whole, model, factor)))
        slope = (ends[0] - ends[1]) / (2 * step)
        expected = found.displacement[..., element]
        assert np.abs(expected[:, :, 0]).max() > 1e-2 * np.abs(expected).max()
        np.testing.assert_allclose(slope, expected, atol=2e-4 * np.abs(expected).max())


def test_a_whole_mesh_gives_the_map_of_its_half(half, found):
    mesh, _, _ = half
    whole = mirror(mesh, "x")
    model = Model(whole)
    baseline = solve(whole, model)
    same = influence_map(model, materials(whole), baseline, probe(whole, POINTS))
    m = len(mesh.tets)
    scale = np.abs(found.displacement).max()
    np.testing.assert_allclose(same.displacement[..., :m], found.displacement, atol=1e-6 * scale)
    mirrored = found.displacement * np.array([-1.0, 1, 1])[:, None]
    np.testing.assert_allclose(same.displacement[..., m:], mirrored, atol=1e-6 * scale)


def test_stiffening_everything_and_raising_the_pressure_alike_changes_nothing(half, found):
    """Stresses scale with the modulus: the map summed over all elements is minus the slope by ln p."""
    mesh, model, baseline = half
    total = 2 * found.displacement.sum(axis=-1)[:, :, 1:]
    solver = Equilibrium(model, materials(mesh), TIGHT)
    monitor = probe(mesh, POINTS)
    for s, state in enumerate(loaded(baseline)):
        ends = [
            monitor.displacement(solver.newton(state.u, state.pressure_MPa * f).u)[:, 1:]
            for f in (1.01, 0.99)
        ]
        slope = (ends[0] - ends[1]) / 0.02
        np.testing.assert_allclose(total[s], -slope, atol=1e-3 * np.abs(slope).max())


def test_the_deviation_of_a_slightly_stiffer_element_is_the_map_times_its_stiffening(half, found, elements):
    """J_hat has a kink at Model A: the one-sided slope, both mirror images stiffened."""
    mesh, model, baseline = half
    monitor = probe(mesh, POINTS)
    gradients = gradients_of(baseline, POINTS, monitor, 21)
    step = 1e-3
    for element in elements:
        factor = np.ones(len(mesh.tets))
        factor[element] += step
        stiffer = solve(mesh, model, factor)
        curves = [
            t.of_time(centreline(np.array([POINTS + monitor.displacement(s.u) for s in t.solved]), 21))
            for t in (stiffer, baseline)
        ]
        J = centreline_deviation(*curves).J_hat
        both = attrs.evolve(found, displacement=2 * found.displacement * np.array([0.0, 1, 1])[:, None])
        slope = deviation_map(both, gradients, shares_of_time(baseline))[element]
        assert J / step == pytest.approx(slope, rel=5e-3)


def test_the_map_is_nowhere_negative(half, found):
    mesh, _, baseline = half
    gradients = gradients_of(baseline, POINTS, probe(mesh, POINTS), 21)
    J = deviation_map(found, gradients, shares_of_time(baseline))
    assert 0 <= J.min() < J.max()


def test_shares_of_time_leave_out_rest(half):
    np.testing.assert_allclose(shares_of_time(half[2]), [0.25, 0.5])


def test_the_centreline_moves_with_its_points():
    gradient = centreline_gradient(POINTS + np.arange(6)[:, None] ** 2 * [0, 0.1, 0], 11)
    # A translation of all points moves every station alike.
    np.testing.assert_allclose(gradient.sum(axis=2), np.broadcast_to(np.eye(3), (11, 3, 3)), atol=1e-6)
    moved = np.zeros((1, 6, 3))
    moved[:, :, 0] = 0.3
    assert mean_deviation(gradient[None], moved, np.array([0.5])) == pytest.approx(0.15, rel=1e-6)


def test_the_mirrored_trajectory_is_in_equilibrium(half):
    mesh, _, baseline = half
    whole, states = whole_body(mesh, baseline)
    assert whole.symmetry == ()
    solver = Equilibrium(Model(whole), materials(whole))
    for state in loaded(states):
        again = solver.newton(state.u, state.pressure_MPa)
        assert again.iterations == 0
        assert again.residual < 1e-9


def test_representative_pressures_stand_for_all(half):
    """A state that was left out, from the polynomial through the others."""
    mesh, model, _ = half
    made = materials(mesh)
    pressure = np.array([0.0, -20.0, -10.0, 10.0, 20.0, 30.0])
    baseline = simulate(Equilibrium(model, made), np.arange(6.0), pressure)
    assert representative_pressures(baseline).tolist() == [-0.02, 0.01, 0.03]
    monitor = probe(mesh, POINTS)
    every = influence_map(model, made, baseline, monitor)
    few = influence_map(model, made, baseline, monitor, representative_pressures(baseline)).at(
        every.pressure_MPa
    )
    gradients, weights = gradients_of(baseline, POINTS, monitor, 21), shares_of_time(baseline)
    one, other = (deviation_map(found, gradients, weights) for found in (every, few))
    assert np.abs(one - other).max() < 0.02 * one.max()


def test_other_mirror_planes_are_refused(half):
    mesh = attrs.evolve(half[0], symmetry=("x", "y"))
    with pytest.raises(MeshingError, match="off the plane"):
        parities(attrs.make_class("Body", {"mesh": attrs.field()})(mesh))


def test_what_is_unstable_out_of_its_plane_is_left_out():
    """A column of 1 x 3 x 10 buckles sideways at a strain of pi^2/4800, which its half does not see."""
    mesh = bodies.box((1, 2, 10), (0.5, 3.0, 10.0), symmetry=("x",), clamp=True)
    model = Model(mesh, threads=1)
    material = Materials.neo_hooke(np.ones(len(mesh.tets)), np.zeros(len(mesh.tets)))

    def pressed(euler):
        """Pressed to so many times the strain at which it buckles; the pressure only numbers the state."""
        strain = euler * np.pi**2 / 4800.0
        return State(-0.001 * euler, -strain * mesh.nodes * np.array([0.0, 0.0, 1.0]))

    states = (pressed(1.3), pressed(1.1), pressed(0.9), pressed(0.5), State(0.0, np.zeros_like(mesh.nodes)))
    order = np.array([4, 3, 2, 1, 0, 1, 4])
    pressures = np.array([s.pressure_kPa for s in states])[order]
    found = stable_part(model, material, Trajectory(np.arange(7.0), pressures, states, order, mesh))
    assert found.solved == states[2:]
    assert found.time_s.tolist() == [0.0, 1.0, 2.0, 6.0]
    assert [s.pressure_kPa for s in found.states] == found.pressure_kPa.tolist()
    even, odd = parities(model)
    data = model.parameters(material)
    even.model.factor.factor(even.model.tangent(states[0].u, 0.0, data))
    with pytest.raises(IndefiniteError):
        odd.model.factor.factor(odd.model.tangent(states[0].u, 0.0, data))


def test_an_odd_motion_feels_the_contact_within_a_half_and_none_across_its_plane():
    """Second derivatives of the contact's energy along odd motions: the whole body's is twice the half's."""
    pytest.importorskip("ipctk")
    lower, upper = (bodies.box((2, 2, 1), (1.0, 1.0, 1.0), order=1) for _ in range(2))
    # Vertices face the inside of facets, so that no pair is of two kinds at once.
    above = upper.nodes * 0.4 + np.array([0.13, 0.31, 1.5])
    nodes = np.vstack([lower.nodes, above]) + np.array([0.2, 0.0, 0.0])
    mesh = bodies.make(nodes, np.vstack([lower.tets, upper.tets + len(lower.nodes)]), 1, symmetry=("x",))
    whole = mirror(mesh, "x")
    assert len(whole.nodes) == 2 * len(nodes)
    model = Model(mesh, threads=1)
    model.self_contact = SelfContact(mesh, 0.05, 0.1)
    odd = parities(model)[1].model.self_contact
    both = SelfContact(whole, 0.05, 0.1)
    flip = np.array([-1.0, 1.0, 1.0])
    raised = nodes[:, 2:] > 1.2

    def along(contact, u, v):
        return v.ravel() @ (contact.stiffness(u) @ v.ravel())

    u = np.where(raised, [0.0, 0.0, -0.48], 0.0)
    v = np.random.default_rng(0).standard_normal(nodes.shape)
    expected = along(both, np.vstack([u, u * flip]), np.vstack([v, -v * flip]))
    assert 2 * along(odd, u, v) == pytest.approx(expected, rel=1e-9)
    assert abs(expected) > 1e-3
    # Faces that near their images: along the plane's normal both go alike.
    near = u + np.array([-0.19, 0.0, 0.0])
    together = np.where(raised, 0.0, [1.0, 0.0, 0.0])
    assert along(odd, near, together) == pytest.approx(along(odd, u, together))
    assert along(model.self_contact, near, together) > along(odd, near, together) + 1e-3
