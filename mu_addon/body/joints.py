"""Joints of struts, stiffer than beams, as rigid zones in stretch and in bending; their strain concentration.

In an infinite lattice of half diagonals under small strain, joints move with the mean strain and do not turn.
Let k_a and k_t be the stiffness of a half diagonal along and across it, its ends not turning, and h half a
cell. Then C44 = (k_a/3 + k_t/6)/h and (C11 - C12)/2 = k_t/(2 h). The solid cell gives k_a and k_t, and these
the lengths of both zones. The bulk modulus is then k_a/(3 h); its error is kept.
"""

from __future__ import annotations

import math
from functools import lru_cache

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice_kinds import LatticeKind
from ..fem.beams import SHEAR_FACTOR
from ..fem.elements import reference_gradients
from ..fem.materials import Materials
from ..fem.stress import exceeded
from ..homogenize.elasticity import Elasticity, strained
from ..meshing.mesh import Mesh
from .strut import radius_of, strut_mesh

POISSON = 0.45
# Of the solid octant: its moduli are then within 1 % of a mesh by pytetwild (docs/engineering/method.md).
RINGS, LAYERS = 3, 18
# A free joint of fewer octants bends more easily: factors of the zone in bending where 4, 2 and 1 meet, which
# give blocks of 2 to 8 cells the stiffness that solid ones have.
FEWER = ((4, 0.704), (2, 0.362), (1, 0.0))


@attrs.frozen
class Zones:
    """Rigid zones about a joint in junction diameters: in stretch, and in bending, twist and shear.

    fewer: factor of the latter by the number of struts that meet, else 1. bulk_error: of the infinite
    lattice's bulk modulus with these zones, relative to the solid cell's.
    """

    stretch: float
    bend: float
    fewer: tuple[tuple[int, float], ...] = FEWER
    bulk_error: float = 0.0

    def lengths(self, junction_mm: Array, meeting: Array) -> tuple[Array, Array]:
        """Lengths in mm (any shape) of both zones, of junction diameters and numbers of struts there."""
        factor = np.ones(np.shape(meeting))
        for number, less in self.fewer:
            factor = np.where(meeting == number, less, factor)
        return self.stretch * junction_mm, self.bend * junction_mm * factor


def zones_of(d: Dimensions) -> Zones:
    """The zones of a lattice of half diagonals, by its solid cell without grading; kept for the process."""
    return _zones(*shape_of(d))


def shape_of(d: Dimensions) -> tuple[LatticeKind, float, float]:
    """Kind and diameters in cells: the unit's scale has no effect."""
    return d.kind, round(d.junction_diameter / d.cell, 9), round(d.midspan_diameter / d.cell, 9)


@lru_cache(maxsize=32)
def _zones(kind: LatticeKind, junction: float, midspan: float) -> Zones:
    from scipy.optimize import brentq

    strut = _Strut(kind, junction, midspan)
    solid = _octant(strut)[1]
    half = 0.5
    across = half * (solid.C11 - solid.C12)
    along = 3 * (half * solid.C44 - across / 6)
    most = 0.4 * strut.length
    stretch = brentq(lambda zone: strut.along(zone) / along - 1, 0.0, most) / junction
    bend = brentq(lambda zone: strut.across(zone) / across - 1, 0.0, most) / junction
    return Zones(float(stretch), float(bend), FEWER, float(along / (3 * half) / solid.bulk - 1))


@attrs.frozen
class ConcentrationFactors:
    """Strain concentration factors: strain in a joint over its struts', by beam theory where they leave it.

    stretched, bent: of struts that are one of both. A printed joint has sharp edges, where no mesh converges,
    so this is the strain that 1 % of its volume exceeds. error: relative, of the factors' sum in a sheared
    lattice, whose struts are pulled and bent.
    """

    stretched: float
    bent: float
    error: float


def concentration_factors(d: Dimensions) -> ConcentrationFactors:
    """The factors of joints of half diagonals, by their solid cell without grading; kept for the process.

    Of an equal strain along all axes, which stretches struts, and of opposite ones along two, which bends
    them.
    """
    return _concentration_factors(*shape_of(d))


@lru_cache(maxsize=8)
def _concentration_factors(kind: LatticeKind, junction: float, midspan: float) -> ConcentrationFactors:
    strut, zones = _Strut(kind, junction, midspan), _zones(kind, junction, midspan)
    mesh, _, unit = _octant(strut)
    along = mesh.nodes[mesh.tets[:, :4]].mean(axis=1) @ np.ones(3) / math.sqrt(3.0)
    joint = (along < junction) | (along > strut.length - junction)
    reference = reference_gradients(mesh.nodes, mesh.tets[joint])

    def local(u: Array) -> float:
        slope = np.einsum("eai,eqaj->eqij", u[mesh.tets[joint]], reference.gradients)
        strain = np.linalg.eigvalsh((slope + np.swapaxes(slope, -1, -2)) / 2)[..., 2]
        return exceeded(strain, reference.volumes)

    pulled, across = strut.end_strains(zones)
    # Offsets of a strut's ends: its length, and across it; of the shear a third and the rest of both.
    stretched = local(unit[:3].sum(axis=0)) / (pulled * strut.length)
    bent = local(unit[0] - unit[1]) / (across * strut.length * math.sqrt(2.0 / 3.0))
    both = stretched * pulled * strut.length / 3.0 + bent * across * strut.length / math.sqrt(18.0)
    return ConcentrationFactors(stretched, bent, both / local(unit[3]) - 1.0)


@attrs.frozen
class _Strut:
    """A half diagonal of a cell of 1 mm, of a resin of 1 MPa."""

    kind: LatticeKind
    junction_diameter: float
    midspan_diameter: float
    cell: float = 1.0

    @property
    def length(self) -> float:
        """Length from the cell's corner to its centre."""
        return math.sqrt(3.0) / 2

    def _sections(self, zone: float) -> tuple[Array, Array, Array]:
        """Positions, radii and weights along the part between rigid zones."""
        x, w = np.polynomial.legendre.leggauss(64)
        span = self.length - 2 * zone
        s = zone + span * (1 + x) / 2
        return s, radius_of(self)(s / self.length), span * w / 2

    def end_strains(self, zones: Zones) -> tuple[float, float]:
        """Strains in 1/mm where a strut leaves its joints, of offsets along and across it of ends that do not
        turn."""
        stretch, bend = (zone * self.junction_diameter for zone in (zones.stretch, zones.bend))
        first, second = radius_of(self)(np.array([stretch, bend]) / self.length).tolist()
        moment = (self.length / 2 - bend) * self.across(bend)
        return self.along(stretch) / (math.pi * first**2), 4 * moment / (math.pi * second**3)

    def along(self, zone: float) -> float:
        """Axial stiffness in N/mm."""
        _, r, w = self._sections(zone)
        return float(1 / (w / (np.pi * r**2)).sum())

    def across(self, zone: float) -> float:
        """Stiffness in N/mm against a relative offset of the ends, which do not turn."""
        s, r, w = self._sections(zone)
        inertia, shear = np.pi * r**4 / 4, SHEAR_FACTOR / (2 * (1 + POISSON))
        lever = s - self.length / 2
        turn, mixed = (w / inertia).sum(), -(w * lever / inertia).sum()
        offset = (w * lever**2 / inertia).sum() + (w / (shear * np.pi * r**2)).sum()
        return float(turn / (turn * offset - mixed**2))


@lru_cache(maxsize=8)
def _octant(strut: _Strut) -> tuple[Mesh, Elasticity, Array]:
    """Solid octant of a strut's cell, its elasticity, and its motion (4, n, 3): three stretches, a shear."""
    mesh = strut_mesh(strut, RINGS, LAYERS)
    count = len(mesh.tets)
    resin = Materials.neo_hooke(np.ones(count), np.full(count, POISSON))
    return mesh, *strained(mesh, resin, alike=True)
