"""Light signal of a waveguide over a body's motion, and its figures as a sensor.

`signal_of_states` is the one door for a path's signal from states of a finite-element mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..design.anchors import Window, anchor_points
from ..design.parameters import Unit
from ..design.waveguide import waveguide
from ..errors import InputError
from ..meshing.mesh import Mesh
from .embedded_waveguide import EmbeddedWaveguide, Joints, embed_waveguide
from .light_law import Law, features, fit_law, traced
from .optics import Optics


@attrs.frozen(eq=False)
class Signal:
    """A waveguide's light in k states of its body: transmitted (k,), the share of the source's that arrives.

    at_rest: the same of the body at rest; errors (k,): standard error of log(transmitted / at_rest). No
    units.
    """

    transmitted: Array
    at_rest: float
    errors: Array

    @property
    def delta(self) -> Array:
        """Delta V / V_f (k,): the share of the light at rest that is lost; negative where light is gained."""
        return 1 - self.transmitted / self.at_rest


def signal_of_states(
    unit: Unit,
    path: Window | ArrayLike,
    mesh: Mesh,
    displacements: Sequence[Array],
    optics: Optics | None = None,
    law: Law | None = None,
    rays: int | None = None,
) -> Signal:
    """The signal of a unit's waveguide in a sequence of its states, in their order.

    path: a window of anchors, or lattice nodes (h, 3) in mm; mesh: the unit's own, in its own frame, whole or
    halved; displacements: k arrays (nodes, 3) in mm. law: one fitted to the unit's printed dimensions and the
    optics (`fit_law`, some seconds), by default fitted here. rays: number to trace through the bent bar in
    place of the law, see `traced_signal`. Raises InputError for a path that no waveguide can follow.
    """
    optics = Optics() if optics is None else optics
    nodes = anchor_points(unit)[list(path.indices)] if isinstance(path, Window) else np.asarray(path, float)
    joints = Joints.of(mesh, nodes)
    guide = embed_waveguide(waveguide(unit, path), nodes, unit.printed)
    moved = [joints.moved(u) for u in displacements]
    if rays is not None:
        return traced_signal(guide, moved, optics, rays)
    return signal_of_nodes(fit_law(unit.printed, optics) if law is None else law, guide, moved)


def signal_of_nodes(law: Law, guide: EmbeddedWaveguide, moved: Sequence[tuple[Array, Array]]) -> Signal:
    """The light of an embedded waveguide in states of its nodes, by a fitted law.

    moved: for each of k states positions (h, 3) in mm and rotations (h, 3, 3). See `Signal`.
    """
    rest = features(guide.shape, guide.at_rest)
    found = [features(guide.shape, guide.legs(*state)) for state in moved]
    return Signal(
        np.array([np.exp(-law.coefficients @ row) for row in found]),
        float(np.exp(-law.coefficients @ rest)),
        np.array([law.error(row - rest) for row in found]),
    )


def traced_signal(
    guide: EmbeddedWaveguide,
    moved: Sequence[tuple[Array, Array]],
    optics: Optics,
    rays: int = 60_000,
    seed: int = 0,
) -> Signal:
    """The light of an embedded waveguide in states of its nodes, by tracing rays in the bent bar.

    moved: for each of k states positions (h, 3) in mm and rotations (h, 3, 3). errors: statistical errors for
    this number of rays (no unit). Raises InputError for a bar that is not straight at rest.
    """
    if len(guide.at_rest) > 1:
        raise InputError(
            "rays are followed through straight waveguides only",
            "path",
            "choose a path without a bend, or use the signal of the fitted law",
        )
    every = [guide.at_rest, *(guide.legs(*state) for state in moved)]
    lights = [traced(guide.shape, leg, optics, rays, seed) for (leg,) in every]
    share = np.array([light.detected for light in lights])
    error = np.array([light.error for light in lights]) / np.maximum(share, 1e-12)
    return Signal(share[1:], float(share[0]), np.hypot(error[1:], error[0]))


@attrs.frozen(eq=False)
class Response:
    """A sensor's signal over a motion.

    angle_deg (k,) and transmitted (k,), sorted by angle; sensitivity_per_deg: signed change of Delta V / V_f
    a degree at rest; monotonic_deg: the widest interval about rest in which the signal is monotonic; span:
    range of Delta V / V_f over that interval; rest_deg: the angle at rest, not 0 under a weight.
    """

    angle_deg: Array
    transmitted: Array
    sensitivity_per_deg: float
    monotonic_deg: tuple[float, float]
    span: float
    rest_deg: float = 0.0

    @property
    def delta(self) -> Array:
        """Delta V / V_f (k,): the share of the light at rest that is lost (no unit)."""
        return 1 - self.transmitted / np.interp(self.rest_deg, self.angle_deg, self.transmitted)


def response(angle_deg: Array, share: Array, rest_deg: float = 0.0) -> Response:
    """Sensitivity, monotonic range and span of a signal over bending; see `Response`.

    angle_deg (k,): in degrees, in any order; share (k,): of the light that arrives; rest_deg: the angle at
    rest. Raises InputError for fewer than two different angles, or if rest_deg is outside them.
    """
    order = np.argsort(angle_deg, kind="stable")
    angle, light = np.asarray(angle_deg, float)[order], np.asarray(share, float)[order]
    keep = np.r_[True, np.diff(angle) > 1e-9]
    angle, light = angle[keep], light[keep]
    if len(angle) < 2 or not angle[0] <= rest_deg <= angle[-1]:
        raise InputError(
            "the unit does not bend, or its state at rest is missing",
            "angle_deg",
            "give a protocol that bends it",
        )
    delta = 1 - light / np.interp(rest_deg, angle, light)
    slope = np.diff(delta) / np.diff(angle)
    at = int(np.clip(np.searchsorted(angle, rest_deg, side="right") - 1, 0, len(slope) - 1))
    # On a sample the mean of both sides.
    here = (slope[at] + slope[at - 1]) / 2 if at > 0 and angle[at] == rest_deg else slope[at]
    low, high = at, at
    sign = np.sign(here)
    while low > 0 and np.sign(slope[low - 1]) == sign:
        low -= 1
    while high + 1 < len(slope) and np.sign(slope[high + 1]) == sign:
        high += 1
    return Response(
        angle,
        light,
        float(here),
        (float(angle[low]), float(angle[high + 1])),
        float(abs(delta[high + 1] - delta[low])),
        rest_deg,
    )


def pareto(
    disturbance: Sequence[float], sensitivity: Sequence[float], known: Sequence[bool] | None = None
) -> list[bool | None]:
    """Whether each of n candidates is Pareto-optimal: no other disturbs less and senses more.

    disturbance (n,) and sensitivity (n,): each in one unit of the caller's; the sign of a sensitivity does
    not matter. known (n,): False where the disturbance is a lower bound; None is then what it leaves open.

    >>> pareto([1.0, 2.0, 2.5], [1.0, 1.5, 1.2])
    [True, True, False]
    >>> pareto([1.0, 2.0, 1.5], [1.0, 1.5, 1.2], [True, True, False])
    [True, True, None]
    """
    low, s = np.asarray(disturbance, float), np.abs(np.asarray(sensitivity, float))
    high = low if known is None else np.where(known, low, np.inf)

    def beaten(other: Array, own: Array) -> Array:
        senses = s[None] >= s[:, None]
        less = (other[None] < own[:, None]) | (s[None] > s[:, None])
        found = (other[None] <= own[:, None]) & senses & less
        np.fill_diagonal(found, False)
        return found.any(axis=1)

    surely, perhaps = beaten(high, low), beaten(low, high)
    return [False if out else None if open_ else True for out, open_ in zip(surely, perhaps, strict=True)]


def best_sets(signals: Array, noise: float, size: int, most: int = 5) -> list[tuple[tuple[int, ...], float]]:
    """Sets of `size` sensors with the largest information, best first, and that information in nats.

    signals (n, q): each sensor's derivative by q independent bending modes, each of unit standard deviation;
    noise: standard deviation of a reading, in the unit of the signals. D-optimality with a unit prior: log
    det(1 + S^T S / noise^2) / 2. most: how many sets. Raises InputError for a size outside 1 to n.
    """
    n, q = signals.shape
    if not 1 <= size <= n:
        raise InputError(f"no set of {size} among {n} sensors", "size", f"1 to {n}")
    scored = []
    for chosen in combinations(range(n), size):
        rows = signals[list(chosen)] / noise
        scored.append((chosen, 0.5 * float(np.linalg.slogdet(np.eye(q) + rows.T @ rows)[1])))
    return sorted(scored, key=lambda item: -item[1])[:most]


def differential_pairs(sensitivity: Sequence[float], most: int = 5) -> list[tuple[tuple[int, int], float]]:
    """Pairs of sensors whose difference changes most with bending, best first, with that signed change.

    sensitivity (n,): relative change of each one's light by bending, in 1/degree, say; the result has the
    same unit. A dimming common to both, as of a warming light source, cancels in the difference of their
    logarithms.
    """
    pairs = [((i, j), sensitivity[i] - sensitivity[j]) for i, j in combinations(range(len(sensitivity)), 2)]
    return sorted(pairs, key=lambda pair: -abs(pair[1]))[:most]
