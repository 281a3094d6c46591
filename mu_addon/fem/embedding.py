"""Points embedded in a mesh: a printable surface that follows the motion of the analysis mesh."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array, ranges
from ..design.printing.crossing import covered
from ..meshing.mesh import TET_EDGES, Mesh, boundary_faces
from ..meshing.quality import shapes
from .elements import shape_functions, shape_gradients

# A curved element may hold points that its corners do not, beyond them by a share of its size: most are
# found with the first, the rest, where a thin element follows a bend, with the second.
_BULGES = (0.1, 0.7)
_INSIDE = 1e-6
_BLOCK = 20_000
_NEIGHBOURS = 16
# A smaller Newton step in reference coordinates is not followed by another.
_SETTLED = 1e-9
# Of elements that a point lies in or near to equally, to within this in reference coordinates or mm, the one
# with the nearest middle is taken, then the first: beyond them each continues the displacement in its own
# way, and rounding is not the same in every library.
_ALIKE = 1e-9


@attrs.frozen(eq=False)
class Probe:
    """Points of a mesh, read in any of its states.

    nodes (p, n): of the element that each point lies in; weights (p, n): the element's shape functions there.
    """

    nodes: Array
    weights: Array

    def displacement(self, u: Array) -> Array:
        """Displacements (p, 3) in mm at the points, of nodal displacements (n, 3)."""
        return np.einsum("pn,pni->pi", self.weights, u[self.nodes])


@attrs.frozen(eq=False)
class Embedding(Probe):
    """Points (p, 3) in mm that move with a mesh; made by `embed`.

    outside_mm (p,): distance of each point from the mesh, 0 inside. mirrored (p,): True for a point on the
    other side of the mirror plane x = 0 of a half mesh.
    """

    outside_mm: Array
    mirrored: Array

    def displacement(self, u: Array) -> Array:
        """Displacements (p, 3) in mm of the points, of nodal displacements u (n, 3) in mm."""
        found = super().displacement(u)
        found[self.mirrored, 0] *= -1.0
        return found

    def displacements(self, states: Array) -> Array:
        """Displacements (s, p, 3) in mm of the points, in single precision, in states (s, n, 3) at once.

        A third of the time of one state after another: a window waits for it.
        """
        by_node = np.ascontiguousarray(states.transpose(1, 0, 2).reshape(states.shape[1], -1), np.float32)
        weights = self.weights.astype(np.float32)
        found = np.zeros((len(self.nodes), by_node.shape[1]), np.float32)
        for k in range(self.nodes.shape[1]):
            found += weights[:, k, None] * by_node[self.nodes[:, k]]
        moved = found.reshape(len(found), -1, 3).transpose(1, 0, 2)
        moved[:, self.mirrored, 0] *= -1.0
        return moved


def embed(mesh: Mesh, points: Array) -> Embedding:
    """Embed points (p, 3) in mm in a mesh, so that they move with its deformation.

    Inside the mesh a point moves by the shape functions of its element. Outside, the displacement of the
    nearest surface point is continued linearly with its gradient; points beyond the fixed base are fixed.
    Points across the mirror plane x = 0 of a half mesh move as their images do.
    """
    points = np.asarray(points, float)
    mirrored = np.zeros(len(points), bool)
    if "x" in mesh.symmetry:
        side = 1.0 if mesh.nodes[:, 0].max() > -mesh.nodes[:, 0].min() else -1.0
        mirrored = points[:, 0] * side < 0
        points = points * np.where(mirrored[:, None], [-1.0, 1.0, 1.0], 1.0)
    element, local = _elements(mesh, points)
    inside = element >= 0
    weights = np.empty((len(points), mesh.tets.shape[1]))
    distance = np.zeros(len(points))
    weights[inside] = shape_functions(_barycentric(local[inside]), mesh.order)
    out = np.flatnonzero(~inside)
    if len(out):
        element[out], at, held, distance[out] = _nearest(mesh, points[out])
        weights[out] = _weights(mesh.nodes[mesh.tets[element[out]]], at, held, points[out])
    return Embedding(mesh.tets[element], weights, distance, mirrored)


@attrs.frozen(eq=False)
class Footholds:
    """Positions of points (p, 3) relative to a mesh, so that their weights follow small motions of both.

    tets (p, n): nodes of each point's element; at (p, 4): barycentric position in it, about which the
    displacement is continued linearly; held (p,): beyond the fixed base, without continuation. weights (p,
    n): as in `embed`, at the positions that the footholds were made for.
    """

    tets: Array
    at: Array
    held: Array
    weights: Array

    @classmethod
    def of(cls, mesh: Mesh, points: Array) -> Footholds:
        """Footholds of points in or near a quadratic mesh, none of them across a mirror plane."""
        element, local = _elements(mesh, points)
        inside = element >= 0
        at, held = _barycentric(local), np.zeros(len(points), bool)
        weights = shape_functions(at, mesh.order)
        out = np.flatnonzero(~inside)
        if len(out):
            element[out], at[out], held[out], _ = _nearest(mesh, points[out])
            weights[out] = _weights(mesh.nodes[mesh.tets[element[out]]], at[out], held[out], points[out])
        return cls(mesh.tets[element], at, held, weights)

    def moved(self, nodes: Array, points: Array, rows: Array) -> Array:
        """Weights (k, n) of some points (k,) with the mesh's nodes (n, 3) and all points (p, 3) elsewhere, to
        first order."""
        return _weights(nodes[self.tets[rows]], self.at[rows], self.held[rows], points[rows])


def _inverted(nodes: Array, points: Array, local: Array) -> Array:
    """Reference coordinates (e, 3) of a point in each of e curved elements, by Newton's method.

    nodes (e, 10, 3) and points (e, 3) in mm. local (e, 3): start, changed in place; -1 if the map becomes
    singular.
    """
    left = np.arange(len(local))
    for _ in range(8):
        own = nodes[left]
        bary = np.column_stack([1 - local[left].sum(axis=1), local[left]])
        shape, slope = shapes(bary, TET_EDGES, 2)
        away = points[left] - np.einsum("en,eni->ei", shape, own)
        jacobian = np.einsum("eni,enj->eij", own, slope)
        # A point far outside an element may meet a singular map; such an element is not its home.
        good = np.abs(np.linalg.det(jacobian)) > 1e-12
        local[left[~good]] = -1.0
        left = left[good]
        step = np.clip(np.linalg.solve(jacobian[good], away[good][:, :, None])[:, :, 0], -1, 1)
        local[left] += step
        # The next step would be the square of this one, below the last digit.
        left = left[np.abs(step).max(axis=1, initial=0.0) > _SETTLED]
        if not len(left):
            break
    return local


def _barycentric(local: Array) -> Array:
    return np.column_stack([1 - local.sum(axis=1), local])


def _elements(mesh: Mesh, points: Array) -> tuple[Array, Array]:
    """Element (p,) that contains each point, or -1, and its reference coordinates there (p, 3)."""
    nodes = mesh.nodes[mesh.tets]
    inverse = np.linalg.inv((nodes[:, 1:4] - nodes[:, :1]).transpose(0, 2, 1))
    curved = np.zeros(len(nodes), bool)
    if mesh.order == 2:
        middles = nodes[:, :4][:, TET_EDGES].mean(axis=2)
        curved = np.abs(nodes[:, 4:] - middles).max(axis=(1, 2)) > _INSIDE
    grid = _Grid(nodes.min(axis=1), nodes.max(axis=1))
    element, local = np.full(len(points), -1), np.zeros((len(points), 3))
    for bulge in _BULGES:
        left = np.flatnonzero(element < 0)
        for rows in np.array_split(left, len(left) // _BLOCK + 1):
            point, tet = grid.pairs(points[rows])
            point = rows[point]
            at = np.einsum("kij,kj->ki", inverse[tet], points[point] - nodes[tet, 0])
            depth = _barycentric(at).min(axis=1)
            close = depth >= np.where(curved[tet], -bulge, -_INSIDE)
            point, tet, at, depth = point[close], tet[close], at[close], depth[close]
            bent = np.flatnonzero(curved[tet])
            if len(bent):
                at[bent] = _inverted(nodes[tet[bent]], points[point[bent]], at[bent])
                depth[bent] = _barycentric(at[bent]).min(axis=1)
            # Where elements meet, the one that a point lies deepest in.
            deepest = np.full(len(points), -np.inf)
            np.maximum.at(deepest, point, depth)
            alike = np.flatnonzero(depth >= deepest[point] - _ALIKE)
            best = alike[np.unique(point[alike], return_index=True)[1]]
            best = best[depth[best] >= -_INSIDE]
            element[point[best]], local[point[best]] = tet[best], at[best]
    return element, local


class _Grid:
    """Boxes (m, 3) sorted into equal cells, to be found by points."""

    def __init__(self, low: Array, high: Array) -> None:
        self._origin, self._size = low.min(axis=0), float(np.median(high - low))
        lower, upper = self._cells(low), self._cells(high)
        self._shape = upper.max(axis=0) + 1
        box, cells = covered(lower, upper)
        keys = self._key(cells)
        order = np.argsort(keys, kind="stable")
        self._keys, self._boxes = keys[order], box[order]

    def _cells(self, points: Array) -> Array:
        return np.floor((points - self._origin) / self._size).astype(np.int64)

    def _key(self, cells: Array) -> Array:
        return np.ravel_multi_index(tuple(cells.T), tuple(self._shape))

    def pairs(self, points: Array) -> tuple[Array, Array]:
        """Numbers of points and boxes, (k,) each, that share a cell; ordered by point."""
        cells = self._cells(points)
        on = np.flatnonzero(((cells >= 0) & (cells < self._shape)).all(axis=1))
        keys = self._key(cells[on])
        start, end = (np.searchsorted(self._keys, keys, side=side) for side in ("left", "right"))
        row, number = ranges(end - start, start)
        return on[row], self._boxes[number]


def _weights(nodes: Array, at: Array, held: Array, points: Array) -> Array:
    """Weights (p, n) of points, continued linearly from places `at` (p, 4) of elements' nodes (p, n, 3)."""
    order = 1 if nodes.shape[1] == 4 else 2
    weights, slope = shape_functions(at, order), shape_gradients(at, order)
    surface = np.einsum("en,eni->ei", weights, nodes)
    jacobian = np.einsum("eni,enj->eij", nodes, slope)
    further = np.linalg.solve(jacobian, (points - surface)[:, :, None])[:, :, 0]
    further[held] = 0.0
    return np.asarray(weights + np.einsum("enj,ej->en", slope, further))


def _nearest(mesh: Mesh, points: Array) -> tuple[Array, Array, Array, Array]:
    """Elements (p,) at the surface points nearest to points outside a mesh, and these, barycentric (p, 4).

    Also returned: mask (p,) of those on the fixed base, and distances (p,) in mm.
    """
    from scipy.spatial import cKDTree
    from trimesh.triangles import closest_point

    faces, owner = boundary_faces(mesh.tets)
    triangles = mesh.nodes[faces]
    # What lies in a mirror plane is no surface of the body.
    outer = np.ones(len(faces), bool)
    if "x" in mesh.symmetry:
        outer = ~(triangles[:, :, 0] == 0.0).all(axis=1)
    faces, owner, triangles = faces[outer], owner[outer], triangles[outer]
    found = cKDTree(triangles.mean(axis=1)).query(points, min(_NEIGHBOURS, len(faces)))
    middle, near = (one.reshape(len(points), -1) for one in found)
    at = closest_point(triangles[near].reshape(-1, 3, 3), np.repeat(points, near.shape[1], axis=0))
    at = at.reshape(*near.shape, 3)
    away = np.linalg.norm(at - points[:, None], axis=2)
    middle = np.where(away <= away.min(axis=1)[:, None] + _ALIKE, middle, np.inf)
    alike = middle <= middle.min(axis=1)[:, None] + _ALIKE
    rows, best = np.arange(len(points)), np.where(alike, near, len(faces)).argmin(axis=1)
    face, surface = near[rows, best], at[rows, best]
    element = owner[face]
    nodes = mesh.nodes[mesh.tets[element]]
    edges = (nodes[:, 1:4] - nodes[:, :1]).transpose(0, 2, 1)
    local = np.linalg.solve(edges, (surface - nodes[:, 0])[:, :, None])[:, :, 0]
    if mesh.order == 2:
        local = _inverted(nodes, surface, local)
    held = np.isin(faces[face], mesh.base).all(axis=1)
    return element, _barycentric(local), held, away[rows, best]
