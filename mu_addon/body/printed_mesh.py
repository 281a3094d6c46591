"""Mesh of a printed unit: its wall, and its struts tied to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..design.body import Body, covering
from ..design.dimensions import Dimensions
from ..design.lattice import lattice_of
from ..design.parameters import Unit
from ..fem.embedding import embed
from ..meshing.mesh import MEMBRANE, Mesh, mirror, second_order
from ..meshing.quality import check_positive
from ..meshing.settings import CELL_MM, MeshSettings
from ..meshing.wall_and_cavity import Membrane, WallGrid
from .beams import REACH, with_beams
from .frame import frame_zones
from .graph_beams import with_graph_beams
from .lattice import LEAST_SUPPORT, clearance, struts, support, without_loose_parts
from .strut import is_half_diagonal

Progress = Callable[[str, float], None]

TIE_MM = 0.1
"""Struts' nodes this near the wall's outside are tied to it, too, for a cell of 12.5 mm and refinements to 1.

Ties only of nodes within the wall let it dent between them: three chambers then bend by 5 to 10 % more than
in a conforming mesh (docs/engineering/method.md). The distance shrinks with finer elements; grown with
coarser ones it would stiffen the feet (-19.2 for -20.7 degrees at -10 kPa, refine 0.5).
"""


@attrs.frozen
class Sizes:
    """Element sizes of a printed mesh; how they were chosen: docs/engineering/decisions.md.

    Of the wall in mm for a cell of 12.5 mm, proportional to the cell: along its meridian, and around its
    largest radius; through_wall: elements across it. Of struts rings and layers as in `strut_mesh`.
    """

    meridian_mm: float = 1.0
    hoop_mm: float = 2.0
    through_wall: int = 1
    rings: int = 1
    layers: int = 5

    def refined(self, by: float) -> Sizes:
        """Sizes divided and counts multiplied by a factor."""
        return Sizes(
            self.meridian_mm / by,
            self.hoop_mm / by,
            max(1, int(by * 0.7 + 0.5)) * self.through_wall,
            max(1, round(self.rings * by)),
            max(3, round(self.layers * by)),
        )


def beam_layers(sizes: Sizes) -> int:
    """Layers of a strut where struts are beams: they cost little, so that only the wall gets coarser."""
    return max(sizes.layers, Sizes().layers)


def mesh_printed(
    unit: Unit,
    settings: MeshSettings | None = None,
    progress: Progress | None = None,
    cache: Path | None = None,
    body: Body | None = None,
    sizes: Sizes | None = None,
    solid: bool = False,
) -> Mesh:
    """The printed unit as quadratic tetrahedra: wall and caps, and struts whose nodes in the wall follow it.

    Elements of struts count as far as they lie outside the actuator (`filled`); nodes inside it are tied to
    the wall. Struts are beams where they are whole (`with_beams`; of other kinds than half diagonals
    `with_graph_beams`), solids where the wall's law has memory. The base is clamped, the inlet is left out.

    cache: folder for the octants of lattices other than body-centred. body: a closed surface that cuts the
    lattice in place of its box. progress: called with a stage and the share done. sizes: of elements before
    `refine` divides them. solid: mesh every strut as a solid, to check the beams. Raises InputError and
    MeshingError.
    """
    s = settings or MeshSettings()
    report = progress or (lambda stage, share: None)
    d = unit.printed
    own = covering(d, body)
    # The wall's law is that of struts, too, and beams have no memory.
    beams = not (solid or unit.wall.has_memory)
    sizes = (sizes or Sizes()).refined(s.refine)
    if beams:
        sizes = attrs.evolve(sizes, layers=beam_layers(sizes))
    report("mesh of the wall", 0.0)
    full = body is not None or s.fraction == "full"
    wall = wall_mesh(d, sizes)
    if full:
        wall = mirror(wall, "x")
    report("mesh of the struts", 0.1)
    lattice = struts(d, sizes.rings, sizes.layers, full, cache, body)
    report("ties", 0.5)
    near = TIE_MM * d.cell / CELL_MM / max(s.refine, 1.0)
    clear = clearance(d, lattice.nodes)
    loose_free = without_loose_parts(lattice, (clear <= near) | (lattice.nodes[:, 2] == 0.0))
    if loose_free is not lattice:
        lattice, clear = loose_free, clearance(d, loose_free.nodes)
    mesh = tied(wall, lattice, clear - near)
    check_positive(mesh)
    if beams:
        reach = REACH * d.junction_diameter
        clear = np.concatenate([np.full(len(wall.nodes), np.inf), clear])
        if is_half_diagonal(d):
            mesh = with_beams(mesh, own, sizes.layers, clear, reach)
        else:
            zones = frame_zones(own, cache)
            mesh = with_graph_beams(mesh, lattice_of(own), sizes.layers, clear, reach, zones)
    report("mesh", 1.0)
    return mesh


def wall_grid(d: Dimensions, sizes: Sizes) -> WallGrid:
    """Grid of a unit's wall and caps at x >= 0."""
    scale = d.cell / CELL_MM
    return WallGrid(d, sizes.meridian_mm * scale, sizes.hoop_mm * scale, sizes.through_wall)


def wall_mesh(d: Dimensions, sizes: Sizes) -> Mesh:
    """Quadratic tetrahedra of a unit's wall and caps at x >= 0; base and tip are its end planes."""
    return wall_of(wall_grid(d, sizes).membrane, d)


def wall_of(found: Membrane, d: Dimensions) -> Mesh:
    """Quadratic tetrahedra of a membrane at x >= 0 of these dimensions; see `wall_mesh`."""
    nodes, tets, cavity = second_order(found.nodes, found.tets, found.cavity, found.middles)
    nodes[np.abs(nodes[:, 0]) < 1e-9 * d.cell, 0] = 0.0
    base, tip = (np.flatnonzero(nodes[:, 2] == z) for z in (0.0, d.height))
    return Mesh(nodes, tets, np.full(len(tets), MEMBRANE), cavity, base, tip, ("x",))


def tied(wall: Mesh, lattice: Mesh, clear_mm: Array) -> Mesh:
    """Mesh of a wall and of struts, whose nodes inside it follow the wall.

    clear_mm (n,): distance of the struts' nodes from the region where they are tied, negative within. Beyond
    the wall's inner face and just outside it, its displacement is continued with its gradient (`embed`).
    Nodes with almost no filled volume around them are tied, too. Struts in the plane of the wall's base are
    clamped with it.
    """
    within = np.flatnonzero((clear_mm <= 0) | (support(lattice) < LEAST_SUPPORT))
    follows = embed(wall, lattice.nodes[within])
    count = len(wall.nodes)
    free = np.ones(len(lattice.nodes), bool)
    free[within] = False
    floor = np.flatnonzero((lattice.nodes[:, 2] == wall.nodes[wall.base[0], 2]) & free)
    points = lattice.filled.shape[1]
    return attrs.evolve(
        wall,
        nodes=np.vstack([wall.nodes, lattice.nodes]),
        tets=np.vstack([wall.tets, lattice.tets + count]),
        region=np.concatenate([wall.region, lattice.region]),
        base=np.concatenate([wall.base, count + floor]),
        filled=np.vstack([np.ones((len(wall.tets), points)), lattice.filled]),
        tied=count + within,
        tied_to=follows.nodes,
        tied_weights=follows.weights,
    )
