"""A printed waveguide in the mesh of a printed unit: bar, wells and seats, and the struts they cut."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..arrays import Array
from ..design.anchors import Window
from ..design.body import Body, covering
from ..design.dimensions import Dimensions
from ..design.lattice import lattice_of
from ..design.parameters import Unit
from ..design.waveguide import Bar, waveguide
from ..errors import InputError
from ..fem.embedding import embed
from ..meshing.mesh import LATTICE, Mesh, part
from ..meshing.quality import check_positive
from ..meshing.wall_and_cavity import unmovable
from .bar import bar_mesh, is_own_mirror_image, outside_bar, outside_seat, seat_mesh
from .beams import REACH, without_beams
from .graph_beams import graph_layers_of
from .lattice import LEAST_SUPPORT, Depth, clearance, cuts, filled_outside, support
from .octants import in_replaced, is_thickening, thickened_nodes
from .strut import is_half_diagonal

# An element of a strut of which the bar leaves less than this is all replaced.
_LEAST = 0.02


def bar_of(unit: Unit, path: Window | ArrayLike, body: Body | None = None) -> Bar:
    """Waveguide along a window of anchors or lattice nodes (n, 3) in mm, as printed.

    body: a closed surface that cuts the lattice in place of its box. Raises InputError for a path that no
    waveguide fits, and for struts that it would thicken in a lattice that is not swept (`strut_mesh`).
    """
    d = covering(unit.printed, body)
    bar = waveguide(unit, path, d)
    if not is_half_diagonal(d) and is_thickening(d, bar):
        raise InputError(
            f"struts of {d.junction_diameter:.3g} mm are thickened where they meet a waveguide of "
            f"{d.waveguide_section:.3g} mm, which the model follows in body-centred lattices alone",
            "[lattice] kind, junction_diameter_mm",
            "make junctions as wide as the waveguide",
        )
    return bar


def with_waveguide(mesh: Mesh, bar: Bar, unit: Unit, body: Body | None = None) -> Mesh:
    """The mesh of a printed unit with a waveguide, of `bar_of`.

    mesh: of `mesh_printed`, a half or a whole; its own nodes and elements come first, in their order. Nodes
    of struts that the waveguide thickens are moved. Parts of struts within bar or seats, and struts that the
    bar replaces, no longer count. Their nodes there follow the bar, as the seats do; nodes within the wall
    follow the wall. Raises InputError for a half mesh of an asymmetric waveguide, MeshingError for inverted
    elements.
    """
    half = "x" in mesh.symmetry
    if half and not is_own_mirror_image(bar):
        raise InputError(
            "one half of a unit cannot hold a waveguide that is not its own image in the plane x = 0",
            "path, --fraction",
            "mesh the whole unit, or choose a window of anchors",
        )
    d = covering(unit.printed, body)
    found, wall_ties = _thickened(mesh, bar, d, body)
    struts = found.region == LATTICE
    outside: list[Depth] = [partial(outside_bar, bar), *(partial(outside_seat, seat) for seat in bar.seats)]
    filled = found.filled.copy()
    filled[struts] *= filled_outside(part(found, struts), outside, drop=False).filled
    filled[struts & in_replaced(d, bar, found.nodes[found.tets].mean(axis=1))] = 0.0
    filled[filled.mean(axis=1) < _LEAST] = 0.0
    found = attrs.evolve(found, filled=filled)
    away = np.min([distance(found.nodes) for distance in outside], axis=0)
    within = (away <= 0) | (support(found) < LEAST_SUPPORT)
    within[found.tets[~struts]] = False
    within[wall_ties.nodes] = False
    within[np.setdiff1d(mesh.beams, mesh.tets)] = False
    if len(mesh.beams):
        moved = (found.nodes != mesh.nodes).any(axis=1)
        touched = (filled != mesh.filled).any(axis=1) | moved[found.tets].any(axis=1)
        touched |= (away[found.tets] < REACH * d.junction_diameter).any(axis=1)
        touched &= struts
        if is_half_diagonal(d):
            found = without_beams(found, touched)
        else:
            found = graph_layers_of(mesh, lattice_of(d)).without(found, touched)
        within[found.carried] = False
        # Sections that no beam uses any more follow the bar or the struts: anchors may be among them.
        unused = np.setdiff1d(mesh.beams[:, 0::2], np.union1d(found.beams, found.tets))
        inside = away[unused] <= 0
        within[unused[inside]] = True
        unused = unused[~inside]
        if len(unused):
            follows = tie(unused, found.nodes[unused], part(found, struts))
            wall_ties = joined([wall_ties, follows], len(found.nodes))

    actuator: list[Depth] = [lambda points: clearance(d, points)]
    own = bar_mesh(bar, half, actuator)
    parts = [own, *(seat_mesh(bar, seat, half, actuator) for seat in bar.seats)]
    firsts = np.cumsum([len(found.nodes), *(len(piece.nodes) for piece in parts)])
    follow, wall, floor = np.flatnonzero(within), part(found, ~struts), found.nodes[found.base[0], 2]
    ties, held = [wall_ties, tie(follow, found.nodes[follow], own, firsts[0])], [found.base]
    for piece, first in zip(parts, firsts, strict=False):
        weak, in_wall = support(piece) < LEAST_SUPPORT, clearance(d, piece.nodes) <= 0
        if piece is own:
            in_wall |= weak
            in_bar = np.zeros_like(weak)
        else:
            in_bar = ~in_wall & (weak | (outside_bar(bar, piece.nodes) <= 0))
        for rows, to, number in ((in_wall, wall, 0), (in_bar, own, firsts[0])):
            ties.append(tie(first + np.flatnonzero(rows), piece.nodes[rows], to, number))
        held.append(first + np.flatnonzero((piece.nodes[:, 2] == floor) & ~in_wall & ~in_bar))
    tied = joined(ties, int(firsts[-1]))
    more = sum(len(piece.tets) for piece in parts)
    whole = attrs.evolve(
        found,
        nodes=np.vstack([found.nodes, *(piece.nodes for piece in parts)]),
        tets=np.vstack([found.tets, *(p.tets + first for p, first in zip(parts, firsts, strict=False))]),
        region=np.concatenate([found.region, np.full(more, LATTICE)]),
        base=np.concatenate(held),
        filled=np.vstack([found.filled, *(piece.filled for piece in parts)]),
        tied=tied.nodes,
        tied_to=tied.to,
        tied_weights=tied.weights,
        beam_of=np.append(found.beam_of, np.full(more, -1)) if len(found.beam_of) else found.beam_of,
        in_beams=np.pad(found.in_beams, ((0, more), (0, 0))) if found.in_beams.size else found.in_beams,
    )
    check_positive(whole)
    return whole


def moved_with_waveguide(
    drawn: Mesh, first: Mesh, mesh: Mesh, bar: Bar, unit: Unit, body: Body | None = None
) -> Mesh:
    """The mesh of a similar unit with its waveguide, of the same elements as that of a first one.

    drawn: the first unit's, first: that with its waveguide; mesh: the first unit's moved to the other
    (`PrintedMorph`), bar: the other's. Of each element the share that the waveguide leaves stays as it is:
    anew it is counted point by point, in steps. Raises as `with_waveguide`, and MeshingError where elements,
    ties or beams would be others.
    """
    found = with_waveguide(mesh, bar, unit, body)
    same = ("tets", "region", "base", "tied", "beams", "carried")
    if not all(np.array_equal(getattr(found, name), getattr(first, name)) for name in same):
        raise unmovable("its waveguide meets other struts")
    own, left = len(drawn.filled), np.zeros_like(drawn.filled)
    np.divide(first.filled[:own], drawn.filled, out=left, where=drawn.filled > 0)
    return attrs.evolve(found, filled=np.vstack([left * mesh.filled, first.filled[own:]]))


def _thickened(mesh: Mesh, bar: Bar, d: Dimensions, body: Body | None) -> tuple[Mesh, Ties]:
    """The mesh with struts thickened by the bar that they touch, and its nodes' ties to the wall."""
    before = Ties(mesh.tied, mesh.tied_to, mesh.tied_weights)
    if not is_thickening(d, bar):
        return mesh, before
    struts = mesh.region == LATTICE
    nodes, rows = mesh.nodes.copy(), np.unique(mesh.tets[struts])
    nodes[rows] = thickened_nodes(d, bar, nodes[rows])
    moved = (nodes != mesh.nodes).any(axis=1)
    elements = struts & moved[mesh.tets].any(axis=1)
    found, filled = attrs.evolve(mesh, nodes=nodes), mesh.filled.copy()
    filled[elements] = filled_outside(part(found, elements), cuts(d, body), drop=False).filled
    again = np.union1d(mesh.tied[moved[mesh.tied]], np.flatnonzero(moved & (clearance(d, nodes) <= 0)))
    kept = Ties(*(table[~moved[mesh.tied]] for table in before))
    ties = joined([kept, tie(again, nodes[again], part(found, ~struts))], len(nodes))
    return attrs.evolve(found, filled=filled), ties


class Ties(NamedTuple):
    """Nodes (t,) that move as weighted sums of others: their numbers and weights (t, k)."""

    nodes: Array
    to: Array
    weights: Array


def tie(rows: Array, points: Array, to: Mesh, first: int = 0) -> Ties:
    """Nodes (t,), at points (t, 3) in mm, that follow a mesh whose nodes are numbered from `first` on."""
    follows = embed(to, points)
    return Ties(rows, follows.nodes + first, follows.weights)


def joined(parts: list[Ties], count: int) -> Ties:
    """All ties of a body of `count` nodes, each node tied once at most.

    A node that follows tied ones follows their nodes: weights multiply. Chains are two ties long at most.
    """
    width = max(part.to.shape[1] for part in parts)
    padded = [(part, width - part.to.shape[1]) for part in parts]
    nodes = np.concatenate([part.nodes for part in parts])
    to = np.vstack([np.pad(part.to, ((0, 0), (0, more)), "edge") for part, more in padded])
    weights = np.vstack([np.pad(part.weights, ((0, 0), (0, more))) for part, more in padded])
    if not np.isin(to, nodes).any():
        return Ties(nodes, to, weights)
    free = np.setdiff1d(np.arange(count), nodes)
    rows = np.concatenate([free, np.repeat(nodes, width)])
    columns = np.concatenate([free, to.ravel()])
    values = np.concatenate([np.ones(len(free)), weights.ravel()])
    follows = sparse.csr_matrix((values, (rows, columns)), shape=(count, count))
    follows = (follows[nodes] @ follows).tocsr()
    follows.eliminate_zeros()
    each = np.diff(follows.indptr)
    place = np.arange(follows.nnz) - np.repeat(follows.indptr[:-1], each)
    row = np.repeat(np.arange(len(nodes)), each)
    to = np.repeat(follows.indices[follows.indptr[:-1], None], each.max(), axis=1)
    weights = np.zeros(to.shape)
    to[row, place], weights[row, place] = follows.indices, follows.data
    return Ties(nodes, to, weights)
