"""Drains and leaks of chambers: they must drain through their inlet and hold pressure otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import connected
from .. import shapes
from ..dimensions import Dimensions
from ..parameters import Unit
from ..surface import Triangles, Vertices
from .chambers import Chambers, Opening
from .faces import edges
from .finding import Finding, Points, Severity, counted, judged
from .printer import Limit, Printer
from .voxels import frame_along


def drainage_findings(solid: Any, chambers: Chambers, unit: Unit | None, printer: Printer) -> list[Finding]:
    """Findings on chambers of a Manifold in mm: each must drain through its inlet and be tight otherwise.

    With a unit the inlet's place is known, and the number of chambers that a plug in it seals off is checked
    exactly. Without one a chamber's widest way out is taken for its inlet, and others are warnings.
    """
    limit = printer.limits["drain_diameter_mm"]
    step = float(chambers.grid.step[0])
    leaks: list[Points] = []
    widths: list[float] = []
    inlets: list[tuple[float, Points]] = []
    closed: list[Points] = []
    for chamber in chambers.found:
        ways = [_widest_ball(solid, way, step) for way in chamber.openings]
        inlet = 0 if ways else -1
        if unit is not None:
            inlet = next((k for k, (p, _) in enumerate(ways) if _in_inlet(p, unit.dimensions)), -1)
        if inlet < 0:
            stop = None if unit is None else _blockage(solid, unit.dimensions)
            closed.append(chamber.place if stop is None else stop)
        else:
            inlets.append((2.0 * ways[inlet][1], ways[inlet][0]))
        leaks += [place for k, (place, _) in enumerate(ways) if k != inlet]
        widths += [2.0 * radius for k, (_, radius) in enumerate(ways) if k != inlet]
    places = np.array(leaks).reshape(-1, 3)
    wide = f", {max(widths):.2g} mm wide at the most" if widths else ""
    what = counted(len(leaks), "way", "ways") + (
        f" out of chambers beside their inlet{wide}; leaks: holes below {1.75 * step:.2g} "
        "mm are too small for this test"
    )
    none = Limit(0.0, "a chamber that must hold pressure may have only one opening", False)
    severity: Severity = "error" if unit is not None else "warning"
    count = float(len(leaks))
    found = [judged("leaks", bool(leaks), severity, what, count, none, places, "close the hole", "")]
    if unit is not None:
        found.append(_leak_test(solid, chambers, unit, places))
    if closed:
        what = counted(len(closed), "chamber does not drain", "chambers do not drain")
        found.append(judged("drain", True, "error", what, 0.0, limit, np.array(closed), "open the inlet"))
    elif inlets:
        least, place = min(inlets, key=lambda way: way[0])
        what = f"{least:.3g} mm wide at the narrowest point of the drain"
        remedy = "widen the inlet, or rinse the chamber through a needle"
        bad = least < limit.value
        found.append(
            judged("drain", bad, "warning", what, least, limit, place[None], remedy, shown=place[None])
        )
    return found


def _leak_test(solid: Any, chambers: Chambers, unit: Unit, leaks: Points) -> Finding:
    """Finding on leaks: with the inlet plugged there must be one more inner shell, exact for any hole."""
    d = unit.dimensions
    plug = shapes.cylinder(
        d.inlet_radius + d.inlet_wall / 2.0, -1.5 * d.inlet_length, -0.5 * d.inlet_length, 32
    )
    stopped = solid + plug
    before = sum(shell.volume() < 0.0 for shell in solid.decompose())
    volumes = [shell.volume() for shell in stopped.decompose() if shell.volume() < 0.0]
    sealed = len(volumes) - before
    tight = sealed == 1
    words = f"with the inlet plugged {counted(sealed, 'chamber is', 'chambers are')} sealed off"
    if tight:
        words += f", of {-sum(volumes) / 1e3:.4g} ml"
    elif not len(leaks) and not before:
        leaks = _holes(stopped, chambers, d)
    limit = Limit(1.0, "exact Boolean with a plug in the inlet", False)
    remedy = "close the hole, or open the inlet"
    return judged("leak test", not tight, "error", words, float(sealed), limit, leaks, remedy, "")


def _holes(stopped: Any, chambers: Chambers, d: Dimensions) -> Points:
    """Middles (k, 3) of the holes that join a chamber's surface to the outside's, the inlet stopped."""
    mesh = stopped.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    triangles = np.asarray(mesh.tri_verts).astype(np.int64)
    p, q, r = vertices[triangles.T]
    normal = np.cross(q - p, r - p)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    before = (p + q + r) / 3.0 + float(chambers.grid.step[0]) * normal
    curves = necks(vertices, triangles, chambers.hold(before), chambers.beside(before))
    middles = np.array([curve.mean(axis=0) for curve in curves]).reshape(-1, 3)
    return middles[[not _in_inlet(place, d) for place in middles]]


def _in_inlet(place: Points, d: Dimensions) -> bool:
    return bool(np.hypot(place[0], place[1]) <= d.inlet_radius and place[2] <= d.base_cap + d.inlet_radius)


def _blockage(solid: Any, d: Dimensions) -> Points | None:
    """Middle of an obstruction on the inlet's axis, or None."""
    low, high = -2.0 * d.inlet_length, 0.5 * d.cell
    nudge = 1e-3 * d.inlet_radius
    hits = solid.ray_cast([nudge, 0.7 * nudge, low], [nudge, 0.7 * nudge, high])
    if len(hits) < 2:
        return None
    return np.array([0.0, 0.0, low + 0.5 * (hits[0].distance + hits[1].distance) * (high - low)])


def _widest_ball(solid: Any, way: Opening, step: float) -> tuple[Points, float]:
    """Widest free ball about a cell's width across a way: its middle (3,) and radius, by rays around."""
    k = np.arange(200) + 0.5
    z = 1.0 - k / 100.0
    turn = np.pi * (1.0 + np.sqrt(5.0)) * k
    rays = np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)
    reach = 8.0
    x, y, _ = frame_along(way.along)

    def radius(at: Points, above: float) -> float:
        """Radius of the widest ball about a point; where that is no more than `above`, anything up to it."""
        least, start = 1.0, at.tolist()
        for end in (at + reach * rays).tolist():
            hit = solid.ray_cast(start, end)
            if hit and hit[0].distance < least:
                least = hit[0].distance
                if reach * least <= above:
                    break
        return float(reach * least)

    best, size = way.place, radius(way.place, 0.0)
    shift = 0.5 * step
    while shift > 0.02 * step:
        around = [best + shift * side for side in (x, -x, y, -y, x + y, x - y, y - x, -x - y)]
        wider = size
        for at in around:
            if np.linalg.norm(at - way.place) < 1.5 * step:
                # The line that distinguishes inside from outside crosses the whole part, so it comes last.
                found = radius(at, wider)
                if found > wider and _free(solid, at):
                    best, wider = at, found
        if wider == size:
            shift *= 0.5
        size = wider
    return best, size


def _free(solid: Any, at: Points) -> bool:
    """True if a point lies outside the solid: a line from it leaves as often as it enters."""
    return len(solid.ray_cast(at.tolist(), (at + np.array([311.0, 173.0, 97.0])).tolist())) % 2 == 0


_GRAIN = 1e-3
"""Unit in mm of an edge's length as a whole number."""


def necks(
    vertices: Vertices, triangles: Triangles, one: NDArray[np.bool_], other: NDArray[np.bool_]
) -> list[Points]:
    """Shortest closed curves that separate two parts of a surface, each as its edges' middles (k, 3) in mm.

    vertices (n, 3) in mm, triangles (m, 3); one (m,), other (m,): mark the triangles of either part. The
    curves are the minimum cut of the graph of triangles, whose links are as strong as the common edges are
    long. An empty list if the parts are not connected, or one is empty.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    m = len(triangles)
    e = edges(triangles)
    order = np.argsort(e.of_side, kind="stable")
    pairs = np.flatnonzero(np.diff(e.of_side[order]) == 0)
    a, b = order[pairs] % m, order[pairs + 1] % m
    ends = e.ends[e.of_side[order[pairs]]]
    length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
    strength = np.maximum(np.rint(length / _GRAIN), 1).astype(np.int32)
    # Each side is drawn together into one node: 0 and 1, and the other triangles from 2 on.
    node = np.cumsum(~(one | other)) + 1
    node[one], node[other] = 0, 1
    rows, columns = np.concatenate([node[a], node[b]]), np.concatenate([node[b], node[a]])
    n = int(node.max(initial=1)) + 1
    kept = rows != columns
    graph = coo_matrix((np.tile(strength, 2)[kept], (rows[kept], columns[kept])), shape=(n, n)).tocsr()
    if one.any() and other.any():
        left = (graph - maximum_flow(graph, 0, 1).flow).tocsr()
        left.data[left.data < 0] = 0
        left.eliminate_zeros()
        reached = np.zeros(n, bool)
        reached[breadth_first_order(left, 0, return_predecessors=False)] = True
        cut = reached[node[a]] != reached[node[b]]
    else:
        cut = np.zeros(len(a), bool)
    if not cut.any():
        return []
    used, index = np.unique(ends[cut], return_inverse=True)
    first, second = index.reshape(-1, 2).T
    curve = connected(len(used), first, second)[first]
    middle = vertices[ends[cut]].mean(axis=1)
    return [middle[curve == k] for k in range(int(curve.max()) + 1)]
