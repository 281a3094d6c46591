"""Stress and stretch of a deformed body: at its quadrature points, and from there at its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import TET_EDGES
from .elements import ReferenceGradients, reference_gradients, shape_functions, tet_quadrature
from .lattice_law import deformation_gradients, stretches
from .law_at_points import stress
from .rotations import rotation

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh
    from .materials import Materials


_CUT_AWAY = 1e-6
# Poisson's ratio of struts where their resin is not known.
_INCOMPRESSIBLE = 0.5
# Share of a quadrature point's volume beyond which it lies in a beam.
_MOST = 0.5
# Beams among which the one that a place belongs to is sought.
_NEAR = 16


def cauchy(
    mesh: Mesh,
    u: Array,
    materials: Materials,
    history: Sequence[Array] = (),
    reference: ReferenceGradients | None = None,
) -> tuple[Array, Array]:
    """Cauchy stress (m, q, 3, 3) in MPa and deformation gradients (m, q, 3, 3) at the quadrature points.

    u: displacements (n, 3) in mm. sigma = P F^T / det F, the laws of an element added by their weights.
    history: of each law with one, from `MaterialData.kept`. reference: of all elements, if known. Raises
    InputError where a history is missing, since such a law's stress depends on it.
    """
    everywhere = np.arange(len(mesh.tets))
    F, _ = deformation_gradients(mesh, u, everywhere, reference)
    if len(mesh.beams):
        F = of_sections(mesh, u, F, everywhere, materials.small_strain(len(mesh.tets))[1])
    P = np.zeros_like(F)
    points = F.shape[1]
    remembered = iter(history)
    for layer in materials.layers:
        rows = np.repeat(layer.parameters, points, axis=0)
        if layer.law.history:
            own = next(remembered, None)
            if own is None:
                raise InputError(
                    f"{layer.law.name}: its stress depends on how the state was reached",
                    remedy="give the materials' history of it",
                )
            # A step of zero time from a committed state leaves it and its stress unchanged.
            rows = np.hstack([rows, own.reshape(len(rows), -1), np.zeros((len(rows), 1))])
        found = stress(layer.law, F[layer.elements].reshape(-1, 3, 3), rows).reshape(-1, points, 3, 3)
        P[layer.elements] += layer.weight[:, None, None, None] * found
    return P @ np.swapaxes(F, -1, -2) / np.linalg.det(F)[..., None, None], F


def of_sections(mesh: Mesh, u: Array, F: Array, elements: Array, poisson: Array) -> Array:
    """F (e, q, 3, 3) of elements (e,) under displacements u (n, 3) in mm, with that of beams' sections.

    Sections keep their drawn width; a strut stretched by l along its axis narrows by l^-nu. Elements that are
    not swept along a strut have nodes beyond a beam's ends; at points within the beam F is that of its
    sections. poisson (e,): nu.
    """
    beams = _beams_at(mesh)[elements]
    rows, points = np.nonzero(beams >= 0)
    if not len(rows):
        return F
    found, beam = F.copy(), beams[rows, points]
    if mesh.in_beams.size:
        found[rows, points] = _between_sections(mesh, u, beam, _places(mesh, elements[rows], points))
    ends = mesh.nodes[mesh.beams[beam][:, [0, 2]]]
    axis = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None]
    along = axis[:, :, None] * axis[:, None, :]
    stretch = np.linalg.norm(np.einsum("kij,kj->ki", found[rows, points], axis), axis=1)
    lateral = stretch[:, None, None] ** -poisson[rows, None, None]
    found[rows, points] = found[rows, points] @ (along + lateral * (np.eye(3) - along))
    return found


_sought: WeakKeyDictionary[Mesh, Array] = WeakKeyDictionary()


def _beams_at(mesh: Mesh) -> Array:
    """Beam (m, q) that each quadrature point of a mesh lies in, else -1; sought once for a mesh."""
    found = _sought.get(mesh)
    if found is None:
        of_element = mesh.beam_of if len(mesh.beam_of) else np.full(len(mesh.tets), -1)
        found = np.repeat(of_element[:, None], len(tet_quadrature(mesh.order)[0]), axis=1)
        if mesh.in_beams.size:
            rows, points = np.nonzero((found >= 0) | (mesh.in_beams > _MOST))
            found[rows, points] = _nearest_beam(mesh, _places(mesh, rows, points))
        _sought[mesh] = found
    return found


def _places(mesh: Mesh, elements: Array, points: Array) -> Array:
    """Places (k, 3) in mm of quadrature points (k,) of elements (k,), in the undeformed body."""
    shape = shape_functions(tet_quadrature(mesh.order)[0], mesh.order)[points]
    return np.asarray(np.einsum("kn,kni->ki", shape, mesh.nodes[mesh.tets[elements]]))


def _nearest_beam(mesh: Mesh, places: Array) -> Array:
    """Beam (k,) nearest to places (k, 3) in mm."""
    from scipy.spatial import cKDTree

    ends = mesh.nodes[mesh.beams[:, 0::2]]
    near = cKDTree(ends.mean(axis=1)).query(places, min(_NEAR, len(ends)))[1].reshape(len(places), -1)
    start, way = ends[near, 0], ends[near, 1] - ends[near, 0]
    off = places[:, None] - start
    t = np.clip((off * way).sum(axis=2) / (way**2).sum(axis=2), 0.0, 1.0)
    away = np.linalg.norm(off - t[..., None] * way, axis=2)
    return np.asarray(near[np.arange(len(near)), away.argmin(axis=1)])


def _between_sections(mesh: Mesh, u: Array, beam: Array, places: Array) -> Array:
    """F (k, 3, 3) at places (k, 3) in mm of beams (k,): of the motion that `Carried` gives to nodes there."""
    nodes = mesh.beams[beam]
    ends, moved = mesh.nodes[nodes[:, 0::2]], u[nodes[:, 0::2]]
    turned = rotation(u[nodes[:, 1::2]]) - np.eye(3)
    way = ends[:, 1] - ends[:, 0]
    slope = way / (way**2).sum(axis=1)[:, None]
    t = np.clip(((places - ends[:, 0]) * slope).sum(axis=1), 0.0, 1.0)[:, None]
    # Arms are shorter by half the other section's share of the way to it.
    by_place = np.eye(3) - 0.5 * way[:, :, None] * slope[:, None, :]
    found = np.broadcast_to(np.eye(3), (len(beam), 3, 3)).copy()
    for end, share, sign in ((0, 1.0 - t, -1.0), (1, t, 1.0)):
        arm = places - ends[:, end] + 0.5 * (1.0 - share) * sign * way
        found += share[..., None] * (turned[:, end] @ by_place)
        at = np.einsum("kij,kj->ki", turned[:, end], arm) + moved[:, end]
        found += sign * at[:, :, None] * slope[:, None, :]
    return found


def von_mises(sigma: Array) -> Array:
    """Von Mises stress (...) of stress tensors (..., 3, 3), in their unit: sqrt(3/2 s:s), s the deviator.

    >>> import numpy as np
    >>> round(float(von_mises(np.diag([3.0, 0.0, 0.0]))), 9)
    3.0
    """
    mean = np.trace(sigma, axis1=-2, axis2=-1)[..., None, None] / 3.0
    deviator = sigma - mean * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("...ij,...ij->...", deviator, deviator)))


@attrs.frozen(eq=False)
class PeakStretch:
    """The largest principal stretch in a region of a deformed body.

    largest: of all quadrature points; place_mm (3,): where, in the undeformed body. exceeded: the stretch
    that 1 % of the region's volume exceeds; the largest depends on the mesh where struts meet a wall.
    """

    largest: float
    place_mm: Array
    exceeded: float


def peak_stretch(mesh: Mesh, u: Array, region: int) -> PeakStretch:
    """The largest principal stretch of a region under displacements u (n, 3) in mm.

    Points of a printed body's struts that are less than half filled do not count.
    """
    elements = np.flatnonzero(mesh.region == region)
    F, volumes = deformation_gradients(mesh, u, elements)
    if len(mesh.beams):
        F = of_sections(mesh, u, F, elements, np.full(len(elements), _INCOMPRESSIBLE))
    largest = stretches(F)[..., 2]
    if mesh.of_printed_body:
        share = mesh.filled[elements]
        volumes = np.where(share < 0.5, 0.0, volumes * share)
        largest = np.where(share < 0.5, 0.0, largest)
    element, point = np.unravel_index(largest.argmax(), largest.shape)
    shape = shape_functions(tet_quadrature(mesh.order)[0], mesh.order)[point]
    return PeakStretch(
        float(largest.max()),
        shape @ mesh.nodes[mesh.tets[elements[element]]],
        exceeded(largest, volumes),
    )


def exceeded(values: Array, volumes: Array) -> float:
    """The value that 1 % of a volume exceeds, of values and volumes at points, of one shape."""
    order = np.argsort(-values, axis=None)
    above = np.cumsum(volumes.ravel()[order])
    return float(values.ravel()[order[np.searchsorted(above, 0.01 * above[-1])]])


class NodalMean:
    """Values at the quadrature points of some elements (e,) of a mesh, averaged at the nodes.

    They are extrapolated linearly from the points to an element's nodes (its mean where it has one point) and
    averaged over the elements around a node by volume; in a printed mesh by filled volume.
    """

    def __init__(self, mesh: Mesh, elements: Array, reference: ReferenceGradients | None = None) -> None:
        """reference: of all elements of the mesh, where it is known."""
        tets = mesh.tets[elements]
        self._elements = elements
        points, _ = tet_quadrature(mesh.order)
        corners = np.ones((4, 1)) if mesh.order == 1 else np.linalg.inv(points)
        middles = corners[TET_EDGES].mean(axis=1)
        self._to_nodes = corners if mesh.order == 1 else np.vstack([corners, middles])
        if reference is None:
            volumes = reference_gradients(mesh.nodes, tets).volumes.sum(axis=1)
        else:
            volumes = reference.volumes[elements].sum(axis=1)
        if mesh.of_printed_body:
            # Cut parts follow their neighbours: they count only without others.
            volumes *= np.maximum(mesh.filled[elements].mean(axis=1), _CUT_AWAY)
        self.nodes, place = np.unique(tets, return_inverse=True)
        self._place = place.reshape(tets.shape)
        self._share = (
            volumes[:, None]
            / np.bincount(self._place.ravel(), np.repeat(volumes, tets.shape[1]), len(self.nodes))[
                self._place
            ]
        )

    def __call__(self, values: Array) -> Array:
        """Means (k, ...) at `nodes` (k,) of values (m, q, ...) at all elements' points.

        Average tensors first and take invariants after: those of a mean tensor are physically possible.
        """
        mine = values[self._elements]
        flat = mine.reshape(*mine.shape[:2], -1)
        at_nodes = self._share[..., None] * np.einsum("nq,eqc->enc", self._to_nodes, flat)
        place, count = self._place.ravel(), len(self.nodes)
        means = [np.bincount(place, column, count) for column in at_nodes.reshape(len(place), -1).T]
        return np.stack(means, axis=1).reshape(count, *values.shape[2:])
