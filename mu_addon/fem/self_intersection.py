"""Self-intersections of a deformed body's walls, which occur without self-contact."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array, connected
from ..design.printing.crossing import near_pairs
from ..meshing.mesh import LATTICE, TET_EDGES, Mesh, boundary_faces, mirror, mirror_displacement
from .state import State

# A segment in a triangle's plane, to rounding: this share of a box of their edges.
_FLAT = 1e-9


def facets_of(faces: Array) -> Array:
    """Flat triangles of faces (f, 3 | 6): four for one with mid-edge nodes."""
    if faces.shape[1] == 3:
        return faces
    return np.vstack([faces[:, [0, 3, 5]], faces[:, [3, 1, 4]], faces[:, [5, 4, 2]], faces[:, [3, 4, 5]]])


@attrs.frozen(eq=False)
class Crossing:
    """Two pieces of a body's surface that intersect.

    place (3,) in mm: their position, deformed. walls (2, 3) in mm: the middle of either piece in the
    undeformed body. inner: for each, True on the cavity. facets: number of intersecting pairs of facets.
    """

    place: Array
    walls: Array
    inner: tuple[bool, bool]
    facets: int

    def __str__(self) -> str:
        names = ["inner" if i else "outer" for i in self.inner]
        one, other = (f"the {n} wall that was at {_text(w)}" for n, w in zip(names, self.walls, strict=True))
        return f"{one} cuts {other}, near {_text(self.place)} mm"


def _text(place: Array) -> str:
    return "(" + ", ".join(f"{c + 0.0:.1f}" for c in place) + ")"


@attrs.frozen(eq=False)
class FirstSelfIntersection:
    """Pressure in MPa at which walls first touch along a path of states, and the crossings there."""

    pressure_MPa: float
    crossings: tuple[Crossing, ...]


def first_self_intersection(mesh: Mesh, states: Sequence[State]) -> FirstSelfIntersection | None:
    """The first pressure in MPa at which walls of a body touch, along a path of states, or None.

    The first state must be free of self-intersections. Between states the body is taken to move along a
    straight line; the pressure is found to a thousandth of a step.
    """
    surface = _Boundary(mesh)
    for before, after in itertools.pairwise(states):
        found = surface.crossings(after.u)
        if not found:
            continue
        low, high = 0.0, 1.0
        while high - low > 1e-3:
            middle = (low + high) / 2
            if surface.crossings(before.u + middle * (after.u - before.u)):
                high = middle
            else:
                low = middle
        first = surface.crossings(before.u + high * (after.u - before.u))
        pressure = before.pressure_MPa + high * (after.pressure_MPa - before.pressure_MPa)
        return FirstSelfIntersection(pressure, first)
    return None


def crossings(mesh: Mesh, u: Array) -> tuple[Crossing, ...]:
    """Self-intersections of a mesh's surface displaced by u (n, 3) in mm, cavity and outside together.

    Mirror images of half meshes count. The crossing of most facets is first.
    """
    return _Boundary(mesh).crossings(u)


class _Boundary:
    """The facets of a whole body's surface, its mirror images included."""

    def __init__(self, mesh: Mesh) -> None:
        self._part = mesh
        whole = mesh
        for axis in mesh.symmetry:
            whole = mirror(whole, axis)
        faces, owner = boundary_faces(whole.tets)
        if whole.of_printed_body:
            # Struts reach into the wall as drawn; their parts outside it are surface.
            outside = (whole.filled[owner] == 1.0).all(axis=1)
            faces, owner = faces[outside], owner[outside]
        cavity = {tuple(f) for f in np.sort(whole.cavity_corners, axis=1).tolist()}
        inner = np.array([tuple(f) in cavity for f in np.sort(faces, axis=1).tolist()])
        own = owner < len(mesh.tets)
        if mesh.order == 2:
            faces = with_middles(faces, whole.tets[owner])
        self.facets = facets_of(faces)
        repeats = len(self.facets) // len(faces)
        self._inner, self._own = np.tile(inner, repeats), np.tile(own, repeats)
        self._rest = whole.nodes
        # Where a strut meets the wall their surfaces cut each other as drawn.
        self._of_strut = np.tile(whole.of_printed_body & (whole.region[owner] == LATTICE), repeats)

    def crossings(self, u: Array) -> tuple[Crossing, ...]:
        """See the module's `crossings`."""
        mesh = self._part
        for axis in mesh.symmetry:
            u = mirror_displacement(mesh, u, axis)
            mesh = mirror(mesh, axis)
        corners = (self._rest + u)[self.facets]
        pairs = self._near(corners)
        pairs = pairs[_cut(corners[pairs[:, 0]], corners[pairs[:, 1]])]
        return tuple(self._crossing(corners, group) for group in self._groups(pairs))

    def _near(self, corners: Array) -> Array:
        """Pairs (p, 2) of facets with overlapping boxes and no common node, not both of them images."""
        pairs = np.sort(np.concatenate(list(near_pairs(corners))), axis=1)
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        pairs = pairs[self._own[pairs].any(axis=1)]
        a, b = pairs.T
        apart = ~(self.facets[a][:, :, None] == self.facets[b][:, None, :]).any(axis=(1, 2))
        mixed = self._of_strut[a] != self._of_strut[b]
        if mixed.any():
            middle = self._rest[self.facets].mean(axis=1)
            largest = np.linalg.norm(np.ptp(corners, axis=1), axis=1).max()
            apart &= ~mixed | (np.linalg.norm(middle[a] - middle[b], axis=1) > largest)
        return pairs[apart]

    def _groups(self, pairs: Array) -> list[Array]:
        """Pairs (p, 2) of facets in groups, those whose facets share nodes together, the largest first."""
        if not len(pairs):
            return []
        nodes = self.facets[pairs].reshape(len(pairs), -1)
        pair = np.repeat(np.arange(len(pairs)), nodes.shape[1])
        label = connected(len(pairs) + len(self._rest), pair, len(pairs) + nodes.ravel())[: len(pairs)]
        groups = [pairs[label == g] for g in np.unique(label)]
        return sorted(groups, key=len, reverse=True)

    def _crossing(self, corners: Array, pairs: Array) -> Crossing:
        # The surface is cut along a curve; walls are told from the pair of facets nearest its middle.
        middles = corners[pairs].mean(axis=(1, 2))
        place = middles.mean(axis=0)
        nearest = pairs[np.linalg.norm(middles - place, axis=1).argmin()]
        walls = self._rest[self.facets[nearest]].mean(axis=1)
        one, other = self._inner[nearest]
        return Crossing(place, walls, (bool(one), bool(other)), len(pairs))


def with_middles(faces: Array, tets: Array) -> Array:
    """Faces (f, 6) with their mid-edge nodes, of corner faces (f, 3) and their elements tets (f, 10).

    Middle k lies between corners k and k + 1.
    """
    number = np.zeros((4, 4), int)
    for k, (a, b) in enumerate(TET_EDGES):
        number[a, b] = number[b, a] = 4 + k
    local = (tets[:, None, :4] == faces[:, :, None]).argmax(axis=2)
    middles = number[local, np.roll(local, -1, axis=1)]
    return np.hstack([faces, np.take_along_axis(tets, middles, axis=1)])


def _cut(a: Array, b: Array) -> Array:
    """Mask (p,) of triangles of two lists (p, 3, 3) that intersect: an edge of one crosses the other."""
    cut = np.zeros(len(a), bool)
    for one, other in ((a, b), (b, a)):
        for k in range(3):
            cut |= _pierced(one[:, k], one[:, (k + 1) % 3], other)
    return cut


def _pierced(start: Array, end: Array, triangle: Array) -> Array:
    """Mask (p,) of segments (p, 3) to (p, 3) that go through their triangle (p, 3, 3); those in its plane do
    not.

    Source: Moeller and Trumbore, J. Graphics Tools 2 (1997) 21.
    """
    origin, first, second = triangle[:, 0], triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    along, offset = end - start, start - origin
    across = np.cross(along, second)
    determinant = np.einsum("pi,pi->p", first, across)
    size = np.prod([np.linalg.norm(v, axis=1) for v in (along, first, second)], axis=0)
    flat = np.abs(determinant) <= _FLAT * size
    determinant = np.where(flat, 1.0, determinant)
    s = np.einsum("pi,pi->p", offset, across) / determinant
    turned = np.cross(offset, first)
    t = np.einsum("pi,pi->p", along, turned) / determinant
    share = np.einsum("pi,pi->p", second, turned) / determinant
    return ~flat & (s >= 0) & (t >= 0) & (s + t <= 1) & (share >= 0) & (share <= 1)
