"""Self-contact: a barrier between pieces of a body's surface, of walls and struts."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from ..arrays import Array
from ..design.parameters import Unit
from ..design.quantity import in_kPa, in_MPa
from ..errors import InputError
from ..meshing.mesh import AXES, LATTICE, Mesh, pieces
from .outer_faces import free_boundary
from .parallel_edges import reweigh
from .self_friction import SelfFriction
from .self_intersection import facets_of

# Distances in gaps: around a strut's foot where it does not touch the wall; and of pairs that the tangent's
# pattern makes room for, so that it grows seldom.
_FOOT = 2.0
_ROOM = 2.0
# A way along the surface, over the straight one, up to which pieces near each other are one neighbourhood.
_ROUND = 2.5
# Pairs of such neighbours, over the number of facets, up to which their facets may go.
_SLIVERS = 0.05
# Relative step in which two edges' smoothing is differentiated.
_SMALL = 1e-4
# Gaps that a node may move before pairs are searched for anew.
_MARGIN = 0.3
# Slip in gaps at which friction is full.
_SLIP = 0.1
# Of a unit: the gap over the wall's thickness, and the barrier's stiffness over the resin's modulus;
# docs/engineering/method.md says what they move.
_GAP_SHARE, _BARRIER_SHARE = 1 / 9, 0.04
# Share of the way to a mirror plane that a step may go, as ipctk has it for the way to a touch.
_SHORT_OF_TOUCH = 0.8


def _ipctk() -> Any:
    try:
        import ipctk
    except ImportError:
        raise InputError(
            "self-contact needs the package ipctk, which is not installed",
            "self-contact",
            "pip install ipctk, or simulate without self-contact",
        ) from None
    # By default it uses every core, and its sums would depend on their number.
    ipctk.set_num_threads(1)
    return ipctk


@attrs.frozen(eq=False)
class _Pairs:
    """Places (v, 3) in mm of the surface's nodes, and ipctk's pairs within the gap there."""

    places: Array
    near: Any


@attrs.frozen(eq=False)
class Touch:
    """Self-contact of a body in one state.

    pressure_kPa (n,): the contact's normal force at each node of the mesh over the undeformed area around it;
    force_N: total normal force between all pieces, mirror images included; gap_mm: the least distance,
    infinite if no pair is within the gap.
    """

    pressure_kPa: Array
    force_N: float
    gap_mm: float


@attrs.frozen(eq=False)
class _Plane:
    """A mirror plane: its axis, and of the surface's k nodes number, area in mm2 and side (1 or -1)."""

    column: int
    nodes: Array
    area: Array
    side: Array

    def distance(self, places: Array) -> Array:
        """Distances (k,) in mm of the nodes from their images, from the places (n, 3) of all."""
        return np.asarray(2 * self.side * places[self.nodes, self.column])


class SelfContact:
    """Energy of a body's surface near itself, for `Model.self_contact`.

    gap_mm: the distance d at which two pieces of the surface begin to repel each other; they never touch.
    stiffness_MPa: k. An area at distance s < d from the opposite surface has the energy -k d ((s/d)^2 - 1)^2
    ln((s/d)^2) in N/mm, so that the pressure grows without bound as they close (Li et al., ACM Trans. Graph.
    39 (2020) 49; weighted by area: Li et al., arXiv 2307.15908). The sum over pairs of vertices with facets
    and of edges with edges counts an area more than once: two flat plates press on each other like a k 2.3 to
    3.1 times as large, by how their meshes lie. Forces balance exactly all the same, and the gap left hardly
    depends on k. Gap and k are constant along a path: energy, forces and tangent are those of one potential.

    Quadratic faces count as four flat triangles each. A node of a half or quarter mesh is kept from its
    mirror image by the same energy over its area: a symmetric body touches its image only on the plane. In a
    printed mesh the struts have contact only from two gaps away from the wall, bar or seat that supports
    them: near it they may cut into it where it bends. Faces of the base have no contact, nor do facets that
    in the undeformed body are nearer than the gap to their neighbourhood, as around the axis of a cap. Facets
    with a common node are not kept apart.

    friction: Coulomb's coefficient, 0 without friction; see `SelfFriction`. A body with it has memory, as
    with a rough `Obstacle`: `time_stepping.simulate_in_time` solves it. On a mirror plane a body and its
    image move equally, so there is no sliding.

    facets (t, 3): the triangles that touch, as node numbers. Raises InputError if ipctk is missing, or pieces
    of the undeformed surface are nearer than the gap: a third of the wall's thickness is safe.
    """

    def __init__(self, mesh: Mesh, gap_mm: float, stiffness_MPa: float, friction: float = 0.0) -> None:
        if not (0 < gap_mm < np.inf and 0 < stiffness_MPa < np.inf):
            raise InputError(
                f"self-contact with a gap of {gap_mm:g} mm and a stiffness of {stiffness_MPa:g} MPa",
                "self-contact",
                "give both above 0: a third of the wall or less, and a tenth of its modulus",
            )
        if not 0 <= friction < np.inf:
            raise InputError(
                f"a coefficient of friction of {friction:g}",
                "self-contact",
                "give a coefficient of 0 or more",
            )
        self._ipctk = _ipctk()
        self.gap_mm, self.stiffness_MPa, self.friction = gap_mm, stiffness_MPa, friction
        self._rest = mesh.nodes
        self._potential, self._wider = (
            self._ipctk.BarrierPotential(reach, stiffness_MPa, True) for reach in (gap_mm, _ROOM * gap_mm)
        )
        facets = _free_facets(mesh)
        if mesh.of_printed_body:
            facets = self._without_feet(mesh, facets)
        self.facets = self._without_slivers(facets)
        self._surface, self._nodes = self._collision_mesh(self.facets)
        self._planes_near: list[_Plane] = []
        # Which of the surface's nodes share a facet.
        three = np.searchsorted(self._nodes, self.facets)
        ends = np.repeat(three, 3, axis=1).ravel(), np.tile(three, 3).ravel()
        self._beside = sparse.csr_matrix((np.ones(len(ends[0])), ends), shape=(len(self._nodes),) * 2)
        # Of the surface's unknowns among the mesh's.
        self._numbers = (3 * self._nodes.astype(np.int64)[:, None] + np.arange(3)).ravel()
        self._planes = [self._mirror_plane(mesh, axis) for axis in mesh.symmetry]
        # Half the time of ipctk's default, and as safe: it advances by what distance and speed allow.
        self._detection = self._ipctk.AdditiveCCD()
        self._last: _Pairs | None = None
        self._kept: tuple[Array, Any] | None = None
        self._friction: SelfFriction | None = None
        if friction:
            parts = self._ipctk, self._surface, self._potential
            self._friction = SelfFriction(*parts, friction, _SLIP * gap_mm)

    def _collision_mesh(self, facets: Array) -> tuple[Any, Array]:
        nodes, triangles = np.unique(facets, return_inverse=True)
        triangles = np.asfortranarray(np.reshape(triangles, (-1, 3)), dtype=np.int32)
        edges = self._ipctk.edges(triangles)
        return self._ipctk.CollisionMesh(np.asfortranarray(self._rest[nodes]), edges, triangles), nodes

    def _close_as_drawn(self, facets: Array, gap_mm: float) -> list[Array]:
        """Nodes (2 to 4,) of each pair of vertices, edges and facets that is nearer than gap_mm as drawn."""
        surface, nodes = self._collision_mesh(facets)
        near = self._ipctk.NormalCollisions()
        near.build(surface, surface.rest_positions, gap_mm)
        ids = (np.array(near[k].vertex_ids(surface.edges, surface.faces)) for k in range(len(near)))
        return [nodes[pair[pair >= 0]] for pair in ids]

    def _without_feet(self, mesh: Mesh, facets: Array) -> Array:
        """Facets without those at the foot of a part supported by another in the undeformed body.

        The wall and a waveguide's bar and seats support struts, and the wall supports bar and seats.
        """
        number = _parts(mesh)
        foot = np.zeros(len(mesh.nodes), bool)
        for pair in self._close_as_drawn(facets, _FOOT * self.gap_mm):
            of = number[pair]
            if (of != of[0]).any():
                foot[pair[of == (of[of > 0].min())]] = True
        return facets[~foot[facets].any(axis=1)]

    def _without_slivers(self, facets: Array) -> Array:
        """Facets without those nearer than the gap, in the undeformed body, to others of their neighbourhood.

        So they are where facets narrow to a point, as around a cap's axis. Raises InputError where pieces are
        near that do not hang together there, a wall's faces or two walls, and where facets are small.
        """
        count = len(facets)
        while close := self._close_as_drawn(facets, self.gap_mm):
            apart = self._not_neighbours(facets, close)
            if apart is not None or len(close) > _SLIVERS * count:
                x, y, z = self._rest[close[0] if apart is None else apart].mean(axis=0)
                raise InputError(
                    f"the surface is within {self.gap_mm:g} mm of itself as drawn, in {len(close)} pairs",
                    f"self-contact, near ({x:.1f}, {y:.1f}, {z:.1f}) mm",
                    "choose a smaller gap: below a third of the wall, and below the size of the facets",
                )
            goes = np.zeros(len(facets), bool)
            for pair in close:
                # A pair's facet goes, and the facets of its edges; of two vertices, all of theirs.
                goes |= np.isin(facets, pair).sum(axis=1) >= min(2, len(pair) - 1)
            facets = facets[~goes]
        return facets

    def _not_neighbours(self, facets: Array, close: list[Array]) -> Array | None:
        """First pair whose nodes are far from each other along the undeformed surface, or None."""
        ends = facets[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).T
        length = np.linalg.norm(self._rest[ends[0]] - self._rest[ends[1]], axis=1)
        graph = sparse.csr_matrix((length, ends), shape=(len(self._rest),) * 2)
        for pair in close:
            place = self._rest[pair]
            most = _ROUND * np.linalg.norm(place[:, None] - place, axis=2).max()
            if np.isinf(dijkstra(graph, False, pair, limit=most)[:, pair]).any():
                return pair
        return None

    def _mirror_plane(self, mesh: Mesh, axis: str) -> _Plane:
        column = AXES.index(axis)
        x = mesh.nodes[self._nodes, column]
        # Nodes nearer than that to the plane belong to faces that end on it.
        off = np.flatnonzero(np.abs(x) > self.gap_mm)
        return _Plane(column, self._nodes[off], np.asarray(self._surface.vertex_areas)[off], np.sign(x[off]))

    @property
    def lost_mJ(self) -> float:
        """Energy dissipated by friction up to the last committed state, in mJ; of a half mesh its half."""
        return 0.0 if self._friction is None else self._friction.lost_mJ

    def begin(self, u: Array | None = None) -> None:
        """Reset friction's memory at displacement u (n, 3) in mm, by default at rest."""
        self._recall(np.zeros_like(self._rest) if u is None else u, 0.0)

    def kept(self) -> dict[str, Array]:
        """Friction's memory as arrays to store, besides the displacement; empty without friction."""
        return {} if self._friction is None else {"lost_mJ": np.array(self._friction.lost_mJ)}

    def restore(self, u: Array, kept: dict[str, Array]) -> None:
        """Set the memory to its value when `kept` stored it, u (n, 3) in mm being the state then."""
        if self._friction is not None:
            self._recall(u, float(kept["lost_mJ"]))

    def _recall(self, u: Array, lost_mJ: float) -> None:
        if self._friction is not None:
            found = self._pairs(u)
            self._friction.recall(found.places, found.near, lost_mJ)

    def lag_from_memory(self) -> None:
        """Take the normal forces that bound friction from the last committed state."""
        if self._friction is not None:
            self._friction.lag_from_memory()

    def lag_change(self, u: Array) -> float:
        """Change of friction's forces if the lag followed to u (n, 3) in mm, over the sum of their bounds."""
        if self._friction is None:
            return 0.0
        found = self._pairs(u)
        return self._friction.lag_change(found.places, found.near)

    def update_lag(self, u: Array) -> None:
        """Update the normal forces that bound friction to displacement u (n, 3) in mm."""
        if self._friction is not None:
            found = self._pairs(u)
            self._friction.update_lag(found.places, found.near)

    def commit(self, u: Array) -> None:
        """Commit a converged state u (n, 3) in mm to friction's memory."""
        if self._friction is not None:
            found = self._pairs(u)
            self._friction.commit(found.places, found.near)

    def without_image(self) -> SelfContact:
        """The same contact of a half body, without contact across its mirror planes."""
        other = copy.copy(self)
        other._planes, other._last, other._kept = [], None, None
        return other

    def relocated(self, mesh: Mesh, gap_mm: float, stiffness_MPa: float) -> SelfContact:
        """The same facets and mirror planes on a mesh of the same elements with moved nodes.

        gap_mm, stiffness_MPa: as the class has them, for the other body. Without friction.
        """
        other = copy.copy(self)
        other.gap_mm, other.stiffness_MPa, other.friction, other._friction = gap_mm, stiffness_MPa, 0.0, None
        other._rest, other._last, other._kept = mesh.nodes, None, None
        other._potential, other._wider = (
            self._ipctk.BarrierPotential(reach, stiffness_MPa, True) for reach in (gap_mm, _ROOM * gap_mm)
        )
        # Computed on demand.
        for name in ("_surface", "_planes"):
            other.__dict__.pop(name, None)
        other._planes_near = self._planes
        return other

    @cached_property
    def _surface(self) -> Any:
        return self._collision_mesh(self.facets)[0]

    @cached_property
    def _planes(self) -> list[_Plane]:
        area = np.asarray(self._surface.vertex_areas)
        return [
            attrs.evolve(plane, area=area[np.searchsorted(self._nodes, plane.nodes)])
            for plane in self._planes_near
        ]

    def energy_mJ(self, u: Array) -> float:
        """Energy in mJ at u (n, 3) in mm; infinite where a mirror plane is crossed."""
        found = self._pairs(u)
        energy = self._potential(found.near, self._surface, found.places) if len(found.near) else 0.0
        if self._friction is not None:
            energy += self._friction.energy_mJ(found.places)
        for plane in self._planes:
            # Half of the whole body's, like everything else.
            energy += 0.5 * plane.area @ self._barrier(plane.distance(self._rest + u))[0]
        return float(energy)

    def forces(self, u: Array) -> tuple[Array, Array]:
        """Nodes (j,) of the surface, each once, and the energy's derivative by them, (j, 3) in N.

        u: displacements (n, 3) in mm.
        """
        forces = self._normal_forces(u)
        if self._friction is not None:
            forces += self._friction.gradient_N(self._places(u))
        return self._nodes, forces

    def _normal_forces(self, u: Array) -> Array:
        """The barrier's derivative (j, 3) in N by the surface's nodes."""
        found = self._pairs(u)
        total = np.zeros_like(self._rest)
        if len(found.near):
            gradient = self._potential.gradient(found.near, self._surface, found.places)
            total[self._nodes] = gradient.reshape(-1, 3)
        for plane in self._planes:
            slope = self._barrier(plane.distance(self._rest + u))[1]
            total[plane.nodes, plane.column] += plane.area * plane.side * slope
        return np.asarray(total[self._nodes])

    def by_places(self, u: Array, along: Sequence[Array]) -> tuple[list[Array], list[Array]]:
        """Derivatives (n, 3) in N of v . forces, for each v of `along`, by displacements and undeformed
        positions.

        u and v: displacements (n, 3) in mm, which stay; gap and stiffness stay, too. Without friction.
        """
        stiffness = self.stiffness(u).tocsr()
        by_u = [np.asarray(stiffness @ v.ravel()).reshape(-1, 3) for v in along]
        found = [one.copy() for one in by_u]
        own = np.stack([v[self._nodes] for v in along])
        for total, of_surface in zip(found, self._by_rest(u, own), strict=True):
            total[self._nodes] += of_surface
        for plane in self._planes:
            slope = self._barrier(plane.distance(self._rest + u))[1]
            for total, v in zip(found, along, strict=True):
                of_node = np.zeros(len(self._rest))
                of_node[plane.nodes] = slope * plane.side * v[plane.nodes, plane.column]
                self._add_by_area(total, of_node)
        return by_u, found

    def _by_rest(self, u: Array, along: Array) -> Array:
        """Derivatives (v, j, 3) of v . forces (v, j, 3) by the undeformed surface at a fixed deformed one.

        By the pairs' weights, which are areas, and where edges are nearly parallel by the smoothing there,
        which is over a share of the squares of their lengths.
        """
        surface, places = self._surface, self._places(u)
        near = self._near(places, self.gap_mm, by_places=True, among=self._candidates(places))
        rest = np.asarray(surface.rest_positions)
        found = np.zeros((len(along), rest.size))
        for number in range(len(near)):
            pair = near[number]
            nodes = np.array(pair.vertex_ids(surface.edges, surface.faces))
            nodes = nodes[nodes >= 0]
            at, v = places[nodes].ravel(), along[:, nodes].reshape(len(along), -1)
            work = v @ self._potential.gradient(pair, at)
            by_weight = pair.weight_gradient
            found[:, by_weight.indices] += np.outer(work / pair.weight, by_weight.data)
            if len(nodes) < 4 or not hasattr(pair, "eps_x"):
                continue
            threshold = pair.eps_x
            sides = []
            for factor in (1.0 + _SMALL, 1.0 - _SMALL):
                pair.eps_x = factor * threshold
                sides.append(v @ self._potential.gradient(pair, at))
            pair.eps_x = threshold
            change = (sides[0] - sides[1]) / _SMALL
            if change.any():
                edges = rest[nodes[[1, 3]]] - rest[nodes[[0, 2]]]
                slope = edges / (edges**2).sum(axis=1)[:, None]
                by_node = np.stack([-slope[0], slope[0], -slope[1], slope[1]]).ravel()
                unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
                found[:, unknowns] += np.outer(change, by_node)
        return found.reshape(len(along), -1, 3)

    def _add_by_area(self, total: Array, weight: Array) -> None:
        """Add derivatives (n, 3) of the nodes' areas, a third of their facets', each times a weight (n,)."""
        a, b, c = (self._rest[corner] for corner in self.facets.T)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        share = weight[self.facets].sum(axis=1)[:, None] / 6.0
        for corner, opposite in zip(self.facets.T, (c - b, a - c, b - a), strict=True):
            np.add.at(total, corner, share * np.cross(normal, opposite))

    def stiffness(self, u: Array, convex: bool = False) -> sparse.coo_matrix:
        """Second derivative (3 n, 3 n) in N/mm of the energy at u (n, 3) in mm, symmetric if not definite.

        convex: that of each pair without its negative eigenvalues, as directions of descent want it.
        """
        rows, columns, values = self._entries(self._pairs(u), convex)
        for plane in self._planes:
            at = 3 * plane.nodes + plane.column
            rows, columns = np.concatenate([rows, at]), np.concatenate([columns, at])
            # The barrier of a distance to a plane is convex as it is.
            bend = self._barrier(plane.distance(self._rest + u))[2]
            values = np.concatenate([values, 2 * plane.area * bend])
        return sparse.coo_matrix((values, (rows, columns)), shape=(self._rest.size,) * 2)

    def room(self, u: Array) -> tuple[Array, Array]:
        """Rows and columns (j,) of 3 n that `stiffness` may fill while the surface moves on a little.

        Those of pairs within some gaps and of the facets around them: a point that slides past an edge or a
        corner faces the next facet. u: displacements (n, 3) in mm.
        """
        places = self._places(u)
        h = self._hessian(self._wider, self._near(places, _ROOM * self.gap_mm), places)
        count = len(self._nodes)
        near = sparse.csr_matrix((np.ones(len(h.row)), (h.row // 3, h.col // 3)), shape=(count, count))
        around = (self._beside @ near @ self._beside).tocoo()
        i, j = (self._nodes.astype(np.int64)[side] for side in (around.row, around.col))
        three = np.arange(3)
        rows = np.repeat(3 * i[:, None] + three, 3, axis=1).ravel()
        return rows, np.tile(3 * j[:, None] + three, 3).ravel()

    def least_gap_mm(self, u: Array) -> float:
        """Least distance in mm of the surface from itself at u (n, 3) in mm; infinite beyond the gap."""
        found = self._pairs(u)
        least = np.inf
        if len(found.near):
            least = float(np.sqrt(found.near.compute_minimum_distance(self._surface, found.places)))
        images = min((float(p.distance(self._rest + u).min()) for p in self._planes), default=np.inf)
        return min(least, images if images < self.gap_mm else np.inf)

    def touch(self, u: Array) -> Touch:
        """Regions where the surface is within the gap of itself at u (n, 3) in mm, and the pressure there."""
        area = np.asarray(self._surface.vertex_areas)
        size = np.linalg.norm(self._normal_forces(u), axis=1)
        pressure = np.zeros(len(self._rest))
        pressure[self._nodes] = in_kPa(size / area)
        # Both pieces of each contact feel its force.
        force = 2.0 ** len(self._planes) * float(size.sum()) / 2.0
        return Touch(pressure, force, self.least_gap_mm(u))

    def count(self, u: Array) -> int:
        """Number of pairs of vertices, edges and facets within the gap at u (n, 3) in mm."""
        return len(self._pairs(u).near)

    def intersects(self, u: Array) -> bool:
        """Return True if the surface intersects itself or a mirror plane at u (n, 3) in mm."""
        if any((plane.distance(self._rest + u) <= 0).any() for plane in self._planes):
            return True
        return bool(self._ipctk.has_intersections(self._surface, self._places(u)))

    def free_share(self, u: Array, to: Array) -> float:
        """Share, up to 1, of the straight way between displacements u and to, (n, 3) in mm, without a touch.

        u must be free of intersections. Where something would touch, the share ends before it does.
        """
        start, end = self._places(u), self._places(to)
        if max(self._moved_mm(start), self._moved_mm(end)) <= self._margin_mm:
            assert self._kept is not None
            candidates = self._kept[1]
        else:
            candidates = self._ipctk.Candidates()
            candidates.build(self._surface, start, end)
        share = float(
            candidates.compute_collision_free_stepsize(self._surface, start, end, 0.0, self._detection)
        )
        for plane in self._planes:
            before, after = (plane.distance(self._rest + v) for v in (u, to))
            crosses = after <= 0
            if crosses.any():
                way = before[crosses] / (before - after)[crosses]
                share = min(share, _SHORT_OF_TOUCH * float(way.min()))
        return share

    def _places(self, u: Array) -> Array:
        return np.asfortranarray((self._rest + u)[self._nodes])

    def forget_candidates(self) -> None:
        """Force a new search of pairs, so that results do not depend on earlier searches."""
        self._kept, self._last = None, None

    @property
    def _margin_mm(self) -> float:
        """Distance that a node may move while the last search's pairs still contain all within the gap."""
        return _MARGIN * self.gap_mm

    def _moved_mm(self, places: Array) -> float:
        """Largest move of a node since the last search whose candidates are kept; infinite without one."""
        return (
            np.inf
            if self._kept is None
            else float(np.sqrt(((places - self._kept[0]) ** 2).sum(axis=1).max()))
        )

    def _candidates(self, places: Array) -> Any:
        """ipctk's candidates: a superset of the pairs within the gap at positions (v, 3)."""
        if self._moved_mm(places) > self._margin_mm:
            found = self._ipctk.Candidates()
            # Boxes are inflated on either side.
            found.build(self._surface, places, self.gap_mm / 2 + self._margin_mm)
            self._kept = places, found
        assert self._kept is not None
        return self._kept[1]

    def _pairs(self, u: Array) -> _Pairs:
        """The pairs within the gap at u, those of the last call where u is the same."""
        places = self._places(u)
        if self._last is not None and np.array_equal(self._last.places, places):
            return self._last
        self._last = _Pairs(places, self._near(places, self.gap_mm, among=self._candidates(places)))
        return self._last

    def _near(self, places: Array, reach_mm: float, by_places: bool = False, among: Any = None) -> Any:
        """ipctk's pairs of the surface nearer than reach_mm at its nodes' places (v, 3) in mm.

        by_places: with the terms for derivatives by undeformed positions. among: candidates that contain all
        pairs; without it weights may be wrong, and only the distances are valid.
        """
        near = self._ipctk.NormalCollisions()
        if by_places:
            # Called again it would double them.
            if not self._surface.are_area_jacobians_initialized():
                self._surface.init_area_jacobians()
            near.enable_shape_derivatives = True
        near.use_area_weighting = True
        near.collision_set_type = self._ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        if among is None:
            near.build(self._surface, places, reach_mm)
        else:
            near.build(among, self._surface, places, reach_mm)
            reweigh(self._ipctk, self._surface, near, among, places, reach_mm)
        return near

    def _hessian(self, potential: Any, near: Any, places: Array, convex: bool = False) -> sparse.coo_matrix:
        """Second derivative of a potential over pairs, by the surface's unknowns (3 v, 3 v)."""
        return potential.hessian(near, self._surface, places, self._projection(convex)).tocoo()

    def _projection(self, convex: bool) -> Any:
        method = self._ipctk.PSDProjectionMethod
        return method.CLAMP if convex else method.NONE

    def _entries(self, found: _Pairs, convex: bool) -> tuple[Array, Array, Array]:
        """Rows, columns and values (j,) of the pairs' second derivative, numbered by the mesh's nodes."""
        parts = []
        if len(found.near):
            parts.append(self._hessian(self._potential, found.near, found.places, convex))
        if self._friction is not None and self._friction.has_pairs:
            parts.append(self._friction.hessian(found.places, self._projection(convex)))
        if not parts:
            return np.empty(0, int), np.empty(0, int), np.empty(0)
        rows, columns, values = (
            np.concatenate([getattr(h, name) for h in parts]) for name in ("row", "col", "data")
        )
        return self._numbers[rows], self._numbers[columns], values

    def _barrier(self, distance: Array) -> tuple[Array, Array, Array]:
        """Energy per area in N/mm at distances (k,) in mm, its slope in MPa and the slope's in MPa/mm."""
        d = self.gap_mm
        near = distance < d
        s = np.where(near, np.maximum(distance, 0.0), d) / d
        energy, slope, bend = np.zeros((3, len(distance)))
        with np.errstate(divide="ignore"):
            q, log = s * s - 1, 2 * np.log(s)
            energy[near] = (-(q**2) * log)[near]
            slope[near] = (-4 * s * q * log - 2 * q**2 / s)[near]
            bend[near] = (-4 * (3 * s**2 - 1) * log - 16 * q + 2 * q**2 / s**2)[near]
        k = self.stiffness_MPa
        return k * d * energy, k * slope, k / d * bend


def _parts(mesh: Mesh) -> Array:
    """Number (n,) of the part of a printed mesh that each node is of: the wall 0, struts, bar and seats."""
    number = pieces(mesh) + 1
    number[mesh.tets[mesh.region != LATTICE]] = 0
    return number


def _free_facets(mesh: Mesh) -> Array:
    """Triangles (t, 3) of a mesh's surface that can touch: not the base's, mirror planes', or buried ones."""
    faces, _ = free_boundary(mesh)
    # Tied nodes of overlapping parts lie inside another part.
    faces = faces[~np.isin(faces, mesh.tied).any(axis=1)]
    if not len(mesh.beams):
        return facets_of(faces)
    # Sections of beams do not deform: of struts flat faces do, a quarter as many. Where solid struts go on
    # their faces must end in the same edges.
    wall = np.zeros(len(mesh.nodes), bool)
    wall[mesh.tets[mesh.region != LATTICE]] = True
    of_wall = wall[faces].all(axis=1)
    return np.concatenate([facets_of(faces[of_wall]), faces[~of_wall][:, :3]])


def self_contact_of(unit: Unit, mesh: Mesh, friction: float = 0.0) -> SelfContact:
    """Self-contact of a printed body's walls and struts, with friction between them. Raises InputError."""
    return SelfContact(mesh, *_barrier_of(unit), friction)


def relocated_contact(contact: SelfContact, unit: Unit, mesh: Mesh) -> SelfContact:
    """Contact of a unit whose mesh is that of another with moved nodes; see `self_contact_of`."""
    return contact.relocated(mesh, *_barrier_of(unit))


def _barrier_of(unit: Unit) -> tuple[float, float]:
    """Gap in mm and stiffness in MPa of a unit's contact with itself."""
    resin_MPa = in_MPa(unit.material.membrane_modulus_kPa)
    return _GAP_SHARE * unit.printed.thinnest_wall, _BARRIER_SHARE * resin_MPa
