"""The waveguide as light sees it: its resin, and a closed surface swept along a bent centreline."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError

WALL, ENTRY, EXIT, JUNCTION = 0, 1, 2, 3


@attrs.frozen(eq=False)
class Guide:
    """A closed surface: vertices (n, 3) in mm, triangles (f, 3) with normals outward, and their kinds (f,).

    WALL reflects and refracts; light enters at ENTRY and is detected at EXIT; JUNCTION opens into a strut of
    the same resin, in which light is lost. entry_frame (3, 3): rows are the entry's two edges in mm and its
    inward unit normal; entry_corner (3,) in mm.
    """

    vertices: Array
    triangles: Array
    kinds: Array
    entry_corner: Array
    entry_frame: Array


@attrs.frozen(eq=False)
class Centreline:
    """A waveguide's axis: lengths s (n,) in mm when straight, points (n, 3) in mm now, normals (n, 3).

    The normals are those of the face with the wells, outward, of unit length and square to the axis.
    """

    s: Array
    points: Array
    normals: Array

    @property
    def curvature(self) -> Array:
        """Bending (n,) in 1/mm of the undeformed length, positive where the wells' face is stretched."""
        tangent = np.gradient(self.points, self.s, axis=0, edge_order=2)
        turning = np.gradient(
            tangent / np.linalg.norm(tangent, axis=1)[:, None], self.s, axis=0, edge_order=2
        )
        return -np.asarray(np.einsum("ni,ni->n", turning, self.normals))

    @property
    def stretch(self) -> Array:
        """Stretch (n,) of the axis, length now over length when straight (no unit)."""
        return np.linalg.norm(np.gradient(self.points, self.s, axis=0, edge_order=2), axis=1)


def arc(length: float, angle_deg: float, steps: int = 200) -> Centreline:
    """A centreline of `length` mm bent to a circle's arc in the y-z plane, in `steps` equal pieces.

    angle_deg: angle in degrees between its ends; positive angles stretch the face with the wells.
    """
    s = np.linspace(0.0, length, steps + 1)
    a = np.radians(angle_deg)
    if abs(a) < 1e-12:
        return Centreline(s, np.column_stack([0 * s, 0 * s, s]), np.tile([0.0, 1.0, 0.0], (len(s), 1)))
    radius, turn = length / a, a * s / length
    points = np.column_stack([0 * s, radius * (np.cos(turn) - 1), radius * np.sin(turn)])
    normals = np.column_stack([0 * s, np.cos(turn), np.sin(turn)])
    return Centreline(s, points, normals)


def swept(
    line: Centreline,
    width: float,
    height: float,
    wells: Sequence[float] = (),
    well_width: float = 1.0,
    well_depth: float = 0.65,
    junctions: Sequence[tuple[float, float]] = (),
    edge: float = 0.25,
) -> Guide:
    """The surface of a bar of that section, in mm, along a centreline, with wells centred at lengths `wells`.

    width is measured across, height along the normals, both of the bar at rest; wells are cut into the outer
    face over the whole width. Cross-sections stay plane and square to the axis, so that a well opens as its
    side is stretched: (1 + height curvature / 2) times. They shrink as the axis is stretched, at constant
    volume. junctions: (start, end) lengths over which the two side faces open into struts. edge: longest step
    along the axis. Raises InputError for wells that overlap or leave the bar.
    """
    total = float(line.s[-1])
    cuts = sorted((at - well_width / 2, at + well_width / 2) for at in wells)
    ends = [0.0, *(end for cut in cuts for end in cut), total]
    if any(b - a <= 0 for a, b in pairwise(ends)) or not 0 < well_depth < height:
        raise InputError(
            "wells overlap, reach the waveguide's end, or cut through it", "wells", "space them out"
        )
    breaks = np.unique(np.concatenate([ends, [p for pair in junctions for p in pair if 0 < p < total]]))
    stations = np.unique(
        np.concatenate(
            [np.linspace(a, b, max(2, int(np.ceil((b - a) / edge)) + 1)) for a, b in pairwise(breaks)]
        )
    )
    middles = (stations[1:] + stations[:-1]) / 2
    cut, opened = (
        np.any([(a < middles) & (middles < b) for a, b in spans], axis=0) & np.ones(len(middles), bool)
        for spans in (cuts or [(0.0, 0.0)], junctions or [(0.0, 0.0)])
    )
    rings = _rings(line, stations, width, (-height / 2, height / 2 - well_depth, height / 2))
    corners, kinds = _faces(len(stations), cut, opened)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    used, dense = np.unique(triangles, return_inverse=True)
    points = rings.reshape(-1, 3)
    corner, right, up = points[_BL], points[_BR] - points[_BL], points[_TL] - points[_BL]
    inward = np.cross(right, up)
    inward /= np.linalg.norm(inward)
    frame = np.array([right, up, inward])
    return Guide(points[used], dense.reshape(-1, 3), np.tile(kinds, 2), corner, frame)


# Around a section, against the clock seen from its end: at the bottom, at the wells' floor, at the top.
_BL, _BR, _MR, _TR, _TL, _ML = range(6)


def _rings(line: Centreline, stations: Array, width: float, levels: tuple[float, float, float]) -> Array:
    """Corners (n, 6, 3) of the sections at lengths (n,)."""
    point, normal = (
        np.column_stack([np.interp(stations, line.s, column) for column in values.T])
        for values in (line.points, line.normals)
    )
    axis = np.gradient(line.points, line.s, axis=0)
    axis = np.column_stack([np.interp(stations, line.s, column) for column in axis.T])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    normal = normal - axis * np.einsum("ni,ni->n", axis, normal)[:, None]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    thinner = 1 / np.sqrt(np.interp(stations, line.s, line.stretch))[:, None]
    across = np.cross(normal, axis) * thinner * width / 2
    low, floor, top = (point + level * thinner * normal for level in levels)
    return np.stack(
        [low - across, low + across, floor + across, top + across, top - across, floor - across], axis=1
    )


def _faces(n: int, cut: Array, opened: Array) -> tuple[Array, Array]:
    """Quadrilaterals (m, 4) outward over rings of six, and their kinds (m,)."""
    quads: list[list[int]] = [[_ML, _MR, _BR, _BL], [_TL, _TR, _MR, _ML]]
    kinds = [ENTRY, ENTRY]
    for k in range(n - 1):
        ring, following = 6 * k, 6 * (k + 1)
        beside = JUNCTION if opened[k] else WALL
        if cut[k]:
            sides = [(_BL, _BR, WALL), (_BR, _MR, beside), (_MR, _ML, WALL), (_ML, _BL, beside)]
        else:
            sides = [(_BL, _BR, WALL), (_BR, _MR, beside), (_MR, _TR, beside)]
            sides += [(_TR, _TL, WALL), (_TL, _ML, beside), (_ML, _BL, beside)]
        for a, b, kind in sides:
            quads.append([ring + a, ring + b, following + b, following + a])
            kinds.append(kind)
        if k + 1 < n - 1 and cut[k] != cut[k + 1]:
            # The wall of a well looks into it: along the axis where the well begins.
            wall = [following + c for c in (_ML, _MR, _TR, _TL)]
            quads.append(wall if cut[k + 1] else wall[::-1])
            kinds.append(WALL)
    last = 6 * (n - 1)
    quads += [[last + c for c in (_BL, _BR, _MR, _ML)], [last + c for c in (_ML, _MR, _TR, _TL)]]
    kinds += [EXIT, EXIT]
    return np.array(quads), np.array(kinds)
