"""A unit whose last chambers lie behind a clog: the pressure drops in the neck before them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import AXES, TRIANGLE_EDGES
from .model import MaterialData, Model

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh


# Gauss-Legendre points on 0..1, exact for the cone's integrand of degree 5.
_AT, _WEIGHT = np.polynomial.legendre.leggauss(3)
_AT, _WEIGHT = (_AT + 1) / 2, _WEIGHT / 2


class CloggedModel(Model):
    """A body whose cavity beyond a neck at `height_mm` holds 1 - share_lost of the pressure.

    The neck is closed by a cone from the neck's rim to the mean of its nodes. It carries the pressure
    difference to the rim, so that both chambers are closed and the load has a potential, -p (V - share_lost
    V_beyond): the tangent stays symmetric. Its part of the tangent, of the rim alone, is left out: Newton's
    method needs more steps to the same equilibrium. more: further arguments of `Model`. Raises InputError
    where no neck is cut.
    """

    def __init__(self, mesh: Mesh, height_mm: float, share_lost: float, **more: Any) -> None:
        super().__init__(mesh, **more)
        beyond = mesh.nodes[mesh.cavity_corners].mean(axis=1)[:, 2] > height_mm
        if beyond.all() or not beyond.any():
            raise InputError(
                f"no cavity is cut at z = {height_mm:g} mm", "clogged chamber", "give the height of a neck"
            )
        self._lost = share_lost
        self._beyond = np.flatnonzero(beyond)
        self._shares = self._put(np.where(beyond, 1 - share_lost, 1.0), wp.float64)
        self._rim = _rim(mesh, mesh.cavity[beyond])
        self._rim_nodes = np.unique(self._rim)

    def _pressure_work(self, pressure: float) -> float:
        return super()._pressure_work(pressure) - self._lost * pressure * self._within_cone()

    def residual(self, u: Array, pressure: float, m: MaterialData) -> Array:
        """Internal minus external forces (n, 3) in N at u (n, 3) in mm and pressure in MPa.

        As `Model.residual`, with the pressure's difference on the clog's cone, which the rim's nodes carry.
        """
        residual = super().residual(u, pressure, m)
        self._add_cone(residual, self.mesh.nodes + u, -self._lost * pressure)
        return residual

    def volume_beyond(self, u: Array) -> float:
        """Volume in mm3 that the cavity beyond the clog, the clog's cone and the mirror planes enclose.

        u: displacements (n, 3) in mm.
        """
        self._place(u)
        return float(self._face_volumes()[self._beyond].sum()) + self._within_cone()

    def _within_cone(self) -> float:
        """Volume in mm3 between the clog's cone and the origin, at the displacement in `_place`."""
        x = self._x.numpy()
        apex = self._apex(x)
        _, area = self._cone(x, apex)
        # On a cone x - apex lies in the surface; its normal points into the part beyond.
        return -float(apex @ area.sum(axis=0)) / 3

    def _apex(self, x: Array) -> Array:
        apex = x[self._rim_nodes].mean(axis=0)
        for axis in self.mesh.symmetry:
            apex[AXES.index(axis)] = 0.0
        return apex

    def _cone(self, x: Array, apex: Array) -> tuple[Array, Array]:
        """Area vectors of the cone of each of e rim edges by its nodes (e, k, 3), and whole (e, 3)."""
        shape, slope = _edge_shapes(self._rim.shape[1])
        edge = x[self._rim]
        place = np.einsum("qa,eai->eqi", shape, edge) - apex
        along = np.einsum("qa,eai->eqi", slope, edge)
        area = np.cross(place, along) * _WEIGHT[:, None]
        return np.einsum("qa,eqi->eai", shape, area) / 3, area.sum(axis=1) / 2

    def _add_cone(self, residual: Array, x: Array, pressure: float) -> None:
        """Add the force of a pressure on the cone; the apex shares its third among the rim's nodes."""
        of_nodes, whole = self._cone(x, self._apex(x))
        np.add.at(residual, self._rim, pressure * of_nodes)
        at_apex = pressure * whole.sum(axis=0) / 3
        for axis in self.mesh.symmetry:
            at_apex[AXES.index(axis)] = 0.0
        residual[self._rim_nodes] += at_apex / len(self._rim_nodes)


def _rim(mesh: Mesh, faces: Array) -> Array:
    """Edges (e, 2 | 3) of faces (f, 3 | 6) that one of them has, mirror planes left out, turned round.

    Turned so that a cone over them continues the faces' orientation.
    """
    edges = faces[:, TRIANGLE_EDGES].reshape(-1, 2)
    middles = faces[:, 3:].reshape(-1, 1)
    whole = np.hstack([edges, middles]) if middles.size else edges
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    open_ = whole[first[count == 1]]
    for axis in mesh.symmetry:
        open_ = open_[(mesh.nodes[open_, AXES.index(axis)] != 0.0).any(axis=1)]
    turned = open_.copy()
    turned[:, :2] = open_[:, 1::-1]
    return turned


def _edge_shapes(count: int) -> tuple[Array, Array]:
    """Shape functions (q, count) of an edge's ends, and middle if it has one, and their derivatives."""
    t = _AT
    if count == 2:
        return np.stack([1 - t, t], axis=1), np.stack([-np.ones_like(t), np.ones_like(t)], axis=1)
    shape = [(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)]
    return np.stack(shape, axis=1), np.stack([4 * t - 3, 4 * t - 1, 4 - 8 * t], axis=1)
