"""What a waveguide's light tells of bending: traced rays, a law fitted to them, and the figures of a sensor.

The law: the logarithm of the light's loss is linear in how long the guide is, how many wells and junctions it
has, by how much it is stretched, its wells' curvature (signed: a well on the stretched side opens), and the
curvature squared along it (bend loss).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import attrs
import numpy as np
from scipy.interpolate import CubicSpline

from ..design.parameters import Dimensions
from ..errors import InputError
from .guide import Array, Centreline, arc, swept
from .optics import Optics
from .tracing import lambertian, trace

RAYS = 6000
_STEPS_A_MM = 4
# Curvatures the law is fitted to, in 1/mm; the unit's own at 60 degrees over its length is 0.014.
_MOST_CURVATURE = 0.02
_STRETCH = (0.94, 1.1)


@attrs.frozen(eq=False)
class Guided:
    """A waveguide's fixed part: section and wells in mm, lengths of wells' centres and of open junctions."""

    width: float
    height: float
    wells: tuple[float, ...]
    well_width: float
    well_depth: float
    junctions: tuple[tuple[float, float], ...] = ()

    @classmethod
    def straight(cls, d: Dimensions, length: float) -> Guided:
        """The guide of a straight path of `length` mm from its first node's end face to its last one's.

        Junctions, a strut's diameter wide, lie at every cell; wells at whole pitches from half a pitch beyond
        the first node, clear of them.
        """
        first = d.waveguide_end
        inner = length - 2 * first
        if inner <= 0:
            raise InputError(f"a waveguide of {length:g} mm has no room between its ends", "path", "longer")
        wells = first + (np.arange(int(inner / d.well_pitch + 1e-9)) + 0.5) * d.well_pitch
        half = d.junction_diameter / 2
        spans = tuple(
            (float(max(0.0, node - half)), float(min(length, node + half)))
            for node in first + np.arange(int(inner / d.cell + 1e-9) + 1) * d.cell
        )
        room = d.well_width / 2 + 0.1
        clear = tuple(float(w) for w in wells if all(not a - room < w < b + room for a, b in spans))
        section = d.waveguide_section
        return cls(section, section, clear, d.well_width, d.well_depth, spans)


def transmitted(guided: Guided, line: Centreline, optics: Optics, rays: int = RAYS, seed: int = 0) -> float:
    """Share of a diffuse source's light that reaches the detector through the bent guide, by traced rays."""
    guide = swept(
        line,
        guided.width,
        guided.height,
        guided.wells,
        guided.well_width,
        guided.well_depth,
        guided.junctions,
        edge=1.0 / _STEPS_A_MM,
    )
    return trace(guide, optics, lambertian(guide, rays, seed), seed).detected


def features(guided: Guided, line: Centreline) -> Array:
    """What the law is linear in, (8,): see FEATURES."""
    curvature = line.curvature
    at_wells = np.interp(guided.wells, line.s, curvature)
    return np.array(
        [
            1.0,
            float(line.s[-1]),
            float(len(guided.wells)),
            float(len(guided.junctions)),
            _area(line.stretch - 1, line.s),
            float(at_wells.sum()),
            float((at_wells**2).sum()),
            _area(curvature**2, line.s),
        ]
    )


FEATURES = (
    "one", "length_mm", "wells", "junctions", "elongation_mm", "curvature_of_wells", "its_square", "bending",
)  # fmt: skip
CURVATURE_OF_WELLS = FEATURES.index("curvature_of_wells")


def _area(values: Array, s: Array) -> float:
    return float(((values[1:] + values[:-1]) / 2 * np.diff(s)).sum())


@attrs.frozen(eq=False)
class Law:
    """-log(transmitted) = coefficients (8,) times `features`, fitted to traces.

    covariance (8, 8) of the coefficients; rms: of what it misses in traces left out.
    """

    coefficients: Array
    covariance: Array
    rms: float

    def transmitted(self, guided: Guided, line: Centreline) -> float:
        """Share of the light that arrives."""
        return float(np.exp(-self.coefficients @ features(guided, line)))

    def error(self, change: Array) -> float:
        """Standard error of the log of the light for a change of features (8,)."""
        return float(np.sqrt(change @ self.covariance @ change))


def fit_law(
    d: Dimensions,
    optics: Optics,
    rays: int = RAYS,
    traces: int = 160,
    seed: int = 0,
    on_trace: Callable[[float], None] = lambda fraction: None,
) -> Law:
    """Trace rays through guides of many lengths and bends, and fit the law; the rms is by leave-one-out."""
    random = np.random.default_rng(seed)
    rows, logs = [], []
    for k in range(traces):
        length = float(random.uniform(2.5, 6.0)) * d.cell + 2 * d.waveguide_end
        guided = Guided.straight(d, length)
        curvature = random.uniform(-_MOST_CURVATURE, _MOST_CURVATURE, 2)
        line = _bent(length, curvature, random.uniform(*_STRETCH))
        share = transmitted(guided, line, optics, rays, seed + k)
        if share > 0:
            rows.append(features(guided, line))
            logs.append(-np.log(share))
        on_trace((k + 1) / traces)
    if len(rows) < 3 * len(FEATURES):
        raise InputError(
            "hardly any light arrives in the waveguides of this unit",
            "optics",
            "a clearer resin or less loss",
        )
    A, y = np.array(rows), np.array(logs)
    # Columns differ by orders of magnitude.
    scale = np.maximum(np.abs(A).max(axis=0), 1e-12)
    inverse = np.linalg.pinv(A / scale)
    coefficients = inverse @ y
    hat = np.einsum("ij,ji->i", A / scale, inverse)
    off = y - A / scale @ coefficients
    variance = float(off @ off) / (len(y) - A.shape[1])
    covariance = variance * (inverse @ inverse.T) / np.outer(scale, scale)
    rms = float(np.sqrt(np.mean((off / np.maximum(1 - hat, 1e-6)) ** 2)))
    return Law(coefficients / scale, covariance, rms)


def _bent(length: float, curvature: Array, stretch: float = 1.0) -> Centreline:
    """A planar guide whose curvature goes linearly between its ends' (2,), in 1/mm when straight."""
    steps = max(8, int(_STEPS_A_MM * length))
    s = np.linspace(0, length, steps + 1)
    first, last = curvature
    turn = first * s + (last - first) * s**2 / (2 * length)
    middle = (turn[1:] + turn[:-1]) / 2
    points = np.zeros((steps + 1, 3))
    points[1:, 1] = np.cumsum(-np.sin(middle)) * stretch * length / steps
    points[1:, 2] = np.cumsum(np.cos(middle)) * stretch * length / steps
    return Centreline(s, points, np.column_stack([0 * s, np.cos(turn), np.sin(turn)]))


def through(nodes: Array, lengths: Array, end: float) -> Centreline:
    """A centreline through path nodes (k, 3) in mm, at lengths (k,) when straight, and `end` mm beyond.

    The path lies in a plane x = const, as windows of anchors do; its wells look toward +y at rest.
    """
    spline = CubicSpline(lengths, nodes)
    s = np.linspace(lengths[0], lengths[-1], max(8, int(_STEPS_A_MM * (lengths[-1] - lengths[0]))) + 1)
    inner = spline(s)
    slope = spline(s, 1)
    step = max(2, int(_STEPS_A_MM * end))
    before = np.linspace(-end, 0, step, endpoint=False)
    after = np.linspace(0, end, step + 1)[1:]
    points = np.vstack([inner[0] + before[:, None] * slope[0], inner, inner[-1] + after[:, None] * slope[-1]])
    tangent = np.vstack([np.tile(slope[0], (step, 1)), slope, np.tile(slope[-1], (step, 1))])
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normals = np.cross(tangent, [1.0, 0.0, 0.0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    whole = np.concatenate([s[0] + before, s, s[-1] + after])
    return Centreline(whole - whole[0], points, normals)


@attrs.frozen(eq=False)
class Response:
    """A sensor's signal over a motion.

    angle_deg (k,) and transmitted (k,), sorted by angle; sensitivity_per_deg: change of Delta V / V_f a
    degree at 0 degrees, signed; monotonic_deg: the widest interval about 0 in which the signal only rises
    or only falls; span: what Delta V / V_f covers over that interval.
    """

    angle_deg: Array
    transmitted: Array
    sensitivity_per_deg: float
    monotonic_deg: tuple[float, float]
    span: float

    @property
    def delta(self) -> Array:
        """Delta V / V_f (k,): the share of the light at rest that is lost."""
        return 1 - self.transmitted / np.interp(0.0, self.angle_deg, self.transmitted)


def response(angle_deg: Array, share: Array) -> Response:
    """The figures of a signal `share` (k,) at angles (k,) that include 0; see Response."""
    order = np.argsort(angle_deg, kind="stable")
    angle, light = np.asarray(angle_deg, float)[order], np.asarray(share, float)[order]
    keep = np.r_[True, np.diff(angle) > 1e-9]
    angle, light = angle[keep], light[keep]
    if len(angle) < 2 or not angle[0] <= 0 <= angle[-1]:
        raise InputError(
            "the unit does not bend, or was not seen at rest", "angle_deg", "a protocol that bends it"
        )
    delta = 1 - light / np.interp(0.0, angle, light)
    slope = np.diff(delta) / np.diff(angle)
    at = int(np.clip(np.searchsorted(angle, 0.0, side="right") - 1, 0, len(slope) - 1))
    # On a sample the mean of both sides.
    here = (slope[at] + slope[at - 1]) / 2 if at > 0 and angle[at] == 0 else slope[at]
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
    )


def pareto(disturbance: Sequence[float], sensitivity: Sequence[float]) -> list[bool]:
    """Whether no other candidate disturbs less and senses more, (n,)."""
    d, s = np.asarray(disturbance, float), np.abs(np.asarray(sensitivity, float))
    better = (
        (d[None] <= d[:, None]) & (s[None] >= s[:, None]) & ((d[None] < d[:, None]) | (s[None] > s[:, None]))
    )
    return [not row.any() for row in better]


def best_sets(signals: Array, noise: float, size: int, most: int = 5) -> list[tuple[tuple[int, ...], float]]:
    """Sets of `size` sensors that tell the most, best first, with the logarithm of their information.

    signals (n, q): each sensor's derivative by q independent ways to bend, each of unit spread; noise: of a
    reading. D-optimality with a unit prior: log det(1 + S^T S / noise^2) / 2, in natural units.
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
    """Pairs of sensors whose difference changes most with bending, best first, and by how much.

    sensitivity (n,): relative change of each one's light by bending. What dims both alike, such as a light
    source that warms, is not in the difference of their logarithms.
    """
    pairs = [((i, j), sensitivity[i] - sensitivity[j]) for i, j in combinations(range(len(sensitivity)), 2)]
    return sorted(pairs, key=lambda pair: -abs(pair[1]))[:most]


def arc_response(
    d: Dimensions, optics: Optics, length: float, angles_deg: Array, rays: int = RAYS
) -> Response:
    """The traced response of a straight path bent to circles' arcs, as around a mandrel on the bench."""
    guided = Guided.straight(d, length)
    return response(
        angles_deg, np.array([transmitted(guided, arc(length, a), optics, rays) for a in angles_deg])
    )
