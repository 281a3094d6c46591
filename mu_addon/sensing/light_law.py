"""The light that a bent waveguide transmits: traced rays, and a fast law fitted to them.

The logarithm of the light's loss is linear in

- the guide's length, its junctions, and its elongation;
- the logarithm of its number of wells: each finds less of the light that it can take;
- the kinks at its wells, either way;
- the signed curvature at its wells: light travels along the outer side of a bend and reaches wells there;
- the curvature squared along it: bend loss.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.waveguide import STRUT_GAP
from ..errors import InputError
from .embedded_waveguide import WaveguideShape
from .guide import Centreline, swept
from .notched import well_angles, with_wells
from .optics import Optics
from .tracing import Light, lambertian, trace

RAYS = 8000
_STEPS_A_MM = 4
_EDGE = 0.125
# What the law is fitted to: lengths between end nodes in cells, curvatures in 1/mm (the unit's own at 60
# degrees over its length is 0.014), stretches.
_CELLS = (1.5, 5.5)
_MOST_CURVATURE = 0.012
_STRETCH = (0.96, 1.06)
# Of a well in radians, below which a kink costs by its square.
_SMALLEST_KINK = 0.1

MISFIT = 0.05
"""Error of the law in a guide's log(light) beyond the noise of its trace: 200 traces of 40 000 rays."""

CHANGE_MISFIT = 0.45
"""Error of the law in a change of log(light), as a share: three paths of mu-1.0x, five states, 100 000 rays.
"""


def traced(shape: WaveguideShape, line: Centreline, optics: Optics, rays: int = RAYS, seed: int = 0) -> Light:
    """Fate of a diffuse source's light in the bent guide, by Monte Carlo ray tracing.

    line: of the bar as if it had no wells, straight or with one leg at rest; see `with_wells`. rays: their
    number. Raises InputError for wells that overlap or leave the bar.
    """
    guide = swept(
        with_wells(shape, line),
        shape.width,
        shape.height,
        shape.wells,
        shape.well_width,
        shape.well_depth,
        shape.junctions,
        edge=_EDGE,
    )
    return trace(guide, optics, lambertian(guide, rays, seed), seed)


def features(shape: WaveguideShape, legs: Sequence[Centreline]) -> Array:
    """Inputs (8,) of the linear law, named in FEATURES, of a guide whose axis consists of legs.

    In mm, 1/mm and radians: length in mm, elongation in mm, kinks in rad, curvature at the wells in 1/mm,
    integral of the squared curvature in 1/mm. The bends of the bar at rest, between two legs, are not
    included: their loss is there at rest as well.
    """
    wells = np.asarray(shape.wells)
    stretched, kinked, signed, bent = 0.0, 0.0, 0.0, 0.0
    for k, leg in enumerate(legs):
        curvature = leg.curvature
        here = wells[(wells >= leg.s[0]) & ((wells < leg.s[-1]) | (k == len(legs) - 1))]
        stretched += _area(leg.stretch - 1, leg.s)
        kinked += float((np.hypot(well_angles(shape, leg), _SMALLEST_KINK) - _SMALLEST_KINK).sum())
        signed += float(np.interp(here, leg.s, curvature).sum())
        bent += _area(curvature**2, leg.s)
    length, junctions = float(legs[-1].s[-1]), len(shape.junctions)
    return np.array([1.0, length, np.log1p(len(wells)), junctions, stretched, kinked, signed, bent])


FEATURES = (
    "one", "length_mm", "log_wells", "junctions", "elongation_mm", "kinks", "curvature_of_wells", "bending",
)  # fmt: skip
CURVATURE_OF_WELLS = FEATURES.index("curvature_of_wells")


def _area(values: Array, s: Array) -> float:
    return float(((values[1:] + values[:-1]) / 2 * np.diff(s)).sum())


@attrs.frozen(eq=False)
class Law:
    """-log(transmitted) = coefficients (8,) times `features`, fitted to traces.

    coefficients: in one over the unit of each feature. covariance (8, 8): of the coefficients; rms: weighted
    root mean square error of log(transmitted) for traces left out, including their noise.
    """

    coefficients: Array
    covariance: Array
    rms: float

    def transmitted(self, shape: WaveguideShape, legs: Sequence[Centreline]) -> float:
        """Share (0 to 1) of the source's light that arrives, for a guide whose axis consists of legs."""
        return float(np.exp(-self.coefficients @ features(shape, legs)))

    def error(self, change: Array) -> float:
        """Standard error of the change of log(light) by a change of features (8,), the law's misfit included.

        No unit; 0 for no change. The misfit is `MISFIT` for each of two states and `CHANGE_MISFIT` of the
        change.
        """
        if not change.any():
            return 0.0
        missed = 2 * MISFIT**2 + (CHANGE_MISFIT * float(self.coefficients @ change)) ** 2
        return float(np.sqrt(change @ self.covariance @ change + missed))


def straight_guide(d: Dimensions, length: float) -> WaveguideShape:
    """A guide printed straight along a column of cells, `length` mm from its first node to its last.

    d: dimensions of the unit in mm. Wells lie at whole pitches from the first node but for those in a strut,
    which is as wide as the bar at least. Raises InputError where no well has room.
    """
    end, half = d.waveguide_end, max(d.junction_diameter, d.waveguide_section) / 2
    total = length + 2 * end
    nodes = end + np.arange(int(length / d.cell + 1e-9) + 1) * d.cell
    wells = end + np.arange(int(length / d.well_pitch + 1e-9) + 1) * d.well_pitch
    away = np.abs(wells[:, None] - nodes).min(axis=1)
    room = d.well_width / 2 + STRUT_GAP
    clear = wells[(away > half + room) & (wells > room) & (wells < total - room)]
    if not len(clear):
        raise InputError(
            f"a waveguide of {length:g} mm is too short for a well", "path", "choose a longer one"
        )
    spans = tuple((max(0.0, at - half), min(total, at + half)) for at in nodes.tolist())
    section = d.waveguide_section
    return WaveguideShape(section, section, tuple(clear.tolist()), d.well_width, d.well_depth, spans)


def fit_law(
    d: Dimensions,
    optics: Optics,
    rays: int = RAYS,
    traces: int = 120,
    seed: int = 0,
    on_trace: Callable[[float], None] = lambda fraction: None,
) -> Law:
    """A law of transmitted light for a unit's waveguides, fitted to traces of many lengths and bends.

    d: printed dimensions of the unit in mm; rays: in each trace; traces: how many guides; on_trace: called
    with the share done. The law's rms error is the leave-one-out error. Takes some seconds. Raises InputError
    where almost no light arrives.
    """
    random = np.random.default_rng(seed)
    rows, logs, spread = [], [], []
    for k in range(traces):
        between = float(random.uniform(*_CELLS)) * d.cell
        shape = straight_guide(d, between)
        curvature = random.uniform(-_MOST_CURVATURE, _MOST_CURVATURE, 2)
        line = _bent(between + 2 * d.waveguide_end, d.waveguide_end, curvature, random.uniform(*_STRETCH))
        light = traced(shape, line, optics, rays, seed + k)
        if light.detected > 0:
            rows.append(features(shape, [line]))
            logs.append(-np.log(light.detected))
            spread.append(np.hypot(light.error / light.detected, MISFIT))
        on_trace((k + 1) / traces)
    if len(rows) < 3 * len(FEATURES):
        raise InputError(
            "almost no light reaches the detector in the waveguides of this unit",
            "optics",
            "use a clearer resin or smaller losses",
        )
    weight = 1 / np.array(spread)
    A, y = np.array(rows) * weight[:, None], np.array(logs) * weight
    # Columns differ by orders of magnitude.
    scale = np.maximum(np.abs(A).max(axis=0), 1e-12)
    inverse = np.linalg.pinv(A / scale)
    coefficients = inverse @ y
    hat = np.einsum("ij,ji->i", A / scale, inverse)
    off = y - A / scale @ coefficients
    variance = float(off @ off) / (len(y) - A.shape[1])
    covariance = variance * (inverse @ inverse.T) / np.outer(scale, scale)
    left_out = off / np.maximum(1 - hat, 1e-6)
    rms = float(np.sqrt((left_out @ left_out) / (weight @ weight)))
    return Law(coefficients / scale, covariance, rms)


def _bent(length: float, end: float, curvature: Array, stretch: float = 1.0) -> Centreline:
    """A planar axis whose curvature is linear between its ends' values (2,), in 1/mm when straight.

    The last `end` mm at either end are straight and not stretched.
    """
    s = np.linspace(0, length, max(8, int(_STEPS_A_MM * length)) + 1)
    middle = (s[1:] + s[:-1]) / 2
    inner = (middle > end) & (middle < length - end)
    steps = np.diff(s)
    bend = np.where(inner, curvature[0] + (curvature[1] - curvature[0]) * middle / length, 0.0)
    turn = np.concatenate([[0.0], np.cumsum(bend * steps)])
    along = (turn[1:] + turn[:-1]) / 2
    steps = steps * np.where(inner, stretch, 1.0)
    points = np.zeros((len(s), 3))
    points[1:, 1] = np.cumsum(-np.sin(along) * steps)
    points[1:, 2] = np.cumsum(np.cos(along) * steps)
    return Centreline(s, points, np.column_stack([0 * s, np.cos(turn), np.sin(turn)]))
