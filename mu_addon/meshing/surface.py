"""Tetrahedra inside any closed surface mesh, by pytetwild, cached because it has no seed."""

from __future__ import annotations

import contextlib
import hashlib
import sys
import tempfile
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..design.surface import bad_edges, winding_number
from ..errors import InputError, MeshingError
from ..files import read_npz, write_npz
from .mesh import LATTICE, Mesh, boundary_faces, edges_of, oriented, second_order
from .quality import check_positive

# Without a seed pytetwild gives another mesh each time; a sliver on a side made flat is bad luck.
_ATTEMPTS = 4
# Its worst elements have 0.06 to 0.09 of a regular one's volume, those made flat 0 but for rounding.
_FLAT = 1e-3


def mesh_surface(
    vertices: Array,
    triangles: Array,
    edge_mm: float,
    *,
    epsilon_mm: float | None = None,
    order: int = 1,
    cache: Path | None = None,
) -> Mesh:
    """Fill a closed surface, vertices (n, 3) in mm and triangles (f, 3) outward, with tetrahedra (LATTICE).

    Elements are about edge_mm long; the result stays within epsilon_mm of the surface (a fiftieth of edge_mm
    if not given). Sides on the bounding box are made exactly flat; base and tip are empty. Elements of order
    2 are straight-sided. With a cache folder the same input always gives the same mesh. Raises InputError for
    a surface that is not closed, OutputError for a cache that cannot be written, and MeshingError.
    """
    points, faces = np.asarray(vertices, float), np.asarray(triangles)
    if bad_edges(faces):
        raise InputError(
            "a surface to be meshed is not closed and consistently oriented",
            f"{len(faces)} triangles",
            "close its holes, merge its double vertices and make its normals point outward",
        )
    epsilon = edge_mm / 50 if epsilon_mm is None else epsilon_mm
    for attempt in range(_ATTEMPTS):
        nodes, tets = _cached(cache, points, faces.astype(np.int32), edge_mm, epsilon, anew=attempt > 0)
        mesh = _inside(points, faces, nodes, oriented(nodes, tets), epsilon, order)
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


def _inside(points: Array, faces: Array, nodes: Array, tets: Array, epsilon: float, order: int) -> Mesh:
    """The tetrahedra inside a surface, flat where its box is."""
    tets = tets[winding_number(points, faces, nodes[tets].mean(axis=1)) > 0.5]
    used, dense = np.unique(tets, return_inverse=True)
    if not len(used):
        raise MeshingError("no element is left inside the surface", "pytetwild", "make edge_mm smaller")
    nodes, tets = nodes[used], np.reshape(dense, (-1, 4))
    outside, none = boundary_faces(tets)[0], np.zeros((0, 3), np.int32)
    for column, plane in ((c, p) for c in range(3) for p in (points[:, c].min(), points[:, c].max())):
        near = np.all(np.abs(nodes[outside][:, :, column] - plane) <= 2 * epsilon, axis=1)
        nodes[np.unique(outside[near]), column] = plane
    if order == 2:
        edges, _ = edges_of(tets)
        nodes, tets, none = second_order(nodes, tets, none, nodes[edges].mean(axis=1))
    return Mesh(nodes, tets, np.full(len(tets), LATTICE), none, base=[], tip=[])


def _cached(
    cache: Path | None, points: Array, faces: Array, edge: float, epsilon: float, *, anew: bool
) -> tuple[Array, Array]:
    """pytetwild's nodes and tets for an input: from the cache folder if it holds them, else computed."""
    if cache is None:
        return _tetrahedralize(points, faces, edge, epsilon)
    digest = hashlib.sha256(
        repr((points.shape, faces.shape, edge, epsilon, str(load_pytetwild().__version__))).encode()
    )
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
