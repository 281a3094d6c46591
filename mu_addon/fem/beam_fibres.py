"""Terms that laws other than neo-Hooke's add to beams: energy of fibres along them, under uniaxial stress.

The beams of `fem.beams` are of a neo-Hookean resin. A fibre of another law adds the difference in energy of
two rods, one of each law, pulled along the beam with free lateral strain. Strains of fibres are those of
linear theory: the beam's stretch, and its moment over its flexural stiffness. The added energy is exact to
first order in the law's difference, and has a potential at any size.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .law_at_points import evaluate
from .laws import NeoHooke

if TYPE_CHECKING:
    from .beams import Sections
    from .materials import Layer


# Stretches of fibres that energies are tabulated at, on either side of 1; beyond, they go on as parabolas.
_SHORTER, _LONGER = np.linspace(0.5, 1.0, 26), np.linspace(1.0, 1.7, 36)
# Where a law's tangent jumps at no strain, each side has its own.
_BESIDE = 1e-7
_ITERATIONS, _TOLERANCE = 60, 1e-10
# Halvings of a step that raises the energy.
_HALVINGS = 12
_DIGITS = 9
# Of a round section of radius 1: fibres exact for polynomials of degree 5, (7, 2), and their shares.
_ANGLES = np.arange(6) * np.pi / 3
_AT = np.vstack([np.zeros(2), np.sqrt(2 / 3) * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])])
_SHARE = np.array([1 / 4] + [1 / 8] * 6)
# Places along a beam, from its middle to an end, exact for moments that change linearly.
_ALONG = np.array([-1.0, 1.0]) / np.sqrt(3)
# Symmetric tensors by their components: the first along the fibre.
_PARTS = ((2, 2), (0, 0), (1, 1), (0, 1), (0, 2), (1, 2))


class Mixture(NamedTuple):
    """Laws in parallel in e beams: law, parameters (e, count) and weights (e,), 0 where a beam lacks it."""

    law: Any
    parameters: Array
    weight: Array


@attrs.frozen(eq=False)
class Fibres:
    """Energy that fibres add to e beams, 14 to a beam.

    by_strain (e, 14, 6): slopes of the fibres' stretches by the beam's strains; volume (e, 14) in mm3; own
    (e,): number of each beam's curve. coefficients (4, k, c): of c curves, cubics of the stress in MPa beyond
    the neo-Hookean one, by the stretch since each of `knots` (k + 1,); energies (k, c) in MPa at the knots.
    """

    by_strain: Array
    volume: Array
    own: Array
    knots: Array
    coefficients: Array
    energies: Array

    def added(self, strains: Array) -> tuple[Array, Array, Array]:
        """Energies (e,) in mJ, slopes (e, 6) and second slopes (e, 6, 6) by the beams' strains (e, 6)."""
        # The third strain is the stretch itself.
        stretch = np.einsum("eqi,ei->eq", self.by_strain, strains)
        held = np.clip(stretch, self.knots[0], self.knots[-1])
        piece = np.clip(np.searchsorted(self.knots, held, side="right") - 1, 0, len(self.knots) - 2)
        x, beyond = held - self.knots[piece], stretch - held
        a, b, c, d = (k[piece, self.own[:, None]] for k in self.coefficients)
        stress, slope = d + x * (c + x * (b + x * a)), c + x * (2 * b + x * 3 * a)
        energy = self.energies[piece, self.own[:, None]] + x * (d + x * (c / 2 + x * (b / 3 + x * a / 4)))
        energy += beyond * (stress + slope * beyond / 2)
        stress = stress + slope * beyond
        weighted = self.volume[..., None] * self.by_strain
        return (
            (self.volume * energy).sum(axis=1),
            np.einsum("eqi,eq->ei", weighted, stress),
            np.einsum("eqi,eq,eqj->eij", weighted, slope, self.by_strain),
        )


def mixtures(layers: Sequence[Layer], part: Array, beam_of: Array, share: Array, count: int) -> list[Mixture]:
    """Laws of `count` beams from material layers, means over the elements that are their parts.

    part (k,): elements; beam_of (k,): the beam of each; share (k,): its share of the beam's volume.
    """
    found = []
    for layer in layers:
        row = np.full(int(max(part.max(), layer.elements.max())) + 1, -1)
        row[layer.elements] = np.arange(len(layer.elements))
        here = np.flatnonzero(row[part] >= 0)
        if not len(here):
            continue
        own, beam, rows = share[here], beam_of[here], row[part[here]]
        weight = np.bincount(beam, own * layer.weight[rows], count)
        whole = np.bincount(beam, own, count)
        parameters = np.stack(
            [
                np.bincount(beam, own * column[rows], count) / np.where(whole > 0, whole, 1.0)
                for column in layer.parameters.T
            ],
            axis=1,
        )
        # A law has to be given admissible parameters where it counts for nothing, too.
        parameters[whole == 0] = layer.parameters[0]
        found.append(Mixture(layer.law, parameters, weight))
    return found


def fibres_of(
    found: Sequence[Mixture],
    length: Array,
    frames: Array,
    sections: Sections,
    modulus_MPa: Array,
    poisson: Array,
) -> Fibres | None:
    """Fibres of e beams of laws in parallel; None where all of these are neo-Hookean.

    length (e,) in mm; frames (e, 3, 3): as `Beams` has them; sections: the stiffness of beams of the moduli
    (e,) in MPa and Poisson's ratios (e,) at small strain. Raises InputError for a law with memory.
    """
    if all(one.law is NeoHooke for one in found):
        return None
    for one in found:
        if one.law.history:
            raise InputError(
                f"{one.law.name}: struts that are beams have no memory",
                "a mesh with beams",
                "mesh the struts as solids",
            )
    along = frames[:, 2]
    # Opposite directions are one.
    first = np.take_along_axis(along, np.abs(along).argmax(axis=1)[:, None], axis=1)
    along = along * np.sign(first)
    columns = [np.column_stack([one.parameters, one.weight]) for one in found]
    keys = np.round(np.column_stack([*columns, along, modulus_MPa, poisson]), _DIGITS)
    _, at, own = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rows = [Mixture(one.law, one.parameters[at], one.weight[at]) for one in found]
    base = [Mixture(NeoHooke, NeoHooke.parameters(modulus_MPa[at], poisson[at]), np.ones(len(at)))]
    knots = np.concatenate([_SHORTER[:-1], _LONGER])
    pieces = []
    for stretch in (_SHORTER[::-1], _LONGER):
        sides = zip(_curve(rows, frames[at], stretch), _curve(base, frames[at], stretch), strict=True)
        stress, slope = (both - own for both, own in sides)
        stress[0] = 0.0
        order = np.argsort(stretch)
        pieces.append(_cubics(stretch[order], stress[order], slope[order]))
    coefficients = np.concatenate(pieces, axis=1)
    step = np.diff(knots)[:, None]
    a, b, c, d = coefficients
    grown = step * (d + step * (c / 2 + step * (b / 3 + step * a / 4)))
    energies = np.vstack([np.zeros(len(at)), np.cumsum(grown, axis=0)])
    energies -= energies[len(_SHORTER) - 1]
    by_strain, volume = _places(length, sections, modulus_MPa)
    return Fibres(by_strain, volume, own.ravel(), knots, coefficients, energies[:-1])


def _places(length: Array, s: Sections, modulus_MPa: Array) -> tuple[Array, Array]:
    """Slopes (e, 14, 6) of fibres' stretches by the beams' strains, and volumes (e, 14) in mm3."""
    area = s.axial / modulus_MPa
    # The flexibility of the turn alone, over the length.
    bending = (s.turn * s.offset - s.mixed**2) / s.offset * length
    radius = 2 * np.sqrt(bending / modulus_MPa / area)
    count = len(_ALONG) * len(_SHARE)
    by_strain = np.zeros((len(length), count, 6))
    by_strain[:, :, 2] = 1.0
    ratio = length / bending
    for k, place in enumerate(_ALONG):
        # Moments about both axes at a place, by shears and curvatures; see `beams._law`.
        at = place * length / 2
        turn, shear = s.turn - s.mixed * at, s.mixed - s.offset * at
        for q, (first, second) in enumerate(_AT):
            row = by_strain[:, k * len(_SHARE) + q]
            row[:, 3] = ratio * turn * radius * second
            row[:, 1] = -ratio * shear * radius * second
            row[:, 4] = -ratio * turn * radius * first
            row[:, 0] = -ratio * shear * radius * first
    volume = (area * length)[:, None] * np.tile(_SHARE / len(_ALONG), len(_ALONG))
    return by_strain, volume


def _cubics(x: Array, value: Array, slope: Array) -> Array:
    """Coefficients (4, k, c) of cubics between knots x (k + 1,), of values and slopes (k + 1, c)."""
    h = np.diff(x)[:, None]
    rise = np.diff(value, axis=0) / h
    low, high = slope[:-1], slope[1:]
    return np.stack([(low + high - 2 * rise) / h**2, (3 * rise - 2 * low - high) / h, low, value[:-1]])


def _curve(found: Sequence[Mixture], frames: Array, stretches: Array) -> tuple[Array, Array]:
    """Stress and tangent modulus (k, c) in MPa of c rods at stretches (k,), the first of which is 1.

    Under uniaxial stress along the third axes of frames (c, 3, 3): the energy is minimal over all other
    components of a symmetric stretch tensor.
    """
    basis = []
    for i, j in _PARTS:
        unit = np.zeros((3, 3))
        unit[i, j] = unit[j, i] = 1.0
        basis.append(np.einsum("cia,ij,cjb->cab", frames, unit, frames))
    B = np.stack(basis, axis=1).reshape(len(frames), len(_PARTS), 9)
    stress, slope = np.empty((2, len(stretches), len(frames)))
    parts = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (len(frames), 1))
    before = 1.0
    for k, stretch in enumerate(stretches):
        at = stretch if k else stretch + _BESIDE * np.sign(stretches[1] - stretch)
        parts[:, 0] = at
        if k:
            # Near constant volume, from where the last one ended.
            parts[:, 1:3] *= (before / at) ** 0.5
        before = at
        g, H = _relaxed(found, B, parts)
        others = np.linalg.solve(H[:, 1:, 1:], H[:, 1:, :1])
        stress[k], slope[k] = g[:, 0], H[:, 0, 0] - (H[:, :1, 1:] @ others)[:, 0, 0]
    return stress, slope


def _relaxed(found: Sequence[Mixture], B: Array, parts: Array) -> tuple[Array, Array]:
    """Slopes (c, 6) and second slopes (c, 6, 6) where all but the first of parts (c, 6) are relaxed.

    Newton's method with halved steps; parts change in place.
    """
    energy, g, H = _mixed(found, B, parts)
    for _ in range(_ITERATIONS):
        size = np.abs(H[:, 0, 0])
        if (np.abs(g[:, 1:]).max(axis=1) <= _TOLERANCE * size).all():
            break
        way = -np.linalg.solve(H[:, 1:, 1:], g[:, 1:, None])[..., 0]
        share = np.ones(len(parts))
        for _ in range(_HALVINGS):
            trial = parts.copy()
            trial[:, 1:] += share[:, None] * way
            new = _mixed(found, B, trial)
            worse = ~(new[0] <= energy + 1e-14 * size)
            if not worse.any():
                break
            share[worse] /= 2
        parts[:] = trial
        energy, g, H = new
    return g, H


def _mixed(found: Sequence[Mixture], B: Array, parts: Array) -> tuple[Array, Array, Array]:
    """Energy (c,), slopes (c, 6) and second slopes (c, 6, 6) of laws in parallel by the parts (c, 6)."""
    F = np.einsum("ck,cka->ca", parts, B).reshape(-1, 3, 3)
    energy, g, H = np.zeros(len(parts)), np.zeros(parts.shape), np.zeros((*parts.shape, 6))
    for one in found:
        at = evaluate(one.law, F, one.parameters)
        w = one.weight
        energy += w * at.energy
        g += w[:, None] * np.einsum("cka,ca->ck", B, at.stress.reshape(-1, 9))
        H += w[:, None, None] * np.einsum("cka,cab,clb->ckl", B, at.tangent, B)
    return energy, g, H
