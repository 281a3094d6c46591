"""Values of the design's steps as arrays to draw, and candidate paths.

It is for display only and takes milliseconds; printed or simulated geometry comes from the core.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...design.anchors import anchor_points, windows
from ...design.block import FACES
from ...design.lattice import Graph, Lattice
from ...design.parameters import Unit
from ...design.steps import Path, Section, Struts, TrimmedStruts, along
from ...design.waveguide import Bar
from ..shared.wording import path_symbol
from .nodes import unit as unit_group

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

AROUND = 48
"""Number of flat pieces around the axis."""
ALONG_STRUT = 4
"""Number of straight pieces of a strut, enough to show its taper."""
INTO_WALL, INTO_CUT_WALL = 6.0, 0.4
"""Length of a strut inside the wall that cuts it, in radii; less where one sees into the chambers."""
WIDEST_LANE = 0.4
"""Largest distance, in cells, between candidate paths drawn side by side, if the lattice is wide enough."""
CANDIDATE_RADIUS = 0.07
"""Radius, in cells, of a candidate path's tube."""
_CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
_CUBE_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_CUBE_EDGES = np.array([[a, b] for a in range(8) for b in range(a) if np.abs(_CUBE[a] - _CUBE[b]).sum() == 1])


@attrs.frozen(eq=False)
class Skeleton:
    """A mesh to draw: vertices (n, 3) in mm, edges (e, 2), faces, a list of (m, k) arrays, and attributes.

    attributes: values (n,) at the vertices by name, integers or not; slots: number of the material of each
    face, or None; smooth: smooth shading of all faces or of each; inputs: further inputs, by name, of its
    node group.
    """

    vertices: Floats
    edges: Integers = attrs.field(factory=lambda: np.empty((0, 2), np.int64))
    faces: tuple[Integers, ...] = ()
    attributes: dict[str, Any] = attrs.field(factory=dict)
    slots: Integers | None = None
    smooth: Any = True
    inputs: dict[str, Any] = attrs.field(factory=dict)


def outline(profile: Floats) -> Skeleton:
    """The outer profile as a line in the bending plane, on the side with more lattice."""
    points = np.column_stack([np.zeros(len(profile)), profile])
    return Skeleton(points, _polylines(1, len(points)))


def cavity(polygon: Floats | None, cut: bool) -> Skeleton | None:
    """Surface of the cavity; with `cut`, its half x <= 0."""
    return None if polygon is None else _revolved(polygon[::-1], closed=not cut)


def actuator(section: Section | None, cut: bool) -> Skeleton | None:
    """Surface of the actuator with its inlet; with `cut`, the half x <= 0 and its section."""
    if section is None:
        return None
    outer = section.outer[1:]
    if not cut:
        return _revolved(np.concatenate([section.inlet, outer]), closed=True)
    bore = section.inlet[:1]
    inner = bore * [0.0, 1.0] if section.cavity is None else section.cavity[:0:-1]
    loop = np.concatenate([section.inlet[1:], outer, inner, bore])
    half = _revolved(np.concatenate([loop, loop[:1]]), closed=False)
    return _with_section(half, loop)


def boxes(graph: Graph | None) -> Skeleton | None:
    """Edges of the lattice's cells, those that neighbours share once."""
    if graph is None:
        return None
    whole = graph.kind.divisions
    corners = graph.cells[:, None] + whole * _CUBE
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    edges = index.reshape(-1, 8)[:, _CUBE_EDGES].reshape(-1, 2)
    return Skeleton(points * (graph.cell / whole), np.unique(np.sort(edges, axis=1), axis=0))


def lines(trimmed: TrimmedStruts | None, cut: bool) -> Skeleton | None:
    """Axes of the visible struts; with `cut`, those at x <= 0."""
    return None if trimmed is None else lattice(Struts(trimmed, None), cut)


def lattice(struts: Struts | None, cut: bool, bladder: float = np.inf) -> Skeleton | None:
    """Struts as polylines with a ball at every node, or without a radius as lines; with `cut`, at x <= 0.

    bladder: outer radius in mm of the bladders.
    """
    if struts is None:
        return None
    shown = struts.trimmed
    here = (shown.ends[:, :, 0] <= 1e-6).all(axis=1) if cut else np.full(len(shown.ends), True)
    ends, first, last = shown.ends[here], shown.first[here], shown.last[here]
    pieces = 1 if struts.lattice is None else ALONG_STRUT
    whole = np.stack([first == 0.0, last == 1.0], axis=1)
    if struts.lattice is not None:
        # Cut where its axis meets the wall, a tube that grazes it would show its end: it goes on into it.
        radii = (INTO_CUT_WALL if cut else INTO_WALL) * _widest(struts.lattice)
        into = radii / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        # Its node then lies within the bladders; of one that the user's own body cuts, outside.
        inner = np.linalg.norm(ends[..., :2], axis=2) < 1.001 * bladder
        first = np.where(inner[:, 0], np.maximum(first - into, 0.0), first)
        last = np.where(inner[:, 1], np.minimum(last + into, 1.0), last)
    t = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, pieces + 1)
    edges = _polylines(len(ends), pieces + 1)
    points = along(ends, t)
    if struts.lattice is None:
        return Skeleton(points.reshape(-1, 3), edges)
    radii = struts.lattice.radii(t, shown.rows[here])
    # As the print has them: without a ball the tubes' ends lie open where they meet.
    nodes, thick = points[:, [0, -1]][whole], radii[:, [0, -1]][whole]
    place, number = np.unique(nodes.round(4), axis=0, return_inverse=True)
    widest = np.zeros(len(place))
    np.maximum.at(widest, number.ravel(), thick)
    kind = np.repeat([unit_group.TUBE, unit_group.NODE], [radii.size, len(place)]).astype(np.int32)
    attributes = {"radius": np.concatenate([radii.ravel(), widest]), unit_group.SKIN: kind}
    return Skeleton(np.concatenate([points.reshape(-1, 3), place]), edges, attributes=attributes)


def anchor_skeleton(points: Floats | None, struts: Struts | None) -> Skeleton | None:
    """Anchors as points, a little wider than their junctions."""
    if points is None:
        return None
    thick = struts is not None and struts.lattice is not None
    widest = _widest(struts.lattice) if thick else 0.8
    return Skeleton(points, attributes={"radius": np.full(len(points), 1.24 * widest)})


def _widest(struts: Lattice) -> float:
    """Radius in mm of the widest strut."""
    most = 1.0 if struts.factors is None else float(struts.factors.max())
    return most * max(struts.junction_radius, struts.midspan_radius)


def line_through(path: Path | None) -> Skeleton | None:
    """The path as a line through its anchors."""
    return None if path is None else Skeleton(path.points, _polylines(1, len(path.points)))


def bar(found: Bar | None) -> Skeleton | None:
    """The waveguide's bar and seats (slot 0) with the volumes cut from them (slot 1)."""
    if found is None:
        return None
    solid = [*found.legs, *(seat.body.corners for seat in found.seats)]
    hollow = [block.corners for block in found.cuts]
    corners = np.array([*solid, *hollow])
    faces = np.concatenate([FACES + 8 * number for number in range(len(corners))])
    slots = np.repeat(np.arange(len(corners)) >= len(solid), 6).astype(np.int64)
    return Skeleton(corners.reshape(-1, 3), faces=(faces,), slots=slots, smooth=False)


def candidates(unit: Unit) -> dict[str, Skeleton]:
    """Every candidate path by name, as a chart beside the lattice, on the side of its anchors.

    All of them run along one column of anchors and would cover each other there. Seen from +x each has its
    true length and height, in a separate lane. A ranking moves none of them.
    """
    d = unit.dimensions
    at, side = anchor_points(unit), float(np.sign(d.row)) or 1.0
    low, high = d.bounds[1]
    radius = CANDIDATE_RADIUS * d.cell
    known = {window.name: window for window in windows(len(at))}
    lane = min(WIDEST_LANE * d.cell, (high - low) / len(known))
    found = {}
    for number, name in enumerate(known):
        points = at[list(known[name].indices)].copy()
        points[:, 0] = 0.0
        points[:, 1] = (high if side > 0 else low) + side * (d.cell + lane * (number + 0.5))
        size = 0.5 * lane
        label = {
            "Label": path_symbol(name),
            "At": (0.0, float(points[0, 1]) - 0.5 * size, float(points[0, 2]) - 1.4 * size),
            "Size": size,
            "In Viewport": False,
        }
        widths = {"radius": np.full(len(points), radius)}
        found[name] = Skeleton(points, _polylines(1, len(points)), attributes=widths, inputs=label)
    return found


def box(low: ArrayLike, high: ArrayLike) -> Skeleton:
    """A box between two corners (3,) in mm, its faces outward."""
    corners = np.asarray(low, float) + (np.asarray(high, float) - np.asarray(low, float)) * _CUBE
    return Skeleton(corners, faces=(_CUBE_FACES,), smooth=False)


def ball(radius: float, around: int = 16) -> Skeleton:
    """A ball around the origin."""
    polar = np.linspace(0.0, np.pi, around // 2 + 1)
    return _revolved(radius * np.column_stack([np.sin(polar), -np.cos(polar)]), closed=True, around=around)


def joined(parts: Sequence[Skeleton]) -> Skeleton:
    """Several skeletons as one; an attribute that one of them lacks is 0 there."""
    counts = [len(part.vertices) for part in parts]
    starts = np.concatenate([[0], np.cumsum(counts)])[:-1].astype(int)
    attributes: dict[str, Any] = {}
    for name in dict.fromkeys(name for part in parts for name in part.attributes):
        kind = np.result_type(*(part.attributes[name].dtype for part in parts if name in part.attributes))
        of_each = (p.attributes.get(name, np.zeros(n, kind)) for p, n in zip(parts, counts, strict=True))
        attributes[name] = np.concatenate([*of_each])
    sizes = [sum(map(len, part.faces)) for part in parts]
    slots = [np.full(n, 0 if p.slots is None else p.slots) for p, n in zip(parts, sizes, strict=True)]
    smooth = [np.full(n, part.smooth) for part, n in zip(parts, sizes, strict=True)]
    # An empty one first, whatever there is to join.
    return Skeleton(
        np.concatenate([np.empty((0, 3)), *(part.vertices for part in parts)]),
        np.concatenate(
            [np.empty((0, 2), np.int64), *(p.edges + n for p, n in zip(parts, starts, strict=True))]
        ),
        tuple(f + start for p, start in zip(parts, starts, strict=True) for f in p.faces),
        attributes,
        np.concatenate([np.empty(0, np.int64), *slots]),
        np.concatenate([np.empty(0, bool), *smooth]),
    )


def placed(part: Skeleton, rotation: ArrayLike, shift: ArrayLike) -> Skeleton:
    """A skeleton turned by a matrix (3, 3), then moved by (3,) in mm."""
    return attrs.evolve(part, vertices=part.vertices @ np.asarray(rotation).T + np.asarray(shift))


def mirrored(part: Skeleton) -> Skeleton:
    """The mirror image of a skeleton in the bending plane, x = 0."""
    faces = tuple(f[:, ::-1] for f in part.faces)
    return attrs.evolve(part, vertices=part.vertices * [-1.0, 1.0, 1.0], faces=faces)


def free_path(points: Floats, name: str, cell: float) -> Skeleton:
    """A path through any nodes of the lattice, points (h, 3) in mm, at its true position, and its name."""
    at = (float(points[0, 0]) + 0.3 * cell, float(points[0, 1]) + 0.15 * cell, float(points[0, 2]))
    return Skeleton(
        points,
        _polylines(1, len(points)),
        attributes={"radius": np.full(len(points), 0.1 * cell)},
        inputs={"Label": name, "At": at, "Size": 0.3 * cell},
    )


def _polylines(count: int, points: int) -> Integers:
    """Edges of `count` polylines of `points` vertices each, one after another."""
    first = np.arange(count)[:, None] * points + np.arange(points - 1)
    return np.stack([first, first + 1], axis=-1).reshape(-1, 2)


def _revolved(curve: Floats, closed: bool, around: int = AROUND) -> Skeleton:
    """Curve (n, 2) of (radius, z) around z: whole, or the half x <= 0; points on the axis are poles."""
    angle = (
        np.linspace(0.0, 2.0 * np.pi, around + 1)
        if closed
        else np.linspace(0.5, 1.5, around // 2 + 1) * np.pi
    )
    columns = around if closed else len(angle)
    angle = angle[:columns]
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    on_axis = curve[:, 0] < 1e-9
    rows, vertices = [], []
    count = 0
    for (radius, z), pole in zip(curve, on_axis, strict=True):
        points = np.array([[0.0, 0.0, z]]) if pole else np.column_stack([radius * ring, np.full(columns, z)])
        rows.append(np.full(columns, count) if pole else count + np.arange(columns))
        vertices.append(points)
        count += len(points)
    low, up = np.array(rows[:-1]), np.array(rows[1:])
    turn = np.roll if closed else (lambda a, _, axis: a[:, 1:])
    cut = slice(None) if closed else slice(None, -1)
    quads = np.stack([low[:, cut], turn(low, -1, axis=1), turn(up, -1, axis=1), up[:, cut]], axis=-1)
    low_pole, up_pole = on_axis[:-1], on_axis[1:]
    whole = quads[~(low_pole | up_pole)].reshape(-1, 4)
    top = quads[~low_pole & up_pole][..., [0, 1, 2]].reshape(-1, 3)
    bottom = quads[low_pole & ~up_pole][..., [0, 2, 3]].reshape(-1, 3)
    faces = tuple(f for f in (whole, top, bottom) if len(f))
    return Skeleton(np.concatenate(vertices), faces=faces)


def _with_section(half: Skeleton, section: Floats) -> Skeleton:
    """The half with its two cut faces in the plane x = 0, slot 1."""
    from mathutils.geometry import tessellate_polygon

    triangles = np.array(tessellate_polygon([[(r, z, 0.0) for r, z in section]]))
    r, z = section.T
    sides = [np.column_stack([np.zeros_like(r), sign * r, z]) for sign in (1.0, -1.0)]
    vertices, start = np.concatenate([half.vertices, *sides]), len(half.vertices)
    cuts = np.concatenate([triangles + start, triangles + start + len(section)])
    # They face +x.
    p, q, r = vertices[cuts.T]
    away = np.cross(q - p, r - p)[:, 0] < 0.0
    cuts = np.where(away[:, None], cuts[:, ::-1], cuts)
    slots = np.repeat([0, 1], [sum(map(len, half.faces)), len(cuts)])
    return Skeleton(vertices, faces=(*half.faces, cuts), slots=slots)


def write(mesh: Any, skeleton: Skeleton) -> None:
    """Replace the geometry of a Blender mesh by a skeleton, keeping its materials."""
    mesh.clear_geometry()
    mesh.vertices.add(len(skeleton.vertices))
    mesh.attributes["position"].data.foreach_set("vector", skeleton.vertices.astype(np.float32).ravel())
    if len(skeleton.edges):
        mesh.edges.add(len(skeleton.edges))
        mesh.edges.foreach_set("vertices", skeleton.edges.astype(np.int32).ravel())
    if skeleton.faces:
        sizes = np.concatenate([np.full(len(f), f.shape[1]) for f in skeleton.faces])
        corners = np.concatenate([f.ravel() for f in skeleton.faces]).astype(np.int32)
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(sizes))
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)
        mesh.polygons.foreach_set("loop_start", starts)
        if skeleton.slots is not None:
            mesh.polygons.foreach_set("material_index", skeleton.slots.astype(np.int32))
    mesh.update(calc_edges=bool(skeleton.faces))
    if skeleton.faces:
        smooth = np.broadcast_to(np.asarray(skeleton.smooth, bool), len(mesh.polygons))
        mesh.polygons.foreach_set("use_smooth", np.ascontiguousarray(smooth))
        if smooth.any():
            mesh.set_sharp_from_angle(angle=np.radians(40.0))
    for name, values in skeleton.attributes.items():
        whole = np.issubdtype(np.asarray(values).dtype, np.integer)
        attribute = mesh.attributes.new(name, "INT" if whole else "FLOAT", "POINT")
        attribute.data.foreach_set("value", values.astype(np.int32 if whole else np.float32))
