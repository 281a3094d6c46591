"""One printed cell of the lattice: an eighth of its struts, blocks made of it, its density."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, connected
from ..errors import InputError
from . import shapes
from .gates import GateError, of_surface, require
from .lattice import filled
from .lattice_kinds import LatticeKind
from .surface import Triangles, Vertices, bad_edges, genus, stl_bytes, stl_surface, volume, weld

if TYPE_CHECKING:
    from .parameters import Unit


_GRID = 2**18
# Half a cell is a whole number of steps of its vertices' grid: its flat sides are exactly on the planes, and
# images that meet there share their vertices exactly.

_STEPS = (4, 1, 16)
# Steps of that grid that vertices are rounded to; the first that leaves every edge to two triangles is kept.
# The first is 1e-4 mm in the paper's cell.

_CORE = 0.95
# Size of a ball within the struts' own ends: it closes the seams between them and adds no facets.


@attrs.frozen
class Facets:
    """Numbers of flat pieces around a strut, a multiple of 4 from 8 to 128, and along it, 1 to 128.

    Only with a multiple of 4 are mirrored struts mirror images to their last facet. Raises InputError.
    """

    around: int = 24
    along: int = 10

    def __attrs_post_init__(self) -> None:
        if self.around % 4 or not 8 <= self.around <= 128 or not 1 <= self.along <= 128:
            raise InputError(
                f"{self.around} facets around and {self.along} along a strut are not offered",
                "facets",
                "give a multiple of 4 from 8 to 128 around, and 1 to 128 along",
            )


@attrs.frozen
class StrutCell:
    """A lattice's cell as printed, at scale: edge, nominal strut radii and print offsets in mm.

    offset_xy_mm, offset_z_mm: print offset in the plane and along the build axis z; skin_depth_mm,
    skin_factor: depth of the more cured skin, and its modulus over the core's. Raises InputError for a kind
    without three mirror planes, struts that are not connected or have no material, and cells that close.
    """

    kind: LatticeKind
    size_mm: float
    junction_radius_mm: float
    midspan_radius_mm: float
    offset_xy_mm: float = 0.0
    offset_z_mm: float = 0.0
    skin_depth_mm: float = 0.0
    skin_factor: float = 1.0

    def __attrs_post_init__(self) -> None:
        for field in attrs.fields(StrutCell):
            value = getattr(self, field.name)
            if field.name != "kind" and not np.isfinite(value):
                raise InputError(f"{field.name} = {value!r} is not a number", "strut cell", "give a number")
        if not all(self.kind.mirrors):
            across = [axis for axis, same in zip("xyz", self.kind.mirrors, strict=True) if not same]
            raise InputError(
                f"lattice {self.kind.name!r} is not its own mirror image across {' and '.join(across)}",
                "lattice kind",
                "only kinds with three mirror planes can be computed on an eighth of their cell",
            )
        for name in ("size_mm", "junction_radius_mm", "midspan_radius_mm", "skin_factor"):
            if getattr(self, name) <= 0.0:
                raise InputError(
                    f"{name} = {getattr(self, name):g} is not positive", "strut cell", "give more than 0"
                )
        if self.skin_depth_mm < 0.0:
            raise InputError(f"skin_depth_mm = {self.skin_depth_mm:g} is negative", "strut cell", "give 0")
        t = np.linspace(0.0, 1.0, 33)
        radii = self.kind.radius(t, self.junction_radius_mm, self.midspan_radius_mm)
        thinnest = float(radii.min()) + min(self.offset_xy_mm, self.offset_z_mm)
        if thinnest <= 0.0:
            raise InputError(
                f"offsets of {self.offset_xy_mm:g} mm in the plane and {self.offset_z_mm:g} mm along "
                f"z leave no material of struts of {2.0 * radii.min():g} mm",
                "[print] offset_xy_mm, offset_z_mm",
                f"choose offsets above {-radii.min():g} mm",
            )
        widest = 2.0 * (float(radii.max()) + max(0.0, self.offset_xy_mm, self.offset_z_mm))
        opening = min(self.kind.opening, 1.0) * self.size_mm
        if widest >= opening:
            raise InputError(
                f"struts printed {widest:.4g} mm wide fill the cell of {self.size_mm:g} mm: "
                f"its openings, {opening:.4g} mm across, close",
                "[lattice] midspan_diameter_mm, [print] offset_xy_mm, offset_z_mm",
                "choose thinner struts, a smaller offset or a larger cell",
            )
        _check_paths(self)

    @property
    def offset(self) -> Array:
        """Print offset (3,) of surfaces that face x, y and z, in mm."""
        return np.array([self.offset_xy_mm, self.offset_xy_mm, self.offset_z_mm])

    @property
    def half_mm(self) -> float:
        """Edge of the octant, half a cell, in mm."""
        return self.size_mm / 2.0

    def radius(self, t: ArrayLike) -> Array:
        """Nominal strut radii in mm (any shape) at fractions t, 0 .. 1, (any shape) of the strut's length."""
        return self.kind.radius(np.asarray(t, float), self.junction_radius_mm, self.midspan_radius_mm)


def strut_cell(unit: Unit) -> StrutCell:
    """The printed cell of a unit's lattice, at the unit's scale. Raises InputError as `StrutCell` does."""
    d, p = unit.dimensions, unit.print
    return StrutCell(
        kind=d.kind,
        size_mm=d.cell,
        junction_radius_mm=d.junction_diameter / 2.0,
        midspan_radius_mm=d.midspan_diameter / 2.0,
        offset_xy_mm=p.offset_xy_mm,
        offset_z_mm=p.offset_z_mm,
        skin_depth_mm=p.skin_depth_mm,
        skin_factor=p.skin_factor,
    )


def octant_surface(cell: StrutCell, facets: Facets | None = None) -> tuple[Vertices, Triangles]:
    """The printed lattice within [0, size/2]^3 mm: vertices (n, 3) in mm, triangles (m, 3) facing outward.

    The octant's corner at the origin is one of the cell's. Flat sides lie exactly on the six planes, and
    reflections in these planes give the whole lattice. Cells that differ only in size have the same surface,
    scaled. Raises GateError where the surface cannot be closed.
    """
    vertices, triangles = _octant(_shape(cell), facets or Facets())
    return vertices * (cell.half_mm / _GRID), triangles.copy()


def relative_density(cell: StrutCell, facets: Facets | None = None) -> float:
    """Relative density of the printed cell: the solid's share of the cell's volume, 0 .. 1, of its facets.

    Raises GateError as `octant_surface` does.
    """
    vertices, triangles = _octant(_shape(cell), facets or Facets())
    return volume(vertices / _GRID, triangles)


def mass_g(cell: StrutCell, density_g_per_ml: float, n: int = 1, facets: Facets | None = None) -> float:
    """Mass in g of n x n x n printed cells of a resin of this density in g/ml.

    Raises GateError as `octant_surface` does.
    """
    return relative_density(cell, facets) * (n * cell.size_mm / 10.0) ** 3 * density_g_per_ml


def specimen_solid(cell: StrutCell, n: int, facets: Facets | None = None) -> tuple[Vertices, Triangles]:
    """Closed surface of n x n x n cells in [0, n size]^3 mm: vertices (v, 3) in mm and triangles (t, 3).

    Raises InputError for n below 1, GateError for a surface that is open, in pieces, or of another genus than
    E - V + 1 of the lattice's graph, as when struts close openings or touch without a shared node.
    """
    if n < 1:
        raise InputError(f"{n} cells a side are too few", "specimen", "give 1 or more")
    octant, faces = _octant(_shape(cell), facets or Facets())
    side = 2 * n
    parts: list[NDArray[np.int64]] = []
    orders: list[Triangles] = []
    for place in product(range(side), repeat=3):
        odd = np.array(place) % 2 == 1
        points = np.where(odd, _GRID - octant, octant) + np.array(place) * _GRID
        order = faces[:, ::-1] if odd.sum() % 2 else faces
        flat = np.zeros(len(faces), bool)
        for axis in range(3):
            level = points[:, axis][faces]
            for plane in (place[axis], place[axis] + 1):
                if 0 < plane < side:
                    flat |= (level == plane * _GRID).all(axis=1)
        orders.append(order[~flat] + len(parts) * len(octant))
        parts.append(points)
    vertices, triangles = weld(np.concatenate(parts).astype(float), np.concatenate(orders), 1.0)
    vertices *= cell.half_mm / _GRID
    _require(cell, n, vertices, triangles)
    return vertices, triangles


def depth_below_surface(cell: StrutCell, points: ArrayLike) -> Array:
    """Depths (n,) in mm of points (n, 3) in mm below the printed surface of the periodic lattice; 0 outside.

    The largest of the depths within each strut alone: the distance to its surface, square to its axis, with
    the radius of that place. It is exact in straight struts and a lower bound at junctions, where struts
    merge; the taper's slope (below 0.1) and the facets are left out.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    folded = np.mod(points, cell.size_mm)
    folded = np.minimum(folded, cell.size_mm - folded)
    depth = np.zeros(len(points))
    even = cell.offset_xy_mm == cell.offset_z_mm
    for start, end in _struts(cell) * cell.size_mm:
        axis = end - start
        t = np.clip((folded - start) @ axis / (axis @ axis), 0.0, 1.0)
        away = folded - start - t[:, None] * axis
        found = cell.radius(t) + max(cell.offset_xy_mm, cell.offset_z_mm) - np.linalg.norm(away, axis=1)
        if not even:
            deeper = found > depth
            found[deeper] = cell.radius(t[deeper]) + _section_depth(cell, axis, away[deeper])
        depth = np.maximum(depth, found)
    return depth


def _section_depth(cell: StrutCell, axis: Array, away: Array) -> Array:
    """Distance (n,) to the sides of a strut's section from places (n, 3) in it, less the strut's radius.

    The least, over all normals, of the offset minus the position along the normal: for a convex section the
    distance to its boundary.
    """
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    toward = np.divide(away, distance, out=np.zeros_like(away), where=distance > 0.0)
    outward = np.sum(shapes.offset_along(toward, cell.offset) * toward, axis=1)
    least = np.where(distance[:, 0] > 0.0, outward - distance[:, 0], np.inf)
    for normal in shapes.ring(axis, 48):
        least = np.minimum(least, shapes.offset_along(normal, cell.offset) @ normal - away @ normal)
    return np.asarray(least)


@attrs.frozen
class _Shape:
    """Inputs of a cell's surface, in cells, rounded so that scaled cells are equal."""

    kind: LatticeKind
    junction_radius: float
    midspan_radius: float
    offset_xy: float
    offset_z: float


def _shape(cell: StrutCell) -> _Shape:
    lengths = (cell.junction_radius_mm, cell.midspan_radius_mm, cell.offset_xy_mm, cell.offset_z_mm)
    return _Shape(cell.kind, *(round(length / cell.size_mm, 12) for length in lengths))


def _struts(cell: StrutCell) -> Array:
    """Both ends (e, 2, 3), in cells, of the infinite lattice's struts near the octant."""
    shape = _shape(cell)
    widest = float(cell.radius(np.linspace(0.0, 1.0, 33)).max()) / cell.size_mm
    return _near(shape, widest + max(0.0, shape.offset_xy, shape.offset_z))


@lru_cache(maxsize=64)
def _near(shape: _Shape, reach: float) -> Array:
    kind, period = shape.kind, shape.kind.divisions
    shifts = np.array(list(product((-1, 0, 1), repeat=3))) * period
    ends = (kind.grid[kind.struts] + shifts[:, None, None, :]).reshape(-1, 2, 3)
    # Struts on a cell's face come once from either side: each is kept once, from its lower end.
    swap = _descending(ends)
    ends[swap] = ends[swap][:, ::-1]
    ends = np.unique(ends.reshape(-1, 6), axis=0).reshape(-1, 2, 3) / period
    beside = (ends.min(axis=1) >= 0.5 + reach).any(axis=1) | (ends.max(axis=1) <= -reach).any(axis=1)
    return np.asarray(ends[~beside])


def _descending(ends: NDArray[np.int64]) -> NDArray[np.bool_]:
    """True if the first of two ends (e, 2, 3) comes after the second, by x, then y, then z."""
    step = ends[:, 1] - ends[:, 0]
    first = step[np.arange(len(step)), np.argmax(step != 0, axis=1)]
    return np.asarray(first < 0)


@lru_cache(maxsize=16)
def _octant(shape: _Shape, facets: Facets) -> tuple[NDArray[np.int64], Triangles]:
    """Vertices of the octant in whole steps of 1/_GRID of its side, and its triangles."""
    solid = _octant_solid(shape, facets)
    for step in _STEPS:
        mesh = solid.simplify(step / _GRID).to_mesh64()
        vertices = np.array(mesh.vert_properties)[:, :3]
        for plane in (0.0, 1.0):
            vertices[np.abs(vertices - plane) < 1.5 * step / _GRID] = plane
        faces = np.asarray(mesh.tri_verts).astype(np.int64)
        rounded, faces = weld(vertices * float(_GRID), faces, float(step))
        if not bad_edges(faces):
            break
    else:
        raise GateError(
            f"{bad_edges(faces)} edges of the cell are not shared by two triangles (gate: closed surface)",
            f"lattice {shape.kind.name!r}",
            "try other facets or slightly different diameters",
        )
    return np.rint(rounded).astype(np.int64), faces


def _octant_solid(shape: _Shape, facets: Facets) -> Any:
    """The octant as a Manifold in the unit cube."""
    from manifold3d import Manifold, OpType

    kind = shape.kind
    t = np.linspace(0.0, 1.0, facets.along + 1)
    radii = 2.0 * kind.radius(t, shape.junction_radius, shape.midspan_radius)
    offset = 2.0 * np.array([shape.offset_xy, shape.offset_xy, shape.offset_z])
    grown = offset if offset.any() else None
    widest = float(radii.max() + max(0.0, *offset.tolist())) * shapes.inscribed(facets.around)
    ends = 2.0 * _near(shape, widest / 2.0)
    parts = [
        shapes.spindle(end - start, radii, facets.around, grown).translate(start.tolist())
        for start, end in ends
    ]
    # A ball at each node; where the struts leave none of it bare, one within them that fills their seams.
    nodes = np.unique(ends.reshape(-1, 3), axis=0)
    way = ends[:, 1] - ends[:, 0]
    ball = shapes.ball(float(radii[0]), facets.around, grown)
    for node in nodes[((nodes > -widest) & (nodes < 1.0 + widest)).all(axis=1)]:
        start, end = ((ends[:, k] == node).all(axis=1) for k in (0, 1))
        covered = _spans(np.concatenate([way[start], -way[end]]))
        parts.append((ball.scale([_CORE] * 3) if covered else ball).translate(node.tolist()))
    return Manifold.batch_boolean(parts, OpType.Add) ^ shapes.box([0.0] * 3, [1.0] * 3)


def _spans(directions: Array) -> bool:
    """True if every direction in space is within less than 90 degrees of one of these (k, 3)."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return bool((unit @ _SPHERE.T).max(axis=0).min() > 0.1)


def _sphere_points(n: int) -> Array:
    """Nearly even points (n, 3) on the unit sphere, on a spiral of the golden angle."""
    z = 1.0 - (2.0 * np.arange(n) + 1.0) / n
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    return np.stack([np.sqrt(1.0 - z**2) * np.cos(angle), np.sqrt(1.0 - z**2) * np.sin(angle), z], axis=1)


_SPHERE = _sphere_points(400)


@lru_cache(maxsize=64)
def _pieces(shape: _Shape) -> tuple[Array, ...]:
    """Box (2, 3) of each piece of the octant, in the unit cube."""
    solid = _octant_solid(shape, Facets(12, 6))
    return tuple(np.reshape(piece.bounding_box(), (2, 3)) for piece in solid.decompose())


def _check_paths(cell: StrutCell) -> None:
    """Raise InputError where the printed struts do not carry from face to face or fall into pieces."""
    boxes = _pieces(_shape(cell))
    remedy = "let its struts meet at nodes and reach opposite faces of the cell, or make them thicker"
    for k, axis in enumerate("xyz"):
        if not any(box[0, k] < 1e-9 and box[1, k] > 1.0 - 1e-9 for box in boxes):
            raise InputError(
                f"struts of lattice {cell.kind.name!r} are not connected: no load path along {axis}",
                "lattice kind",
                remedy,
            )
    if len(boxes) != 1:
        raise InputError(
            f"struts of lattice {cell.kind.name!r} are not connected: it falls into {len(boxes)} pieces",
            "lattice kind",
            remedy,
        )


def _require(cell: StrutCell, n: int, vertices: Vertices, triangles: Triangles) -> None:
    """Raise GateError where a specimen is open, in pieces, or of another genus than its graph."""
    links = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]]).T
    pieces = int(connected(len(vertices), *links).max()) + 1
    cells = np.array(list(product(range(n), repeat=3))) * cell.kind.divisions
    lattice = filled(cell.kind, cells, cell.size_mm, cell.junction_radius_mm, cell.midspan_radius_mm)
    found, wanted = genus(vertices, triangles), lattice.cycles
    reread = stl_surface(stl_bytes(vertices, triangles))[1]
    require(
        *of_surface(pieces, bad_edges(triangles), bad_edges(reread)),
        (found == wanted, "genus", f"the block has genus {found}, E - V + 1 of its graph is {wanted}"),
        of="specimen",
        remedy="try other facets or thinner struts",
    )
