"""Adjoint map of a trajectory: displacement of the monitored points by each element's stiffness."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MeshingError
from ..fem.embedding import Probe
from ..fem.factor import IndefiniteError
from ..fem.materials import Materials
from ..fem.model import MaterialData, Model
from ..fem.state import State
from ..fem.trajectory import Trajectory
from ..meshing.mesh import Mesh
from .deviation import centreline
from .sampling import polynomials

# Step in mm for the centreline's derivative by its points; the spline is smooth, so that the error is
# of the order of its square.
_STEP = 1e-4


@attrs.frozen(eq=False)
class Parity:
    """The responses of a body with a mirror plane x = 0 that are even in x, or those that are odd.

    components: 0 to 2, of the displacement of points on the plane, that this parity allows.
    """

    model: Model
    components: tuple[int, ...]
    odd: bool


def parities(model: Model) -> list[Parity]:
    """The responses of a whole body about a state of its model, which may be of one half.

    A load on one side of the mirror plane is half an even and half an odd load. Both tangents are those of
    the half mesh, with different supports on the plane. In an odd motion a point in contact with its image
    moves with it, so that contact across the plane does not enter that tangent. Raises MeshingError for a
    mesh with other mirror planes.
    """
    mesh = model.mesh
    if not mesh.symmetry:
        return [Parity(model, (0, 1, 2), False)]
    if mesh.symmetry != ("x",):
        raise MeshingError("paths off the plane need a half or a whole mesh", f"mirrors: {mesh.symmetry}")
    held = np.zeros((len(mesh.nodes), 3), bool)
    held[mesh.symmetry_nodes("x"), 1:] = True
    # Sections there turn about y and z, as they do not in an even motion.
    ends = mesh.beams.reshape(-1, 2)
    held[ends[mesh.nodes[ends[:, 0], 0] == 0.0, 1], 0] = True
    whole = attrs.evolve(mesh, symmetry=())
    other = Model(whole, supports=held, device=model.device, threads=model.threads)
    if model.self_contact is not None:
        other.self_contact = model.self_contact.without_image()
    return [Parity(model, (1, 2), False), Parity(other, (0,), True)]


def probe_loads(mesh: Mesh, monitor: Probe, components: Sequence[int]) -> Array:
    """Nodal loads (3n, p, c) whose work is the displacement of p monitored points along c components.

    components: numbers 0 to 2 of the axes. A load is 1 N on the point, shared among its element's nodes;
    `Model.passed_on` moves the forces on nodes that follow others.
    """
    points = len(monitor.nodes)
    loads = np.zeros((3 * len(mesh.nodes), points, len(components)))
    for i in range(points):
        for c, component in enumerate(components):
            np.add.at(loads[:, i, c], 3 * monitor.nodes[i] + component, monitor.weights[i])
    return loads


def loaded(trajectory: Trajectory, pressures_MPa: Array | None = None) -> list[State]:
    """A trajectory's states under pressure or weight; the undeformed one is left out.

    pressures_MPa (t,): take only those at these pressures.
    """
    states = [state for state in trajectory.solved if state.loaded]
    if pressures_MPa is None:
        return states
    return [s for s in states if np.isclose(s.pressure_MPa, pressures_MPa, rtol=1e-9).any()]


def stable_part(
    model: Model, materials: Materials, trajectory: Trajectory, sides: list[Parity] | None = None
) -> Trajectory:
    """The trajectory without states that are unstable, also against motions that break the mirror symmetry.

    A half mesh contains symmetric motions only.
    """
    sides = parities(model) if sides is None else sides
    data = model.parameters(materials)

    def stable(state: State) -> bool:
        try:
            for side in sides:
                # The tangent first: where contact adds pairs, its pattern grows, and with it the factor.
                tangent = side.model.tangent(state.u, state.pressure_MPa, data)
                side.model.factor.factor(tangent)
        except IndefiniteError:
            return False
        return True

    out: set[int] = set()
    for sign in (-1.0, 1.0):
        outward = [i for i, s in enumerate(trajectory.solved) if s.loaded and sign * s.pressure_MPa > 0]
        for i in sorted(outward, key=lambda i: -sign * trajectory.solved[i].pressure_MPa):
            if stable(trajectory.solved[i]):
                break
            out.add(i)
    kept = [i for i in range(len(trajectory.solved)) if i not in out]
    holds = np.isin(trajectory.index, kept)
    return attrs.evolve(
        trajectory,
        time_s=trajectory.time_s[holds],
        pressure_kPa=trajectory.pressure_kPa[holds],
        solved=tuple(trajectory.solved[i] for i in kept),
        index=np.searchsorted(kept, trajectory.index[holds]),
    )


def representative_pressures(trajectory: Trajectory) -> Array:
    """Pressures (t,) in MPa, ascending, of three of a trajectory's loaded states that represent all.

    The least, the largest, and the one nearest two thirds between them; also 0 if the unit deviates there by
    its weight. Over the grasp protocol J_hat by `polynomials` through these was within 0.4 % of that with
    each pressure solved for.
    """
    pressures = np.array([state.pressure_MPa for state in loaded(trajectory)])
    low, high = pressures.min(), pressures.max()
    middle = pressures[np.argmin(np.abs(pressures - (low + 2 * high) / 3))]
    return np.unique([low, middle, high, *pressures[pressures == 0]])


@attrs.frozen(eq=False)
class Influence:
    """Displacement (s, p, 3, m) in mm of p points in s states by each element's stiffening, to first order.

    pressure_MPa (s,): of the states. A value is the change for one element of the whole body made stiffer by
    the factor 1 + e, divided by e; an element of a half mesh counts without its mirror image.
    """

    pressure_MPa: Array
    displacement: Array

    def at(self, pressures_MPa: Array) -> Influence:
        """The map at other pressures (t,) in MPa, by `polynomials` through its own."""
        weights = polynomials(self.pressure_MPa, pressures_MPa)
        return Influence(np.asarray(pressures_MPa), np.tensordot(weights, self.displacement, axes=1))


def influence_map(
    model: Model,
    materials: Materials,
    trajectory: Trajectory,
    monitor: Probe,
    pressures_MPa: Array | None = None,
    sides: list[Parity] | None = None,
) -> Influence:
    """First-order displacement of p monitored points by the stiffening of m elements, in s states.

    In each state K lambda = probe is solved for every monitored point and component (adjoint method);
    stiffening an element whose internal force is f then moves the point by -lambda f. Linear in the weights
    of the element's laws. trajectory: of Model A; monitor: probe of p points; pressures_MPa: the states to
    take, by default all under pressure or weight; sides: `parities(model)`. Raises IndefiniteError at an
    unstable state, and MeshingError as `parities`.
    """
    mesh = model.mesh
    sides = parities(model) if sides is None else sides
    states = loaded(trajectory, pressures_MPa)
    data = model.parameters(materials)
    found = np.zeros((len(states), len(monitor.nodes), 3, len(mesh.tets)))
    for s, state in enumerate(states):
        forces = model.element_forces(state.u, data).reshape(len(mesh.tets), -1)
        for side in sides:
            free = side.model.free
            loads = probe_loads(mesh, monitor, side.components)
            given = loads.shape[1:]
            loads = side.model.passed_on(state.u, loads.reshape(len(loads), -1))
            tangent = side.model.tangent(state.u, state.pressure_MPa, data)
            solved = np.zeros_like(loads)
            solved[free] = side.model.factor.factor(tangent).solve(loads[free])
            followed = side.model.passed_back(state.u, solved).reshape(len(mesh.nodes), 3, -1)
            adjoint = followed[mesh.tets].reshape(*forces.shape, -1)
            moved = np.einsum("ei,eic->ce", forces, adjoint)
            moved += of_beams(model, state.u, data, followed)
            moved = moved.reshape(*given, -1)
            found[s][:, list(side.components)] = -moved / len(sides)
    return Influence(np.array([state.pressure_MPa for state in states]), found)


def of_beams(model: Model, u: Array, data: MaterialData, moved: Array) -> Array:
    """Work (c, m) in mJ of the elements that beams replace on displacements `moved` (n, 3, c) in mm.

    Each gets the share of its beam's work that it has of its volume.
    """
    mesh = model.mesh
    found = np.zeros((moved.shape[2], len(mesh.tets)))
    if data.beams is None:
        return found
    forces = data.beams.forces(u[mesh.beams].reshape(len(mesh.beams), 12))
    work = np.einsum("ei,eic->ce", forces, moved[mesh.beams].reshape(len(mesh.beams), 12, -1))
    part = np.flatnonzero(~mesh.solid)
    of, volume = mesh.beam_of[part], model.volumes[part]
    share = volume / np.bincount(of, volume, len(mesh.beams))[of]
    found[:, part] = work[:, of] * share
    return found


def centreline_gradient(points: Array, stations: int) -> Array:
    """Derivative (j, 3, p, 3) of the centreline's j stations by the points (p, 3) in mm it goes through.

    By central differences of 1e-4 mm.
    """
    shifts = _STEP * np.eye(points.size).reshape(-1, *points.shape)
    ahead, behind = (centreline(points + sign * shifts, stations) for sign in (1, -1))
    return np.asarray((ahead - behind) / (2 * _STEP)).transpose(1, 2, 0).reshape(stations, 3, *points.shape)


def mean_deviation(gradients: Array, moved: Array, weights: Array) -> Array:
    """J_hat (...,) in mm, to first order, of displacements (..., s, p, 3) of the monitored points.

    gradients (s, j, 3, p, 3) of the centreline in every state; weights (s,) share of the instants of each
    state.
    """
    total = np.zeros(moved.shape[:-3])
    # State by state, for there are as many displacements as elements or paths.
    for s, (gradient, weight) in enumerate(zip(gradients, weights, strict=True)):
        delta = np.tensordot(moved[..., s, :, :], gradient, axes=((-2, -1), (2, 3)))
        total += weight * np.linalg.norm(delta, axis=-1).mean(axis=-1)
    return total


def shares_of_time(trajectory: Trajectory) -> Array:
    """Share (s,), 0 to 1, of a trajectory's instants for each loaded state."""
    count = np.bincount(trajectory.index, minlength=len(trajectory.solved)) / len(trajectory.index)
    return count[[state.loaded for state in trajectory.solved]]


def gradients_of(trajectory: Trajectory, points: Array, monitor: Probe, stations: int) -> Array:
    """`centreline_gradient` (s, j, 3, p, 3) about the monitored points of every loaded state.

    points (p, 3) in mm at rest, monitor their probe; stations: the number j.
    """
    return np.array(
        [centreline_gradient(points + monitor.displacement(s.u), stations) for s in loaded(trajectory)]
    )


def deviation_map(found: Influence, gradients: Array, weights: Array) -> Array:
    """dJ_hat (m,) in mm by each element's relative stiffening, alone, about Model A.

    gradients (s, j, 3, p, 3), weights (s,): as `mean_deviation` has them. J_hat is a mean of distances and
    has a kink at Model A, where all of them are 0. This is its slope toward stiffening, which is never
    negative.
    """
    return mean_deviation(gradients, np.moveaxis(found.displacement, -1, 0), weights)
