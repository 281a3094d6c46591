"""Axes of a lattice's struts of any kind: which is nearest to a point, and struts graded about them."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, lattice_of
from ..errors import InputError
from ..meshing.mesh import Mesh
from ..meshing.quality import inverted

# Stations of axes among which a point's strut is sought: how many a strut, and how many of them.
_STATIONS, _NEAR = 10, 24
# Of a point that lies between struts the displacements by all whose axes are as near, within so many radii.
_BETWEEN = 0.3
# Radii within which struts that meet may overlap, and the share of a strut that they may take.
_JOINT, _LONGEST = 2.0, 0.25
# Passes of smoothing, at most, where elements turn over.
_PASSES = 20


class Axes:
    """The axes of a lattice's struts."""

    def __init__(self, lattice: Lattice) -> None:
        self.lattice = lattice
        self.start = lattice.nodes[lattice.struts[:, 0]]
        self.way = lattice.nodes[lattice.struts[:, 1]] - self.start
        t = (np.arange(_STATIONS) + 0.5) / _STATIONS
        self._stations = cKDTree((self.start[:, None] + t[:, None] * self.way[:, None]).reshape(-1, 3))

    def near(self, points: Array) -> Array:
        """Struts (p, k) around points (p, 3), the nearest ones among them; some of them repeatedly."""
        return np.asarray(self._stations.query(points, min(_NEAR, self._stations.n))[1] // _STATIONS)

    def nearest(self, points: Array) -> Array:
        """Strut (p,) nearest to points (p, 3) in its radii."""
        near = self.near(points)
        best = self.distances(points[:, None], near)[0].argmin(axis=1)
        return np.asarray(near[np.arange(len(points)), best])

    def distances(self, points: Array, struts: Array) -> tuple[Array, Array]:
        """Distances in radii, and fractions of the length, of points (..., 3) in mm from struts (...)."""
        way = self.way[struts]
        off = points - self.start[struts]
        t = np.clip((off * way).sum(axis=-1) / (way**2).sum(axis=-1), 0.0, 1.0)
        radius = _radii(self.lattice, t, struts)
        return np.linalg.norm(off - t[..., None] * way, axis=-1) / radius, t


def graded_about_axes(d: Dimensions, mesh: Mesh) -> Mesh:
    """A mesh of uniform struts of any kind moved to graded ones.

    A node keeps its distance from its strut's axis in radii. Near a joint, where struts overlap, nodes also
    move away from it by the joint's factor, so that its struts agree. The factor fades out along the strut.
    Nodes in the box's faces stay in them. Raises InputError for struts that fill their cell.
    """
    lattice, nodes = lattice_of(d), mesh.nodes
    widest = 2.0 * float(lattice.radii(np.linspace(0.0, 1.0, 33)).max())
    opening = min(d.kind.opening, 1.0) * d.cell
    if widest >= opening:
        raise InputError(
            f"graded struts of {widest:.4g} mm close the openings of {opening:.4g} mm of their cell",
            "[grading]",
            f"choose factors that give less than {opening:.4g} mm",
        )
    axes = Axes(attrs.evolve(lattice, factors=None))
    near = np.sort(axes.near(nodes), axis=1)
    away, t = axes.distances(nodes[:, None], near)
    weight = np.maximum(1.0 - (away - away.min(axis=1, keepdims=True)) / _BETWEEN, 0.0)
    weight[:, 1:][near[:, 1:] == near[:, :-1]] = 0.0
    node, column = np.nonzero(weight)
    share = weight[node, column] / weight.sum(axis=1)[node]
    moved = share[:, None] * _moved(axes, lattice, nodes[node], near[node, column], t[node, column])
    total = np.column_stack([np.bincount(node, way, len(nodes)) for way in moved.T])
    (x, right), *others = d.bounds
    for axis, planes in enumerate(((x, 0.0, right), *others)):
        total[np.isin(nodes[:, axis], planes), axis] = 0.0
    found = attrs.evolve(mesh, nodes=nodes + total)
    for _ in range(_PASSES):
        bad = inverted(found)
        if not len(bad):
            break
        # Between struts neighbours may move unlike each other: there they take the mean around them.
        own = np.unique(mesh.tets[bad])
        around = mesh.tets[np.isin(mesh.tets, own).any(axis=1)]
        count = np.bincount(around.ravel(), minlength=len(nodes))
        means = total[around].mean(axis=1)
        for axis in range(3):
            summed = np.bincount(around.ravel(), np.repeat(means[:, axis], around.shape[1]), len(nodes))
            total[own, axis] = np.where(total[own, axis] == 0.0, 0.0, summed[own] / count[own])
        found = attrs.evolve(mesh, nodes=nodes + total)
    return found


def _moved(axes: Axes, graded: Lattice, points: Array, struts: Array, t: Array) -> Array:
    """Displacements (p, 3) in mm of points (p, 3), fractions t (p,) along struts (p,), by their grading."""
    plain, way = axes.lattice, axes.way[struts]
    length = np.linalg.norm(way, axis=1)
    end = (t > 0.5).astype(int)
    joint = graded.struts[struts, end]
    from_joint = np.where(end, 1.0 - t, t) * length
    reach = np.minimum(_JOINT * plain.node_radii[joint], _LONGEST * length)
    beyond = np.clip((length / 2.0 - from_joint) / (length / 2.0 - reach), 0.0, 1.0)
    grown = graded.node_radii[joint] / plain.node_radii[joint] - 1.0
    along = grown * np.minimum(from_joint, reach * beyond) / length
    other = t + np.where(end, -along, along)
    ratio = _radii(graded, other, struts) / _radii(plain, t, struts)
    off = points - axes.start[struts] - t[:, None] * way
    return np.asarray((other - t)[:, None] * way + (ratio - 1.0)[:, None] * off)


def _radii(lattice: Lattice, t: Array, struts: Array) -> Array:
    """Radii in mm (...) of struts (...) at fractions t (...) of their length."""
    return lattice.radii(t.reshape(-1, 1), struts.ravel()).reshape(t.shape)
