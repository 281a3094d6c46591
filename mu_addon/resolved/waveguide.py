"""A printed waveguide in the mesh of a printed unit: bar, wells and seats in place of what they cut away."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import attrs
import numpy as np

from ..design.anchors import Window
from ..design.block import Block
from ..design.lattice import lattice_of
from ..design.parameters import Unit
from ..design.waveguide import Bar, Seat, strut_radii, waveguide
from ..errors import InputError
from ..fem.embedding import embed
from ..meshing.mesh import LATTICE, Array, Mesh
from .grid import box_grid, cut_levels
from .lattice import LEAST_SUPPORT, filled_outside, support

# Longest element of a bar and of a seat, as a share of the bar's section.
_LONGEST = 0.9
# An element of a strut of which the bar leaves less than this is all replaced.
_LEAST = 0.02


def bar_of(unit: Unit, window: Window) -> Bar:
    """The waveguide that is printed along a window of anchors, as the printer makes it.

    Raises InputError for a window that no waveguide fits, and for struts that it would thicken.
    """
    d = unit.printed
    bar = waveguide(unit, window, d)
    lattice = lattice_of(d)
    t = np.linspace(0.0, 1.0, 17)
    if (strut_radii(lattice, bar.met, bar.half, t) > lattice.radius(t) + 1e-6 * d.cell).any():
        raise InputError(
            f"struts of {d.junction_diameter:.3g} mm are thickened where they meet a waveguide of "
            f"{d.waveguide_section:.3g} mm, which the resolved model does not follow yet",
            "[lattice] junction_diameter_mm, fidelity",
            'make junctions as wide as the waveguide, or choose fidelity "homogenised"',
        )
    return bar


def with_waveguide(mesh: Mesh, bar: Bar) -> Mesh:
    """The mesh of a printed unit with a straight waveguide in its mirror plane, along z.

    mesh: of `mesh_printed`, a half or a whole; its own nodes and elements come first, in their order. What of
    the struts lies within the bar or its seats counts no longer, and their nodes there follow the bar; the
    seats are tied to it likewise. Raises InputError for a bar that bends or leaves the mirror plane.
    """
    way = np.diff(bar.points, axis=0)
    if (np.abs(bar.points[:, 0]) > 1e-9).any() or (np.abs(way[:, :2]) > 1e-9).any():
        raise InputError(
            "the resolved model knows straight waveguides along z in the mirror plane x = 0",
            "path",
            'choose a window of anchors, or fidelity "homogenised"',
        )
    half = "x" in mesh.symmetry
    parts = [_bar_mesh(bar, half), *(_seat_mesh(bar, seat, half) for seat in bar.seats)]
    struts = mesh.region == LATTICE
    outside: list[Callable[[Array], Array]] = [lambda points: _outside_bar(bar, points)]
    outside += [partial(_outside_seat, seat) for seat in bar.seats]
    cut = filled_outside(_struts_of(mesh, struts), outside, drop=False)
    filled = mesh.filled.copy()
    filled[struts] *= cut.filled
    filled[filled.mean(axis=1) < _LEAST] = 0.0
    found = attrs.evolve(mesh, filled=filled)
    within = np.min([away(mesh.nodes) for away in outside], axis=0) <= 0
    within |= support(found) < LEAST_SUPPORT
    within[mesh.tied] = False
    of_struts = np.zeros(len(mesh.nodes), bool)
    of_struts[np.unique(mesh.tets[struts])] = True
    first = len(mesh.nodes)
    tied = [_tie(np.flatnonzero(within & of_struts), mesh.nodes, parts[0], first)]
    nodes, tets, shares = [mesh.nodes], [mesh.tets], [filled]
    for number, part in enumerate(parts):
        if number:
            inside = np.flatnonzero((_outside_bar(bar, part.nodes) <= 0) | (support(part) < LEAST_SUPPORT))
            own = _tie(inside, part.nodes, parts[0], len(mesh.nodes))
            tied.append((own[0] + first, own[1], own[2]))
        nodes.append(part.nodes)
        tets.append(part.tets + first)
        shares.append(part.filled if part.resolved else np.ones((len(part.tets), filled.shape[1])))
        first += len(part.nodes)
    more = sum(len(part.tets) for part in parts)
    return attrs.evolve(
        found,
        nodes=np.vstack(nodes),
        tets=np.vstack(tets),
        region=np.concatenate([mesh.region, np.full(more, LATTICE)]),
        filled=np.vstack(shares),
        tied=np.concatenate([mesh.tied, *(t[0] for t in tied)]),
        tied_to=np.vstack([mesh.tied_to, *(t[1] for t in tied)]),
        tied_weights=np.vstack([mesh.tied_weights, *(t[2] for t in tied)]),
    )


def _struts_of(mesh: Mesh, rows: Array) -> Mesh:
    return Mesh(
        mesh.nodes,
        mesh.tets[rows],
        mesh.region[rows],
        mesh.cavity[:0],
        mesh.base[:0],
        mesh.tip[:0],
        mesh.symmetry,
    )


def _tie(rows: Array, nodes: Array, to: Mesh, first: int) -> tuple[Array, Array, Array]:
    """Nodes that follow a part whose own nodes are numbered from `first` on, what they follow and how."""
    follows = embed(to, nodes[rows])
    return rows, follows.nodes + first, follows.weights


def _outside_bar(bar: Bar, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a straight bar along z, negative inside it."""
    low, high = bar.points[0], bar.points[-1]
    across = np.abs(points[:, :2] - low[:2]).max(axis=1) - bar.half
    along = np.maximum(np.minimum(low[2], high[2]) - points[:, 2], points[:, 2] - np.maximum(low[2], high[2]))
    return np.maximum(across, along)


def _bar_mesh(bar: Bar, half: bool) -> Mesh:
    """The bar without what its wells cut out."""
    low, high = sorted((float(bar.points[0, 2]), float(bar.points[-1, 2])))
    wells = [block.corners for block in bar.wells]
    edges = np.array([z for corners in wells for z in (corners[:, 2].min(), corners[:, 2].max())])
    floors = np.array([y for c in wells for y in (c[:, 1].min(), c[:, 1].max())])
    longest = _LONGEST * 2.0 * bar.half
    x = np.array([0.0, bar.half]) if half else np.array([-bar.half, 0.0, bar.half])
    middle = float(bar.points[0, 1])
    y = cut_levels(middle - bar.half, middle + bar.half, longest, np.unique(floors.round(9)))
    z = cut_levels(low, high, longest, edges)
    middles = [(a[1:] + a[:-1]) / 2 for a in (x, y, z)]
    centres = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    solid = np.ones(centres.shape[:3], bool)
    for corners in wells:
        inside = (centres > corners.min(axis=0)) & (centres < corners.max(axis=0))
        solid &= ~inside.all(axis=-1)
    return box_grid((x, y, z), solid)


def _seat_mesh(bar: Bar, seat: Seat, half: bool) -> Mesh:
    """A seat outside the bar, less its pocket and notch."""
    corners = np.concatenate([seat.foot.corners, seat.body.corners])
    kept: list[Callable[[Array], Array]] = [
        lambda points: -_outside_seat(seat, points),
        lambda points: _outside_bar(bar, points),
        *(partial(_outside_block, block) for block in (seat.pocket, seat.notch)),
    ]
    (x0, y0, z0), (x1, y1, z1) = corners.min(axis=0), corners.max(axis=0)
    inner = np.concatenate([block.corners for block in (seat.foot, seat.body, seat.pocket, seat.notch)])
    longest = _LONGEST * 2.0 * bar.half
    spans = ((0.0 if half else x0, x1), (y0, y1), (z0, z1))
    x, y, z = (
        cut_levels(float(low), float(high), longest, np.unique(inner[:, axis].round(9)))
        for axis, (low, high) in enumerate(spans)
    )
    solid = np.ones((len(x) - 1, len(y) - 1, len(z) - 1), bool)
    return filled_outside(box_grid((x, y, z), solid), kept)


def _outside_seat(seat: Seat, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a seat's hull, its pocket filled, negative inside."""
    from scipy.spatial import ConvexHull

    planes = ConvexHull(np.concatenate([seat.foot.corners, seat.body.corners])).equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3]).max(axis=1))


def _outside_block(block: Block, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a box, negative inside it."""
    return np.asarray((np.abs((points - block.centre) @ block.axes.T) - block.half).max(axis=1))
