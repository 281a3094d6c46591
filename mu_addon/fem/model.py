"""A discretised body: energy, residual and tangent of given displacements, pressure and materials."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import warp as wp
from scipy import sparse

from ..meshing.mesh import AXES
from . import kernels
from .elements import reference_gradients, triangle_shapes
from .factor import Cholesky, SuperLU, make_factor, nested_dissection
from .laws import NeoHooke, mat33, parameters

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Materials:
    """Small-strain Young's modulus in MPa and Poisson's ratio of every element, (m,) each."""

    modulus_MPa: Array
    poisson: Array


@attrs.frozen(eq=False)
class Pattern:
    """Sparsity of the tangent between free unknowns: its lower triangle by columns, and an order."""

    indptr: Array
    indices: Array
    order: Array


def _lists(target: Array, count: int) -> tuple[Array, Array]:
    """For each of `count` targets the list of positions that add to it, as (start, index)."""
    index = np.argsort(target, kind="stable")
    start = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(np.bincount(target, minlength=count), out=start[1:])
    return start, index.astype(np.int32)


class Model:
    """Total Lagrangian body under follower pressure on its cavity; base fixed, mirror planes kept.

    mesh: tetrahedra of order 1 or 2 in mm. law: see laws.NeoHooke. held: further supports, (n, 3) bool.
    Displacements are (n, 3) in mm,
    pressure in MPa, energy in mJ (N mm), forces in N. Free unknowns are numbered as in `free`.
    """

    def __init__(
        self,
        mesh: Mesh,
        law: Any = NeoHooke,
        held: Array | None = None,
        device: str = "cpu",
        threads: int = 2,
    ) -> None:
        self.mesh = mesh
        self.law = law
        self.device = device
        self.threads = threads
        self._kernels = kernels.law_kernels(law)
        reference = reference_gradients(mesh.nodes, mesh.tets)
        self.volumes = reference.volumes.sum(axis=1)

        def put(a: Array, dtype: Any) -> wp.array:
            return wp.array(np.ascontiguousarray(a), dtype=dtype, device=device)

        n, m, f = len(mesh.nodes), len(mesh.tets), len(mesh.cavity)
        k, kf = mesh.tets.shape[1], mesh.cavity.shape[1]
        self._tets = put(mesh.tets.astype(np.int32), int)
        self._gradients = put(reference.gradients, wp.vec3d)
        self._dV = put(reference.volumes, wp.float64)
        shape, derivative, weight = triangle_shapes(mesh.order)
        self._faces = put(mesh.cavity.astype(np.int32).reshape(f, kf), int)
        self._face_rule = (
            put(derivative, wp.float64),
            put(shape, wp.float64),
            put(weight, wp.float64),
        )
        self._energy = wp.empty(m, dtype=wp.float64, device=device)
        self._smallest_J = wp.empty(m, dtype=wp.float64, device=device)
        self._face_volume = wp.zeros(f, dtype=wp.float64, device=device)
        self._x = wp.empty(n, dtype=wp.vec3d, device=device)
        self._u = wp.empty(n, dtype=wp.vec3d, device=device)

        self._parts = wp.zeros(m * k + f * kf, dtype=wp.vec3d, device=device)
        self._element_force = self._parts[: m * k].reshape((m, k))
        self._face_force = self._parts[m * k :].reshape((f, kf)) if f else None
        start, index = _lists(np.concatenate([mesh.tets.ravel(), mesh.cavity.ravel()]), n)
        self._node_lists = put(start, int), put(index, int)
        self._residual = wp.empty(n, dtype=wp.vec3d, device=device)

        fixed = np.zeros((n, 3), dtype=bool) if held is None else held.copy()
        fixed[mesh.base] = True
        for axis in mesh.symmetry:
            fixed[mesh.symmetry_nodes(axis), AXES.index(axis)] = True
        self.free = np.nonzero(~fixed.ravel())[0]
        self._build_pattern(fixed, put)

    def _build_pattern(self, fixed: Array, put: Any) -> None:
        mesh = self.mesh
        n = len(mesh.nodes)
        ends = []
        for cells in (mesh.tets, mesh.cavity):
            a, b = np.triu_indices(cells.shape[1])
            ends.append(np.stack([cells[:, a].ravel(), cells[:, b].ravel()], axis=1))
        self._element_blocks = len(ends[0])
        pairs = np.vstack(ends)
        # Parts hold block (a, b); the lower triangle wants row >= column.
        flipped = pairs[:, 0] < pairs[:, 1]
        rows, columns = pairs.max(axis=1).astype(np.int64), pairs.min(axis=1).astype(np.int64)
        keys, target = np.unique(columns * n + rows, return_inverse=True)
        start, index = _lists(target, len(keys))
        index = np.where(flipped[index], -index - 1, index).astype(np.int32)
        self._block_lists = put(start, int), put(index, int)
        self._block_parts = wp.zeros(len(pairs), dtype=mat33, device=self.device)
        self._blocks = wp.empty(len(keys), dtype=mat33, device=self.device)
        block_rows, block_columns = keys % n, keys // n

        number = np.full(3 * n, -1)
        number[self.free] = np.arange(len(self.free))
        i, j = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
        row = number[3 * block_rows[:, None] + i.ravel()]
        column = number[3 * block_columns[:, None] + j.ravel()]
        keep = np.nonzero(((row >= column) & (column >= 0)).ravel())[0]
        row, column = row.ravel()[keep], column.ravel()[keep]
        sorting = np.lexsort((row, column))
        self._scalar_map = keep[sorting]
        indptr = np.zeros(len(self.free) + 1, dtype=np.int64)
        np.cumsum(np.bincount(column, minlength=len(self.free)), out=indptr[1:])

        ones = np.ones(len(keys))
        graph = sparse.coo_matrix((ones, (block_rows, block_columns)), shape=(n, n)).tocsr()
        graph = graph + graph.T
        free_nodes = np.nonzero(~fixed.all(axis=1))[0]
        by_node = free_nodes[nested_dissection(graph[free_nodes][:, free_nodes])]
        unknowns = number[(3 * by_node[:, None] + np.arange(3)).ravel()]
        self.pattern = Pattern(indptr, row[sorting], unknowns[unknowns >= 0])

    @cached_property
    def factor(self) -> Cholesky | SuperLU:
        """The factorisation for tangents of this pattern, analysed once; it holds one factor at a time."""
        return make_factor(self.pattern.indptr, self.pattern.indices, self.pattern.order)

    def parameters(self, materials: Materials) -> wp.array:
        """Law parameters of every element on the device."""
        values = self.law.parameters(materials.modulus_MPa, materials.poisson)
        return wp.array(values, dtype=parameters, device=self.device)

    def _launch(self, kernel: Any, dim: int, inputs: list[Any]) -> None:
        # A CPU launch runs on one core but releases the interpreter, so slices run side by side.
        if self.device != "cpu" or dim < 2048 or self.threads == 1:
            wp.launch(kernel, dim, [0, *inputs], device=self.device)
            return
        cuts = np.linspace(0, dim, self.threads + 1).astype(int)
        with ThreadPoolExecutor(self.threads) as pool:
            list(
                pool.map(
                    lambda c: wp.launch(kernel, int(c[1] - c[0]), [int(c[0]), *inputs], device="cpu"),
                    itertools.pairwise(cuts),
                )
            )

    def _place(self, u: Array) -> None:
        self._u.assign(np.ascontiguousarray(u))
        self._x.assign(self.mesh.nodes + u)

    def potential(self, u: Array, pressure: float, m: wp.array) -> float:
        """Strain energy minus pressure times cavity volume, in mJ; infinite where J <= 0."""
        self._place(u)
        inputs = [self._u, self._tets, self._gradients, self._dV, m, self._energy, self._smallest_J]
        self._launch(self._kernels.energy, len(self.mesh.tets), inputs)
        if self._smallest_J.numpy().min() <= 0:
            return float("inf")
        return float(self._energy.numpy().sum() - pressure * self._volume())

    def _volume(self) -> float:
        if len(self.mesh.cavity) == 0:
            return 0.0
        inputs = [self._x, self._faces, *self._face_rule, self._face_volume]
        wp.launch(kernels.enclosed_volume, len(self.mesh.cavity), inputs, device=self.device)
        return float(self._face_volume.numpy().sum())

    def cavity_volume(self, u: Array) -> float:
        """Volume in mm3 that the deformed cavity surface and the mirror planes enclose."""
        self._place(u)
        return self._volume()

    def smallest_jacobian(self, u: Array, m: wp.array) -> tuple[float, int]:
        """The smallest det F at any quadrature point, and its element."""
        self.potential(u, 0.0, m)
        values = self._smallest_J.numpy()
        return float(values.min()), int(values.argmin())

    def residual(self, u: Array, pressure: float, m: wp.array) -> Array:
        """Internal minus external forces in N, (n, 3), supports included."""
        self._place(u)
        inputs = [self._u, self._tets, self._gradients, self._dV, m, self._element_force]
        self._launch(self._kernels.force, len(self.mesh.tets), inputs)
        if len(self.mesh.cavity):
            inputs = [pressure, self._x, self._faces, *self._face_rule, 0, self._face_force]
            wp.launch(kernels.pressure_force, len(self.mesh.cavity), inputs, device=self.device)
        inputs = [self._parts, *self._node_lists, self._residual]
        wp.launch(kernels.gather_vectors, len(self.mesh.nodes), inputs, device=self.device)
        return self._residual.numpy().copy()

    def force_scale(self) -> float:
        """Root sum of squares of all element and face forces of the last residual, in N."""
        parts = self._parts.numpy()
        return float(np.sqrt(np.einsum("ij,ij->", parts, parts)))

    def tangent(self, u: Array, pressure: float, m: wp.array) -> Array:
        """Values (nnz,) of the tangent's lower triangle by columns, in N/mm, as in `pattern`."""
        self._place(u)
        inputs = [self._u, self._tets, self._gradients, self._dV, m, self._block_parts]
        self._launch(self._kernels.stiffness, len(self.mesh.tets), inputs)
        if len(self.mesh.cavity):
            inputs = [pressure, self._x, self._faces, *self._face_rule]
            inputs += [self._element_blocks, self._block_parts]
            wp.launch(kernels.pressure_stiffness, len(self.mesh.cavity), inputs, device=self.device)
        inputs = [self._block_parts, *self._block_lists, self._blocks]
        self._launch(kernels.gather_blocks, len(self._blocks), inputs)
        return self._blocks.numpy().ravel()[self._scalar_map]

    def matrix(self, values: Array) -> sparse.csc_matrix:
        """The whole symmetric tangent between free unknowns, of its lower triangle's values."""
        size = (len(self.free), len(self.free))
        lower = sparse.csc_matrix((values, self.pattern.indices, self.pattern.indptr), shape=size)
        return lower + sparse.tril(lower, -1).T
