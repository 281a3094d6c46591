"""Geometrically exact two-node beams: energy, forces and stiffness of 12 unknowns an element.

A beam node has a displacement and a rotation vector, measured from the undeformed body. Between two nodes the
section turns about one axis (Crisfield and Jelenic, Proc. R. Soc. A 455 (1999) 1125): strains are measured in
the frame midway between both, so they vanish in a rigid motion. In linear theory an element is exact for any
taper, since its stiffness comes from the integrated flexibility of the strut (`sections_of`).

Unknowns of an element, (12,): displacement and rotation vector of its first node, then of its second.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from .rotations import skew

if TYPE_CHECKING:
    from .beam_fibres import Fibres


LEAST_STRETCH = 0.2
"""Below this stretch an element's axial energy continues as a parabola, so that it keeps some length."""

SHEAR_FACTOR = 0.9
"""Cowper's shear coefficient of a solid round section, 6 (1 + nu)/(7 + 6 nu), at Poisson's ratio 0.45."""

_SMALL_ANGLE = 1e-2
_SMALL_TURN = 0.1
_EYE = np.eye(3)
# The offset along a section's first axis goes with the turn about the second, and the other way round.
_COUPLES = np.array([[0.0, 1.0], [-1.0, 0.0]])


@attrs.frozen(eq=False)
class Sections:
    """Stiffness of e elements: axial (N), torsional (N mm2), and of bending with shear, each (e,).

    bending: of the relative rotation t of both ends and the offset q of one from the other's tangent, as
    energy 1/2 (turn t^2 + 2 mixed t q + offset q^2), in N mm, N and N/mm; equal in both planes of the axis.
    """

    axial: Array
    torsion: Array
    turn: Array
    mixed: Array
    offset: Array


@attrs.frozen(eq=False)
class Beams:
    """Elements of a neo-Hookean, nearly incompressible resin; every array has e rows.

    chord (e, 3): from an element's first to its second end in mm; frames (e, 3, 3): rows are two axes of its
    section and its own axis; sections: its stiffness. An axial stretch makes the section thinner and changes
    the resin's modulus, and therefore all other stiffness (`_law`). fibres: the part that another law adds.
    """

    chord: Array
    frames: Array
    sections: Sections
    fibres: Fibres | None = None

    @property
    def length(self) -> Array:
        """Lengths (e,) in mm."""
        return np.asarray(np.linalg.norm(self.chord, axis=1))

    def energy_mJ(self, x: Array) -> Array:
        """Energies (e,) in mJ of the unknowns x (e, 12)."""
        return self._law(self.strains(x))[0]

    def forces(self, x: Array) -> Array:
        """Derivatives (e, 12) of the energy by the unknowns x (e, 12): N, and N mm for rotation vectors."""
        at = _State.of(self, x)
        _, stress, _ = self._law(at.strains)
        return np.asarray(np.einsum("ei,eij->ej", stress, at.slopes))

    def stiffness(self, x: Array) -> Array:
        """Second derivatives (e, 12, 12) of the energy by the unknowns x (e, 12)."""
        at = _State.of(self, x)
        _, stress, moduli = self._law(at.strains)
        return np.asarray(at.slopes.transpose(0, 2, 1) @ moduli @ at.slopes + at.curvature(stress))

    def strains(self, x: Array) -> Array:
        """Shears (2), stretch, curvatures (2) and twist in 1/mm, (e, 6), along and about the frame's axes."""
        return _State.of(self, x).strains

    def end_loads(self, x: Array) -> tuple[Array, Array]:
        """Axial forces (e,) in N, and both ends' bending moments (e, 2, 2) in N mm about the section's axes.

        x (e, 12): the unknowns. The moment changes along an element by its shear force.
        """
        stress = self._law(self.strains(x))[1] / self.length[:, None]
        lever = 0.5 * self.length[:, None] * (stress[:, :2] @ _COUPLES)
        return stress[:, 2], np.stack([stress[:, 3:5] + lever, stress[:, 3:5] - lever], axis=1)

    def _law(self, strains: Array) -> tuple[Array, Array, Array]:
        own = _law(strains, self.length, self.sections)
        if self.fibres is None:
            return own
        more = self.fibres.added(strains)
        return own[0] + more[0], own[1] + more[1], own[2] + more[2]


@attrs.frozen(eq=False)
class _State:
    """Strains (e, 6) of elements at their unknowns, their slopes (e, 6, 12) and the terms of second slopes.

    sign (e, 1): of the second node's quaternion, which is turned to the side of the first one's.
    """

    strains: Array
    slopes: Array
    beams: Beams
    span: Array
    first: tuple[Array, Array, Array]
    second: tuple[Array, Array, Array]
    middle: Array
    relative: Array
    sign: Array

    @classmethod
    def of(cls, beams: Beams, x: Array) -> _State:
        length = beams.length[:, None, None]
        span = beams.chord + x[:, 6:9] - x[:, 0:3]
        qa, ta = quaternions(x[:, 3:6])
        qb, tb = quaternions(x[:, 9:12])
        sign = np.where(np.einsum("ei,ei->e", qa, qb) < 0, -1.0, 1.0)[:, None]
        qb, tb = sign * qb, sign[:, :, None] * tb
        middle = qa + qb
        square = np.einsum("ei,ei->e", middle, middle)[:, None, None]
        turned = _turned(middle, beams.frames) / square
        stretch = np.einsum("eij,ej->ei", turned, span)
        by_middle = 2.0 * (_forms(beams.frames, span) @ middle[:, None, :, None])[..., 0]
        by_middle = (by_middle - 2.0 * stretch[..., None] * middle[:, None, :]) / square
        relative = np.einsum("eij,ej->ei", _left(qa), qb)
        turn, by_relative = _logarithm(relative)
        turn = np.einsum("eij,ej->ei", beams.frames, turn)
        by_relative = beams.frames @ by_relative
        slopes = np.zeros((len(x), 6, 12))
        slopes[:, :3, 0:3], slopes[:, :3, 6:9] = -turned, turned
        slopes[:, :3, 3:6], slopes[:, :3, 9:12] = by_middle @ ta, by_middle @ tb
        slopes[:, 3:, 3:6] = by_relative @ (_right(qb) @ ta)
        slopes[:, 3:, 9:12] = by_relative @ (_left(qa) @ tb)
        strains = np.concatenate([stretch, turn], axis=1) / length[:, 0]
        first, second = (qa, ta, x[:, 3:6]), (qb, tb, x[:, 9:12])
        return cls(strains, slopes / length, beams, span, first, second, middle, relative, sign)

    def curvature(self, stress: Array) -> Array:
        """Stresses (e, 6) times the second slopes of the strains, (e, 12, 12)."""
        weights = stress / self.beams.length[:, None]
        (qa, ta, va), (qb, tb, vb) = self.first, self.second
        m = self.middle
        square = np.einsum("ei,ei->e", m, m)[:, None, None]
        # Of the stretch: N(m, d) / |m|^2 with N quadratic in the middle quaternion m, linear in the span d.
        along = np.einsum("ei,eij->ej", weights[:, :3], self.beams.frames)
        form = _forms(along[:, None], self.span)[:, 0]
        fm = np.einsum("eij,ej->ei", form, m)
        value = np.einsum("ei,ei->e", fm, m)[:, None, None]
        outer = fm[:, :, None] * m[:, None, :]
        mm = 2 * form / square - 4 * (outer + outer.transpose(0, 2, 1)) / square**2
        mm += (8 * value / square**3) * m[:, :, None] * m[:, None, :] - 2 * value / square**2 * np.eye(4)
        by_m = (2 * fm - 2 * value[:, 0] / square[:, 0] * m) / square[:, 0]
        dm = _turned_slopes(m, along) / square
        dm -= 2 * _turned(m, along[:, None])[:, 0, :, None] * m[:, None, :] / square**2
        # Of the relative rotation, whose quaternion is bilinear in both.
        about = np.einsum("ei,eij->ej", weights[:, 3:], self.beams.frames)
        by_p, pp = _logarithm_slopes(self.relative, about)
        left, right = _left(qa), _right(qb)
        aa = mm + right.transpose(0, 2, 1) @ pp @ right
        bb = mm + left.transpose(0, 2, 1) @ pp @ left
        ab = mm + right.transpose(0, 2, 1) @ pp @ left + _between(by_p)
        ga = by_m + np.einsum("eji,ej->ei", right, by_p)
        gb = by_m + np.einsum("eji,ej->ei", left, by_p)
        found = np.zeros((len(m), 12, 12))
        found[:, 3:6, 3:6] = ta.transpose(0, 2, 1) @ aa @ ta + _quaternion_slopes(va, ga)
        found[:, 9:12, 9:12] = tb.transpose(0, 2, 1) @ bb @ tb + _quaternion_slopes(vb, self.sign * gb)
        found[:, 3:6, 9:12] = ta.transpose(0, 2, 1) @ ab @ tb
        found[:, 6:9, 3:6], found[:, 6:9, 9:12] = dm @ ta, dm @ tb
        found[:, 0:3, 3:6], found[:, 0:3, 9:12] = -found[:, 6:9, 3:6], -found[:, 6:9, 9:12]
        found[:, 9:12, 3:6] = found[:, 3:6, 9:12].transpose(0, 2, 1)
        for rows in (slice(0, 3), slice(6, 9)):
            for columns in (slice(3, 6), slice(9, 12)):
                found[:, columns, rows] = found[:, rows, columns].transpose(0, 2, 1)
        return found


def _law(strains: Array, length: Array, s: Sections) -> tuple[Array, Array, Array]:
    """Energies (e,) in mJ of strains (e, 6), their slopes (e, 6) and second slopes (e, 6, 6).

    Of a thin incompressible neo-Hookean rod stretched by l: axially E A (l^2 + 2/l - 3)/6. Its section's
    second moment shrinks by l^-2 and the tangent modulus is E (1 + 2/l^3)/3. A given relative rotation of its
    ends therefore has (1 + 2/l^3)/(3 l) of the undeformed energy, and a given twist 1/l.
    """
    shear, turn, twist = strains[:, :2] * length[:, None], strains[:, 3:5] * length[:, None], strains[:, 5]
    real = strains[:, 2]
    stretch = np.maximum(real, LEAST_STRETCH)
    beyond = real - stretch
    axial = (stretch**2 + 2 / stretch - 3) / 6, (stretch - stretch**-2) / 3, (1 + 2 * stretch**-3) / 3
    value = axial[0] + axial[1] * beyond + axial[2] * beyond**2 / 2
    slope = axial[1] + axial[2] * beyond
    held = (beyond == 0).astype(float)
    factor = np.stack([(1 + 2 / stretch**3) / (3 * stretch), -(1 / stretch**2 + 8 / stretch**5) / 3 * held])
    factor = np.vstack([factor, [(2 / stretch**3 + 40 / stretch**6) / 3 * held]])
    twisting = np.stack([1 / stretch, -held / stretch**2, 2 * held / stretch**3])
    by_shear = s.offset[:, None] * shear + s.mixed[:, None] * turn @ _COUPLES.T
    by_turn = s.turn[:, None] * turn + s.mixed[:, None] * shear @ _COUPLES
    bending = 0.5 * (np.einsum("ei,ei->e", by_shear, shear) + np.einsum("ei,ei->e", by_turn, turn))
    torsion = 0.5 * length * s.torsion * twist**2
    energy = length * s.axial * value + factor[0] * bending + twisting[0] * torsion
    stress, moduli = np.zeros_like(strains), np.zeros((len(strains), 6, 6))
    bent = np.concatenate([by_shear, by_turn], axis=1) * length[:, None]
    stress[:, [0, 1, 3, 4]] = factor[0][:, None] * bent
    stress[:, 2] = length * s.axial * slope + factor[1] * bending + twisting[1] * torsion
    stress[:, 5] = twisting[0] * length * s.torsion * twist
    square = length**2 * factor[0]
    for k in range(2):
        moduli[:, k, k], moduli[:, 3 + k, 3 + k] = square * s.offset, square * s.turn
        for other in range(2):
            moduli[:, k, 3 + other] = moduli[:, 3 + other, k] = square * s.mixed * _COUPLES[k, other]
    moduli[:, 2, 2] = length * s.axial * axial[2] + factor[2] * bending + twisting[2] * torsion
    moduli[:, 2, [0, 1, 3, 4]] = moduli[:, [0, 1, 3, 4], 2] = factor[1][:, None] * bent
    moduli[:, 5, 5] = twisting[0] * length * s.torsion
    moduli[:, 2, 5] = moduli[:, 5, 2] = twisting[1] * length * s.torsion * twist
    return energy, stress, moduli


def frames_along(directions: Array) -> Array:
    """Frames (e, 3, 3) whose third row is a direction (e, 3), the others any two across it."""
    along = directions / np.linalg.norm(directions, axis=1)[:, None]
    least = _EYE[np.argmin(np.abs(along), axis=1)]
    across = np.cross(along, least)
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.stack([across, np.cross(along, across), along], axis=1)


def _sines(vectors: Array) -> tuple[Array, Array, Array, Array]:
    """cos t/2, S = sin(t/2)/t, and S', S'' by t^2, (n,) each, of rotation vectors (n, 3) of angle t."""
    x = np.einsum("ei,ei->e", vectors, vectors)
    small = x < _SMALL_ANGLE
    safe = np.where(small, 1.0, x)
    t = np.sqrt(safe)
    cosine = np.where(small, 1 - x / 8 + x**2 / 384 - x**3 / 46080 + x**4 / 10321920, np.cos(t / 2))
    s = np.where(small, 0.5 - x / 48 + x**2 / 3840 - x**3 / 645120 + x**4 / 185794560, np.sin(t / 2) / t)
    first = (np.cos(t / 2) / 2 - np.sin(t / 2) / t) / (2 * safe)
    first = np.where(small, -1 / 48 + x / 1920 - x**2 / 215040 + x**3 / 46448640, first)
    second = (-np.sin(t / 2) / t / 8 - 3 * first) / (2 * safe)
    return cosine, s, first, np.where(small, 1 / 1920 - x / 107520 + x**2 / 15482880, second)


def quaternions(vectors: Array) -> tuple[Array, Array]:
    """Unit quaternions (n, 4), scalar first, of rotation vectors (n, 3), and their slopes (n, 4, 3)."""
    cosine, s, first, _ = _sines(vectors)
    slopes = np.empty((len(vectors), 4, 3))
    slopes[:, 0] = -0.5 * s[:, None] * vectors
    slopes[:, 1:] = s[:, None, None] * _EYE
    slopes[:, 1:] += 2 * first[:, None, None] * vectors[:, :, None] * vectors[:, None, :]
    return np.concatenate([cosine[:, None], s[:, None] * vectors], axis=1), slopes


def _quaternion_slopes(vectors: Array, weights: Array) -> Array:
    """Second slopes (n, 3, 3) of weights (n, 4) times the quaternions of rotation vectors (n, 3)."""
    _, s, first, second = _sines(vectors)
    outer = vectors[:, :, None] * vectors[:, None, :]
    w, along = weights[:, 1:], np.einsum("ei,ei->e", weights[:, 1:], vectors)
    mixed = vectors[:, :, None] * w[:, None, :]
    found = 2 * first[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
    found += (2 * first * along - 0.5 * s * weights[:, 0])[:, None, None] * _EYE
    found += (4 * second * along - first * weights[:, 0])[:, None, None] * outer
    return np.asarray(found)


def _turned(q: Array, vectors: Array) -> Array:
    """Vectors (e, k, 3) turned by quaternions (e, 4) and stretched by the square of their size."""
    scalar, part = q[:, None, :1], np.broadcast_to(q[:, None, 1:], vectors.shape)
    along = np.einsum("eki,eki->ek", part, vectors)[..., None]
    square = np.einsum("eki,eki->ek", part, part)[..., None]
    return np.asarray(
        (scalar**2 - square) * vectors + 2 * along * part + 2 * scalar * np.cross(part, vectors)
    )


def _turned_slopes(q: Array, vectors: Array) -> Array:
    """Slopes (e, 3, 4) of `_turned` vectors (e, 3) by the quaternions (e, 4)."""
    scalar, part = q[:, :1], q[:, 1:]
    found = np.empty((len(q), 3, 4))
    found[:, :, 0] = 2 * scalar * vectors + 2 * np.cross(part, vectors)
    found[:, :, 1:] = 2 * (part[:, :, None] * vectors[:, None, :] - vectors[:, :, None] * part[:, None, :])
    found[:, :, 1:] += 2 * np.einsum("ei,ei->e", part, vectors)[:, None, None] * _EYE
    found[:, :, 1:] -= 2 * scalar[:, :, None] * skew(vectors)
    return found


def _forms(vectors: Array, spans: Array) -> Array:
    """Symmetric A (e, k, 4, 4): q' A q is the span (e, 3) times the vectors (e, k, 3) turned by q."""
    spans = np.broadcast_to(spans[:, None], vectors.shape)
    dot = np.einsum("eki,eki->ek", vectors, spans)
    found = np.empty((*vectors.shape[:2], 4, 4))
    found[..., 0, 0] = dot
    found[..., 0, 1:] = found[..., 1:, 0] = np.cross(vectors, spans)
    outer = vectors[..., :, None] * spans[..., None, :]
    found[..., 1:, 1:] = outer + outer.swapaxes(-1, -2) - dot[..., None, None] * _EYE
    return found


def _left(q: Array) -> Array:
    """Matrices (e, 4, 4) of conj(q) p as a function of p."""
    found = np.empty((len(q), 4, 4))
    found[:, 0], found[:, 1:, 0] = q, -q[:, 1:]
    found[:, 1:, 1:] = q[:, :1, None] * _EYE - skew(q[:, 1:])
    return found


def _right(p: Array) -> Array:
    """Matrices (e, 4, 4) of conj(q) p as a function of q."""
    found = np.empty((len(p), 4, 4))
    found[:, 0], found[:, 1:, 0] = p, p[:, 1:]
    found[:, 1:, 1:] = -p[:, :1, None] * _EYE + skew(p[:, 1:])
    return found


def _between(weights: Array) -> Array:
    """Second slopes (e, 4, 4) of weights (e, 4) times conj(q) p, by q and by p."""
    found = np.empty((len(weights), 4, 4))
    found[:, 0], found[:, 1:, 0] = weights, -weights[:, 1:]
    found[:, 1:, 1:] = weights[:, :1, None] * _EYE + skew(weights[:, 1:])
    return found


def _turn_factors(p: Array) -> tuple[Array, Array, Array]:
    """f = 2 atan(r/c)/r, a = (df/dr)/r and b = (da/dr)/r, (e,) each, of p = (c, w) with r = |w|."""
    c, square = p[:, 0], np.einsum("ei,ei->e", p[:, 1:], p[:, 1:])
    small = square < _SMALL_TURN**2 * c**2
    y = np.where(small, square / np.where(c == 0, 1.0, c) ** 2, 0.0)
    inverse = 1 / np.where(small, c, 1.0)
    k = np.arange(9)
    terms = (-1.0) ** k * 2 / (2 * k + 1)
    powers = y[:, None] ** k
    f0 = inverse * (powers @ terms)
    a0 = inverse**3 * (powers[:, :-1] @ (terms * 2 * k)[1:])
    b0 = inverse**5 * (powers[:, :-2] @ (terms * 2 * k * (2 * k - 2))[2:])
    r = np.sqrt(np.where(small, 1.0, square))
    rho = c**2 + r**2
    angle = 2 * np.arctan2(r, c)
    a = (2 * c * r / rho - angle) / r**3
    b = -4 * c / (rho**2 * r**2) - 3 * a / r**2
    return np.where(small, f0, angle / r), np.where(small, a0, a), np.where(small, b0, b)


def _logarithm(p: Array) -> tuple[Array, Array]:
    """Rotation vectors (e, 3) of quaternions p (e, 4), and their slopes (e, 3, 4)."""
    f, a, _ = _turn_factors(p)
    w = p[:, 1:]
    rho = np.einsum("ei,ei->e", p, p)
    slopes = np.empty((len(p), 3, 4))
    slopes[:, :, 0] = -2 / rho[:, None] * w
    slopes[:, :, 1:] = f[:, None, None] * _EYE + a[:, None, None] * w[:, :, None] * w[:, None, :]
    return f[:, None] * w, slopes


def _logarithm_slopes(p: Array, weights: Array) -> tuple[Array, Array]:
    """Slopes (e, 4) and second slopes (e, 4, 4) of weights (e, 3) times `_logarithm` of p (e, 4)."""
    f, a, b = _turn_factors(p)
    c, w = p[:, 0], p[:, 1:]
    rho = np.einsum("ei,ei->e", p, p)
    along = np.einsum("ei,ei->e", weights, w)
    slopes = np.empty((len(p), 4))
    slopes[:, 0] = -2 / rho * along
    slopes[:, 1:] = f[:, None] * weights + (a * along)[:, None] * w
    found = np.empty((len(p), 4, 4))
    found[:, 0, 0] = 4 * c / rho**2 * along
    found[:, 0, 1:] = -2 / rho[:, None] * weights + (4 * along / rho**2)[:, None] * w
    found[:, 1:, 0] = found[:, 0, 1:]
    mixed = weights[:, :, None] * w[:, None, :]
    found[:, 1:, 1:] = (
        a[:, None, None] * (mixed + mixed.transpose(0, 2, 1)) + (a * along)[:, None, None] * _EYE
    )
    found[:, 1:, 1:] += (b * along)[:, None, None] * w[:, :, None] * w[:, None, :]
    return slopes, found


def sections_of(length: Array, flexible: Array, modulus_MPa: Array, poisson: Array) -> Sections:
    """Stiffness of e elements of a resin, from the integrals of 1 over their sections' properties.

    length (e,) in mm; modulus_MPa, poisson (e,): at small strain; flexible (e, 6): over the element, of 1/A,
    1/(2 I), 1/I, s/I, s^2/I and again 1/A, with s from mid-element: for stretch, twist, bending (three) and
    shear, in mm^-1, mm^-3, mm^-3, mm^-2, mm^-1 and mm^-1.
    """
    area, twist, bend, tilt, lever, sheared = flexible.T
    shear_MPa = modulus_MPa / (2 * (1 + poisson))
    turn, mixed = bend / modulus_MPa, -tilt / modulus_MPa
    offset = lever / modulus_MPa + sheared / (SHEAR_FACTOR * shear_MPa)
    determinant = turn * offset - mixed**2
    return Sections(
        length * modulus_MPa / area,
        length * shear_MPa / twist,
        offset / determinant,
        -mixed / determinant,
        turn / determinant,
    )


def turned_slopes(vectors: Array, arms: Array) -> Array:
    """Slopes (n, 3, 3) of arms (n, 3), turned by rotation vectors (n, 3), by these."""
    q, slopes = quaternions(vectors)
    return np.asarray(_turned_slopes(q, arms) @ slopes)


def turned_curvature(vectors: Array, arms: Array, weights: Array) -> Array:
    """Second slopes (n, 3, 3) of weights (n, 3) times arms (n, 3) turned by rotation vectors (n, 3)."""
    q, slopes = quaternions(vectors)
    form = 2 * _forms(arms[:, None], weights)[:, 0]
    by_q = np.einsum("eij,ej->ei", form, q)
    return np.asarray(slopes.transpose(0, 2, 1) @ form @ slopes + _quaternion_slopes(vectors, by_q))
