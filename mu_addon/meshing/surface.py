"""Labelled tetrahedra inside any closed surface mesh, by pytetwild, cached because it has no seed."""

from __future__ import annotations

import contextlib
import hashlib
import sys
import tempfile
import types
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError, MeshingError
from ..files import read_npz, write_npz
from .mesh import LATTICE, Mesh, boundary_faces, edges_of, oriented, second_order
from .quality import check_positive

VOID = 0
# Without a seed pytetwild gives another mesh each time; a sliver on a side made flat is bad luck.
_ATTEMPTS = 4
# Its worst elements have 0.06 to 0.09 of a regular one's volume, those made flat 0 but for rounding.
_FLAT = 1e-3


@attrs.frozen(eq=False)
class Surface:
    """A closed triangulated surface: vertices (n, 3) in mm, triangles (f, 3) with normals outward.

    region: of the space that it encloses, LATTICE, MEMBRANE or VOID.
    """

    vertices: Array
    triangles: Array
    region: int = VOID


def mesh_surface(
    vertices: Array,
    triangles: Array,
    edge_mm: float,
    *,
    region: int = LATTICE,
    inside: Sequence[Surface] = (),
    classify: Callable[[Array], Array] | None = None,
    epsilon_mm: float | None = None,
    order: int = 1,
    symmetry: tuple[str, ...] = (),
    cache: Path | None = None,
) -> Mesh:
    """Fill a closed surface, vertices (n, 3) in mm and triangles (f, 3) outward, with tetrahedra.

    Elements are about edge_mm long; the result stays within epsilon_mm of the surface (a fiftieth of edge_mm
    if not given). Each tetrahedron belongs to the last surface of `inside` that encloses its centroid by
    winding number, else to `region`; or `classify` maps centroids (m, 3) to regions (m,). Elements in VOID
    are left out, and its wall becomes the cavity. Sides on the bounding box are made exactly flat. The lowest
    and highest in z are base and tip; those of `symmetry` must be at zero. Elements of order 2 are
    straight-sided. With a cache folder the same input always gives the same mesh. Raises InputError for a
    surface that is not closed, OutputError for a cache that cannot be written, and MeshingError.
    """
    outer = Surface(np.asarray(vertices, float), np.asarray(triangles), region)
    surfaces = [outer, *inside]
    for surface in surfaces:
        _require_closed(surface)
    starts = np.cumsum([0, *[len(s.vertices) for s in surfaces]])
    points = np.vstack([s.vertices for s in surfaces])
    faces = np.vstack([s.triangles + start for s, start in zip(surfaces, starts, strict=False)])
    epsilon = edge_mm / 50 if epsilon_mm is None else epsilon_mm
    for attempt in range(_ATTEMPTS):
        nodes, tets = _cached(cache, points, faces.astype(np.int32), edge_mm, epsilon, anew=attempt > 0)
        mesh = _labelled(nodes, oriented(nodes, tets), surfaces, classify, epsilon, order, symmetry)
        if not (_fullness(mesh) < _FLAT).any():
            break
    check_positive(mesh)
    return mesh


def _fullness(mesh: Mesh) -> Array:
    """Volume of each element (m,) over that of a regular one with its longest edge, negative if inverted."""
    x = mesh.nodes[mesh.corners]
    volume = np.linalg.det(x[:, 1:] - x[:, :1]) / 6
    longest = np.linalg.norm(x[:, :, None] - x[:, None], axis=-1).max(axis=(1, 2))
    return np.asarray(6 * np.sqrt(2) * volume / longest**3)


def _labelled(
    nodes: Array,
    tets: Array,
    surfaces: Sequence[Surface],
    classify: Callable[[Array], Array] | None,
    epsilon: float,
    order: int,
    symmetry: tuple[str, ...],
) -> Mesh:
    """The tetrahedra inside the first surface, without voids, labelled, and flat where its box is."""
    outer, *inside = surfaces
    tets = tets[winding_number(outer, nodes[tets].mean(axis=1)) > 0.5]
    centroids = nodes[tets].mean(axis=1)
    if classify is not None:
        label = np.asarray(classify(centroids))
    else:
        label = np.full(len(tets), outer.region)
        for surface in inside:
            label[winding_number(surface, centroids) > 0.5] = surface.region
    kept = label != VOID
    outside, _ = boundary_faces(tets)
    used, dense = np.unique(tets[kept], return_inverse=True)
    if not len(used):
        raise MeshingError("no element is left inside the surface", "pytetwild", "make edge_mm smaller")
    number = np.full(len(nodes), -1)
    number[used] = np.arange(len(used))
    nodes, tets = nodes[used], np.reshape(dense, (-1, 4))
    faces, _ = boundary_faces(tets)
    was_outside = {tuple(f) for f in np.sort(number[outside], axis=1).tolist()}
    walls = np.array([tuple(f) not in was_outside for f in np.sort(faces, axis=1).tolist()])
    cavity = faces[walls]

    bounds = np.array([outer.vertices.min(axis=0), outer.vertices.max(axis=0)])
    for column, plane in ((c, p) for c in range(3) for p in bounds[:, c]):
        _flatten(nodes, faces[~walls], column, plane, epsilon)
    if order == 2:
        edges, _ = edges_of(tets)
        nodes, tets, cavity = second_order(nodes, tets, cavity, nodes[edges].mean(axis=1))
    base, tip = (np.flatnonzero(nodes[:, 2] == z) for z in bounds[:, 2])
    return Mesh(nodes, tets, label[kept], cavity, base, tip, symmetry)


def winding_number(surface: Surface, points: Array) -> Array:
    """Winding number (n,) of a closed surface around points (n, 3) in mm: 1 inside, 0 outside.

    The sum of its triangles' solid angles over 4 pi. Source: Van Oosterom and Strackee, IEEE Trans. Biomed.
    Eng. BME-30 (1983) 125.
    """
    corners = surface.vertices[surface.triangles]
    result = np.empty(len(points))
    step = max(1, 500_000 // max(1, len(corners)))
    for start in range(0, len(points), step):
        a, b, c = np.moveaxis(corners - points[start : start + step, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        numerator = np.einsum("pfd,pfd->pf", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("pfd,pfd->pf", u, v) for u, v in ((a, b), (b, c), (c, a)))
        angle = np.arctan2(numerator, la * lb * lc + ab * lc + bc * la + ca * lb)
        result[start : start + step] = angle.sum(axis=1) / (2 * np.pi)
    return result


def _require_closed(surface: Surface) -> None:
    """Raise InputError unless every edge is used once in each direction."""
    directed = surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forward, backward = (np.unique(d, axis=0) for d in (directed, directed[:, ::-1]))
    if len(forward) != len(directed) or not np.array_equal(forward, backward):
        raise InputError(
            "a surface to be meshed is not closed and consistently oriented",
            f"{len(surface.triangles)} triangles",
            "close its holes, merge its double vertices and make its normals point outward",
        )


def _flatten(nodes: Array, faces: Array, column: int, plane: float, epsilon: float) -> None:
    """Move faces lying near a plane, by the tolerance they were meshed with, exactly onto it."""
    near = np.all(np.abs(nodes[faces][:, :, column] - plane) <= 2 * epsilon, axis=1)
    nodes[np.unique(faces[near]), column] = plane


def _cached(
    cache: Path | None, points: Array, faces: Array, edge: float, epsilon: float, *, anew: bool
) -> tuple[Array, Array]:
    """pytetwild's nodes and tets for an input: from the cache folder if it holds them, else computed."""
    if cache is None:
        return _tetrahedralize(points, faces, edge, epsilon)
    digest = hashlib.sha256(repr((points.shape, faces.shape, edge, epsilon, _version())).encode())
    digest.update(np.ascontiguousarray(points).tobytes())
    digest.update(np.ascontiguousarray(faces).tobytes())
    path = Path(cache) / f"tetwild-{digest.hexdigest()[:32]}.npz"
    stored = None if anew else read_npz(path)
    if stored is not None and {"nodes", "tets"} <= stored.keys():
        return stored["nodes"], stored["tets"]
    nodes, tets = _tetrahedralize(points, faces, edge, epsilon)
    write_npz(path, {"nodes": nodes, "tets": tets})
    return nodes, tets


def _tetrahedralize(points: Array, faces: Array, edge: float, epsilon: float) -> tuple[Array, Array]:
    """Nodes (n, 3) and tets (m, 4) from pytetwild; raises MeshingError."""
    pytetwild = load_pytetwild()
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    # fTetWild leaves a file __tracked_surface.stl in the working folder.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        try:
            nodes, tets = pytetwild.tetrahedralize(
                points,
                faces,
                edge_length_abs=edge,
                epsilon=epsilon / diagonal,
                num_threads=1,
                quiet=True,
                # Its own filter misjudges inside and outside where surfaces touch.
                disable_filtering=True,
            )
        except (RuntimeError, ValueError) as error:
            raise MeshingError(
                f"pytetwild failed: {error}", "the given surface", "repair the surface or change edge_mm"
            ) from error
    if not len(tets):
        raise MeshingError("pytetwild returned no elements", "the given surface", "make edge_mm smaller")
    return np.asarray(nodes, float), np.asarray(tets)


def load_pytetwild() -> Any:
    """The pytetwild module. Raises MeshingError where it cannot be loaded.

    It is loaded without pyvista, which it imports only to extend it.
    """
    try:
        with _pyvista_stand_in():
            import pytetwild
    except (ImportError, OSError) as error:
        raise MeshingError(f"pytetwild cannot be loaded: {error}", remedy="pip install pytetwild") from error
    return pytetwild


@contextlib.contextmanager
def _pyvista_stand_in() -> Iterator[None]:
    """An empty module named pyvista while none is loaded: pytetwild 0.4 imports it unconditionally."""
    if "pyvista" in sys.modules or "pytetwild" in sys.modules:
        yield
        return
    sys.modules["pyvista"] = types.ModuleType("pyvista")
    try:
        yield
    finally:
        del sys.modules["pyvista"]


def _version() -> str:
    return str(load_pytetwild().__version__)
