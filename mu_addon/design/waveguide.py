"""The optical waveguide: a square bar along lattice nodes with wells on its outer face and seats at its ends.

Its path is a window of anchors or any chain of lattice nodes. It replaces the struts along its path. Every
other strut that touches it is at least as thick as the bar up to the strut's middle. Wells keep a constant
pitch along the path, however it bends, and those that a strut or the membrane would cover are left out. At
either end a light source or detector sits flat on the bar's end face, in a pocket that is open along its
axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from .anchors import Window, anchor_points
from .block import Block, face_moves
from .dimensions import Dimensions
from .lattice import Lattice, lattice_of
from .parameters import Unit
from .profile import outer_radius

Integers = NDArray[np.int64]

SHARPEST_DEG = 100.0
"""Sharpest bend of a bar in degrees; beyond it its mitres grow long, and light leaves it."""

STRUT_GAP = 0.1
"""Least distance in mm between a well or a seat's pocket and a strut's surface."""

ROOM = 1.0
"""Length in mm, beyond the part's, that is kept clear in front of a seat to insert the part."""

_STEP = 0.15  # of the points by which boxes are separated from struts
_LONGER = 0.25  # steps in mm by which an end is made longer, until its seat has room
_OVER = 0.03  # by which a cut passes the faces that it opens, so that none coincide
_AXES = np.array([[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]], float)


@attrs.frozen(eq=False)
class Seat:
    """The holder at one end of a waveguide: foot, wider body, pocket for the part and notch for its wires."""

    foot: Block
    body: Block
    pocket: Block
    notch: Block

    def solid(self, offset: Array | None = None) -> Any:
        """Convex hull of foot and body, before pocket and notch are cut, as a Manifold in mm.

        offset (3,): outward move of its faces along x, y and z in mm.
        """
        from manifold3d import Manifold

        blocks = [_moved(block, offset).corners for block in (self.foot, self.body)]
        return Manifold.hull_points(np.concatenate(blocks))


@attrs.frozen(eq=False)
class Bar:
    """A waveguide; lengths in mm.

    points (n, 3): its axis, both ends included; normals (n - 1, 3): outward normal of each leg's outer face;
    half: half its section; wells: boxes that are cut out of it; seats: one an end, or none; met (E, 2): mask
    of the lattice's struts that touch it with their first and second end; replaced (E,): mask of struts that
    the bar replaces; loops: number of steps of the path without a strut, each an additional loop in the
    lattice's graph; path_mm: length between its end nodes.
    """

    points: Array
    normals: Array
    half: float
    wells: tuple[Block, ...]
    seats: tuple[Seat, ...]
    met: NDArray[np.bool_]
    replaced: NDArray[np.bool_]
    loops: int
    path_mm: float

    @property
    def directions(self) -> Array:
        """Unit vectors (n - 1, 3) along each straight leg."""
        return _directions(self.points)

    @property
    def planes(self) -> Array:
        """Normals (n, 3), of any length, of the planes that legs end in; at a bend it halves the angle."""
        way = self.directions
        return np.concatenate([way[:1], way[:-1] + way[1:], way[-1:]])

    @property
    def legs(self) -> Array:
        """Corners (n - 1, 8, 3) in mm of each straight leg, in the order of `Block.corners`."""
        rings = self.rings()
        order = [0, 3, 1, 2]  # from around the section to the order of a box
        return np.concatenate([rings[:-1, order], rings[1:, order]], axis=1)

    @property
    def cuts(self) -> list[Block]:
        """All boxes that are cut out of the bar: wells, then pockets and notches of the seats."""
        return [*self.wells, *(cut for seat in self.seats for cut in (seat.pocket, seat.notch))]

    def rings(self, offset: Array | None = None) -> Array:
        """Corners (n, 4, 3) in mm of the section at every point, around it, in the plane that halves a bend.

        offset (3,): outward move of faces along x, y and z in mm; two legs with unequal sections meet in the
        mean of their corners.
        """
        way, planes = self.directions, self.planes
        moves = np.zeros((len(way), 3)) if offset is None else _leg_moves(way, self.normals, offset)
        side = np.cross(way, self.normals)
        rings = np.zeros((len(self.points), 4, 3))
        count = np.zeros(len(self.points))
        for leg in range(len(way)):
            around = [
                a * (self.half + moves[leg, 1]) * self.normals[leg]
                + b * (self.half + moves[leg, 2]) * side[leg]
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
            for end in (leg, leg + 1):
                corners = np.array(around)
                slide = (corners @ planes[end]) / (way[leg] @ planes[end])
                rings[end] += self.points[end] + corners - slide[:, None] * way[leg]
                count[end] += 1
        rings /= count[:, None, None]
        rings[0] -= moves[0, 0] * way[0]
        rings[-1] += moves[-1, 0] * way[-1]
        return rings

    def solid(self, offset: Array | None = None) -> Any:
        """The bar with its seats, before anything is cut out, as a Manifold in mm.

        offset (3,): outward move of its faces along x, y and z in mm.
        """
        from manifold3d import Manifold, Mesh64, OpType

        rings = self.rings(offset)
        last = 4 * (len(rings) - 1)
        quads = [[0, 3, 2, 1], [last, last + 1, last + 2, last + 3]]
        for leg in range(len(rings) - 1):
            for k in range(4):
                a, b = 4 * leg + k, 4 * leg + (k + 1) % 4
                quads.append([a, b, b + 4, a + 4])
        faces = np.array(quads)
        triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
        bar = Manifold(Mesh64(rings.reshape(-1, 3), triangles.astype(np.uint64)))
        return Manifold.batch_boolean([bar, *(seat.solid(offset) for seat in self.seats)], OpType.Add)

    def cut_solids(self, offset: Array | None = None) -> list[Any]:
        """The boxes of `cuts` as Manifolds in mm, made smaller by an offset (3,) in mm of solid faces."""
        return [_moved(cut, None if offset is None else -offset).solid() for cut in self.cuts]


def waveguide(unit: Unit, path: Window | ArrayLike, within: Dimensions | None = None) -> Bar:
    """The waveguide along a window of anchors, or along a chain of lattice nodes (n, 3) in mm.

    within: dimensions of the lattice around it, if that is not the unit's. Raises InputError for a path off
    the lattice's nodes, through the actuator, bent by more than SHARPEST_DEG, or without room for a seat at
    an end.
    """
    d = unit.dimensions if within is None else within
    lattice = lattice_of(d)
    nodes = anchor_points(unit)[list(path.indices)] if isinstance(path, Window) else np.asarray(path, float)
    numbers = _numbers(lattice, nodes, isinstance(path, Window))
    _check_path(d, nodes)
    numbers = _passed(lattice, numbers)
    met = np.isin(lattice.struts, numbers)
    steps = {tuple(sorted(pair)) for pair in pairwise(numbers)}
    replaced = np.array([tuple(sorted(strut)) in steps for strut in lattice.struts.tolist()], bool)
    struts = _Struts(lattice, met, replaced, d.waveguide_section / 2.0)

    kept = np.concatenate([[0], 1 + np.flatnonzero(_bends(nodes) > 1e-6), [len(nodes) - 1]])
    nodes = nodes[kept]
    way = _directions(nodes)
    ends = [_end(d, struts, nodes[0], -way[0], "first"), _end(d, struts, nodes[-1], way[-1], "last")]
    points = np.stack([ends[0].face, *nodes, ends[1].face])
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9  # ends of zero length are no legs
    points = points[np.concatenate([[True], apart])]
    inner = 1 + np.flatnonzero(_bends(points) > 1e-6)
    points = points[np.concatenate([[0], inner, [len(points) - 1]])]
    normals = _normals(points)
    return Bar(
        points=points,
        normals=normals,
        half=d.waveguide_section / 2.0,
        wells=tuple(
            well
            for well in _wells(d, points, normals, nodes)
            if struts.gap(at := well.points(_STEP)) > STRUT_GAP and _clear_of_membrane(d, at)
        ),
        seats=tuple(end.seat for end in ends if end.seat is not None),
        met=met,
        replaced=replaced,
        loops=len(numbers) - 1 - int(np.count_nonzero(replaced)),
        path_mm=float(np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum()),
    )


def free_bar(d: Dimensions, length: float) -> Bar:
    """A straight waveguide along z outside any lattice, with seats if the unit has them: a coupon.

    length: distance in mm between the points that are its end nodes in a lattice. Wells in the feet of its
    seats are left out.
    """
    nodes = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length]])
    up, outer, end = _AXES[0], _AXES[2], d.waveguide_end
    points = nodes + np.array([[-end], [end]]) * up
    normals = outer[None]
    seats = (_seat(d, points[0], -up, outer, end), _seat(d, points[1], up, outer, end))
    clear = d.waveguide_section
    return Bar(
        points=points,
        normals=normals,
        half=d.waveguide_section / 2.0,
        wells=tuple(w for w in _wells(d, points, normals, nodes) if clear < w.centre[2] < length - clear),
        seats=seats if d.seats else (),
        met=np.zeros((0, 2), bool),
        replaced=np.zeros(0, bool),
        loops=0,
        path_mm=length,
    )


def strut_radii(
    lattice: Lattice,
    met: NDArray[np.bool_],
    least: float,
    t: ArrayLike,
    rows: NDArray[Any] | slice = slice(None),
) -> Array:
    """Radii (e, n) in mm of the struts `rows`, by default of all, at fractions t (n,), thickened at a bar.

    met (e, 2): mask of the first and second ends that touch it. From that end to mid-span a strut's radius is
    at least `least` mm; from there to the other end the added thickness fades as sin^2(pi t).
    """
    t = np.asarray(t, float)
    law = lattice.radii(t, rows)
    fading = np.sin(np.pi * t) ** 2
    first, second = np.where(t <= 0.5, 1.0, fading), np.where(t >= 0.5, 1.0, fading)
    share = np.maximum(met[:, :1] * first, met[:, 1:] * second)
    return np.asarray(law + share * np.maximum(0.0, least - law))


class _Struts:
    """Struts near a bar: their positions, and distances of points from them."""

    def __init__(
        self, lattice: Lattice, met: NDArray[np.bool_], replaced: NDArray[np.bool_], half: float
    ) -> None:
        self.t = np.linspace(0.0, 1.0, 33)
        standing = ~replaced
        self.ends = lattice.nodes[lattice.struts[standing]]
        self.radii = strut_radii(lattice, met[standing], half, self.t, standing)

    def gap(self, points: Array) -> float:
        """Least distance in mm of points (n, 3) from the struts' surfaces, negative inside; 1 at most."""
        low, high = points.min(axis=0), points.max(axis=0)
        reach = float(self.radii.max()) + 1.0
        near = ((self.ends.max(axis=1) > low - reach) & (self.ends.min(axis=1) < high + reach)).all(axis=1)
        least = 1.0
        for (start, end), radii in zip(self.ends[near], self.radii[near], strict=True):
            axis = end - start
            t = np.clip((points - start) @ axis / (axis @ axis), 0.0, 1.0)
            away = points - start - t[:, None] * axis
            least = min(
                least, float((np.sqrt(np.einsum("ij,ij->i", away, away)) - np.interp(t, self.t, radii)).min())
            )
        return least


def _numbers(lattice: Lattice, nodes: Array, is_window: bool) -> list[int]:
    """Numbers of the lattice's nodes at points (n, 3). Raises InputError for a point that is not a node."""
    found = []
    for point in nodes:
        gap = np.linalg.norm(lattice.nodes - point, axis=1)
        if gap.min() > 1e-5 * lattice.cell:
            if is_window:
                raise InputError(
                    f"lattice {lattice.kind.name!r} has no node at the cell's centre, where the anchors are",
                    "[lattice] kind",
                    "choose a kind that has one, or build the unit without a waveguide",
                )
            x, y, z = (float(c) for c in point)
            raise InputError(
                f"({x:.4g}, {y:.4g}, {z:.4g}) mm is not a node of the lattice",
                "path",
                "take a path of this unit, from the paths.csv of `place --paths graph` at the same scale",
            )
        found.append(int(gap.argmin()))
    return found


def _passed(lattice: Lattice, numbers: list[int]) -> list[int]:
    """Numbers of all nodes that a chain of nodes passes, for some lattice kinds also between its nodes."""
    nodes, found = lattice.nodes, numbers[:1]
    for first, last in pairwise(numbers):
        way = nodes[last] - nodes[first]
        off = nodes - nodes[first]
        t = off @ way / (way @ way)
        on = (np.linalg.norm(off - t[:, None] * way, axis=1) < 1e-9 * lattice.cell) & (t > 1e-9)
        between = np.flatnonzero(on & (t < 1.0 - 1e-9))
        found = [*found, *between[np.argsort(t[between])].tolist(), last]
    return found


def _check_path(d: Dimensions, nodes: Array) -> None:
    """Raise InputError for a path of one point, through the actuator, or too sharp a bend."""
    if len(nodes) < 2 or (np.linalg.norm(np.diff(nodes, axis=0), axis=1) < 1e-9).any():
        raise InputError("a path needs two different nodes", "path", "choose another path")
    t = np.linspace(0.0, 1.0, 25)[:, None]
    for start, end in pairwise(nodes):
        at = start + t * (end - start)
        inside = np.hypot(at[:, 0], at[:, 1]) < outer_radius(d, at[:, 2]) - d.wall_at(at[:, 2])[0]
        if inside.any():
            x, y, z = (float(c) for c in at[inside][0])
            raise InputError(
                f"the path runs through the cavity at ({x:.4g}, {y:.4g}, {z:.4g}) mm",
                "path",
                "choose a path outside the actuator",
            )
    sharpest = float(np.degrees(_bends(nodes).max(initial=0.0)))
    if sharpest > SHARPEST_DEG:
        raise InputError(
            f"the path bends by {sharpest:.0f} degrees at once",
            "path",
            f"choose one that bends by {SHARPEST_DEG:g} degrees at most",
        )


def _directions(points: Array) -> Array:
    """Unit vectors (n - 1, 3) along a polyline (n, 3)."""
    way = np.diff(points, axis=0)
    return np.asarray(way / np.linalg.norm(way, axis=1)[:, None])


def _bends(points: Array) -> Array:
    """Angles (n - 2,) in radians by which a polyline (n, 3) turns at its inner points."""
    way = _directions(points)
    turn = np.linalg.norm(np.cross(way[:-1], way[1:]), axis=1)
    return np.asarray(np.arctan2(turn, np.sum(way[:-1] * way[1:], axis=1)))


def _normals(points: Array) -> Array:
    """Outward normals (n - 1, 3) of each leg's outer face, handed on from leg to leg without a twist.

    The first normal is rotated so that the normals point away from the actuator's axis as much as possible,
    averaged over the length.
    """
    way = _directions(points)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    start = np.cross(way[0], np.eye(3)[np.argmin(np.abs(way[0]))])
    start /= np.linalg.norm(start)
    frames = [np.stack([start, np.cross(way[0], start)])]
    for before, after in pairwise(way):
        axis = np.cross(before, after)
        cosine = float(before @ after)
        turned = [
            v + np.cross(axis, v) + np.cross(axis, np.cross(axis, v)) / (1.0 + cosine) for v in frames[-1]
        ]
        frames.append(np.array(turned))
    middle = (points[:-1] + points[1:]) / 2.0
    outward = middle * [1.0, 1.0, 0.0]
    outward /= np.maximum(np.linalg.norm(outward, axis=1), 1e-9)[:, None]
    shares = np.einsum("lij,lj,l->i", np.array(frames), outward, length)
    angle = np.arctan2(shares[1], shares[0])
    normals = np.array([np.cos(angle) * a + np.sin(angle) * b for a, b in frames])
    # Along the z axis they are exact, so that equal bars have equal files.
    return np.where(np.abs(normals) < 1e-12, 0.0, normals)


def _leg_moves(way: Array, normals: Array, offset: Array) -> Array:
    """Moves (n, 3) of the faces across, outer and lateral of each leg."""
    return np.stack([face_moves(v, offset) for v in (way, normals, np.cross(way, normals))], axis=1)


def _moved(block: Block, offset: Array | None) -> Block:
    return block if offset is None else block.grown(offset)


@attrs.frozen(eq=False)
class _End:
    """An end of the bar, and the seat there."""

    face: Array
    seat: Seat | None


def _end(d: Dimensions, struts: _Struts, node: Array, onward: Array, name: str) -> _End:
    """The end beyond a node with the least bend, then the least length with room for a seat."""
    if not d.seats:
        return _End(node + d.waveguide_end * onward, None)
    limit = np.cos(np.radians(SHARPEST_DEG)) + 1e-9
    axes = _AXES[np.argsort(-(_AXES @ onward), kind="stable")]
    why = ""
    for direction in [onward, *(axis for axis in axes if limit < axis @ onward < 1.0 - 1e-9)]:
        for length in np.arange(d.waveguide_end, max(d.waveguide_end, d.cell / 2.0) + 1e-9, _LONGER):
            face = node + length * direction
            for normal in _notches(face, direction):
                seat = _seat(d, face, direction, normal, float(length))
                found = _obstacle(d, struts, seat)
                if found is None:
                    return _End(face, seat)
                why = why or found
    x, y, z = (float(c) for c in node)
    raise InputError(
        f"the {name} end of the path, at ({x:.4g}, {y:.4g}, {z:.4g}) mm, has no space for a seat: {why}",
        "[waveguide] seats",
        "choose another path or a thinner seat_wall_mm, or set seats = false and mount the parts separately",
    )


def _notches(face: Array, direction: Array) -> Array:
    """Directions (k, 3) for a seat's wires, square to its axis: the one away from the actuator first."""
    outward = _normals(np.stack([face - direction, face]))[0]
    if np.abs(direction).max() < 1.0 - 1e-9:
        return outward[None]
    square = _AXES[np.abs(_AXES @ direction) < 1e-9]
    return np.asarray(square[np.argsort(-(square @ outward), kind="stable")])


def _seat(d: Dimensions, face: Array, outward: Array, normal: Array, length: float) -> Seat:
    """The seat at an end face (3,), its pocket opening along `outward`, its notch along `normal`.

    Its foot is at the node, `length` mm before the face: a shelf nearer the face would leave narrow slots
    next to the bar and the struts' roots.
    """
    axes = np.stack([outward, normal, np.cross(outward, normal)])
    c, w, h = d.seat_clearance, d.seat_wall, d.waveguide_section / 2.0
    depth, out, side = d.part_height + c, d.part_width / 2.0 + c, d.part_length / 2.0 + c
    return Seat(
        foot=Block.between([-length, -h, -h], [0.0, h, h], face, axes),
        body=Block.between([-min(w, length), -out - w, -side - w], [depth, out + w, side + w], face, axes),
        pocket=Block.between([0.0, -out, -side], [depth + _OVER, out, side], face, axes),
        notch=Block.between(
            [0.0, out - _OVER, -d.cable / 2.0], [depth + _OVER, out + w + _OVER, d.cable / 2.0], face, axes
        ),
    )


def _obstacle(d: Dimensions, struts: _Struts, seat: Seat) -> str | None:
    """Obstacle to a seat, to inserting its part, or to its wires; None without one."""
    low, high = np.array(d.bounds).T
    if ((seat.body.corners < low - 1e-6) | (seat.body.corners > high + 1e-6)).any():
        return "the envelope ends"
    ways = [seat.pocket.longer(0, d.part_height + ROOM), seat.notch.longer(1, ROOM)]
    for step in (0.6, _STEP):
        for way in ways:
            at = way.points(step)
            if struts.gap(at) < STRUT_GAP:
                return "a strut is in the way"
            if not _clear_of_membrane(d, at):
                return "the membrane is in the way"
    return None


def _clear_of_membrane(d: Dimensions, points: Array) -> bool:
    z = points[:, 2]
    beside = (z >= 0.0) & (z <= d.height)
    return bool((np.hypot(points[:, 0], points[:, 1])[beside] > outer_radius(d, z[beside]) + _OVER).all())


def _wells(d: Dimensions, points: Array, normals: Array, nodes: Array) -> Iterator[Block]:
    """Wells at whole multiples of the pitch from the first node along the path, none across a bend."""
    way = _directions(points)
    half = d.waveguide_section / 2.0
    spike = np.concatenate([[0.0], half * np.tan(_bends(points) / 2.0), [0.0]])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    begin = np.concatenate([[0.0], np.cumsum(length)])
    # The path is measured from its first node, which may lie within a straight leg.
    first = float(np.linalg.norm(nodes[0] - points[0]))
    total = float(np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum())
    for s in first + np.arange(int(np.floor(total / d.well_pitch + 1e-9)) + 1) * d.well_pitch:
        leg = min(int(np.searchsorted(begin, s, side="right")) - 1, len(way) - 1)
        along = s - begin[leg]
        if (
            along < spike[leg] + d.well_width / 2.0
            or along > length[leg] - spike[leg + 1] - d.well_width / 2.0
        ):
            continue
        axes = np.stack([way[leg], normals[leg], np.cross(way[leg], normals[leg])])
        reach = half + _OVER
        yield Block.between(
            [-d.well_width / 2.0, half - d.well_depth, -reach],
            [d.well_width / 2.0, reach, reach],
            points[leg] + along * way[leg],
            axes,
        )
