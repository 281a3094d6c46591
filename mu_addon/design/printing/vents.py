"""Vents for resin that a part traps along a build direction, and the plugs that close them afterwards.

While a part is printed, the film closes every layer; a space closed toward the platform is a cup. A hole at
its start, on the platform's side, lets resin in and out. A void that never opens gets a second hole at its
other end, so that air follows the resin. After printing and washing, each gets its plug.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from .. import shapes
from ..gates import GateError
from ..solid import printable
from ..surface import Triangles, Vertices
from .layers import regions
from .printer import Printer
from .trapped_resin import cups
from .voxels import frame_along, voxel_rows

DIAMETER_MM = 2.0
"""Diameter of a vent: a ball of it passes, and viscous resin drains (assumed)."""
THINNEST_MM = 1.2
"""Least thickness of a wall for a vent: a thinner one stretches, and holds no plug (assumed)."""
THICKEST_MM = 12.0
"""Largest thickness of such a wall: a longer bore cannot be washed out (assumed)."""
CLEARANCE_MM = 0.05
"""Clearance between plug and bore on every side, for resin as glue (assumed)."""
HEAD_MM = (1.0, 1.0)
"""Overhang of a plug's head over the bore on every side, and its thickness."""
STEP_MM = 0.25
FACETS = 48


@attrs.frozen(eq=False)
class Vent:
    """A hole through a wall: its ends (3,) in mm, within and outside, and its plug, a Manifold in place.

    head: True if the plug has a head outside; the wall around the hole is not flat without one.
    """

    inner: Array
    outer: Array
    diameter: float
    plug: Any
    head: bool

    @property
    def length(self) -> float:
        """Length of the hole in mm."""
        return float(np.linalg.norm(self.outer - self.inner))

    def plain(self) -> dict[str, Any]:
        """Its figures by name, for a file."""
        return {
            "inner_mm": self.inner,
            "outer_mm": self.outer,
            "diameter_mm": self.diameter,
            "length_mm": self.length,
            "plug_mm3": float(self.plug.volume()),
            "plug_has_head": self.head,
        }

    def plug_surface(self) -> tuple[Vertices, Triangles]:
        """The plug as a surface (n, 3), (m, 3), with its head on z = 0."""
        frame = frame_along(self.inner - self.outer)
        at = -frame @ self.outer
        points, faces = printable(self.plug.transform(np.column_stack([frame, at]).tolist()))
        return points - [0.0, 0.0, points[:, 2].min()], faces


@attrs.frozen(eq=False)
class Vented:
    """A part with its vents: vertices (n, 3) in mm, triangles (m, 3), and the trapped resin, in ml.

    before_ml, after_ml: the largest cup along the direction, without and with the vents.
    """

    vertices: Vertices
    triangles: Triangles
    vents: list[Vent]
    before_ml: float
    after_ml: float


def vented(vertices: Vertices, triangles: Triangles, direction: Sequence[float], printer: Printer) -> Vented:
    """A part, vertices (n, 3) in mm and triangles (m, 3), with a vent for every cup along a build direction.

    Cups up to the printer's limit are left. Without a cup the list of vents is empty and the part is
    unchanged. A wall can take a vent if it is between THINNEST_MM and THICKEST_MM, square to the hole, with
    the outside behind it. Raises GateError if the part is not closed, no wall of a cup has room for a vent,
    or the result is not one body or still has a cup above the limit.
    """
    from manifold3d import Error, Manifold, Mesh64, OpType

    solid = Manifold(Mesh64(vertices, triangles.astype(np.uint64)))
    if solid.status() != Error.NoError or solid.is_empty():
        raise GateError("the surface is not closed", "vents", "repair it first")
    up = np.asarray(direction, float) / np.linalg.norm(direction)
    limit = printer["cup_ml"]
    trapped = _cups(solid, up, printer)
    large = np.flatnonzero(trapped.volume / 1e3 > limit)
    before = float(trapped.volume[:1].sum()) / 1e3
    if not len(large):
        return Vented(vertices, triangles, [], before, before)
    outside = _outside(solid)
    vents = []
    for k in large.tolist():
        ml = trapped.volume[k] / 1e3
        vents.append(_vent(solid, outside, trapped.first[k], up, ml))
        if trapped.sealed[k]:
            vents.append(_vent(solid, outside, trapped.last[k], -up, ml))
    bores = [_bore(vent.inner, vent.outer, 0.5 * vent.diameter, 0.5) for vent in vents]
    points, faces = printable(solid - Manifold.batch_boolean(bores, OpType.Add))
    drilled = Manifold(Mesh64(points, faces.astype(np.uint64)))
    bodies = sum(piece.volume() > 0.0 for piece in drilled.decompose())
    if bodies != 1:
        raise GateError(
            f"with its vents the part falls into {bodies} pieces", "vents", "choose another build direction"
        )
    after = float(_cups(drilled, up, printer).volume[:1].sum()) / 1e3
    if after > limit:
        raise GateError(
            f"with {len(vents)} vents {after:.3g} ml are still trapped, of {before:.3g} ml",
            "vents",
            "choose another build direction: see the build directions of `check`",
        )
    return Vented(points, faces, vents, before, after)


def _cups(solid: Any, up: Array, printer: Printer) -> Any:
    """Cups of a Manifold along a direction (3,)."""
    mesh = solid.simplify(0.01).to_mesh64()
    seen = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)
    grid = voxel_rows(*seen, STEP_MM, printer["layer_mm"], frame_along(up))
    return cups(grid, regions(grid, free=True))


def _outside(solid: Any) -> Any:
    """Return a function: is the box's outside visible from a point (3,) in mm in some direction?"""
    low, high = np.array(solid.bounding_box()).reshape(2, 3)
    far = 2.0 * float(np.linalg.norm(high - low))
    ways = np.array(list(itertools.product((-1.0, 0.31, 1.0), repeat=3)))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return lambda at: any(not solid.ray_cast(at.tolist(), (at + far * way).tolist()) for way in ways)


def _vent(solid: Any, outside: Any, start: Array, up: Array, ml: float) -> Vent:
    """The vent at the start of a cup, through the most suitable wall; raises GateError."""
    ways = np.array([w for w in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(w)]) @ frame_along(up)
    ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    # Toward the platform first, then aside: a hole away from it would begin above the cup's first layer.
    ways = ways[np.argsort(ways @ up, kind="stable")]
    radius = 0.5 * DIAMETER_MM
    seen = []
    for way in ways[ways @ up < 0.1]:
        hits = solid.ray_cast(start.tolist(), (start + 3.0 * THICKEST_MM * way).tolist())
        if len(hits) < 2 or hits[0].distance * 3.0 * THICKEST_MM > 2.0 * THICKEST_MM:
            continue
        inner, outer = (start + 3.0 * THICKEST_MM * hit.distance * way for hit in hits[:2])
        wall = float(np.linalg.norm(outer - inner))
        square = all(abs(np.asarray(hit.normal) @ way) > 0.9 for hit in hits[:2])
        if not square or not outside(outer + 0.5 * way):
            continue
        seen.append(wall)
        if not THINNEST_MM <= wall <= THICKEST_MM:
            continue
        # Only the wall itself may be in the way, no strut behind it.
        taken = solid ^ _bore(inner, outer, radius, 2.0)
        if len(taken.decompose()) != 1 or taken.volume() > 1.3 * np.pi * radius**2 * wall:
            continue
        return Vent(inner, outer, DIAMETER_MM, *_plug(solid, inner, outer, radius))
    found = f"walls of {min(seen):.2g} to {max(seen):.2g} mm were found" if seen else "no wall was found"
    x, y, z = start
    raise GateError(
        f"the cup of {ml:.3g} ml can have no vent: {found} where it begins, and a vent takes one of "
        f"{THINNEST_MM:g} to {THICKEST_MM:g} mm that is flat, with the outside behind it",
        f"({x:.2f}, {y:.2f}, {z:.2f}) mm",
        "print along another direction: see the build directions of `check`",
    )


def _placed(body: Any, at: Array, way: Array) -> Any:
    """A Manifold along z, moved to a place and rotated to a direction, (3,) each."""
    frame = frame_along(way)
    return body.transform(np.column_stack([frame.T, at]).tolist())


def _bore(inner: Array, outer: Array, radius: float, beyond: float) -> Any:
    way = outer - inner
    length = float(np.linalg.norm(way))
    return _placed(shapes.cylinder(radius, -beyond, length + beyond, FACETS), inner, way / length)


def _plug(solid: Any, inner: Array, outer: Array, radius: float) -> tuple[Any, bool]:
    """The plug of a bore, with a head outside if there is room for it, and True if so."""
    way = (outer - inner) / np.linalg.norm(outer - inner)
    stem = _bore(inner, outer, radius - CLEARANCE_MM, 0.0)
    wider, thick = HEAD_MM
    head = _placed(shapes.cylinder(radius + wider, 0.0, thick, FACETS), outer, way)
    # The head must lie flat: nothing of the part in it, and the part right below it all around.
    below = _placed(shapes.cylinder(radius + wider, -0.2, -0.1, FACETS), outer, way)
    flat = (head ^ solid).volume() < 1e-3 * head.volume()
    held = (below ^ solid).volume() > 0.95 * below.volume()
    if not (flat and held):
        return stem, False
    # A little into the stem, so that both are one body.
    joint = _placed(shapes.cylinder(radius - CLEARANCE_MM, -0.1, 0.1, FACETS), outer, way)
    return stem + head + joint, True
