"""The unit once more, by signed distances on a grid: nothing of it is shared with the Boolean solid."""

import itertools

import numpy as np

from mu_addon.design.lattice import lattice_of
from mu_addon.design.profile import cavity_radius, outer_radius, outer_slope

DIAGONALS = [np.array(d) for d in itertools.product((0, 1), repeat=3) if any(d)]


def smooth_least(a, b, k):
    """Least of two distances, rounded over k mm: sharp creases make tunnels smaller than any cell."""
    h = np.maximum(k - np.abs(a - b), 0.0) / k
    return np.minimum(a, b) - 0.25 * h * h * k


def field(unit, step, k=0.5):
    """Signed distance (nx, ny, nz), negative inside, at the points of a grid, and the grid's axes."""
    d = unit.dimensions
    bounds = np.array(d.bounds)
    low = np.array([bounds[0, 0], bounds[1, 0], -d.inlet_length]) - 2.3 * step
    high = bounds[:, 1] + 2.3 * step
    x, y, z = axes = [np.arange(a, b, step) for a, b in zip(low, high, strict=True)]
    far = np.full([len(a) for a in axes], 10.0)

    lattice = lattice_of(d)
    nodes = lattice.nodes
    for one, two in nodes[lattice.struts]:
        way = two - one
        length = np.linalg.norm(way)
        reach = 0.5 * d.midspan_diameter + k + 3 * step
        box = tuple(
            slice(*np.searchsorted(a, [min(p, q) - reach, max(p, q) + reach]))
            for a, p, q in zip(axes, one, two, strict=True)
        )
        px, py, pz = x[box[0]] - one[0], y[box[1]] - one[1], z[box[2]] - one[2]
        along = px[:, None, None] * way[0] + py[None, :, None] * way[1] + pz[None, None, :] * way[2]
        t = np.clip(along / length**2, 0.0, 1.0)
        square = px[:, None, None] ** 2 + py[None, :, None] ** 2 + pz[None, None, :] ** 2
        square = square - 2.0 * t * along + t * t * length**2
        distance = np.sqrt(np.maximum(square, 0.0)) - lattice.radius(t)
        far[box] = smooth_least(far[box], distance, k)
    X, Y, Z = np.meshgrid(*axes, indexing="ij", sparse=True)
    box = np.maximum.reduce(
        np.broadcast_arrays(
            *(
                np.abs(P - m) - h
                for P, m, h in zip((X, Y, Z), bounds.mean(axis=1), np.ptp(bounds, axis=1) / 2.0, strict=True)
            )
        )
    )
    far = np.maximum(far, box)

    r = np.hypot(X, Y)
    inner = np.clip(Z, 0.0, d.height)
    slant = np.sqrt(1.0 + outer_slope(d, inner) ** 2)
    body = np.maximum((r - outer_radius(d, inner)) / slant, np.abs(Z - d.height / 2.0) - d.height / 2.0)
    far = smooth_least(far, body, k)
    boss = np.maximum(
        r - d.inlet_radius - d.inlet_wall, np.abs(Z + d.inlet_length / 2) - d.inlet_length / 2 - 0.01
    )
    far = np.minimum(far, np.maximum(boss, -Z - d.inlet_length))

    within = np.clip(Z, d.base_cap, d.height - d.tip_cap)
    middle, half = (d.base_cap + d.height - d.tip_cap) / 2.0, (d.height - d.tip_cap - d.base_cap) / 2.0
    cavity = np.maximum((r - cavity_radius(d, within)) / slant, np.abs(Z - middle) - half)
    bore = np.maximum(r - d.inlet_radius, Z - d.base_cap - d.inlet_radius)
    return np.maximum(far, -np.minimum(cavity, bore)), axes


def topology(inside):
    """Pieces, sealed voids and genus of what is inside (nx, ny, nz), its cubes cut into six tetrahedra each.

    Euler's number counts the corners, edges, triangles and tetrahedra that lie inside; the genus of the
    surface is then pieces + voids - Euler's number (a body's loops).
    """
    from scipy.ndimage import label

    near = np.zeros((3, 3, 3), bool)
    for way in [np.zeros(3, int), *DIAGONALS]:
        near[tuple(1 + way)] = near[tuple(1 - way)] = True

    def count(*corners):
        n = np.array(inside.shape) - np.max(corners, axis=0)
        every = np.ones(n, bool)
        for c in corners:
            every &= inside[tuple(slice(a, a + b) for a, b in zip(c, n, strict=True))]
        return int(np.count_nonzero(every))

    zero = np.zeros(3, int)

    def below(a, b):
        return (a <= b).all() and (a < b).any()

    euler = count(zero) - sum(count(zero, a) for a in DIAGONALS)
    pairs = [(a, b) for a in DIAGONALS for b in DIAGONALS if below(a, b)]
    euler += sum(count(zero, a, b) for a, b in pairs)
    euler -= sum(count(zero, a, b, c) for a, b in pairs for c in DIAGONALS if below(b, c))
    pieces = label(inside, near)[1]
    voids = label(~inside, near)[1] - 1
    return pieces, voids, pieces + voids - euler
