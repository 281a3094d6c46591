"""An elastic ring under pressure from outside, until its opposite sides lie on each other.

Lengths are in radii of the ring, pressures in D / radius^3, forces per unit of width in D / radius^2, with D
the wall's bending stiffness per unit of width; the ring's line keeps its length. A quarter, over the arc s
from the middle A of a long side, on the y axis, to the end B on the x axis: x' = cos(theta),
y' = sin(theta), theta' = kappa. The force on what lies before s has F_x' = p y', F_y' = -p x'; symmetry
about B leaves F_x = p y, and (kappa - kappa_0)' = F_x sin(theta) - F_y cos(theta), where kappa_0 is the
curvature as drawn. Where sides are apart F_y(A) = 0; where they touch at A, y(A) = -half_gap; sides that lie
flat over 0 <= x <= flat leave that line without curvature.

Published: a perfect ring buckles at 3, its sides meet at 5.247 and lie flat from 10.34 on (J. E. Flaherty,
J. B. Keller and S. I. Rubinow, SIAM J. Appl. Math. 23 (1972) 446).
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.integrate import solve_bvp

MEETS, FLATTENS = 5.247, 10.34
_ARC = np.linspace(0.0, 1.0, 201)


@attrs.frozen(eq=False)
class Ring:
    """A collapsed ring: half its height and width, half the force between its sides, curvature at A."""

    half_height: float
    half_width: float
    force: float
    curvature: float
    flat: float
    values: np.ndarray

    @classmethod
    def flattened(cls) -> Ring:
        """One of about the right proportions, from which others are found."""
        turn = _ARC * np.pi / 2
        x, y = 1.36 * np.sin(turn), -0.1 * np.cos(turn)
        values = np.array([x, y, turn, 1 - 1.5 * np.cos(2 * turn), -5.0 * x])
        return cls(0.1, 1.36, 0.0, 0.0, 0.05, values).at(MEETS, half_gap=0.0)

    def at(self, pressure, half_gap=None, flat=False, drawn=0.0) -> Ring:
        """The ring at another pressure, sought from this one.

        half_gap: between sides that touch, None where they are apart; flat: whether they touch along a line.
        drawn: the share a of the radius in 1 + a cos(2 phi), phi from B, where the ring as drawn is oval.
        """

        def slopes(s, v, unknown=(0.0,)):
            _, y, theta, kappa, force = v
            length = np.pi / 2 - unknown[0]
            bent = 6 * drawn * np.sin(2 * length * (1 - s))
            bend = pressure * y * np.sin(theta) - force * np.cos(theta) + bent
            return length * np.array([np.cos(theta), np.sin(theta), kappa, bend, -pressure * np.cos(theta)])

        def ends(a, b, unknown=(0.0,)):
            at_a = [a[4]] if half_gap is None else [a[1] + half_gap]
            at_a += [a[3]] if flat else []
            return np.array([a[0] - unknown[0], a[2], *at_a, b[2] - np.pi / 2, b[1]])

        unknown = [self.flat] if flat else None
        found = solve_bvp(slopes, ends, _ARC, self.values, p=unknown, tol=1e-7, max_nodes=100_000)
        assert found.success, found.message
        v = found.sol(_ARC)
        length = float(found.p[0]) if flat else 0.0
        _, y, _, kappa, force = v[:, 0]
        # A line bears the pressure on it.
        return Ring(-y, v[0, -1], force + pressure * length, kappa, length, v)
