"""Small meshes with known answers: boxes, spheres, tubes, Cook's panel, Land's beam and ellipsoid."""

from __future__ import annotations

import itertools

import attrs
import numpy as np

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import CONTACT_NEWTON
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, Mesh, boundary_faces, edges_of, second_order


def _grid(counts, size):
    """Nodes of a box grid and its cells' tetrahedra, six a cell around one diagonal (Kuhn)."""
    axes = [np.linspace(0, s, c + 1) for c, s in zip(counts, size, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([c + 1 for c in counts])
    i, j, k = (a.ravel() for a in np.meshgrid(*map(np.arange, counts), indexing="ij"))
    tets = []
    for way in itertools.permutations(range(3)):
        corner = np.stack([i, j, k])
        path = [number[tuple(corner)]]
        for axis in way:
            corner = corner.copy()
            corner[axis] += 1
            path.append(number[tuple(corner)])
        cell = np.stack(path, axis=1)
        # Odd permutations turn the element inside out.
        if np.linalg.det(np.eye(3)[list(way)]) < 0:
            cell = cell[:, [1, 0, 2, 3]]
        tets.append(cell)
    return nodes, np.vstack(tets)


def make(nodes, tets, order, cavity=None, base=(), symmetry=(), onto=None):
    """A Mesh; order 2 adds mid-edge nodes, moved by `onto` (e, 3) -> (e, 3) where a surface is curved."""
    cavity = np.empty((0, 3), int) if cavity is None else cavity
    if order == 2:
        edges, _ = edges_of(tets)
        middles = nodes[edges].mean(axis=1)
        nodes, tets, cavity = second_order(
            nodes, tets, cavity, middles if onto is None else onto(middles, nodes[edges])
        )
    base = np.asarray([i for i in range(len(nodes)) if base and base[0](nodes[i])], int)
    return Mesh(nodes, tets, np.full(len(tets), MEMBRANE), cavity, base, np.empty(0, int), symmetry)


def box(counts=(2, 2, 2), size=(1.0, 1.0, 1.0), order=2, symmetry=(), jiggle=0.0, clamp=False):
    """A solid box from the origin; `jiggle` moves interior nodes at random by that share of a cell."""
    nodes, tets = _grid(counts, size)
    if jiggle:
        cell = np.array(size) / counts
        inside = ((nodes > 1e-9) & (nodes < np.array(size) - 1e-9)).all(axis=1)
        noise = np.random.default_rng(3).uniform(-jiggle, jiggle, nodes.shape)
        nodes = nodes + inside[:, None] * noise * cell
    base = (lambda p: p[2] == 0,) if clamp else ()
    return make(nodes, tets, order, base=base, symmetry=symmetry)


def hollow_box(order=2, n=4, size=4.0, clamp=True):
    """A cube with a closed cubic cavity in its middle, clamped at z = 0."""
    nodes, tets = _grid((n, n, n), (size, size, size))
    centre = nodes[tets].mean(axis=1)
    low, high = size / n, size - size / n
    inside = ((centre > low) & (centre < high)).all(axis=1)
    tets = tets[~inside]
    used, tets = np.unique(tets, return_inverse=True)
    nodes, tets = nodes[used], tets.reshape(-1, 4)
    faces, _ = boundary_faces(tets)
    middle = nodes[faces].mean(axis=1)
    cavity = faces[((middle > 0.5 * low) & (middle < size - 0.5 * low)).all(axis=1)]
    return make(nodes, tets, order, cavity, (lambda p: p[2] == 0,) if clamp else ())


def half_hollow_cube(size=4.0):
    """The half at x >= 0 of a clamped hollow cube about its middle plane; its +y side is the lattice's."""
    whole = hollow_box(order=1, size=size)
    nodes = whole.nodes - [size / 2, 0.0, 0.0]
    tets = whole.tets[nodes[whole.tets][..., 0].min(axis=1) >= 0.0]
    cavity = whole.cavity[nodes[whole.cavity][..., 0].min(axis=1) >= 0.0]
    used, number = np.unique(tets), np.full(len(nodes), -1)
    number[used] = np.arange(len(used))
    region = np.where(nodes[tets].mean(axis=1)[:, 1] > 0.75 * size, LATTICE, MEMBRANE)
    base = number[np.intersect1d(whole.base, used)]
    return Mesh(nodes[used], number[tets], region, number[cavity], base, np.empty(0), ("x",))


def sphere_octant(inner=10.0, outer=12.0, around=4, through=1, order=2):
    """An octant of a hollow sphere, pressed on its inner surface, mirrored at three planes."""
    nodes, tets = _grid((around, around, through), (1, 1, 1))
    # Three patches of a cube's corner, each a grid in two directions, bent to the sphere.
    sheets, cells = [], []
    for axis in range(3):
        a, b, t = nodes.T
        cube = np.empty_like(nodes)
        cube[:, axis] = 1.0
        cube[:, (axis + 1) % 3] = np.tan(a * np.pi / 4)
        cube[:, (axis + 2) % 3] = np.tan(b * np.pi / 4)
        radius = inner + t * (outer - inner)
        sheets.append(cube / np.linalg.norm(cube, axis=1)[:, None] * radius[:, None])
        cells.append(tets + axis * len(nodes))
    points, where = np.vstack(sheets), np.vstack(cells)
    points[np.abs(points) < 1e-9] = 0.0
    _, first, inverse = np.unique(points.round(7), axis=0, return_index=True, return_inverse=True)
    points, where = points[first], np.reshape(inverse, -1)[where]

    volume = np.linalg.det(points[where][:, 1:] - points[where][:, :1])
    where[volume < 0] = where[volume < 0][:, [1, 0, 2, 3]]
    faces, _ = boundary_faces(where)
    radii = np.linalg.norm(points[faces], axis=2)
    cavity = faces[(np.abs(radii - inner) < 1e-6).all(axis=1)]

    def bend(middles, ends):
        radius = np.linalg.norm(ends, axis=2).mean(axis=1)
        bent = middles / np.linalg.norm(middles, axis=1)[:, None] * radius[:, None]
        bent[(ends == 0).all(axis=1)] = 0.0
        return bent

    return make(points, where, order, cavity, symmetry=("x", "y", "z"), onto=bend)


def cylinder_quarter(inner=10.0, outer=12.0, height=1.0, around=6, through=1, order=2):
    """A quarter of a tube, pressed inside; its ends are mirror planes' images, so plane strain holds."""
    nodes, tets = _grid((through, around, 1), (1, 1, 1))

    def bend(p):
        radius, angle = inner + p[:, 0] * (outer - inner), p[:, 1] * np.pi / 2
        out = np.stack([radius * np.cos(angle), radius * np.sin(angle), p[:, 2] * height], axis=1)
        out[np.abs(out) < 1e-9] = 0.0
        return out

    edges, _ = edges_of(tets)
    middles = bend(nodes[edges].mean(axis=1))
    points = bend(nodes)
    faces, _ = boundary_faces(tets)
    cavity = faces[(nodes[faces][:, :, 0] == 0).all(axis=1)]
    return make(points, tets, order, cavity, symmetry=("x", "y", "z"), onto=lambda m, e: middles)


def cook(n=8, order=2):
    """Cook's tapered panel, 48 wide, 44 to 16 high, one cell thick; its `cavity` is the loaded edge."""
    nodes, tets = _grid((n, n, 1), (1, 1, 1))
    s, t, w = nodes.T
    points = np.stack([48 * s, 44 * s + t * (44 - 28 * s), w * 48 / n], axis=1)
    faces, _ = boundary_faces(tets)
    loaded = faces[(s[faces] == 1).all(axis=1)]
    return make(points, tets, order, loaded, (lambda p: p[0] == 0,))


def cantilever(counts=(20, 1, 2), size=(10.0, 0.5, 1.0), order=2):
    """The half y >= 0 of a beam clamped at x = 0 and pressed on its lower face z = 0."""
    nodes, tets = _grid(counts, size)
    faces, _ = boundary_faces(tets)
    pressed = faces[(nodes[faces][:, :, 2] == 0).all(axis=1)]
    return make(nodes, tets, order, pressed, (lambda p: p[0] == 0,), symmetry=("y",))


def ventricle_quarter(around=4, through=1, order=2):
    """A quarter of Land's truncated ellipsoid (inner half axes 7 and 17, outer 10 and 20), cut at z = 5.

    A sphere octant bent: its polar angle becomes the ellipsoid's, from the apex at -z to the cut.
    """
    octant = sphere_octant(1.0, 2.0, around, through, order)
    x, y, z = octant.nodes.T
    depth = np.linalg.norm(octant.nodes, axis=1) - 1.0
    share = np.arctan2(np.hypot(x, y), z) / (np.pi / 2)
    short, long = 7 + 3 * depth, 17 + 3 * depth
    polar = np.pi - share * (np.pi - np.arccos(5 / long))
    across = np.maximum(np.hypot(x, y), 1e-30)
    # x and y change places, for the turned z axis would otherwise turn the elements inside out.
    nodes = np.stack(
        [short * np.sin(polar) * y / across, short * np.sin(polar) * x / across, long * np.cos(polar)], axis=1
    )
    nodes[share == 0, :2] = 0.0
    return attrs.evolve(octant, nodes=nodes, base=np.flatnonzero(z == 0), symmetry=("x", "y"))


def uniform(mesh, modulus, poisson):
    """One neo-Hookean material everywhere."""
    count = len(mesh.tets)
    return Materials.neo_hooke(np.full(count, modulus), np.full(count, poisson))


def everywhere(mesh, law, *parameters):
    """One law with the same parameters in every element."""
    count = len(mesh.tets)
    return Materials((Layer(law, np.arange(count), np.tile(np.array(parameters, float), (count, 1))),))


def stacked(below, above, foot_mm, at, order=1):
    """A block of foot_mm x foot_mm x 1 clamped at its foot, and one of 2 x 2 x 1 with its corner at `at`."""
    one, first = _grid((below, below, 1), (foot_mm, foot_mm, 1.0))
    other, second = _grid((above, above, 1), (2.0, 2.0, 1.0))
    nodes = np.vstack([one, other + np.asarray(at)])
    return make(nodes, np.vstack([first, second + len(one)]), order, base=(lambda p: p[2] == 0,))


def touching(mesh, *obstacles, poisson=0.3):
    """An elastic body of 1 MPa that may touch obstacles, without pressure."""
    model = Model(mesh, threads=1)
    model.obstacles = obstacles
    return Equilibrium(model, uniform(mesh, 1.0, poisson), CONTACT_NEWTON)
