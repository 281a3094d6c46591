"""The mesh of a printed unit: its wall, and its struts tied to it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np

from ..design.body import Body
from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..errors import InputError
from ..fem.embedding import embed
from ..meshing.membrane import Meridian, division, membrane_mesh, stations
from ..meshing.mesh import MEMBRANE, Array, Mesh, mirror, second_order
from ..meshing.quality import check_positive
from ..meshing.settings import CELL_MM, MeshSettings
from ..meshing.unit import mesh_unit
from .lattice import clearance, struts, support

Progress = Callable[[str, float], None]

# Element sizes in mm of a cell of 12.5 mm at a refinement of 1, chosen by docs/resolved.md.
MERIDIAN_MM = 1.5
HOOP_MM = 2.0
RINGS = 1
LAYERS = 5
# A strut's node outside the wall with less of its elements than this belongs to the wall, too.
_SUPPORT = 0.02


def mesh_of(
    unit: Unit,
    settings: MeshSettings,
    progress: Progress | None = None,
    mesher: str = "auto",
    cache: Path | None = None,
    body: Body | None = None,
) -> Mesh:
    """The unit's analysis mesh of the fidelity that the settings ask for: `mesh_printed` or `mesh_unit`.

    Raises InputError and MeshingError.
    """
    if settings.fidelity == "resolved":
        return mesh_printed(unit, settings, progress, cache, body)
    return mesh_unit(unit, settings, progress, mesher, cache, body)


def mesh_printed(
    unit: Unit,
    settings: MeshSettings | None = None,
    progress: Progress | None = None,
    cache: Path | None = None,
    body: Body | None = None,
) -> Mesh:
    """The printed unit as quadratic tetrahedra: wall and caps, and struts whose nodes in the wall follow it.

    Elements of struts count as far as they lie outside the actuator (`filled`); nodes inside it are tied to
    the wall. The base is clamped, the inlet is left out. settings: of it the fraction ("half" or "full") and
    `refine` count. cache: folder for the octants of lattices other than body-centred. body: a closed surface
    that cuts the lattice in place of its box. progress: called with a stage and the share done. Raises
    InputError and MeshingError.
    """
    s = settings or MeshSettings()
    report = progress or (lambda stage, share: None)
    if s.fraction == "quarter" or s.order != 2:
        raise InputError(
            "the printed body is meshed by quadratic elements, as a half or a whole",
            "fraction, order",
            'choose fraction "half" or "full" and order 2, or fidelity "homogenised"',
        )
    d = unit.printed
    report("mesh of the wall", 0.0)
    full = body is not None
    wall = wall_mesh(d, s.refine)
    if s.fraction == "full" or full:
        wall = mirror(wall, "x")
    report("mesh of the struts", 0.1)
    lattice = struts(
        d,
        max(1, round(RINGS * s.refine)),
        max(3, round(LAYERS * s.refine)),
        s.fraction == "full" or full,
        cache,
        body,
    )
    report("ties", 0.5)
    mesh = tied(wall, lattice, clearance(d, lattice.nodes))
    check_positive(mesh)
    report("mesh", 1.0)
    return mesh


def wall_mesh(d: Dimensions, refine: float = 1.0) -> Mesh:
    """Quadratic tetrahedra of a unit's wall and caps at x >= 0, base and tip those of its own end planes."""
    meridian, size = Meridian.of(d), d.cell / CELL_MM / refine
    found = membrane_mesh(
        meridian,
        turn=math.pi,
        p=stations(meridian, MERIDIAN_MM * size),
        sectors=2 * division(d.R * math.pi / 2, HOOP_MM * size),
        layers=max(1, int(refine * 0.7 + 0.5)),
        rings=division(d.r, HOOP_MM * size),
    )
    nodes, tets, cavity = second_order(found.nodes, found.tets, found.cavity, found.middles)
    nodes[np.abs(nodes[:, 0]) < 1e-9 * d.cell, 0] = 0.0
    base, tip = (np.flatnonzero(nodes[:, 2] == z) for z in (0.0, d.height))
    return Mesh(nodes, tets, np.full(len(tets), MEMBRANE), cavity, base, tip, ("x",))


def tied(wall: Mesh, lattice: Mesh, clear_mm: Array) -> Mesh:
    """One mesh of a wall and of struts, whose nodes inside it move as the wall does there.

    clear_mm (n,): distance of the struts' nodes from the wall's outside, negative within. Beyond the wall's
    inner face and just outside it, its displacement is continued with its gradient (`embed`). Nodes of which
    next to nothing is filled are tied, too. Struts in the plane of the wall's base are clamped with it.
    """
    within = np.flatnonzero((clear_mm <= 0) | (support(lattice) < _SUPPORT))
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
