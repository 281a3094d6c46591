"""A labelled tetrahedral mesh: plain arrays, their edges and faces, and its mirror image."""

from __future__ import annotations

import hashlib
from typing import Any

import attrs
import numpy as np

from ..arrays import Array, connected, float64, int32
from ..errors import MeshingError

MEMBRANE, LATTICE = 1, 2
AXES = ("x", "y", "z")

# Mid-edge nodes follow the corners in VTK's order; faces are listed with normals out of the element.
TET_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
TET_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
TRIANGLE_EDGES = np.array([[0, 1], [1, 2], [2, 0]])

# A reflection turns an element inside out; exchanging its first two corners turns it back.
FLIPPED_TET = np.array([1, 0, 2, 3, 4, 6, 5, 8, 7, 9])
FLIPPED_TRIANGLE = np.array([1, 0, 2, 3, 5, 4])


def _int8(array: Any) -> Array:
    return np.ascontiguousarray(array, np.int8)


@attrs.frozen(eq=False)
class Mesh:
    """Tetrahedra of order 1 or 2 with regions and the surfaces loads act on.

    nodes (n, 3) float64 in mm; tets (m, 4 | 10) int32, positively oriented, mid-edge nodes in VTK's
    order; region (m,) int8, MEMBRANE or LATTICE; cavity (f, 3 | 6) int32, triangles whose normals
    point out of the solid, into the cavity; base and tip, int32 nodes of the two end planes; symmetry,
    the axes whose zero plane is a mirror of the body.

    A mesh of overlapping parts has two more tables, else empty. filled (m, q): the share, 0 to 1, of the
    volume that counts at each of an element's q quadrature points. tied (t,), tied_to (t, k), tied_weights
    (t, k): nodes that move as the weighted sum of untied nodes.

    A mesh with beams (`fem.beams`) has further tables, else empty. beams (e, 4): for each end the node on the
    strut's axis, and a node without elements whose displacement is that end's rotation vector. flexible (e,
    6): integrals over their sections, see `fem.beams.sections_of`. beam_of (m,): the beam that replaces an
    element, which then has no stiffness, or -1. carried (c,), carriers (c, 4), shares (c,): nodes that move
    with the sections at two beam nodes, given as in `beams`; the first has the weight `shares`, the second
    the rest. in_beams (m, q), or empty: for an element that no beam replaces, the share, 0 to 1, of the
    volume at each quadrature point that lies in a beam and has its stiffness there.
    """

    nodes: Array = attrs.field(converter=float64)
    tets: Array = attrs.field(converter=int32)
    region: Array = attrs.field(converter=_int8)
    cavity: Array = attrs.field(converter=int32)
    base: Array = attrs.field(converter=int32)
    tip: Array = attrs.field(converter=int32)
    symmetry: tuple[str, ...] = ()
    filled: Array = attrs.field(factory=lambda: np.zeros((0, 0)), converter=float64)
    tied: Array = attrs.field(factory=lambda: np.zeros(0), converter=int32)
    tied_to: Array = attrs.field(factory=lambda: np.zeros((0, 0)), converter=int32)
    tied_weights: Array = attrs.field(factory=lambda: np.zeros((0, 0)), converter=float64)
    beams: Array = attrs.field(factory=lambda: np.zeros((0, 4)), converter=int32)
    flexible: Array = attrs.field(factory=lambda: np.zeros((0, 6)), converter=float64)
    beam_of: Array = attrs.field(factory=lambda: np.zeros(0), converter=int32)
    carried: Array = attrs.field(factory=lambda: np.zeros(0), converter=int32)
    carriers: Array = attrs.field(factory=lambda: np.zeros((0, 4)), converter=int32)
    shares: Array = attrs.field(factory=lambda: np.zeros(0), converter=float64)
    in_beams: Array = attrs.field(factory=lambda: np.zeros((0, 0)), converter=float64)

    @property
    def of_printed_body(self) -> bool:
        """True if the mesh is of a printed body, strut by strut, in parts that overlap."""
        return self.filled.size > 0

    @property
    def solid(self) -> Array:
        """Mask (m,) of elements that resist by themselves, and are not part of a beam."""
        return np.ones(len(self.tets), bool) if len(self.beam_of) == 0 else self.beam_of < 0

    @property
    def resisting(self) -> Array:
        """Share (m, q) of the volume at each quadrature point that is filled, and does not lie in a beam."""
        return self.filled * (1.0 - self.in_beams) if self.in_beams.size else self.filled

    def following(self, u: Array) -> Array:
        """Displacements u (n, ...) in mm with tied nodes set to those of the nodes they follow, in place."""
        if len(self.tied):
            u[self.tied] = np.einsum("tk,tk...->t...", self.tied_weights, u[self.tied_to])
        return u

    def folded(self, forces: Array) -> Array:
        """Forces (n, ...) in N with those on tied nodes passed on to the nodes they follow, in place."""
        if len(self.tied):
            weights = self.tied_weights.reshape(*self.tied_to.shape, *(1,) * (forces.ndim - 1))
            np.add.at(forces, self.tied_to, weights * forces[self.tied, None])
            forces[self.tied] = 0.0
        return forces

    @property
    def order(self) -> int:
        """Polynomial order of the elements, 1 or 2."""
        return 1 if self.tets.shape[1] == 4 else 2

    @property
    def corners(self) -> Array:
        """Corner nodes of the tetrahedra, (m, 4)."""
        return self.tets[:, :4]

    @property
    def cavity_corners(self) -> Array:
        """Corner nodes of the cavity triangles, (f, 3)."""
        return self.cavity[:, :3]

    def symmetry_nodes(self, axis: str) -> Array:
        """Nodes on the mirror plane of an axis, (k,) int32; raises MeshingError if it is not one."""
        if axis not in self.symmetry:
            raise MeshingError(
                f"the mesh has no mirror plane {axis} = 0", f"its mirror planes: {self.symmetry or 'none'}"
            )
        return np.flatnonzero(self.nodes[:, AXES.index(axis)] == 0.0).astype(np.int32)

    def hash(self) -> str:
        """SHA-256 of every array and the symmetry, equal only for identical meshes."""
        digest = hashlib.sha256(repr(self.symmetry).encode())
        parts = [self.nodes, self.tets, self.region, self.cavity, self.base, self.tip]
        if self.of_printed_body:
            parts += [self.filled, self.tied, self.tied_to, self.tied_weights]
        if len(self.beams):
            parts += [self.beams, self.flexible, self.beam_of, self.carried, self.carriers, self.shares]
        if self.in_beams.size:
            parts.append(self.in_beams)
        for array in parts:
            digest.update(repr((array.shape, array.dtype.str)).encode())
            digest.update(array.tobytes())
        return digest.hexdigest()


def part(mesh: Mesh, rows: Array) -> Mesh:
    """Some elements (m,) of a mesh, with all its nodes and its base, without other surfaces and ties."""
    region = mesh.region[rows]
    return Mesh(mesh.nodes, mesh.tets[rows], region, mesh.cavity[:0], mesh.base, mesh.tip[:0], mesh.symmetry)


def mirror(mesh: Mesh, axis: str) -> Mesh:
    """The whole body from the part on one side of its mirror plane `axis` = 0 ("x", "y" or "z").

    Nodes on the plane are shared, every other node gains an exact image: n nodes become up to 2 n. Raises
    MeshingError where the plane is not a mirror plane of the mesh.
    """
    column, image = AXES.index(axis), images(mesh, axis)
    off = image >= len(mesh.nodes)
    if len(np.unique(np.sign(mesh.nodes[off, column]))) > 1:
        raise MeshingError("a mesh must lie on one side of its mirror plane", f"plane {axis} = 0")
    reflected = mesh.nodes[off].copy()
    reflected[:, column] *= -1
    tets = image[mesh.tets][:, FLIPPED_TET[: mesh.tets.shape[1]]]
    cavity = image[mesh.cavity][:, FLIPPED_TRIANGLE[: mesh.cavity.shape[1]]]
    return Mesh(
        nodes=np.vstack([mesh.nodes, reflected]),
        tets=np.vstack([mesh.tets, tets]),
        region=np.concatenate([mesh.region, mesh.region]),
        cavity=np.vstack([mesh.cavity, cavity]),
        base=np.unique(np.concatenate([mesh.base, image[mesh.base]])),
        tip=np.unique(np.concatenate([mesh.tip, image[mesh.tip]])),
        symmetry=tuple(a for a in mesh.symmetry if a != axis),
        # Each quadrature point is nearest to one corner, and two corners change places.
        filled=np.vstack([mesh.filled, mesh.filled[:, FLIPPED_TET[: mesh.filled.shape[1]]]]),
        **_mirrored_ties(mesh, image),
        **_mirrored_beams(mesh, image),
    )


def images(mesh: Mesh, axis: str) -> Array:
    """Number (n,) in `mirror(mesh, axis)` of the mirror image of each node.

    Raises MeshingError where the axis has no mirror plane in the mesh.
    """
    off = ~_on_plane(mesh, axis)
    found = np.arange(len(mesh.nodes))
    found[off] = len(mesh.nodes) + np.arange(np.count_nonzero(off))
    return found


def _on_plane(mesh: Mesh, axis: str) -> Array:
    """Mask (n,) of nodes in a mirror plane, rotation vectors of sections there included."""
    found = np.zeros(len(mesh.nodes), bool)
    found[mesh.symmetry_nodes(axis)] = True
    for end in (0, 2):
        found[mesh.beams[:, end + 1]] |= found[mesh.beams[:, end]]
    return found


def _mirrored_beams(mesh: Mesh, image: Array) -> dict[str, Array]:
    """Beams of a mesh and of its mirror image; image (n,): number of each node's image."""
    if not len(mesh.beams):
        return {}
    off = image[mesh.carried] != mesh.carried
    beam_of = np.where(mesh.beam_of < 0, -1, mesh.beam_of + len(mesh.beams))
    return {
        "beams": np.vstack([mesh.beams, image[mesh.beams]]),
        "flexible": np.vstack([mesh.flexible, mesh.flexible]),
        "beam_of": np.concatenate([mesh.beam_of, beam_of]),
        "carried": np.concatenate([mesh.carried, image[mesh.carried[off]]]),
        "carriers": np.vstack([mesh.carriers, image[mesh.carriers[off]]]),
        "shares": np.concatenate([mesh.shares, mesh.shares[off]]),
        "in_beams": np.vstack([mesh.in_beams, mesh.in_beams[:, FLIPPED_TET[: mesh.in_beams.shape[1]]]]),
    }


def _mirrored_ties(mesh: Mesh, image: Array) -> dict[str, Array]:
    """Ties of a mesh and of its mirror image; image (n,): number of each node's image."""
    off = image[mesh.tied] != mesh.tied
    return {
        "tied": np.concatenate([mesh.tied, image[mesh.tied[off]]]),
        "tied_to": np.vstack([mesh.tied_to, image[mesh.tied_to[off]]]),
        "tied_weights": np.vstack([mesh.tied_weights, mesh.tied_weights[off]]),
    }


def mirror_displacement(mesh: Mesh, u: Array, axis: str) -> Array:
    """Displacement (n', 3) of `mirror(mesh, axis)`, of a symmetric displacement u (n, 3) of the mesh.

    Raises MeshingError where the axis has no mirror plane in the mesh.
    """
    image = u.copy()
    image[:, AXES.index(axis)] *= -1
    # A rotation vector is mirrored the other way: what turns about the plane's normal stays.
    image[mesh.beams[:, 1::2].ravel()] *= -1
    return np.vstack([u, image[~_on_plane(mesh, axis)]])


def oriented(nodes: Array, tets: Array) -> Array:
    """Linear tets (m, 4) with those of negative volume turned positive; nodes (n, 3) in mm."""
    volume = np.linalg.det(nodes[tets[:, 1:]] - nodes[tets[:, :1]])
    return np.where((volume < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)


def edges_of(tets: Array) -> tuple[Array, Array]:
    """Unique edges (e, 2), ends ascending, and the numbers (m, 6) of each element's edges among them.

    tets (m, 4 | 10), only corners are used; the six are in VTK's order, `TET_EDGES`.
    """
    pairs = np.sort(tets[:, :4][:, TET_EDGES].reshape(-1, 2), axis=1)
    edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
    return edges, np.reshape(inverse, (-1, 6))


def boundary_faces(tets: Array) -> tuple[Array, Array]:
    """Faces that belong to one tetrahedron only, (f, 3) with normals outward, and its number (f,).

    tets (m, 4 | 10), only corners are used.
    """
    faces = tets[:, :4][:, TET_FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    single = np.sort(first[count == 1])
    return faces[single], single // 4


def pieces(mesh: Mesh) -> Array:
    """Number (n,), from 0, of the connected piece that each node of a mesh belongs to."""
    first, others = mesh.tets[:, :1], mesh.tets[:, 1:]
    return connected(len(mesh.nodes), np.broadcast_to(first, others.shape).ravel(), others.ravel())


def edge_keys(edges: Array, count: int) -> Array:
    """Number (e,) of each edge (e, 2) of a mesh of `count` nodes, ordered as edges are.

    The ends of each edge must ascend.
    """
    return np.asarray(edges[:, 0].astype(np.int64) * count + edges[:, 1])


def second_order(nodes: Array, tets: Array, triangles: Array, middles: Array) -> tuple[Array, Array, Array]:
    """Nodes (n + e, 3), tets (m, 10) and triangles (f, 6) of order 2, from those of order 1.

    nodes (n, 3) and middles (e, 3) in mm; tets (m, 4); triangles (f, 3), of edges of the tets; middles: the
    mid-edge nodes, in the order of `edges_of(tets)`.
    """
    edges, of_tet = edges_of(tets)
    ends = np.sort(triangles[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    of_triangle = np.searchsorted(edge_keys(edges, len(nodes)), edge_keys(ends, len(nodes)))
    return (
        np.vstack([nodes, middles]),
        np.hstack([tets, len(nodes) + of_tet]),
        np.hstack([triangles, len(nodes) + of_triangle.reshape(-1, 3)]),
    )
