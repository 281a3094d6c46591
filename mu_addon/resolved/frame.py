"""Elasticity of an endless lattice of beams of any kind, and the rigid zones that give it the solid one's."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from ..design.dimensions import Dimensions
from ..design.lattice import filled
from ..design.lattice_kinds import LatticeKind
from ..design.strut_cell import StrutCell
from ..fem.beams import Beams, frames_along, sections_of
from ..homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from ..homogenize.elasticity import Elasticity, effective_tensor
from ..homogenize.octant import SHEARS
from ..meshing.mesh import Array
from .beams import integrals
from .joints import POISSON, Zones, shape_of

# Elements to a diameter of the solid cell.
_PER_DIAMETER = 3.0
# Zones of half diagonals in stretch and bending; how much a lattice that hardly tells them keeps to these.
_USUAL, _PRIOR = np.array([0.143, 0.505]), 0.02

# Of the stiffest motion, below which joints only move or turn together.
_LOOSE = 1e-10


def frame_zones(d: Dimensions, cache: Path | None = None) -> Zones:
    """Rigid zones about the joints of a lattice of any kind, by its solid cell without grading.

    Those whose beams have the solid cell's C44 and C11 - C12, near those of half diagonals where these hardly
    depend on them. cache: folder that keeps the cell's mesh. Kept for the process. Raises InputError for
    struts that do not fit a cell, and MeshingError.
    """
    return _frame_zones(*shape_of(d), cache)


@lru_cache(maxsize=8)
def _frame_zones(kind: LatticeKind, junction: float, midspan: float, cache: Path | None) -> Zones:
    from scipy.optimize import least_squares

    cell = StrutCell(kind, 1.0, junction / 2.0, midspan / 2.0)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=_PER_DIAMETER), cache)
    solid = effective_tensor(mesh, cell_materials(cell, mesh, 1.0, POISSON))
    one = filled(kind, np.zeros((1, 3), np.int64), 1.0, junction / 2.0, midspan / 2.0)
    each = np.arange(len(one.struts))

    def beams(lengths: Array) -> Elasticity:
        stretch, bend = lengths.tolist()
        flexible = integrals(one, each, one.struts, 0 * each, 1, Zones(stretch, bend, ()))
        return Elasticity(frame_tensor(kind, flexible, POISSON))

    def off(lengths: Array) -> Array:
        found = beams(lengths)
        ratios = [found.C44 / solid.C44, (found.C11 - found.C12) / (solid.C11 - solid.C12)]
        return np.concatenate([np.log(ratios), _PRIOR * (lengths / _USUAL - 1.0)])

    shortest = np.linalg.norm(np.diff(one.nodes[one.struts], axis=1), axis=2).min()
    most = min(0.45 * shortest / junction, 2.0 * _USUAL[1])
    stretch, bend = least_squares(off, np.minimum(_USUAL, 0.9 * most), bounds=(0.0, most)).x.tolist()
    return Zones(stretch, bend, (), float(beams(np.array([stretch, bend])).bulk / solid.bulk - 1))


def frame_tensor(kind: LatticeKind, flexible: Array, poisson: float) -> Array:
    """Elasticity (6, 6) in MPa of an endless lattice of cells of 1 mm, of a resin of 1 MPa.

    flexible (e, 6): of each strut of the kind, from its first node to its second, as
    `fem.beams.sections_of` takes it. In Voigt's order xx, yy, zz, yz, xz, xy with engineering shears. Struts
    that cells share count once.
    """
    struts, once = _once(kind)
    way = kind.nodes[kind.struts[once, 1]] - kind.nodes[kind.struts[once, 0]]
    length = np.linalg.norm(way, axis=1)
    one = np.ones(len(way))
    beams = Beams(way, frames_along(way), sections_of(length, flexible[once], one, poisson * one))
    stiffness = beams.stiffness(np.zeros((len(way), 12)))
    # Of the mean strains each gives a strut's second end an offset beyond the joints' own motion.
    offsets = np.zeros((len(way), 12, 6))
    offsets[:, 6:9] = np.einsum("kij,ej->eik", _unit_strains(), way)
    rows = (6 * struts[:, :, None] + np.arange(6)).reshape(len(struts), 12)
    size = 6 * (1 + int(struts.max()))
    K, pulled = np.zeros((size, size)), np.zeros((size, 6))
    np.add.at(K, (rows[:, :, None], rows[:, None, :]), stiffness)
    forces = stiffness @ offsets
    np.add.at(pulled, rows, forces)
    moved = np.linalg.lstsq(K, pulled, rcond=_LOOSE)[0]
    C = np.einsum("eia,eib->ab", offsets, forces) - pulled.T @ moved
    return np.asarray((C + C.T) / 2.0)


def _unit_strains() -> Array:
    """The six unit mean strains (6, 3, 3), shears engineering ones."""
    unit = np.eye(3)
    shears = [(np.outer(unit[a], unit[b]) + np.outer(unit[b], unit[a])) / 2.0 for a, b in SHEARS]
    return np.array([*(np.outer(e, e) for e in unit), *shears])


def _once(kind: LatticeKind) -> tuple[Array, Array]:
    """Joints (e, 2), numbered by period, and rows (e,) of struts of which none is another's image."""
    period = kind.divisions
    _, number = np.unique(kind.grid % period, axis=0, return_inverse=True)
    first, second = kind.struts.T
    # A strut is known by where it begins, up to whole cells, and its way.
    ends = np.stack([kind.grid[first] % period, kind.grid[second] % period], axis=1)
    way = kind.grid[second] - kind.grid[first]
    turned = np.array([tuple(w) < (0, 0, 0) for w in way.tolist()])
    key = np.column_stack(
        [np.where(turned[:, None], ends[:, 1], ends[:, 0]), np.where(turned[:, None], -way, way)]
    )
    _, once = np.unique(key, axis=0, return_index=True)
    return np.ravel(number)[kind.struts][once], once
