"""First-order response of a unit to any printed waveguide: bars between joints of the lattice.

A waveguide is held by the lattice at the joints of its path. Model A's tangent gives the response to forces
and couples on every joint. A path is a chain of straight bars between joints displaced and rotated as in
Model A. Each bar has six modes of deformation; the struts that it replaces are subtracted. The response is of
first order about Model A; seats and thickened struts are left out, and joints are rigid.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import graded
from ..errors import InputError
from ..fem.embedding import Probe
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.rotations import nearest_rotations
from ..fem.trajectory import Trajectory
from ..meshing.mesh import LATTICE, Mesh
from ..placement.graph import Graph
from ..placement.response import BLOCK, Response, solver_of
from ..placement.sensitivity_map import loaded, probe_loads, representative_pressures
from .strut import radius_of

# Of a square section, as a share of its side's fourth power (Timoshenko and Goodier).
_TORSION = 0.1406
_STATIONS = 101


def bar_response(
    model: Model, materials: Materials, d: Dimensions, trajectory: Trajectory, monitor: Probe, graph: Graph
) -> Response:
    """Linear response of a printed unit to a waveguide along any chain of steps of its lattice graph.

    model, materials, trajectory: Model A of the whole unit, of `mesh_printed`; d: its dimensions as printed;
    monitor: probe of the backbone's p points. In each of `representative_pressures` Model A's tangent is
    solved for six loads on each joint. Raises InputError where a joint has no node to load, IndefiniteError
    at an unstable state.
    """
    mesh = model.mesh
    joints = [_around(mesh, node, d) for node in graph.nodes]
    ends = graph.nodes[graph.steps]
    frames = np.array([_frame(b - a) for a, b in ends])
    modulus, poisson = (
        values[mesh.region == LATTICE][0] for values in materials.small_strain(len(mesh.tets))
    )
    length = graph.lengths
    bars = [_bar_stiffness(d, modulus, poisson, float(step)) for step in length]
    replaced = length < 0.99 * d.cell  # half diagonals; steps along z have no strut
    if replaced.any():
        span = float(length[replaced].min())
        alike = _strut_stiffness(d, modulus, poisson, span) if d.grading is None else None
        for step in np.flatnonzero(replaced).tolist():
            strut = alike
            if strut is None:
                first, last = d.strut_factors(ends[step]).tolist()
                strut = _strut_stiffness(d, modulus, poisson, span, first, last)
            bars[step] = bars[step] - strut
    energy, modes = np.linalg.eigh(np.array(bars))
    scaled = modes * np.sqrt(np.abs(energy))[:, None, :]
    states = loaded(trajectory, representative_pressures(trajectory))
    count, q = len(graph.nodes), 6 * len(graph.steps)
    flexibility, drive = np.zeros((len(states), q, q)), np.zeros((len(states), q))
    reach = np.zeros((len(states), len(monitor.nodes), 3, q))
    data, free = model.parameters(materials), model.free
    probes = probe_loads(mesh, monitor, (0, 1, 2))
    for s, state in enumerate(states):
        place, turn, loads = _moved_joints(mesh, graph.nodes, joints, state.u)
        patterns = np.zeros((6 * count, q))
        for i, (a, b) in enumerate(graph.steps):
            found, compatible = _natural(frames[i], length[i], place[[a, b]], turn[[a, b]])
            own = slice(6 * i, 6 * i + 6)
            drive[s, own] = found @ scaled[i]
            forces = compatible.T @ scaled[i]
            patterns[6 * a : 6 * a + 6, own], patterns[6 * b : 6 * b + 6, own] = forces[:6], forces[6:]
        solve = solver_of(model, model.tangent(state.u, state.pressure_MPa, data))
        applied = model.passed_on(state.u, loads)[free].tocsc()
        monitored = model.passed_on(state.u, probes.reshape(len(probes), -1))[free]
        monitored = monitored.reshape(len(free), -1, 3)
        compliance = np.zeros((6 * count, 6 * count))
        moved = np.zeros((len(monitor.nodes), 3, 6 * count))
        for columns in np.array_split(np.arange(6 * count), -(-6 * count // BLOCK)):
            solved = solve(applied[:, columns].toarray().T).T
            compliance[:, columns] = applied.T @ solved
            moved[:, :, columns] = np.einsum("fpc,fk->pck", monitored, solved)
        flexibility[s] = patterns.T @ compliance @ patterns
        reach[s] = moved @ patterns
    pressure = np.array([state.pressure_MPa for state in states])
    sign = np.where(energy < 0.0, -1.0, 1.0).ravel()
    return Response(graph, pressure, flexibility, drive, reach, sign, 6)


def _around(mesh: Mesh, node: Array, d: Dimensions) -> Array:
    """Nodes (k,) of struts that hold a bar's end at a lattice node (3,)."""
    near = np.linalg.norm(mesh.nodes - node, axis=1) < _reach(d)
    near[mesh.tied] = False
    near[mesh.tets[mesh.region != LATTICE]] = False
    near[mesh.beams[:, 1::2]] = False
    found = np.flatnonzero(near)
    if len(found) < 4:
        x, y, z = node.round(3).tolist()
        raise InputError(
            "a joint of the lattice has too few nodes outside the wall",
            f"at ({x:g}, {y:g}, {z:g}) mm",
            "refine the mesh, or widen the lattice",
        )
    return found


def _reach(d: Dimensions) -> float:
    """Radius of a joint in mm: to the corners of a bar's section and as far along it."""
    return math.sqrt(3.0) / 2.0 * d.waveguide_section


def _frame(way: Array) -> Array:
    """Orthonormal axes (3, 3) as rows, the first along a direction (3,)."""
    first = way / np.linalg.norm(way)
    second = np.cross(np.eye(3)[np.argmin(np.abs(first))], first)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)])


def _moved_joints(
    mesh: Mesh, points: Array, joints: list[Array], u: Array
) -> tuple[Array, Array, sparse.csr_matrix]:
    """Positions (j, 3) in mm and rotations (j, 3, 3) of joints in a state, and the loads (3 n, 6 j) on them.

    A joint moves by the mean of its nodes and rotates by their best fit (Kabsch). Its forces and couples
    along x, y and z are distributed over the nodes so that their work is on that motion. points (j, 3):
    joints in mm at rest.
    """
    place, turn = np.zeros((len(joints), 3)), np.zeros((len(joints), 3, 3))
    rows, columns, values = [], [], []
    for j, nodes in enumerate(joints):
        rest, now = mesh.nodes[nodes], mesh.nodes[nodes] + u[nodes]
        arms, before = now - now.mean(axis=0), rest - rest.mean(axis=0)
        turn[j] = nearest_rotations((arms.T @ before)[None])[0]
        place[j] = now.mean(axis=0) + turn[j] @ (points[j] - rest.mean(axis=0))
        inertia = (arms**2).sum() * np.eye(3) - arms.T @ arms
        spin = np.linalg.inv(inertia)
        for axis in range(3):
            force = np.broadcast_to(np.eye(3)[axis] / len(nodes), arms.shape)
            couple = np.cross(spin[:, axis], arms)
            for column, load in ((6 * j + axis, force), (6 * j + 3 + axis, couple)):
                rows.append((3 * nodes[:, None] + np.arange(3)).ravel())
                columns.append(np.full(load.size, column))
                values.append(load.ravel())
    where = np.concatenate(rows), np.concatenate(columns)
    shape = (mesh.nodes.size, 6 * len(joints))
    return place, turn, sparse.coo_matrix((np.concatenate(values), where), shape=shape).tocsr()


def _natural(frame: Array, length: float, place: Array, turn: Array) -> tuple[Array, Array]:
    """Deformation (6,) of a bar between two joints, and its derivatives (6, 12) by their motions.

    Elongation in mm, twist, then the rotations of both ends from the chord about the second axis and about
    the third. frame (3, 3): the bar's axes at rest as rows; place (2, 3) in mm and turn (2, 3, 3) of the
    joints, whose motions are three displacements and three rotations each.
    """
    from scipy.spatial.transform import Rotation

    chord = place[1] - place[0]
    now = np.linalg.norm(chord)
    first = chord / now
    aside = (turn[0] + turn[1]) @ frame[1]
    second = aside - (aside @ first) * first
    second /= np.linalg.norm(second)
    axes = np.stack([first, second, np.cross(first, second)])
    ends = [Rotation.from_matrix(axes @ r @ frame.T).as_rotvec() for r in turn]
    found = np.array([now - length, ends[1][0] - ends[0][0], ends[0][1], ends[1][1], ends[0][2], ends[1][2]])
    slopes = np.zeros((6, 12))
    apart = np.concatenate([-np.eye(3), np.zeros((3, 3)), np.eye(3), np.zeros((3, 3))], axis=1)
    slopes[0] = axes[0] @ apart
    slopes[1, 3:6], slopes[1, 9:12] = -axes[0], axes[0]
    swing = -axes[2] @ apart / now, axes[1] @ apart / now
    for axis in (0, 1):
        for end in (0, 1):
            row = 2 + 2 * axis + end
            slopes[row] = -swing[axis]
            slopes[row, 3 + 6 * end : 6 + 6 * end] += axes[1 + axis]
    return found, slopes


def _bar_stiffness(d: Dimensions, modulus: float, poisson: float, length: float) -> Array:
    """Stiffness (6, 6) of a bar with wells between its ends' motions of `_natural`, in N, mm and radians."""
    a, left = d.waveguide_section, d.waveguide_section - d.well_depth
    wells = d.well_width / d.well_pitch
    shear = modulus / (2.0 * (1.0 + poisson))

    def along(whole: float, cut: float) -> float:
        return 1.0 / ((1.0 - wells) / whole + wells / cut)

    area = along(a * a, a * left)
    bending = (along(a**4, a * left**3) + along(a**4, a**3 * left)) / 24.0
    torsion = _TORSION * along(a**4, (a * left) ** 2)
    one = np.ones(_STATIONS)
    t = _clear(d, length)
    return _stiffness(t, modulus * area * one, shear * torsion * one, modulus * bending * one, length)


def _strut_stiffness(
    d: Dimensions, modulus: float, poisson: float, length: float, first: float = 1.0, last: float = 1.0
) -> Array:
    """Stiffness as of `_bar_stiffness`, of a round strut with these factors of a grading at its ends."""
    t = _clear(d, length)
    r = radius_of(d)(t)
    if (first, last) != (1.0, 1.0):
        r = graded(r, t, first, last, d.strut_growth / 2.0)
    bending = modulus * np.pi * r**4 / 4.0
    return _stiffness(t, modulus * np.pi * r**2, bending / (1.0 + poisson), bending, length)


def _clear(d: Dimensions, length: float) -> Array:
    """Positions (s,), as shares of the length in mm, where a step bends: between its joints."""
    joint = _reach(d) / length
    return np.linspace(joint, 1.0 - joint, _STATIONS)


def _stiffness(t: Array, stretch: Array, twist: Array, bending: Array, length: float) -> Array:
    """Stiffness (6, 6) of a beam by that of its sections (s,) at places t (s,), rigid beyond; Bernoulli's.

    t: evenly spaced shares, 0 to 1, of the length in mm.
    """

    def total(values: Array) -> float:
        return length * float(((values[1:] + values[:-1]) / 2.0 * np.diff(t)).sum())

    found = np.zeros((6, 6))
    found[0, 0], found[1, 1] = 1.0 / total(1.0 / stretch), 1.0 / total(1.0 / twist)
    mixed = -total(t * (1.0 - t) / bending)
    ends = np.linalg.inv([[total((1.0 - t) ** 2 / bending), mixed], [mixed, total(t**2 / bending)]])
    found[2:4, 2:4] = found[4:6, 4:6] = ends
    return found
