"""A discretised body: energy, residual and tangent of given displacements, pressure and materials."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import warp as wp
from scipy import sparse

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import AXES
from . import follower_pressure, kernels
from .beam_fibres import fibres_of, mixtures
from .beams import Beams, frames_along, sections_of
from .carried_nodes import Carried, Folding
from .conjugate_gradients import ConjugateGradients
from .elements import Reference, triangle_shapes
from .factor import Cholesky, SuperLU, make_factor
from .laws import NeoHooke
from .laws.tensors import mat33
from .materials import Layer, Materials
from .sparsity import Pattern, with_entries
from .ties import TiedBlocks

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh
    from .obstacle import Obstacle
    from .self_contact import SelfContact


LEAST_STRAIN = 1e-5
# With mean dilatation, a bulk modulus up to this many shear moduli still acts point by point. Without it, a
# wall one element thick bends 40 % too easily: one face grows, the other shrinks, and the mean sees neither.
# Chosen by the table of tests/fem/test_locking.py; see docs/engineering/method.md.
POINTWISE_BULK = 5.0
# Entries of self-contact stay in the tangent's pattern until it has grown by this factor.
MOST_GROWTH = 1.1


@attrs.frozen(eq=False)
class LayerData:
    """A layer of materials on the device: kernels of its law, and arrays by its k elements.

    rows (k, count): parameters; mean_kappa (k,): bulk modulus in MPa that acts on the mean J; history
    (k, q, h): numbers at the q quadrature points; weight (k,): share of volume; adds (k,): 1 where an earlier
    layer covers the element.
    """

    kernels: kernels.LawKernels
    elements: wp.array
    rows: wp.array
    mean_kappa: wp.array
    history: wp.array
    weight: wp.array
    adds: wp.array


@attrs.define(eq=False)
class MaterialData:
    """A body's materials on the device, layer by layer, with their history.

    dt_s: length of the step. least_force_N: approximate root sum of squares of the element forces of a body
    strained by LEAST_STRAIN; smaller forces are within the rounding of stresses. beams: of a mesh with some.
    """

    layers: tuple[LayerData, ...]
    least_force_N: float = 0.0
    beams: Beams | None = None
    dt_s: float = 0.0

    @property
    def has_history(self) -> bool:
        """True if a law has history, so that a state depends on those before it."""
        return any(layer.history.shape[2] for layer in self.layers)

    def kept(self) -> tuple[Array, ...]:
        """Copy of each law's history, (k, q, h) each, for `restore`."""
        return tuple(layer.history.numpy().copy() for layer in self.layers if layer.history.shape[2])

    def restore(self, kept: Sequence[Array]) -> None:
        """Set each law's history (k, q, h) to a result of `kept`, in the same order."""
        remembering = [layer.history for layer in self.layers if layer.history.shape[2]]
        for history, values in zip(remembering, kept, strict=True):
            history.assign(np.ascontiguousarray(values))

    def forget(self) -> None:
        """Set every law's history, and the step's length, to 0."""
        self.dt_s = 0.0
        for layer in self.layers:
            layer.history.zero_()


def _lists(target: Array, count: int) -> tuple[Array, Array]:
    """For each of `count` targets the list of positions that contribute to it, as (start, index)."""
    index = np.argsort(target, kind="stable")
    start = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(np.bincount(target, minlength=count), out=start[1:])
    return start, index.astype(np.int32)


class Model:
    """A discretised body: energy, residual and tangent under follower pressure on its cavity.

    Total Lagrangian, float64; the base is fixed and mirror planes are kept. Displacements are (n, 3) in mm,
    pressure in MPa, energy in mJ (N mm), forces in N. Unknowns that are free are numbered as in `free`.

    mesh: tetrahedra of order 1 or 2 in mm. supports: degrees of freedom fixed besides, (n, 3) bool. device:
    "cpu" or a CUDA device of Warp. threads: on the CPU. mean_dilatation, against volumetric locking of
    walls and struts one element thick, and of nearly incompressible bodies: the part of each bulk modulus
    above POINTWISE_BULK shear moduli acts on the mean J of an element. True asks it of every law, which must
    then split the volume off; None, of the laws that do so in a printed mesh, and of none in another.

    Attributes: volumes (m,), filled volumes of the elements in mm3; reference, elements in the undeformed
    body.

    Attributes to set: load, dead forces on the nodes (n, 3) in N, or None; obstacles, rigid bodies that it
    may touch; self_contact, contact of its surface with itself, or None. With self-contact `pattern` grows
    when a pair in contact has no entry; `factor` is then replaced.
    """

    def __init__(
        self,
        mesh: Mesh,
        supports: Array | None = None,
        device: str = "cpu",
        threads: int = 2,
        mean_dilatation: bool | None = None,
    ) -> None:
        self.mesh = mesh
        self.device = device
        self.threads = threads
        self.mean_dilatation = mean_dilatation
        self._takes_means = mesh.of_printed_body if mean_dilatation is None else mean_dilatation
        self.solver = "factorisation" if device == "cpu" else "conjugate gradients"
        self.load: Array | None = None
        self.obstacles: tuple[Obstacle, ...] = ()
        self.self_contact: SelfContact | None = None
        self._least_force = self._beam_forces = 0.0
        # Position of the last forces, and these: they rotate with their sections.
        self._seen: tuple[Array, float, MaterialData, Array] | None = None
        self.reference = Reference(mesh, device)
        # Evaluated now, since it raises MeshingError.
        _ = self.reference.at
        put = self._put
        n, m, f = len(mesh.nodes), len(mesh.tets), len(mesh.cavity)
        k, kf = mesh.tets.shape[1], mesh.cavity.shape[1]
        self._tets = put(mesh.tets.astype(np.int32), int)
        shape, derivative, weight = triangle_shapes(mesh.order)
        self._faces = put(mesh.cavity.astype(np.int32).reshape(f, kf), int)
        self._face_rule = (
            put(derivative, wp.float64),
            put(shape, wp.float64),
            put(weight, wp.float64),
        )
        # Of the pressure, on each face.
        self._shares = put(np.ones(f), wp.float64)
        self._energy = wp.empty(m, dtype=wp.float64, device=device)
        # Elements of beams have neither.
        self._energy.zero_()
        self._smallest_J = wp.full(m, 1.0, dtype=wp.float64, device=device)
        self._acting = put(np.flatnonzero(mesh.solid), int)
        means = m if self._takes_means else 0
        self._mean_J = wp.empty(means, dtype=wp.float64, device=device)
        self._mean_slope = wp.empty((means, k), dtype=wp.vec3d, device=device)
        self._face_volume = wp.zeros(f, dtype=wp.float64, device=device)
        self._x = wp.empty(n, dtype=wp.vec3d, device=device)
        self._u = wp.empty(n, dtype=wp.vec3d, device=device)

        self._parts = wp.zeros(m * k + f * kf, dtype=wp.vec3d, device=device)
        self._element_force = self._parts[: m * k].reshape((m, k))
        faces = (
            self._parts[m * k :].reshape((f, kf)) if f else wp.empty((0, kf), dtype=wp.vec3d, device=device)
        )
        self._face_force = faces
        start, index = _lists(np.concatenate([mesh.tets.ravel(), mesh.cavity.ravel()]), n)
        self._node_lists = put(start, int), put(index, int)
        self._residual = wp.empty(n, dtype=wp.vec3d, device=device)

        fixed = np.zeros((n, 3), dtype=bool) if supports is None else supports.copy()
        fixed[mesh.base] = True
        for axis in mesh.symmetry:
            fixed[mesh.symmetry_nodes(axis), AXES.index(axis)] = True
        fixed[mesh.tied] = True
        self._hold_beams(fixed)
        self.free = np.nonzero(~fixed.ravel())[0]
        self._build_pattern()

    @property
    def volumes(self) -> Array:
        """Volumes (m,) in mm3 of the elements, as far as they resist."""
        return np.asarray(self.reference.resisting_volumes.sum(axis=1))

    @property
    def _gradients(self) -> wp.array:
        return self.reference.on_device[0]

    @property
    def _dV(self) -> wp.array:
        return self.reference.on_device[1]

    def _put(self, a: Array, dtype: Any) -> wp.array:
        return wp.array(np.ascontiguousarray(a), dtype=dtype, device=self.device)

    def _build_pattern(self) -> None:
        mesh = self.mesh
        n = len(mesh.nodes)
        ends = []
        for cells in (mesh.tets, mesh.cavity):
            a, b = np.triu_indices(cells.shape[1])
            ends.append(np.stack([cells[:, a].ravel(), cells[:, b].ravel()], axis=1))
        self._element_blocks = len(ends[0])
        pairs = np.vstack(ends)
        # Elements replaced by beams have no stiffness of their own.
        resists = np.repeat(mesh.solid, ends[0].shape[0] // max(len(mesh.tets), 1))
        acting = np.flatnonzero(np.append(resists, np.ones(len(ends[1]), bool)))
        parts = len(pairs)
        pairs = pairs[acting]
        # Parts hold block (a, b); the lower triangle wants row >= column.
        flipped = pairs[:, 0] < pairs[:, 1]
        rows, columns = pairs.max(axis=1).astype(np.int64), pairs.min(axis=1).astype(np.int64)
        keys, target = np.unique(columns * n + rows, return_inverse=True)
        start, index = _lists(target, len(keys))
        index = np.where(flipped[index], -acting[index] - 1, acting[index]).astype(np.int32)
        self._block_lists = self._put(start, int), self._put(index, int)
        self._block_parts = wp.zeros(parts, dtype=mat33, device=self.device)
        self._blocks = wp.empty(len(keys), dtype=mat33, device=self.device)
        self._block_keys = keys
        self._folding = TiedBlocks(mesh, keys, self.device) if len(mesh.tied) else None
        if self._folding is not None:
            keys = self._folding.keys
            self._folded = wp.empty(len(keys), dtype=mat33, device=self.device)
        if len(mesh.beams):
            keys = self._with_beam_blocks(keys)
        block_rows, block_columns = keys % n, keys // n

        self._number = number = np.full(3 * n, -1)
        number[self.free] = np.arange(len(self.free))
        i, j = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
        row = number[3 * block_rows[:, None] + i.ravel()]
        column = number[3 * block_columns[:, None] + j.ravel()]
        keep = np.nonzero(((row >= column) & (column >= 0)).ravel())[0]
        row, column = row.ravel()[keep], column.ravel()[keep]
        sorting = np.lexsort((row, column))
        self._scalar_map = keep[sorting]
        # Where the body's own entries are in a pattern that has grown by those of self-contact.
        self._own: Any = slice(None)
        self.pattern = self._own_pattern = Pattern.of(row[sorting], column[sorting], self.free)

    def _hold_beams(self, fixed: Array) -> None:
        """Fix the unknowns inside beams, which have no stiffness, and apply supports to rotation vectors."""
        mesh = self.mesh
        self._carried = Carried(mesh) if len(mesh.beams) else None
        if self._carried is None:
            return
        moved = np.concatenate([mesh.tets[mesh.solid].ravel(), mesh.cavity.ravel(), mesh.beams.ravel()])
        idle = np.ones(len(mesh.nodes), bool)
        idle[moved] = False
        turns, first = np.unique(mesh.beams[:, 1::2], return_index=True)
        axes = mesh.beams[:, 0::2].ravel()[first]
        clamped = fixed[axes].all(axis=1)
        for axis in mesh.symmetry:
            column = AXES.index(axis)
            on = mesh.nodes[axes, column] == 0.0
            # On a mirror plane a section turns about the plane's normal alone.
            fixed[turns[on]] = True
            fixed[turns[on], column] = False
        fixed[turns[clamped]] = True
        fixed[idle] = True
        fixed[mesh.carried] = True

    def _with_beam_blocks(self, own: Array) -> Array:
        """Keys of the tangent's blocks, with those of beams and of carried nodes; own (b,): without."""
        mesh, n = self.mesh, len(self.mesh.nodes)
        assert self._carried is not None
        is_carried = np.zeros(n, bool)
        is_carried[mesh.carried] = True
        rows, columns = own % n, own // n
        self._carrying = np.flatnonzero(is_carried[rows] | is_carried[columns])
        self._carried_blocks = Folding.of(self._carried, rows[self._carrying], columns[self._carrying])
        ends = mesh.beams
        a, b = np.tril_indices(4)
        first, second = ends[:, a].ravel().astype(np.int64), ends[:, b].ravel().astype(np.int64)
        self._beam_turned = first < second
        of_beams = np.minimum(first, second) * n + np.maximum(first, second)
        f = self._carried_blocks
        of_carried = f.column.astype(np.int64) * n + f.row
        of_turns = self._carried.turns.astype(np.int64) * (n + 1)
        added, target = np.unique(np.concatenate([of_beams, of_carried, of_turns]), return_inverse=True)
        keys = np.union1d(own, added)
        self._own_places = np.searchsorted(keys, own)
        # Where those of beams, of carried nodes and of turning sections are added, and which to each.
        sums = sparse.csr_matrix((np.ones(len(target)), (target, np.arange(len(target)))))
        self._of_beams = np.searchsorted(keys, added), sums
        self._all_keys = keys
        self._three = (3 * ends[:, :, None].astype(np.int64) + np.arange(3)).reshape(-1, 12)
        return keys

    def following(self, u: Array) -> Array:
        """Displacements u (n, 3) in mm with tied and carried nodes moved with their masters, in place."""
        if self._carried is not None:
            self._carried.follow(u)
        return self.mesh.following(u)

    def passed_on(self, u: Array, loads: Any) -> Any:
        """Loads (3 n, c) passed on from tied and carried nodes to those they follow, about u (n, 3) in mm.

        A sparse matrix, which must leave tied nodes out, gives a sparse one.
        """
        if self._carried is not None:
            loads = self._carried.map(u, np.arange(len(u))).T @ loads
        if sparse.issparse(loads):
            return loads.tocsr()
        return self.mesh.folded(loads.reshape(len(u), 3, -1)).reshape(loads.shape)

    def passed_back(self, u: Array, changes: Array) -> Array:
        """Changes (3 n, c) of displacement of all nodes about u (n, 3) in mm, from those of free nodes."""
        changes = self.mesh.following(changes.reshape(len(u), 3, -1)).reshape(changes.shape)
        if self._carried is None:
            return changes
        return np.asarray(self._carried.map(u, np.arange(len(u))) @ changes)

    def unknowns_of_beams(self, u: Array) -> Array:
        """Unknowns (e, 12) of the beams' ends at u (n, 3)."""
        return np.asarray(u.ravel()[self._three])

    def _beam_tangent(self, u: Array, pressure: float, m: MaterialData, own: Array, convex: bool) -> Array:
        """Blocks (b, 3, 3) of the tangent, plus those of beams and of carried nodes."""
        assert m.beams is not None
        assert self._carried is not None
        found = np.zeros((len(self._all_keys), 3, 3))
        found[self._own_places] = own
        stiffness = m.beams.stiffness(self.unknowns_of_beams(u)).reshape(-1, 4, 3, 4, 3)
        a, b = np.tril_indices(4)
        blocks = stiffness[:, a, :, b].transpose(1, 0, 2, 3).reshape(-1, 3, 3)
        blocks = np.where(self._beam_turned[:, None, None], blocks.transpose(0, 2, 1), blocks)
        folded = self._carried_blocks(own[self._carrying], self._carried.operators(u))
        seen = self._seen
        if seen is None or seen[1] != pressure or seen[2] is not m or not np.array_equal(seen[0], u):
            seen = u, pressure, m, self._forces(u, pressure, m)
        turning = self._carried.turning(u, seen[3], convex)
        places, sums = self._of_beams
        added = sums @ np.concatenate([blocks, folded, turning]).reshape(-1, 9)
        found[places] += added.reshape(-1, 3, 3)
        return found

    @cached_property
    def factor(self) -> Cholesky | SuperLU | ConjugateGradients:
        """The solver for tangents of this pattern, analysed once; it holds one tangent at a time.

        A factorisation on the CPU, conjugate gradients on another device, unless `solver` was set.
        """
        indptr, indices, order = self.pattern.indptr, self.pattern.indices, self.pattern.order
        if self.solver == "conjugate gradients":
            return ConjugateGradients(indptr, indices, order, self.device)
        return make_factor(indptr, indices, order)

    def parameters(self, materials: Materials) -> MaterialData:
        """A body's materials on the device, without history.

        Raises InputError for an element without a law, or, with mean_dilatation, a law without separate
        volumetric part.
        """
        covered = np.zeros(len(self.mesh.tets), dtype=np.int32)
        stiffness = np.zeros(len(self.mesh.tets))
        points = self._dV.shape[1]
        layers = []
        solid = self.mesh.solid
        for layer in (one.of(solid[one.elements]) for one in materials.layers):
            law, k = layer.law, len(layer.elements)
            if self.mean_dilatation and not law.split_volume:
                raise InputError(
                    f"{law.name}: has no volumetric part to take the mean of",
                    "a model with mean_dilatation",
                    "use a law of the kind W_iso + kappa/2 (J - 1)^2, or a model without",
                )
            layers.append(
                LayerData(
                    kernels.law_kernels(law, self._takes_means and law.split_volume),
                    self._put(layer.elements, int),
                    self._put(layer.parameters, wp.float64),
                    self._put(self._mean_kappa(layer), wp.float64),
                    wp.zeros((k, points, law.history), dtype=wp.float64, device=self.device),
                    self._put(layer.weight, wp.float64),
                    self._put(covered[layer.elements], int),
                )
            )
            covered[layer.elements] = 1
            stiffness[layer.elements] += layer.weight * law.small_strain(layer.parameters).sum(axis=1)
        bare = np.flatnonzero((covered == 0) & solid)
        if len(bare):
            place = self.mesh.nodes[self.mesh.corners[bare[0]]].mean(axis=0).round(2)
            raise InputError(
                f"{len(bare)} of {len(covered)} elements have no material",
                f"the first is element {bare[0]} near {tuple(place)} mm",
                "add a layer that covers them",
            )
        least = LEAST_STRAIN * np.linalg.norm(stiffness * self.volumes ** (2 / 3))
        return MaterialData(tuple(layers), float(least), self.beams_of(materials))

    def beams_of(self, materials: Materials) -> Beams | None:
        """Beams of the mesh, of their elements' mean laws; None without beams.

        Raises InputError for a law with memory.
        """
        if not len(self.mesh.beams):
            return None
        mesh, (part, share) = self.mesh, self.shares_of_beams
        of = mesh.beam_of[part]
        E, nu = (
            np.bincount(of, share * a[part], len(mesh.beams)) for a in materials.small_strain(len(mesh.tets))
        )
        chord = mesh.nodes[mesh.beams[:, 2]] - mesh.nodes[mesh.beams[:, 0]]
        length, frames = np.linalg.norm(chord, axis=1), frames_along(chord)
        sections = sections_of(length, mesh.flexible, E, nu)
        fibres = None
        if any(layer.law is not NeoHooke for layer in materials.layers):
            laws = mixtures(materials.layers, part, of, share, len(mesh.beams))
            fibres = fibres_of(laws, length, frames, sections, E, nu)
        return Beams(chord, frames, sections, fibres)

    def by_places(self, u: Array, forces: Array, v: Array | None = None) -> Array | float:
        """Derivative (n, 3), by positions, of forces times motion of carried nodes (`Carried.by_places`)."""
        return 0.0 if self._carried is None else self._carried.by_places(u, forces, v)

    @property
    def shares_of_beams(self) -> tuple[Array, Array]:
        """Elements (k,) that are parts of beams, and each one's share (k,) of its beam's volume."""
        mesh = self.mesh
        part = np.flatnonzero(~mesh.solid)
        of, volume = mesh.beam_of[part], self.volumes[part]
        return part, volume / np.bincount(of, volume, len(mesh.beams))[of]

    def _mean_kappa(self, layer: Layer) -> Array:
        """Bulk modulus (k,) in MPa of a layer that acts on the mean J, 0 where it acts point by point."""
        if not (self._takes_means and layer.law.split_volume) or layer.law.bulk is None:
            return np.zeros(len(layer.elements))
        mu, kappa = layer.law.small_strain(layer.parameters).T
        return np.maximum(kappa - POINTWISE_BULK * mu, 0.0)

    def commit(self, u: Array, m: MaterialData) -> None:
        """Store the converged state u (n, 3) in mm as the history of materials and contacts.

        It lies `m.dt_s` seconds after the last one stored.
        """
        for contact in self.remembering:
            contact.commit(u)
        self._place(u)
        for layer in m.layers:
            if layer.kernels.advance:
                inputs = [layer.elements, layer.rows, layer.mean_kappa, layer.history, m.dt_s]
                inputs += [self._u, self._tets, self._gradients]
                self._launch(layer.kernels.advance, len(layer.elements), inputs)

    def forget(self, time_s: float, m: MaterialData) -> None:
        """Clear the history of materials and contacts, and move obstacles with a path to a time in s."""
        m.forget()
        self.move_obstacles(time_s)
        for contact in self.remembering:
            contact.begin()

    def move_obstacles(self, time_s: float) -> None:
        """Move obstacles with a path to their pose at a time in s."""
        for obstacle in self.obstacles:
            obstacle.move(time_s)

    @property
    def remembering(self) -> tuple[Obstacle | SelfContact, ...]:
        """Contacts whose friction may have history: obstacles, and self-contact where it has friction."""
        own = self.self_contact
        return self.obstacles if own is None or not own.friction else (*self.obstacles, own)

    @property
    def has_friction(self) -> bool:
        """True if anything has friction, so that a state depends on those before it."""
        return any(contact.friction for contact in self.remembering)

    def deepest_mm(self, u: Array) -> float:
        """Largest depth in mm of the surface inside any obstacle at u (n, 3) in mm, 0 without contact."""
        return max((obstacle.deepest_mm(u) for obstacle in self.obstacles), default=0.0)

    def _launch_layers(self, kind: str, m: MaterialData, outputs: list[Any]) -> None:
        """Run one kind of element kernel over every layer; the first to cover an element sets its output."""
        body = [self._u, self._tets, self._gradients, self._dV]
        if self._takes_means:
            inputs = [self._acting, *body, self._mean_J, self._mean_slope]
            self._launch(kernels.mean_dilatation, len(self._acting), inputs)
        for layer in m.layers:
            inputs = [layer.elements, layer.rows, layer.mean_kappa, layer.history, layer.weight, layer.adds]
            inputs += [m.dt_s, *body, self._mean_J, *outputs]
            self._launch(getattr(layer.kernels, kind), len(layer.elements), inputs)

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

    @property
    def has_convex_tangent(self) -> bool:
        """True if `tangent` has negative parts of contact to leave out: of pairs, or of turning sections."""
        return self.self_contact is not None or (self._carried is not None and bool(self.obstacles))

    def moved(self, u: Array, step: Array) -> Array:
        """Displacements (n, 3) in mm of u (n, 3) after a step (f,) in mm of the free unknowns.

        Tied nodes follow.
        """
        found = u.copy()
        found.ravel()[self.free] += step
        return self.following(found)

    def before_touch(self, u: Array, to: Array) -> Array:
        """Displacements `to`, (n, 3) in mm, or the last on the straight line from u before surfaces touch.

        u must be free of intersections. Without self-contact that is always `to`.
        """
        if self.self_contact is None:
            return to
        share = self.self_contact.free_share(u, to)
        return to if share == 1.0 else self.following(u + share * (to - u))

    def _place(self, u: Array) -> None:
        self._u.assign(np.ascontiguousarray(u))
        self._x.assign(self.mesh.nodes + u)

    def potential(self, u: Array, pressure: float, m: MaterialData) -> float:
        """Potential in mJ at u (n, 3) in mm and pressure in MPa; infinite where J <= 0 at a quadrature point.

        Strain energy and contact energy, minus pressure times cavity volume and the work of `load`.
        """
        self._place(u)
        self._launch_layers("energy", m, [self._energy, self._smallest_J])
        if self._smallest_J.numpy().min() <= 0:
            return float("inf")
        work = self._pressure_work(pressure)
        if self.load is not None:
            work += np.einsum("ij,ij->", self.load, u)
        work -= sum(obstacle.energy_mJ(u) for obstacle in self.obstacles)
        if self.self_contact is not None:
            work -= self.self_contact.energy_mJ(u)
        if m.beams is not None:
            work -= float(m.beams.energy_mJ(self.unknowns_of_beams(u)).sum())
        return float(self._energy.numpy().sum() - work)

    def _pressure_work(self, pressure: float) -> float:
        """Work in mJ of a pressure in MPa on the cavity's faces, at the displacement in `_place`."""
        return pressure * float(self._shares.numpy() @ self._face_volumes())

    def _face_volumes(self) -> Array:
        """Volume (f,) in mm3 between each of the cavity's faces and the origin, at that displacement."""
        inputs = [self._x, self._faces, *self._face_rule, self._face_volume]
        wp.launch(follower_pressure.enclosed_volume, len(self.mesh.cavity), inputs, device=self.device)
        return np.asarray(self._face_volume.numpy())

    def cavity_volume(self, u: Array) -> float:
        """Volume in mm3 that the cavity surface displaced by u (n, 3) in mm and the mirror planes enclose."""
        self._place(u)
        return float(self._face_volumes().sum())

    def smallest_jacobian(self, u: Array, m: MaterialData) -> tuple[float, int]:
        """The smallest det F at any quadrature point at u (n, 3) in mm, and the number of its element."""
        self.potential(u, 0.0, m)
        values = self._smallest_J.numpy()
        return float(values.min()), int(values.argmin())

    def residual(self, u: Array, pressure: float, m: MaterialData) -> Array:
        """Internal minus external forces (n, 3) in N at u (n, 3) in mm and pressure in MPa.

        Rows of supported unknowns hold the reactions.
        """
        found = self._forces(u, pressure, m)
        if self._carried is not None:
            self._seen = u.copy(), pressure, m, found.copy()
            self._carried.fold(u, found)
            assert m.beams is not None
            forces = m.beams.forces(self.unknowns_of_beams(u))
            found += np.bincount(self._three.ravel(), forces.ravel(), found.size).reshape(-1, 3)
            self._beam_forces = float(np.einsum("ij,ij->", forces, forces))
        return self.mesh.folded(found)

    def _forces(self, u: Array, pressure: float, m: MaterialData) -> Array:
        """Internal minus external forces (n, 3) in N of solids and contact, before they are passed on."""
        self._place(u)
        self._least_force = m.least_force_N
        self._launch_layers("force", m, [self._mean_slope, self._element_force])
        inputs = [pressure, self._shares, self._x, self._faces, *self._face_rule, self._face_force]
        wp.launch(follower_pressure.pressure_force, len(self.mesh.cavity), inputs, device=self.device)
        inputs = [self._parts, *self._node_lists, self._residual]
        wp.launch(kernels.gather_vectors, len(self.mesh.nodes), inputs, device=self.device)
        residual: Array = self._residual.numpy().copy()
        for obstacle in self.obstacles:
            np.add.at(residual, *obstacle.forces(u))
        if self.self_contact is not None:
            nodes, forces = self.self_contact.forces(u)
            residual[nodes] += forces
        if self.load is not None:
            residual -= self.load
        return residual

    def element_forces(self, u: Array, m: MaterialData) -> Array:
        """Internal forces (m, k, 3) in N of every element on its nodes, at displacements (n, 3) in mm."""
        self._forces(u, 0.0, m)
        return np.asarray(self._element_force.numpy().copy())

    def force_scale(self) -> float:
        """Root sum of squares of all element and face forces of the last residual, in N.

        Never below the materials' `least_force_N`, so that a body without load can be in equilibrium.
        """
        parts = self._parts.numpy()
        return max(float(np.sqrt(np.einsum("ij,ij->", parts, parts) + self._beam_forces)), self._least_force)

    def tangent(self, u: Array, pressure: float, m: MaterialData, convex: bool = False) -> Array:
        """Values (nnz,) in N/mm of the tangent's lower triangle by columns, as in `pattern`.

        u: (n, 3) in mm; pressure in MPa, whose follower stiffness is included, as is that of contact. convex:
        self-contact without its negative eigenvalues (`SelfContact.stiffness`), and forces on sections of
        beams without the stiffness of their rotation (`Carried.turning`).
        """
        self._place(u)
        self._launch_layers("stiffness", m, [self._mean_slope, self._block_parts])
        inputs = [pressure, self._shares, self._x, self._faces, *self._face_rule]
        inputs += [self._element_blocks, self._block_parts]
        wp.launch(follower_pressure.pressure_stiffness, len(self.mesh.cavity), inputs, device=self.device)
        values = self._values(u, pressure, m, convex)
        if self.self_contact is None and self.pattern is self._own_pattern:
            return values
        return self._with_self_contact(values, u, convex)

    def _values(self, u: Array, pressure: float, m: MaterialData, convex: bool = False) -> Array:
        """The tangent's own values (nnz,) of the last element stiffness, with beams and obstacles."""
        blocks, on_beams = self._gathered(u)
        if self._carried is not None:
            blocks = self._beam_tangent(u, pressure, m, blocks, convex)
        values = np.asarray(blocks.ravel()[self._scalar_map])
        for pairs, added in on_beams:
            self._add_on_beams(values, u, pairs, added)
        return values

    def _add_on_beams(self, values: Array, u: Array, pairs: Array, blocks: Array) -> None:
        """Add stiffness of obstacles on carried nodes to the tangent's own values (nnz,), in place.

        pairs (j, 2): nodes of one beam's surface, each pair once; blocks (j, 3, 3), symmetric; u (n, 3).
        """
        twice = pairs[:, 0] != pairs[:, 1]
        pairs = np.vstack([pairs, pairs[twice, ::-1]])
        blocks = np.concatenate([blocks, blocks[twice]])
        rows, columns = np.broadcast_arrays(
            3 * pairs[:, :1, None] + np.arange(3)[:, None], 3 * pairs[:, 1:, None] + np.arange(3)
        )
        size = 3 * len(self.mesh.nodes)
        h = self._uncarried(
            sparse.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)), u
        )
        row, column, data = self._lower(h.row, h.col, h.data)
        places, has = self._own_pattern.places(row, column)
        assert has.all(), "a beam's ends have blocks with each other"
        np.add.at(values, places, data)

    def _with_self_contact(self, own: Array, u: Array, convex: bool) -> Array:
        """Values (nnz,) of the tangent with self-contact, its pattern enlarged if need be."""
        found = np.zeros(len(self.pattern.indices))
        found[self._own] = own
        contact = self.self_contact
        if contact is None:
            return found
        h = self._uncarried(contact.stiffness(u, convex), u)
        rows, columns, values = self._lower(h.row, h.col, h.data)
        places, has = self.pattern.places(rows, columns)
        if not has.all():
            more = self._lower(*self._room(u))
            wanted = np.concatenate([rows, more[0]]), np.concatenate([columns, more[1]])
            if len(self.pattern.indices) > MOST_GROWTH * len(own):
                self.forget_contact()
            self.pattern, kept = with_entries(self.pattern, *wanted, self.free)
            self._own = kept[self._own]
            self.__dict__.pop("factor", None)
            places, _ = self.pattern.places(rows, columns)
            found = np.zeros(len(self.pattern.indices))
            found[self._own] = own
        np.add.at(found, places, values)
        return found

    def _uncarried(self, stiffness: sparse.coo_matrix, u: Array) -> sparse.coo_matrix:
        """A stiffness (3 n, 3 n) between all nodes, mapped to those that are not carried, at u (n, 3)."""
        if self._carried is None:
            return stiffness
        nodes = np.unique(stiffness.row // 3)
        place = np.full(len(self.mesh.nodes), -1)
        place[nodes] = np.arange(len(nodes))
        rows, columns = (3 * place[side // 3] + side % 3 for side in (stiffness.row, stiffness.col))
        own = sparse.csr_matrix((stiffness.data, (rows, columns)), shape=(3 * len(nodes),) * 2)
        to = self._carried.map(u, nodes)
        return sparse.coo_matrix(to.T @ own @ to)

    def _room(self, u: Array) -> tuple[Array, Array]:
        """Entries that self-contact may fill, between nodes that are not carried."""
        assert self.self_contact is not None
        rows, columns = self.self_contact.room(u)
        if self._carried is None:
            return rows, columns
        found = self._uncarried(
            sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(3 * len(self.mesh.nodes),) * 2), u
        )
        return found.row, found.col

    def forget_contact(self) -> None:
        """Return to the pattern without self-contact: factors take less time."""
        if self.pattern is not self._own_pattern:
            self.pattern, self._own = self._own_pattern, slice(None)
            self.__dict__.pop("factor", None)

    def _lower(self, rows: Array, columns: Array, values: Array | None = None) -> tuple[Array, Array, Array]:
        """Entries (j,) of the lower triangle among free unknowns, of all (k,): row, column, value."""
        rows, columns = self._number[rows], self._number[columns]
        keep = (rows >= columns) & (columns >= 0)
        return rows[keep], columns[keep], np.zeros(0) if values is None else values[keep]

    def _gathered(self, u: Array) -> tuple[Array, list[tuple[Array, Array]]]:
        """The tangent's blocks (b, 3, 3) of their parts, and of contact with obstacles.

        Also returned, for each obstacle that touches beams: pairs (j, 2) of carried nodes, and their blocks
        (j, 3, 3). A beam's elements have no blocks: its ends have them (`_add_on_beams`).
        """
        inputs = [self._block_parts, *self._block_lists, self._blocks]
        self._launch(kernels.gather_blocks, len(self._blocks), inputs)
        blocks: Array = self._blocks.numpy()
        on_beams = []
        for obstacle in self.obstacles:
            pairs, added = obstacle.blocks(u)
            # Nodes of a face share an element, so each pair has its block; it is symmetric, as the pair is.
            keys = pairs.min(axis=1).astype(np.int64) * len(self.mesh.nodes) + pairs.max(axis=1)
            places = np.minimum(np.searchsorted(self._block_keys, keys), len(self._block_keys) - 1)
            own = self._block_keys[places] == keys
            np.add.at(blocks, places[own], added[own])
            if not own.all():
                on_beams.append((pairs[~own], added[~own]))
        if self._folding is not None:
            inputs = [self._put(blocks, mat33), *self._folding.lists, self._folded]
            self._launch(kernels.spread_blocks, len(self._folded), inputs)
            blocks = self._folded.numpy()
        return blocks, on_beams

    def matrix(self, values: Array) -> sparse.csc_matrix:
        """The whole symmetric tangent (f, f) between the f free unknowns.

        values (nnz,): of its lower triangle by columns, as `tangent` gives them.
        """
        size = (len(self.free), len(self.free))
        lower = sparse.csc_matrix((values, self.pattern.indices, self.pattern.indptr), shape=size)
        return lower + sparse.tril(lower, -1).T
