"""Closed triangle surfaces as arrays: welding, measures, and binary STL."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError

Vertices = NDArray[np.float64]
Triangles = NDArray[np.int64]
UNITS = {1000.0: "metres", 25.4: "inches", 10.0: "centimetres", 0.001: "micrometres"}
"""Units in which a file of a surface may be, by their length in mm."""

_Number = TypeVar("_Number", np.int64, np.float64)

_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = b"binary STL, millimetres"  # must not begin with "solid", which readers take for the text form


def weld(vertices: Vertices, triangles: Triangles, quantum: float) -> tuple[Vertices, Triangles]:
    """Vertices (k, 3) in mm and triangles (l, 3) of a surface, near vertices merged, in canonical order.

    vertices (n, 3) in mm are rounded to `quantum` mm; triangles (m, 3) that collapse or then lie on one
    another with opposite orientation are removed. Vertices closer than single precision resolves would merge
    in an STL file and open it; rounding first avoids that.
    """
    grid, index = _unique_rows(np.rint(vertices / quantum).astype(np.int64))
    faces = index[triangles]
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = faces[distinct]
    # The smallest index first.
    turned = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3
    faces = _cancelled(np.take_along_axis(faces, turned, axis=1))
    used, index = np.unique(faces, return_inverse=True)
    faces = index.reshape(-1, 3)
    return grid[used] * quantum, faces[np.lexsort(faces.T[::-1])]


def bad_edges(triangles: Triangles) -> int:
    """Number of edges of triangles (m, 3) not shared by two, once in each direction; 0 for a closed surface.

    >>> bad_edges(np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]))
    0
    """
    return sum(map(len, odd_edges(triangles)))


def odd_edges(triangles: Triangles) -> tuple[Triangles, Triangles]:
    """Edges (k, 2) not used once in each direction: those of one or two triangles, and of more."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, place = _unique_rows(np.sort(ends, axis=1))
    ahead = np.bincount(place, weights=ends[:, 0] < ends[:, 1], minlength=len(edges))
    total = np.bincount(place, minlength=len(edges))
    return edges[(total <= 2) & ~((ahead == 1) & (total == 2))], edges[total > 2]


def volume(vertices: Vertices, triangles: Triangles) -> float:
    """Volume in mm3 enclosed by triangles (m, 3) between vertices (n, 3) in mm that face outward.

    By the divergence theorem; a surface that is not closed has no volume, and is not recognised here.
    """
    p, q, r = vertices[triangles.T]
    return float(np.einsum("ij,ij->", p, np.cross(q, r)) / 6.0)


def area(vertices: Vertices, triangles: Triangles) -> float:
    """Area in mm2 of a surface of triangles (m, 3) between vertices (n, 3) in mm."""
    p, q, r = vertices[triangles.T]
    return float(np.linalg.norm(np.cross(q - p, r - p), axis=1).sum() / 2.0)


def winding_number(vertices: Array, triangles: Array, points: Array) -> Array:
    """Winding number (n,) of a closed surface around points (n, 3) in mm: 1 inside, 0 outside.

    The sum of the solid angles of its triangles (f, 3) over 4 pi. Source: Van Oosterom and Strackee,
    IEEE Trans. Biomed. Eng. BME-30 (1983) 125.
    """
    corners = vertices[triangles]
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


def genus(vertices: Vertices, triangles: Triangles) -> int:
    """Genus 1 - (V - E + F)/2 of a closed connected surface of triangles (m, 3) between vertices (n, 3).

    >>> genus(np.eye(4)[:, :3], np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]))
    0
    """
    return 1 - (len(vertices) - 3 * len(triangles) // 2 + len(triangles)) // 2


def stl_bytes(vertices: Vertices, triangles: Triangles) -> bytes:
    """Content of a binary STL file of triangles (m, 3) between vertices (n, 3) in mm.

    The header is fixed, so that equal surfaces give equal files.
    """
    records = np.zeros(len(triangles), _STL)
    records["corners"] = vertices[triangles]
    normal = np.cross(
        vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
        vertices[triangles[:, 2]] - vertices[triangles[:, 0]],
    )
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records["normal"] = normal / np.where(length > 0.0, length, 1.0)
    return _HEADER.ljust(80, b" ") + len(triangles).to_bytes(4, "little") + records.tobytes()


def stl_surface(content: bytes) -> tuple[Vertices, Triangles]:
    """Vertices (n, 3) in mm, equal ones merged, and triangles (m, 3) in the content of a binary STL file.

    Raises InputError where the length does not fit the number of triangles.
    """
    count = int.from_bytes(content[80:84], "little")
    if len(content) != 84 + count * _STL.itemsize:
        raise InputError("the binary STL is truncated or malformed", "STL", "write the file again")
    corners = np.frombuffer(content, _STL, offset=84)["corners"].reshape(-1, 3)
    # A damaged number may be a NaN, whose conversion warns.
    with np.errstate(invalid="ignore"):
        vertices, index = _unique_rows(corners.astype(float))
    return vertices, index.reshape(-1, 3)


def _cancelled(faces: Triangles) -> Triangles:
    """Triangles without the pairs of opposite orientation that a collapsed sliver leaves behind."""
    index = _unique_rows(np.sort(faces, axis=1))[1]
    sign = np.where(faces[:, 1] < faces[:, 2], 1, -1)
    net = np.bincount(index, weights=sign)[index]
    return faces[net * sign > 0]


def _unique_rows(rows: NDArray[_Number]) -> tuple[NDArray[_Number], NDArray[np.int64]]:
    """Distinct rows in lexicographic order and each row's index among them: a fast np.unique(axis=0)."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(new) - 1
    return ordered[new], place
