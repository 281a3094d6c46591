"""Elasticity of an endless lattice of beams of any kind, and the rigid zones that give it the solid one's."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import filled
from ..design.lattice_kinds import LatticeKind
from ..design.strut_cell import StrutCell
from ..fem.beams import Beams, frames_along, sections_of
from ..fem.elements import reference_gradients
from ..fem.stress import exceeded
from ..homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from ..homogenize.elasticity import Elasticity, strained
from ..homogenize.octant import SHEARS
from ..meshing.mesh import Mesh
from .beams import integrals
from .joints import POISSON, Zones, shape_of

# Elements to a diameter of the solid cell.
_PER_DIAMETER = 3.0
# Zones of half diagonals in stretch and bending; how much a lattice that hardly tells them keeps to these.
_USUAL, _PRIOR = np.array([0.143, 0.505]), 0.02

# Mean strains that tell a joint's factors: along one, two and three axes, against each other, and shears.
_CASES = np.array(
    [
        *np.eye(6),
        *([*pair, 0, 0, 0] for pair in ((1, 1, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1))),
        *([*pair, 0, 0, 0] for pair in ((1, -1, 0), (1, 0, -1), (0, 1, -1))),
    ],
    float,
)
# Share of a joint's strain from which on its beams' ends explain it; rounds of fits; a linear strain.
_EXPLAINED, _ROUNDS, _SMALL = 0.3, 20, 1e-6

# Of the stiffest motion, below which joints only move or turn together.
_LOOSE = 1e-10


def frame_zones(d: Dimensions, cache: Path | None = None) -> Zones:
    """Rigid zones about the joints of a lattice of any kind, by its solid cell without grading.

    Their beams have the solid cell's C44 and C11 - C12. Zones that hardly affect these stay near those of
    half diagonals. cache: folder that keeps the cell's mesh. Kept for the process. Raises InputError for
    struts that do not fit a cell, and MeshingError.
    """
    return _frame_zones(*shape_of(d), cache)


@lru_cache(maxsize=4)
def _solid_cell(
    kind: LatticeKind, junction: float, midspan: float, cache: Path | None
) -> tuple[Mesh, Elasticity, Array]:
    """Solid octant of a cell of 1 mm, of a resin of 1 MPa, its elasticity, and its motion (6, n, 3)."""
    cell = StrutCell(kind, 1.0, junction / 2.0, midspan / 2.0)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=_PER_DIAMETER), cache)
    return mesh, *strained(mesh, cell_materials(cell, mesh, 1.0, POISSON))


@lru_cache(maxsize=8)
def _frame_zones(kind: LatticeKind, junction: float, midspan: float, cache: Path | None) -> Zones:
    from scipy.optimize import least_squares

    solid = _solid_cell(kind, junction, midspan, cache)[1]
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


@attrs.frozen(eq=False)
class JointFactors:
    """Strain concentration factors of the joints of a kind of lattice, by their place in its cell.

    places (k, 3): as of `place_in_cell`; stretched, bent (k,): as in `ConcentrationFactors`; error (k,): the
    largest relative error over all mean strains that load the joint.
    """

    places: Array
    stretched: Array
    bent: Array
    error: Array


def joint_factors(d: Dimensions, cache: Path | None = None) -> JointFactors:
    """The factors of joints of any kind, by the solid cell and the frame of beams with its zones.

    Fitted to joints under mean strains along the axes and single shears, as far as beams' ends explain them.
    Kept for the process; the rest as in `frame_zones`.
    """
    return _joint_factors(*shape_of(d), cache)


@lru_cache(maxsize=8)
def _joint_factors(kind: LatticeKind, junction: float, midspan: float, cache: Path | None) -> JointFactors:
    mesh, _, unit = _solid_cell(kind, junction, midspan, cache)
    zones = _frame_zones(kind, junction, midspan, cache)
    one = filled(kind, np.zeros((1, 3), np.int64), 1.0, junction / 2.0, midspan / 2.0)
    each = np.arange(len(one.struts))
    frame = _Frame.of(kind, integrals(one, each, one.struts, 0 * each, 1, zones), POISSON)
    stretched, bent = frame.end_strains(zones, float(one.node_radii[0]))
    reference = reference_gradients(mesh.nodes, mesh.tets)
    middles = mesh.nodes[mesh.tets[:, :4]].mean(axis=1)
    places, first = np.unique(place_in_cell(kind, kind.grid), axis=0, return_index=True)
    _, number = np.unique(kind.grid % kind.divisions, axis=0, return_inverse=True)
    found = np.zeros((len(places), 3))
    for row, (place, node) in enumerate(zip(places / kind.divisions, np.ravel(number)[first], strict=True)):
        near = np.linalg.norm(middles - place, axis=1) < junction
        slopes = np.einsum("cnai,nqaj->cnqij", unit[:, mesh.tets[near]], reference.gradients[near])
        strain = (slopes + np.swapaxes(slopes, -1, -2)) / 2.0
        ends = frame.struts == node
        loads, local = [], []
        for case in _CASES:
            largest = np.linalg.eigvalsh(np.einsum("c,cnqij->nqij", case, strain))[..., 2]
            local.append(exceeded(largest, reference.volumes[near]))
            pulled = np.maximum(np.repeat((stretched @ case)[:, None], 2, axis=1), 0.0)
            loads.append(np.stack([pulled, np.linalg.norm(bent @ case, axis=-1)], axis=-1)[ends])
        found[row] = _fitted(np.array(loads), np.array(local))
    return JointFactors(places, *found.T)


def _fitted(loads: Array, local: Array) -> tuple[float, float, float]:
    """Factors of a joint of known strains (c,), by those of its beams' ends (c, k, 2), and an error.

    Each strain is that of the end with the largest one, by the factors themselves.
    """
    from scipy.optimize import nnls

    explained = loads.sum(axis=2).max(axis=1) > _EXPLAINED * local
    loads, local = loads[explained], local[explained]
    factors = np.ones(2)
    for _ in range(_ROUNDS):
        worst = loads[np.arange(len(loads)), (loads @ factors).argmax(axis=1)]
        factors = (factors + nnls(worst / local[:, None], np.ones(len(local)))[0]) / 2.0
    error = np.abs((loads @ factors).max(axis=1) / local - 1.0).max(initial=0.0)
    return float(factors[0]), float(factors[1]), float(error)


def place_in_cell(kind: LatticeKind, grid: Array) -> Array:
    """Places (n, 3) of nodes of a lattice (n, 3), whole numbers, from the nearest corner of their cell."""
    at = grid % kind.divisions
    return np.minimum(at, kind.divisions - at)


def frame_tensor(kind: LatticeKind, flexible: Array, poisson: float) -> Array:
    """Elasticity (6, 6) in MPa of an endless lattice of cells of 1 mm, of a resin of 1 MPa.

    flexible (e, 6): of each strut of the kind, from its first node to its second, as
    `fem.beams.sections_of` takes it. In Voigt's order xx, yy, zz, yz, xz, xy with engineering shears. Struts
    that cells share count once.
    """
    return _Frame.of(kind, flexible, poisson).tensor


@attrs.frozen(eq=False)
class _Frame:
    """Beams of an endless lattice, joints (e, 2) of each by number, and its elasticity (6, 6).

    moved (e, 12, 6): unknowns of each under unit mean strains.
    """

    beams: Beams
    struts: Array
    moved: Array
    tensor: Array

    @classmethod
    def of(cls, kind: LatticeKind, flexible: Array, poisson: float) -> _Frame:
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
        return cls(beams, struts, offsets - moved[rows], np.asarray((C + C.T) / 2.0))

    def end_strains(self, zones: Zones, radius: float) -> tuple[Array, Array]:
        """Strains by unit mean strains where struts leave their joints: (e, 6) stretched, (e, 2, 2, 6) bent.

        The latter at both ends about two axes; radius: in mm at joints.
        """
        loads = [self.beams.end_loads(_SMALL * self.moved[:, :, case]) for case in range(6)]
        axial = np.stack([load[0] for load in loads], axis=-1) / _SMALL
        at_ends = np.stack([load[1] for load in loads], axis=-1) / _SMALL
        rigid = (zones.bend * 2.0 * radius / self.beams.length)[:, None, None, None]
        moments = (1.0 - rigid) * at_ends + rigid * at_ends[:, ::-1]
        area = np.pi * radius**2
        return axial / area, 4.0 * moments / (area * radius)


def _unit_strains() -> Array:
    """The six unit mean strains (6, 3, 3), shears engineering ones."""
    unit = np.eye(3)
    shears = [(np.outer(unit[a], unit[b]) + np.outer(unit[b], unit[a])) / 2.0 for a, b in SHEARS]
    return np.array([*(np.outer(e, e) for e in unit), *shears])


def _once(kind: LatticeKind) -> tuple[Array, Array]:
    """Joints (e, 2), numbered by period, and rows (e,) of struts, one of each set of periodic images."""
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
