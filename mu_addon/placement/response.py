"""Reduced, linear response of a unit to a path of stiff steps, without solving for the path.

An inclusion a hundred times stiffer than the lattice is far beyond a first-order map. Its strain stays small,
so its forces are linear in the displacement of its co-rotated elements, and the rest of the unit responds
nearly linearly about Model A. Each step of the graph gets a few patterns of strain. Their forces are applied
to Model A's tangent once; any chain of steps is then a small dense system.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np
from scipy import sparse

from ..errors import InputError
from ..fem.elementwise import element_stiffness, rotations
from ..fem.factor import Cholesky, SuperLU
from ..fem.kinematics import Probe
from ..fem.laws import NeoHooke
from ..fem.materials import Layer, Materials
from ..fem.model import Model
from ..fem.state import State
from ..fem.trajectory import Trajectory
from ..fem.triangular import Triangular
from ..meshing.mesh import LATTICE, Mesh
from .graph import Graph
from .inclusion import straight_inclusion
from .sampling import polynomials
from .sensitivity_map import loaded, parities, probe_loads, representative_pressures

Array = np.ndarray[Any, Any]

# Patterns solved at once, so that their solutions need not all be held.
BLOCK = 128
# A step of a longer path is pulled at its ends by its neighbours: its pattern of stretch is that of a
# bar that goes on by this share of its length at the first end, the second, or both.
_BEYOND = 0.5
# Energy of a pattern, as a share of the largest, below which it is a combination of the others.
_DEPENDENT = 1e-9


@attrs.frozen(eq=False)
class Patterns:
    """A step's strain patterns at rest: the forces (e, 3k, q) of the sensor on its elements' nodes (e,).

    Scaled so that the sensor's stiffness between two patterns is 1 for each with itself and 0 otherwise.
    """

    elements: Array
    force: Array


@attrs.frozen(eq=False)
class Response:
    """Reduced response of a unit to any chain of its graph's steps.

    For each of s states, at pressure_MPa (s,): flexibility (s, parities, q, q) between all patterns, drive
    (s, q) the work of each pattern's forces under Model A's deformation, and reach (s, p, 3, q), the
    displacement in mm of the monitored points. stiffness (q,): the sensor's own, pattern by pattern; each
    representative step has as many `patterns`. step (e,) and side (e,) of every step of the graph: index of
    its representative, and its side of the mirror plane, 0 if in it. odd: mask of the odd parities.
    """

    graph: Graph
    pressure_MPa: Array
    flexibility: Array
    drive: Array
    reach: Array
    stiffness: Array
    patterns: int
    step: Array
    side: Array
    odd: tuple[bool, ...]

    def displacements(
        self, chains: Sequence[tuple[int, ...]], pressures_MPa: Array, block: int = 512
    ) -> Array:
        """Displacement (c, t, p, 3) in mm of the monitored points by each of c chains, against Model A.

        pressures_MPa (t,): the response is a polynomial in the pressure through its states and through 0,
        where the deviation is 0. block: chains solved at once. Raises KeyError for a chain that is not the
        graph's.
        """
        moved = self._at_states(chains, block)
        return np.einsum("ts,cspi->ctpi", polynomials(self.pressure_MPa, pressures_MPa), moved)

    def _at_states(self, chains: Sequence[tuple[int, ...]], block: int) -> Array:
        found = np.empty((len(chains), len(self.pressure_MPa), *self.reach.shape[1:3]))
        steps = [self.graph.steps_of(chain) for chain in chains]
        length = np.array([len(s) for s in steps])
        for count in np.unique(length):
            rows = np.flatnonzero(length == count)
            for part in np.array_split(rows, -(-len(rows) // block)):
                found[part] = self._of_equal_length(np.array([steps[i] for i in part]))
        return found

    def _of_equal_length(self, steps: Array) -> Array:
        """Displacement (c, s, p, 3) in mm by chains of as many steps each, (c, h)."""
        k = self.patterns
        chains = len(steps)
        of, side = self.step[steps], np.repeat(self.side[steps], k, axis=1)
        rows = (of[:, :, None] * k + np.arange(k)).reshape(chains, -1)
        signs = [side if odd else np.ones_like(side) for odd in self.odd]
        found = np.empty((chains, len(self.pressure_MPa), *self.reach.shape[1:3]))
        for s in range(len(self.pressure_MPa)):
            system = np.zeros((*rows.shape, rows.shape[1]))
            system[:, range(rows.shape[1]), range(rows.shape[1])] = self.stiffness[rows]
            for sign, flexibility in zip(signs, self.flexibility[s], strict=True):
                coupled = flexibility[rows[:, :, None], rows[:, None, :]]
                system += sign[:, :, None] * sign[:, None, :] * coupled
            force = np.linalg.solve(system, self.drive[s][rows][:, :, None])[:, :, 0]
            reach = self.reach[s][:, :, rows]
            if any(self.odd):
                reach = reach * np.where(np.arange(3)[:, None, None] == 0, side, 1.0)
            found[:, s] = -np.einsum("pick,ck->cpi", reach, force)
        return found


def reduced_response(
    model: Model,
    materials: Materials,
    sensor_MPa: float,
    trajectory: Trajectory,
    monitor: Probe,
    graph: Graph,
    radius_mm: float,
) -> Response:
    """Linear response of a unit to any chain of steps of its lattice graph, by a few strain patterns a step.

    model, materials, trajectory: Model A. sensor_MPa, radius_mm: of the sensor, as in `evaluate`. monitor:
    probe of the backbone's p points. The states are those of `representative_pressures`. Raises InputError if
    a step touches no element, IndefiniteError at an unstable state.
    """
    mesh = model.mesh
    sides = parities(model)
    states = loaded(trajectory, representative_pressures(trajectory))
    step, side, kept = _represented(graph, mirrored=len(sides) > 1)
    patterns = _patterns(model, materials, sensor_MPa, graph, kept, radius_mm)
    k = patterns[0].force.shape[2]
    # A pattern in the mirror plane is whole only with its image, one beside it on its own.
    whole = np.where(side[kept] == 0, len(sides), 1.0)
    data = model.parameters(materials)
    q = k * len(kept)
    flexibility = np.zeros((len(states), len(sides), q, q))
    drive = np.zeros((len(states), q))
    reach = np.zeros((len(states), len(monitor.nodes), 3, q))
    for s, state in enumerate(states):
        forces, drive[s] = _turned(mesh, state, patterns, whole)
        for i, parity in enumerate(sides):
            free = parity.model.free
            tangent = parity.model.tangent(state.u, state.pressure_MPa, data)
            solve = solver_of(parity.model, tangent)
            loads = probe_loads(mesh, monitor, parity.components)
            given = loads.shape[1:]
            loads = parity.model.passed_on(state.u, loads.reshape(len(loads), -1))[free].reshape(-1, *given)
            # What lies in the mirror plane has no odd part.
            active = np.flatnonzero(np.repeat(side[kept] != 0, k)) if parity.odd else np.arange(q)
            applied = parity.model.passed_on(state.u, forces)[free][:, active].tocsc()
            for columns in np.array_split(np.arange(len(active)), -(-len(active) // BLOCK)):
                solved = solve(applied[:, columns].toarray().T).T / len(sides)
                where = active[columns]
                flexibility[s, i][np.ix_(active, where)] = applied.T @ solved
                moved = np.einsum("fpc,fk->pck", loads, solved)
                for component, along in zip(parity.components, moved.transpose(1, 0, 2), strict=True):
                    reach[s, :, component, where] = along.T
    pressure = np.array([state.pressure_MPa for state in states])
    odd = tuple(parity.odd for parity in sides)
    return Response(graph, pressure, flexibility, drive, reach, np.repeat(whole, k), k, step, side, odd)


def solver_of(model: Model, tangent: Array) -> Callable[[Array], Array]:
    """Return a function that solves with a tangent for right-hand sides (k, n), together if possible."""
    factor = model.factor.factor(tangent)
    if isinstance(factor, Cholesky | SuperLU):
        return Triangular(factor.lower(), threads=model.threads).solve
    return lambda b: factor.solve(b.T).T


def _represented(graph: Graph, mirrored: bool) -> tuple[Array, Array, Array]:
    """Index of the representative and own side (e,) of every step, and the representatives (r,).

    In a half mesh, the one of two mirror images at x > 0 represents both.
    """
    if not mirrored:
        every = np.arange(len(graph.steps))
        return every, np.ones(len(every)), every
    x = graph.nodes[graph.steps][:, :, 0]
    side = np.sign(x.sum(axis=1).round(9))
    kept = np.flatnonzero(side >= 0)
    place = np.full(len(graph.steps), -1)
    place[kept] = np.arange(len(kept))
    for other in np.flatnonzero(side < 0):
        place[other] = place[graph.steps_of(tuple(graph.image[graph.steps[other]]))[0]]
    return place, side, kept


def _patterns(
    model: Model,
    materials: Materials,
    sensor_MPa: float,
    graph: Graph,
    steps: Array,
    radius_mm: float,
) -> list[Patterns]:
    """Strain patterns of some steps (r,): six uniform strains, and stretch passed on to neighbours.

    Each is relaxed inside the elements that the step touches, so that the inclusion resists it as in a
    lattice under uniform strain far away.
    """
    mesh = model.mesh
    corners, lattice = mesh.nodes[mesh.corners], mesh.region == LATTICE
    at_rest = np.zeros_like(mesh.nodes)
    data = model.parameters(materials)
    surroundings = model.matrix(model.tangent(at_rest, 0.0, data)).tocsr()
    number = np.full(mesh.nodes.size, -1)
    number[model.free] = np.arange(len(model.free))

    def share(start: Array, end: Array) -> Array:
        return straight_inclusion(corners, lattice, start, end, radius_mm).share

    bars = []
    for start, end in graph.nodes[graph.steps[steps]]:
        beyond = _BEYOND * (end - start)
        own, before, after = share(start, end), share(start - beyond, start), share(end, end + beyond)
        shares = [own, own + before, own + after, own + before + after]
        bars.append([_filled(np.minimum(s, 1.0)) for s in shares])
        if not own.any():
            place = tuple(((start + end) / 2).round(2).tolist())
            raise InputError("a step of the graph touches no lattice element", f"near {place} mm")
    elements = np.unique(np.concatenate([e for bar in bars for e, _ in bar]))
    added = _added_stiffness(model, materials, sensor_MPa, elements)
    found = []
    for bar, (start, end) in zip(bars, graph.nodes[graph.steps[steps]], strict=True):
        strains = _strains(mesh.nodes, start, end)
        if "x" in mesh.symmetry and start[0] == end[0] == 0:
            # In the mirror plane only what the half mesh can do: no shear out of it.
            strains[mesh.symmetry_nodes("x"), 0] = 0.0
        own, filled = bar[0]
        parts = []
        for i, (e, weight) in enumerate(bar):
            stiffness = weight[:, None, None] * added[np.searchsorted(elements, e)]
            fields = strains if i == 0 else strains[:, :, :1]
            relaxed = _relaxed(mesh, surroundings, number, e, stiffness, fields)
            parts.append(relaxed[np.isin(e, own)])
        stiffness = filled[:, None, None] * added[np.searchsorted(elements, own)]
        displacement = np.concatenate(parts, axis=2)
        found.append(Patterns(own, _independent(displacement, stiffness)))
    return found


def _filled(share: Array) -> tuple[Array, Array]:
    """Elements (e,) that a bar fills, of their shares (m,), and the share of each (e,)."""
    elements = np.flatnonzero(share)
    return elements, share[elements]


def _independent(displacement: Array, stiffness: Array) -> Array:
    """Forces (e, 3k, q) of the given patterns, made orthogonal and of unit energy.

    Where some depend on others, as those of a step whose neighbours touch no further element do, as many are
    zero.
    """
    force = stiffness @ displacement
    energy, turn = np.linalg.eigh(np.einsum("eiq,eir->qr", displacement, force))
    kept = energy > _DEPENDENT * energy[-1]
    return force @ (turn * np.where(kept, 1.0, 0.0) / np.sqrt(np.where(kept, energy, 1.0)))


def _added_stiffness(model: Model, materials: Materials, sensor_MPa: float, elements: Array) -> Array:
    """Change of stiffness (e, 3k, 3k) in N/mm at rest when elements get the sensor's material."""
    every = np.arange(len(model.mesh.tets))
    _, poisson = materials.small_strain(len(every))
    parameters = NeoHooke.parameters(np.full(len(every), sensor_MPa), poisson)
    sensor = Materials((Layer(NeoHooke, every, parameters),))
    at_rest = np.zeros_like(model.mesh.nodes)
    ours, theirs = (
        element_stiffness(model, at_rest, model.parameters(m), elements) for m in (sensor, materials)
    )
    return ours - theirs


def _strains(x: Array, start: Array, end: Array) -> Array:
    """Displacements (n, 3, 6) of points (n, 3) under a step's uniform strains, first its stretch."""
    way = (end - start) / np.linalg.norm(end - start)
    first = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    first /= np.linalg.norm(first)
    frame = np.stack([way, first, np.cross(way, first)])
    local = (x - (start + end) / 2) @ frame.T / np.linalg.norm(end - start)
    found = np.empty((*x.shape, 6))
    for i, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        strain = (np.outer(frame[a], frame[b]) + np.outer(frame[b], frame[a])) / 2
        found[:, :, i] = local @ frame @ strain
    return found


def _relaxed(
    mesh: Mesh,
    surroundings: sparse.csr_matrix,
    number: Array,
    elements: Array,
    stiffness: Array,
    fields: Array,
) -> Array:
    """Displacements (e, 3k, q) of a stiffened patch in a lattice displaced by fields (n, 3, q) around it."""
    unknown = (3 * mesh.tets[elements][:, :, None] + np.arange(3)).reshape(len(elements), -1)
    flat = fields.reshape(-1, fields.shape[2])
    local = number[unknown]
    patch = np.unique(local[local >= 0])
    place = np.where(local >= 0, np.searchsorted(patch, local), len(patch))
    # One more row and column takes what supports hold.
    matrix = np.zeros((len(patch) + 1, len(patch) + 1))
    matrix[:-1, :-1] = surroundings[patch][:, patch].toarray()
    np.add.at(matrix, (place[:, :, None], place[:, None, :]), stiffness)
    resisted = np.zeros((len(patch) + 1, flat.shape[1]))
    np.add.at(resisted, place, stiffness @ flat[unknown])
    change = np.zeros_like(resisted)
    change[:-1] = np.linalg.solve(matrix[:-1, :-1], -resisted[:-1])
    return flat[unknown] + change[place]


def _turned(
    mesh: Mesh, state: State, patterns: list[Patterns], whole: Array
) -> tuple[sparse.csr_matrix, Array]:
    """Forces (3 n, r q) of all patterns on the nodes, turned with their elements in a state, and the drive.

    The drive (r q,) is the work of each pattern's forces under Model A's own deformation of its elements.
    """
    elements = np.unique(np.concatenate([p.elements for p in patterns]))
    turn = rotations(mesh, state.u, elements)
    rows, columns, values, drive = [], [], [], []
    first = 0
    for p, times in zip(patterns, whole, strict=True):
        R = turn[np.searchsorted(elements, p.elements)]
        tets = mesh.tets[p.elements]
        q = p.force.shape[2]
        force = p.force.reshape(len(tets), -1, 3, q)
        rest = mesh.nodes[tets]
        # Model A's own deformation, seen from the turned element.
        stretched = (rest + state.u[tets]) @ R - rest
        drive.append(times * np.einsum("eaiq,eai->q", force, stretched))
        turned = times * np.einsum("eij,eajq->eaiq", R, force)
        where = 3 * tets[:, :, None, None] + np.arange(3)[:, None]
        shape = turned.shape
        rows.append(np.broadcast_to(where, shape).ravel())
        columns.append(np.broadcast_to(first + np.arange(q), shape).ravel())
        values.append(turned.ravel())
        first += q
    data = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_matrix(data, shape=(mesh.nodes.size, first)).tocsr(), np.concatenate(drive)
