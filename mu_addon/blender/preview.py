"""The core's curves as arrays to draw: actuator, lattice, anchors, waveguide and candidate paths.

Everything here is for the eye and takes milliseconds; what is printed or simulated comes from the core.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ..design.anchors import Window, anchors, windows
from ..design.lattice import lattice_of
from ..design.parameters import Dimensions, Unit
from ..design.profile import cavity_polygon, outer_polygon, outer_radius
from ..design.waveguide import waveguide

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

AROUND = 48
"""Flat pieces around the axis."""
ALONG = 4
"""Flat pieces along a quarter of a chamber."""
ALONG_STRUT = 4
"""Straight pieces of a strut, enough to see its taper."""
FINE = np.linspace(0.0, 1.0, 33)
"""Places along a strut where it is asked whether it is still inside the actuator."""
LADDER_STEP = 0.45
"""Distance, in cells, between candidate paths drawn side by side outside the lattice."""


@attrs.frozen(eq=False)
class Skeleton:
    """A mesh to draw: vertices (n, 3) in mm, edges (e, 2), faces, a list of (m, k) arrays, and attributes.

    attributes: values (n,) at the vertices by name; slots: number of the material of each face, or None;
    inputs: further inputs, by name, of the node group that skins it.
    """

    vertices: Floats
    edges: Integers = attrs.field(factory=lambda: np.empty((0, 2), np.int64))
    faces: tuple[Integers, ...] = ()
    attributes: dict[str, Floats] = attrs.field(factory=dict)
    slots: Integers | None = None
    inputs: dict[str, Any] = attrs.field(factory=dict)


def actuator(d: Dimensions, cut: bool) -> Skeleton:
    """Surface of the actuator with its inlet; with `cut`, the half x <= 0 and its section."""
    outer = outer_polygon(d, ALONG)[1:]
    boss = d.inlet_radius + d.inlet_wall
    inlet = np.array([[d.inlet_radius, -d.inlet_length], [boss, -d.inlet_length], [boss, 0.0]])
    if not cut:
        bore = np.array([[d.inlet_radius, d.base_cap]])
        return _revolved(np.concatenate([bore, inlet, outer]), closed=True)
    cavity = cavity_polygon(d, ALONG)[::-1]
    bore = np.array([[d.inlet_radius, d.base_cap]])
    section = np.concatenate([inlet, outer, cavity[:-1], bore])
    half = _revolved(np.concatenate([section, section[:1]]), closed=False)
    return _with_section(half, section)


def lattice(d: Dimensions, cut: bool) -> Skeleton:
    """Struts as polylines with their radius; with `cut`, what is at x <= 0 and outside the actuator."""
    found = lattice_of(d)
    ends = found.nodes[found.struts]
    first, last = np.zeros(len(ends)), np.ones(len(ends))
    if cut:
        ends = ends[(ends[:, :, 0] <= 1e-6).all(axis=1)]
        outside = _outside(d, _along(ends, FINE))
        ends, outside = ends[outside.any(axis=1)], outside[outside.any(axis=1)]
        first = FINE[outside.argmax(axis=1)]
        last = FINE[len(FINE) - 1 - outside[:, ::-1].argmax(axis=1)]
    t = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, ALONG_STRUT + 1)
    edges = _polylines(len(ends), ALONG_STRUT + 1)
    return Skeleton(_along(ends, t).reshape(-1, 3), edges, attributes={"radius": found.radius(t).ravel()})


def _along(ends: Floats, t: Floats) -> Floats:
    """Points (e, n, 3) at fractions t, (n,) or (e, n), of the way between ends (e, 2, 3)."""
    return np.asarray(ends[:, :1] + t[..., None] * (ends[:, 1:] - ends[:, :1]))


def _outside(d: Dimensions, points: Floats) -> NDArray[np.bool_]:
    """Whether a strut's axis at points (..., 3) is so far outside the actuator that none shows inside."""
    clear = 0.15 * d.junction_diameter
    return np.asarray(np.hypot(points[..., 0], points[..., 1]) >= outer_radius(d, points[..., 2]) + clear)


def anchor_points(unit: Unit) -> Skeleton:
    """Anchors as points, a little wider than the junctions they are in."""
    at = anchors(unit)
    radius = 0.62 * max(unit.dimensions.junction_diameter, unit.dimensions.midspan_diameter)
    return Skeleton(at, attributes={"radius": np.full(len(at), radius)})


def bar(unit: Unit, window: Window) -> Skeleton:
    """The waveguide's bar (slot 0) with its wells (slot 1)."""
    found = waveguide(unit, window)
    boxes = [found.box, *found.wells]
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    vertices = np.concatenate([box[corners, np.arange(3)] for box in boxes])
    faces = np.concatenate([sides + 8 * number for number in range(len(boxes))])
    return Skeleton(vertices, faces=(faces,), slots=np.repeat(np.arange(len(boxes)) > 0, 6).astype(np.int64))


def candidates(unit: Unit) -> dict[str, Skeleton]:
    """Every candidate path by name, side by side outside the lattice: in place they cover each other."""
    d = unit.dimensions
    at, side = anchors(unit), float(np.sign(d.row)) or 1.0
    edge = d.bounds[1][1] if side > 0 else d.bounds[1][0]
    found = {}
    for number, window in enumerate(windows(len(at)), 1):
        points = at[list(window.indices)].copy()
        points[:, 1] = edge + side * LADDER_STEP * d.cell * (number + 0.5)
        radius = np.full(len(points), 0.06 * d.cell)
        name = {
            "Label": window.name.replace("alpha", "α"),
            "At": (0.1 * d.cell, float(points[0, 1]) - 0.1 * d.cell, float(points[0, 2]) - 0.4 * d.cell),
            "Size": 0.3 * d.cell,
        }
        edges = _polylines(1, len(points))
        found[window.name] = Skeleton(points, edges, attributes={"radius": radius}, inputs=name)
    return found


def _polylines(count: int, points: int) -> Integers:
    """Edges of `count` polylines of `points` vertices each, one after another."""
    first = np.arange(count)[:, None] * points + np.arange(points - 1)
    return np.stack([first, first + 1], axis=-1).reshape(-1, 2)


def _revolved(curve: Floats, closed: bool) -> Skeleton:
    """Curve (n, 2) of (radius, z) around z: whole, or the half x <= 0; points on the axis are poles."""
    angle = (
        np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
        if closed
        else np.linspace(0.5, 1.5, AROUND // 2 + 1) * np.pi
    )
    columns = AROUND if closed else len(angle)
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
    start = len(half.vertices)
    sides = []
    for number, sign in enumerate((1.0, -1.0)):
        flat = np.column_stack([np.zeros(len(section)), sign * section[:, 0], section[:, 1]])
        sides.append((flat, triangles + start + number * len(section)))
    count = sum(len(f) for f in half.faces)
    cuts = np.concatenate(
        [_facing_x(np.concatenate([half.vertices, *(s[0] for s in sides)]), s[1]) for s in sides]
    )
    return Skeleton(
        np.concatenate([half.vertices, *(s[0] for s in sides)]),
        faces=(*half.faces, cuts),
        slots=np.concatenate([np.zeros(count, np.int64), np.ones(len(cuts), np.int64)]),
    )


def _facing_x(vertices: Floats, triangles: Integers) -> Integers:
    """Triangles turned so that they face +x."""
    p, q, r = vertices[triangles.T]
    away = np.cross(q - p, r - p)[:, 0] < 0.0
    return np.where(away[:, None], triangles[:, ::-1], triangles)


def write(mesh: Any, skeleton: Skeleton, smooth: bool = True) -> None:
    """Replace the geometry of a Blender mesh by a skeleton, materials kept."""
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
        mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
        if smooth:
            mesh.set_sharp_from_angle(angle=np.radians(40.0))
    for name, values in skeleton.attributes.items():
        attribute = mesh.attributes.new(name, "FLOAT", "POINT")
        attribute.data.foreach_set("value", values.astype(np.float32))
