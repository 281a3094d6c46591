"""Branches through limit points against closed forms and against independent ways of finding them."""

import itertools

import attrs
import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import brentq, minimize_scalar
from scipy.sparse.linalg import splu

from mu_addon.errors import ConvergenceError
from mu_addon.fem import time_stepping
from mu_addon.fem.arc_length import ContinuationSettings
from mu_addon.fem.continuation import limit_pressure, trace_branch
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import LDL, IndefiniteError
from mu_addon.fem.indefinite import Inertia
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import RESOLVED_OBSTACLE_NEWTON, NewtonSettings
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Plane, Pose
from mu_addon.fem.state import rest
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.meshing.mesh import boundary_faces, edges_of, mirror

from . import bodies

A, B, NU = 10.0, 11.0, 0.499


def equilibrium(mesh, modulus, poisson, held=None, **options):
    k = len(mesh.tets)
    materials = Materials.neo_hooke(np.full(k, modulus), np.full(k, poisson))
    return Equilibrium(Model(mesh, supports=held, threads=1), materials, NewtonSettings(**options))


def balloon(around=3):
    """A hollow sphere of shear modulus 1 MPa."""
    mesh = bodies.sphere_octant(A, B, around)
    return mesh, equilibrium(mesh, 2 * (1 + NU), NU, max_step_MPa=0.05)


def pressure_of(a):
    """Of an incompressible neo-Hookean sphere, mu = 1, whose inner radius has grown a-fold."""
    b = (1 + (a**3 - 1) * (A / B) ** 3) ** (1 / 3)
    return 2 * ((1 / b + 1 / (4 * b**4)) - (1 / a + 1 / (4 * a**4)))


def arch(cells=12, radius=50.0, half_angle=25.0, thickness=1.5, width=4.0):
    """Half a clamped shallow arch in plane strain; its underside is the cavity's wall, its crown at x = 0."""
    nodes, tets = bodies._grid((cells, 1, 1), (1, 1, 1))
    end = np.deg2rad(half_angle)

    def bend(p):
        r, angle = radius + thickness * (p[:, 1] - 0.5), end * p[:, 0]
        out = np.stack([r * np.sin(angle), r * np.cos(angle) - radius, width * p[:, 2]], axis=1)
        out[np.abs(out) < 1e-9] = 0.0
        return out

    edges, _ = edges_of(tets)
    middles = bend(nodes[edges].mean(axis=1))
    faces, _ = boundary_faces(tets)
    under = faces[(nodes[faces][:, :, 1] == 0).all(axis=1)]

    def clamped(p):
        return abs(np.arctan2(p[0], p[1] + radius) - end) < 1e-6

    return bodies.make(bend(nodes), tets, 2, under, (clamped,), ("x", "z"), lambda m, e: middles)


def far_side(mesh):
    """Supports that hold the face opposite the mirror plane z = 0 in z: plane strain."""
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = mesh.nodes[:, 2] == mesh.nodes[:, 2].max()
    return held


def crown(mesh):
    on = np.flatnonzero((mesh.nodes[:, 0] == 0) & (mesh.nodes[:, 2] == 0))
    return on[mesh.nodes[on, 1].argmax()]


@pytest.fixture(scope="module")
def inflated():
    mesh, body = balloon()
    empty = body.model.cavity_volume(np.zeros_like(mesh.nodes))
    settings = ContinuationSettings(first_step_MPa=0.01)
    return body, empty, trace_branch(body, rest(mesh), until_mm3=2.2**3 * empty, settings=settings)


def test_a_balloon_follows_its_closed_form_through_the_limit_point(inflated):
    _, empty, branch = inflated
    stretch = (branch.volume_mm3 / empty) ** (1 / 3)
    assert stretch[-1] == pytest.approx(2.2, rel=1e-9)
    assert branch.ended == "volume reached"
    np.testing.assert_allclose(branch.pressure_MPa[1:], pressure_of(stretch[1:]), rtol=0.005)
    assert max(p.state.residual for p in branch.points) <= 1e-9


def test_the_limit_point_is_where_the_closed_form_peaks(inflated):
    _, empty, branch = inflated
    best = minimize_scalar(lambda a: -pressure_of(a), bounds=(1.05, 3), method="bounded").x
    (limit,) = branch.criticals
    assert limit.kind == "limit point"
    assert limit.state.pressure_MPa == pytest.approx(pressure_of(best), rel=0.003)
    assert (limit.volume_mm3 / empty) ** (1 / 3) == pytest.approx(best, rel=0.001)
    assert limit.accuracy_MPa <= 1e-6 * limit.state.pressure_MPa
    assert limit.state.pressure_MPa >= branch.pressure_MPa.max() - limit.accuracy_MPa
    # All of the sphere yields: the mode is radial and even.
    size = np.linalg.norm(limit.mode, axis=1)
    assert size.max() == pytest.approx(1.0)
    assert size.min() > 0.8


def test_a_balloon_past_its_limit_is_stable_only_at_a_given_volume(inflated):
    _, _, branch = inflated
    peak = branch.pressure_MPa.argmax()
    rising = np.array([p.slope > 0 for p in branch.points])
    np.testing.assert_array_equal(branch.negative, np.where(rising, 0, 1))
    assert rising[: peak + 1 - (not rising[peak])].all()
    assert not rising[peak + 1 :].any()
    assert all(p.stable == r for p, r in zip(branch.points, rising, strict=True))
    # Where not pressure but volume is held, the one mode lost is the one that volume holds.
    assert all(p.negative == int(p.compliance < 0) for p in branch.points)


def test_what_stops_load_stepping_is_named(inflated):
    _, _, branch = inflated
    mesh, body = balloon()
    states = []
    with pytest.raises(ConvergenceError, match="limit point"):
        body.path(np.arange(0.02, 0.2, 0.02), rest(mesh), states.append)
    assert limit_pressure(body, states[0], toward=0.06) is None
    limit = limit_pressure(body, states[-1], toward=0.2)
    assert limit.kind == "limit point"
    assert limit.state.pressure_MPa == pytest.approx(branch.criticals[0].state.pressure_MPa, rel=1e-5)
    assert "limit point at 117.8 kPa near (" in str(limit)


def test_a_branch_lands_on_the_state_that_load_stepping_finds():
    mesh, body = balloon(2)
    branch = trace_branch(
        body, rest(mesh), until_MPa=0.08, settings=ContinuationSettings(first_step_MPa=0.01)
    )
    assert branch.ended == "pressure reached"
    assert branch.pressure_MPa[-1] == pytest.approx(0.08, rel=1e-12)
    stepped = body.path([0.08], rest(mesh))[-1]
    np.testing.assert_allclose(branch.points[-1].state.u, stepped.u, atol=1e-6)


def test_a_collapsing_arch_is_the_one_that_displacement_control_finds():
    """Suck an arch through both its limit points; Newton's method with the crown's height given agrees."""
    mesh = arch()
    body = equilibrium(mesh, 1.0, 0.3, far_side(mesh))
    settings = ContinuationSettings(first_step_MPa=1e-4)
    branch = trace_branch(body, rest(mesh), until_MPa=-4e-4, settings=settings)
    assert [c.kind for c in branch.criticals] == ["limit point", "limit point"]
    assert branch.criticals[0].state.pressure_MPa < 2 * branch.criticals[1].state.pressure_MPa
    assert branch.negative.max() == 1
    assert branch.negative[-1] == 0
    assert branch.pressure_MPa[-1] == pytest.approx(-4e-4, rel=1e-12)

    model, m, top = body.model, body.parameters, 3 * crown(mesh) + 1
    pick = (model.free == top).astype(float)[:, None]
    u, pressure = np.zeros_like(mesh.nodes), 0.0
    found = []
    heights = np.array([p.state.u.ravel()[top] for p in branch.points])
    for start, end in itertools.pairwise(heights):
        for height in np.linspace(start, end, 5)[1:]:
            for _ in range(12):
                force = model.residual(u, pressure, m).ravel()[model.free]
                by_pressure = model.residual(u, pressure + 1.0, m).ravel()[model.free] - force
                K = model.matrix(model.tangent(u, pressure, m))
                bordered = sparse.bmat([[K, by_pressure[:, None]], [pick.T, None]]).tocsc()
                step = splu(bordered).solve(np.append(-force, height - u.ravel()[top]))
                u.ravel()[model.free] += step[:-1]
                pressure += step[-1]
        found.append(pressure)
    np.testing.assert_allclose(branch.pressure_MPa[1:], found, rtol=1e-7)


def test_damped_motion_turns_an_arch_over_that_bears_its_load_no_more():
    """From its midline's mirror image, which is on the other side already, it comes to the same state."""
    mesh = arch()
    body = equilibrium(mesh, 1.0, 0.3, far_side(mesh))
    model = body.model
    model.load = np.zeros_like(mesh.nodes)
    model.load[crown(mesh), 1] = -0.01
    with pytest.raises(ConvergenceError):
        body.newton(rest(mesh).u, 0.0, reach_mm=1.0)
    found = body.settled(rest(mesh).u, 0.0)
    feet = mesh.nodes[mesh.base, 1].mean()
    turned = np.zeros_like(mesh.nodes)
    turned[:, 1] = 2 * (feet + 50.0 - np.sqrt(50.0**2 - mesh.nodes[:, 0] ** 2))
    turned[mesh.base] = 0.0
    over = body.settled(turned, 0.0)
    assert found.u[crown(mesh), 1] < 1.5 * feet
    assert np.abs(found.u - over.u).max() < 1e-6
    assert body.newton(found.u, 0.0).iterations == 0


@pytest.mark.slow
def test_a_motion_in_time_goes_on_beyond_a_limit_point(monkeypatch):
    """A loaded arch whose prop is drawn away at once turns over and falls on it, lower down."""
    # Newton's method would find the arch on the other side by itself, and not tell.
    monkeypatch.setattr(time_stepping, "LEAP", 1e-3)
    mesh = arch()
    mesh = attrs.evolve(mesh, cavity=mesh.cavity[:0])
    model = Model(mesh, supports=far_side(mesh), threads=1)
    prop = Obstacle(
        mesh,
        Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)),
        4e-4,
        0.01,
        friction=0.3,
        path=lambda t: Pose(shift=(0.0, -5.0 * (t > 1.0), 0.0)),
    )
    model.obstacles = (prop,)
    model.load = np.zeros_like(mesh.nodes)
    model.load[crown(mesh), 1] = -0.01
    body = Equilibrium(model, bodies.uniform(mesh, 1.0, 0.3), RESOLVED_OBSTACLE_NEWTON, explains=False)
    times, none = np.array([0.0, 1.0, 2.0]), np.zeros(3)
    before, _, after = simulate_in_time(body, times, none).states
    assert before.snapped_mm == 0.0
    assert after.snapped_mm > 3.0
    contact = prop.contact(after.u)
    assert contact.normal_N[1] < -1e-3
    assert np.hypot(*contact.tangential_N[[0, 2]]) < 0.3 * -contact.normal_N[1]
    reaction = model.residual(after.u, 0.0, body.parameters)[mesh.base, 1].sum()
    assert reaction - contact.force_N[1] == pytest.approx(0.01, rel=1e-6)
    # Without friction there is one place to lie, whatever the way there.
    prop.friction = 0.0
    again, otherwise = (body.settled(state.u, 0.0) for state in (after, before))
    assert np.abs(again.u - otherwise.u).max() < 1e-6
    prop.friction, body.settings = 0.3, attrs.evolve(body.settings, follow_snaps=False)
    with pytest.raises(ConvergenceError, match="no equilibrium at"):
        simulate_in_time(body, times, none)


def test_a_whole_arch_buckles_sideways_before_its_limit_point():
    """The half arch cannot; its tangent under the antisymmetric mode's supports says when the whole does."""
    half = arch()
    whole = mirror(half, "x")
    settings = ContinuationSettings(first_step_MPa=1e-4, max_points=8)
    branches = {}
    for name, mesh in (("half", half), ("whole", whole)):
        body = equilibrium(mesh, 1.0, 0.3, far_side(mesh))
        branches[name] = trace_branch(body, rest(mesh), toward=-1, settings=settings)
    buckling, limit = branches["whole"].criticals[:2]
    assert (buckling.kind, limit.kind) == ("bifurcation", "limit point")
    assert branches["half"].criticals[0].kind == "limit point"
    assert limit.state.pressure_MPa == pytest.approx(
        branches["half"].criticals[0].state.pressure_MPa, rel=1e-5
    )
    # At the bifurcation another branch leaves this one sideways: the crown does not move down.
    top = crown(whole)
    assert abs(buckling.mode[top, 1]) < 1e-4
    assert abs(buckling.mode[top, 0]) > 0.05

    # The same mesh without its mirror plane x = 0, held there as an antisymmetric mode is.
    held = far_side(half)
    held[half.symmetry_nodes("x"), 1:] = True
    free_of_x = type(half)(half.nodes, half.tets, half.region, half.cavity, half.base, [], ("z",))
    sideways = equilibrium(free_of_x, 1.0, 0.3, held)
    body = equilibrium(half, 1.0, 0.3, far_side(half), max_step_MPa=5e-5, min_step_MPa=1e-6)

    def least(pressure):
        u = body.path([pressure], rest(half))[-1].u
        K = sideways.model.matrix(sideways.model.tangent(u, pressure, sideways.parameters))
        return np.linalg.eigvalsh(K.toarray())[0]

    expected = brentq(least, -2.0e-4, -2.302e-4, xtol=1e-11)
    assert buckling.state.pressure_MPa == pytest.approx(expected, rel=1e-4)


def shifted():
    """A model and its tangent less a multiple of the identity, with five negative eigenvalues."""
    model = Model(bodies.hollow_box(1, n=3), threads=1)
    k = len(model.mesh.tets)
    m = model.parameters(Materials.neo_hooke(np.full(k, 0.6), np.full(k, 0.4)))
    values = model.tangent(np.zeros_like(model.mesh.nodes), 0.0, m)
    exact = np.linalg.eigvalsh(model.matrix(values).toarray())
    return model, values, exact


def test_ldl_counts_negative_eigenvalues_and_solves():
    model, values, exact = shifted()
    pattern = model.pattern
    factor = LDL(pattern.indptr, pattern.indices, pattern.order)
    b = np.random.default_rng(0).standard_normal((len(model.free), 2))
    for count in (0, 1, 5, 40):
        moved = values.copy()
        moved[pattern.indptr[:-1]] -= (exact[count - 1] + exact[count]) / 2 if count else 0.0
        factor.factor(moved)
        assert factor.negative == count
        np.testing.assert_allclose(model.matrix(moved) @ factor.solve(b), b, atol=1e-10)
        np.testing.assert_allclose(factor.solve(b[:, 0]), factor.solve(b)[:, 0], rtol=1e-9, atol=1e-12)


def test_springs_give_the_same_inertia_and_solution_as_ldl():
    model, values, exact = shifted()
    inertia = Inertia(model)
    b = np.random.default_rng(1).standard_normal((len(model.free), 2))
    assert inertia.factor(values).negative == 0
    for count in (1, 2, 3, 2, 1, 0):
        moved = values.copy()
        moved[model.pattern.indptr[:-1]] -= (exact[count - 1] + exact[count]) / 2 if count else 0.0
        # Once by L D L^T where no springs are known, then by springs.
        for _ in range(2):
            assert inertia.factor(moved).negative == count
            np.testing.assert_allclose(model.matrix(moved) @ inertia.solve(b), b, atol=1e-9)
        assert inertia._engine is model.factor
        stiffness, modes = inertia.modes(2)
        K = model.matrix(moved)
        np.testing.assert_allclose(K @ modes, modes * stiffness, atol=1e-6)


def test_a_singular_tangent_is_refused():
    model, values, _ = shifted()
    with pytest.raises(ArithmeticError):
        Inertia(model).factor(np.zeros_like(values))


def test_a_hasty_factorisation_does_without_ldl():
    model, values, _ = shifted()
    with pytest.raises(IndefiniteError):
        Inertia(model).factor(-values, thorough=False)


def test_a_branch_must_start_at_an_equilibrium():
    mesh, body = balloon(2)
    start = rest(mesh)
    with pytest.raises(ConvergenceError, match="converged state"):
        trace_branch(body, type(start)(0.01, start.u))


def test_a_branch_that_cannot_be_followed_says_where():
    mesh, body = balloon(2)
    with pytest.raises(ConvergenceError, match=r"beyond 0 kPa and .* mm3") as caught:
        trace_branch(body, rest(mesh), settings=ContinuationSettings(max_iterations=1))
    assert "mm" in caught.value.where
