"""Marker slip."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Chambers
from ...measured import Experiment
from ..lags import DEADBAND_kPa, play_operator
from ..spanned import basis
from .declaration import ALL, CYCLED, Array, Data, Declaration, Law, Parameter, Setting, Values

ANGLE = "angle_deg"
CHANNEL = re.compile(r"marker(\d+)_([yz])_mm")
# A larger jump than one chamber of a unit at 1.0x is a confusion of markers.
FARTHEST_mm = Chambers().cell_mm
# Smallest slip from which a fit begins.
SMALLEST_mm = 0.01
# Powers of the pressure in the regression of a marker's position, beside the other markers.
POWERS = 4
# Samples at either end in which a step cannot be distinguished from an isolated reading.
ENDS = 4
# Most samples of a search: longer records are thinned.
SAMPLES = 20_000
# Chi squared beyond that of the best moment by noise, above which a second marker is offered, too.
PLAIN = 10.0
# Deviations from the median of itself and its neighbours beyond which a reading is isolated.
ALONE = 6.0


class Recordings:
    """Seconds of recording of the records that show markers, counted on from each to the next.

    experiments: in the order they were run. Each record begins half a sample before its first one and ends
    half a sample after its last one.
    """

    def __init__(self, experiments: Sequence[Experiment]) -> None:
        self.experiments = tuple(
            e for e in experiments if markers(e.columns) and "time_s" in e.columns and len(e) > 1
        )
        self._number = {e.name: k for k, e in enumerate(self.experiments)}
        self._times = [e["time_s"] - e["time_s"][0] for e in self.experiments]
        self._sample_s = [float(np.median(np.diff(t))) for t in self._times]
        lasts = [float(t[-1]) + h for t, h in zip(self._times, self._sample_s, strict=True)]
        self._begins = np.concatenate([[0.0], np.cumsum(lasts)])

    @property
    def total_s(self) -> float:
        """Length of all records together, in s."""
        return float(self._begins[-1])

    def place(self, moment_s: float) -> tuple[Experiment, float]:
        """Record that contains a moment of recording, and the time by its clock, both in s."""
        k = self._of(moment_s)
        first = float(self.experiments[k]["time_s"][0])
        return self.experiments[k], first + moment_s - float(self._begins[k]) - 0.5 * self._sample_s[k]

    def moment(self, experiment: str, sample: int) -> float:
        """Moment of recording, in s, half way between a sample of an experiment and the one before it."""
        k = self._number[experiment]
        if sample == 0:
            return float(self._begins[k])
        middle = 0.5 * float(self._times[k][sample - 1] + self._times[k][sample])
        return float(self._begins[k]) + 0.5 * self._sample_s[k] + middle

    def share(self, experiment: Experiment, moment_s: float) -> Array | float:
        """Share of a slip at that moment of recording, in s, that samples (n,) of an experiment show.

        0 before and 1 after it, in the experiment and in later ones of the same specimen at the same scale.
        Between two samples it is a ramp: all of the slip is in the later one for a moment half way.
        """
        k = self._number.get(experiment.name)
        if k is None:
            return 0.0
        at = self._of(moment_s)
        if k != at:
            return float(k > at and _whose(self.experiments[k]) == _whose(self.experiments[at]))
        t, half = self._times[k], 0.5 * self._sample_s[k]
        ends = np.concatenate([[-half], t, [t[-1] + half]])
        index = np.concatenate([[-0.5], np.arange(len(t)), [len(t) - 0.5]])
        slips = np.interp(moment_s - self._begins[k] - half, ends, index)
        now = np.interp(experiment["time_s"] - experiment["time_s"][0], t, np.arange(float(len(t))))
        return np.clip(now - slips + 0.5, 0.0, 1.0)

    def _of(self, moment_s: float) -> int:
        k = int(np.searchsorted(self._begins, moment_s, side="right")) - 1
        return min(max(k, 0), len(self.experiments) - 1)


def markers(columns: Iterable[str]) -> dict[int, str]:
    """Axes of the picture (y, z) in which columns show each marker, by its number."""
    found: dict[int, str] = {}
    for column in columns:
        if named := CHANNEL.fullmatch(column):
            number = int(named[1])
            found[number] = "".join(sorted(found.get(number, "") + named[2]))
    return dict(sorted(found.items()))


def _offered(law: Law, data: Data) -> list[Law]:
    """Markers that may have slipped, with starts by a search of the records.

    None where fewer than two markers are seen: one alone moves as it would if the camera were moved. The
    marker whose best moment gains most is always included, others if their best moment gains more than the
    best of so many moments would by noise. A marker that is seen along one axis has a signed displacement,
    others a length and a direction in the picture.
    """
    known, recordings = markers(data.channels), Recordings(data.experiments)
    found = [s for s in searched(recordings) if known.get(s.marker) and set(s.axes) <= set(known[s.marker])]
    if not found:
        return []
    found.sort(key=lambda s: -s.gain)
    tried = sum(s.tried for s in found)
    plain = 2.0 * math.log(tried) + PLAIN
    offered = [s for k, s in enumerate(found) if k == 0 or s.gain > plain]
    most = FARTHEST_mm * max(e.scale for e in recordings.experiments)
    return [_law(law, s, most, recordings.total_s, tried) for s in offered]


@attrs.frozen
class Slip:
    """Result of a search for one marker's slip: the moment, in s of recording, and its step (y, z) in mm.

    gain: chi squared of the step; tried: number of moments it is the best of.
    """

    marker: int
    axes: str
    moment_s: float
    step_mm: tuple[float, float]
    gain: float
    tried: int


def _law(law: Law, slip: Slip, most: float, total_s: float, tried: int) -> Law:
    marker, (y, z) = f"marker{slip.marker}", slip.step_mm
    # A large moment's finite difference would step over samples.
    near = max(slip.moment_s - 1e-2 * total_s, 0.0)
    moment = Parameter(
        f"{marker}_moment_s",
        "s",
        0.0,
        total_s,
        near,
        (slip.moment_s,),
        "seconds of recording, all records in their order",
    )
    size = min(max(math.hypot(y, z), SMALLEST_mm), 0.9 * most)
    source = "farther than a chamber it would be taken for another marker"
    shape: tuple[Parameter, ...]
    if slip.axes == "yz":
        direction = math.degrees(math.atan2(z, y))
        shape = (
            Parameter(f"{marker}_mm", "mm", 0.0, most, 0.0, (size,), source),
            Parameter(
                f"{marker}_direction_deg",
                "deg",
                -360.0,
                360.0,
                direction - 30.0,
                (direction,),
                "in the picture of the unit at rest, from y (across) toward z (along the axis)",
            ),
        )
    else:
        signed = math.copysign(size, y + z)
        shape = (Parameter(f"{marker}_{slip.axes}_mm", "mm", -most, most, 0.0, (signed,), source),)
    words = f"marker {slip.marker} slips on the unit's surface at one moment and stays there"
    return attrs.evolve(law, parameters=(*shape, moment), mechanism=words, tried=tried)


def _slipped(y: Array, v: Values, at: Setting) -> Array:
    """Channels (c, n) with the displacement, in the picture, of each marker that slipped.

    It rotates with the surface that the marker sits on: by twice the angle of the line from the inlet, as on
    an arc. Along one axis it is unchanged.
    """
    found = y
    for number, axes in markers(at.channels).items():
        key = f"marker{number}"
        rows = [at.channels.index(f"{key}_{axis}_mm") for axis in axes]
        if size := v.get(f"{key}_mm", 0.0):
            across, along = rows
            tilt = 2.0 * np.arctan2(y[across] - at.rest[across], y[along])
            way = math.radians(v.get(f"{key}_direction_deg", 0.0)) - tilt
            step = [size * np.cos(way), size * np.sin(way)]
        else:
            step = [np.asarray(v.get(f"{key}_{axis}_mm", 0.0)) for axis in axes]
        if not any(s.any() for s in step):
            continue
        share = at.recordings.share(at.experiment, v.get(f"{key}_moment_s", 0.0))
        found = found.copy() if found is y else found
        for row, s in zip(rows, step, strict=True):
            found[row] += s * share
    return found


def searched(recordings: Recordings) -> list[Slip]:
    """Best step of each marker, in no order, over every moment of every fitted record.

    Records of one specimen, scale and orientation are taken together.
    """
    groups: dict[Any, list[Experiment]] = {}
    for e in recordings.experiments:
        if e.role == "fit" and "pressure_kPa" in e.columns:
            how = (*_whose(e), e.orientation_deg, e.orientation_axis)
            groups.setdefault((how, tuple(markers(e.columns).items())), []).append(e)
    best: dict[int, Slip] = {}
    for members in groups.values():
        seen = markers(members[0].columns)
        for number in seen if len(seen) > 1 else ():
            found = _best_step(number, seen[number], members, recordings)
            if found is None:
                continue
            known = best.get(number, found)
            tried = found.tried + (known.tried if number in best else 0)
            best[number] = attrs.evolve(max(known, found, key=lambda s: s.gain), tried=tried)
    return list(best.values())


def _best_step(number: int, axes: str, members: Sequence[Experiment], recordings: Recordings) -> Slip | None:
    """The step of one marker that gains most in records of one specimen, scale and orientation.

    Its channels are regressed on powers of the pressure, the direction of loading and the unit's other
    channels. The residual is taken for noise of the first order, with its correlation estimated around the
    step found before. None where the records are too short.
    """
    every = max(1, math.ceil(sum(len(e) for e in members) / SAMPLES))
    own = [f"marker{number}_{a}_mm" for a in axes]
    others = [c for c in members[0].columns if (CHANNEL.fullmatch(c) or c == ANGLE) and c not in own]
    others = [c for c in others if all(c in e.columns for e in members)]

    def joined(of: Any) -> Array:
        return np.concatenate([np.asarray(of(e), float)[::every] for e in members])

    target = np.stack([joined(lambda e, c=c: e[c]) for c in own], axis=1)
    beside = [joined(lambda e, c=c: e[c]) for c in others]
    beside = [v for v in beside if np.isfinite(v).mean() > 0.9]
    p = joined(lambda e: e["pressure_kPa"])
    turned = joined(lambda e: np.sign(np.gradient(play_operator(e["pressure_kPa"], DEADBAND_kPa))))
    x = p / max(float(np.nanmax(np.abs(p))), 1e-9)
    columns = np.stack([np.ones_like(x), *(x**k for k in range(1, POWERS + 1)), turned, *beside], axis=1)
    sample = np.concatenate([np.arange(len(e))[::every] for e in members])
    of = np.concatenate([np.full(len(range(0, len(e), every)), k) for k, e in enumerate(members)])
    kept = np.isfinite(target).all(axis=1) & np.isfinite(columns).all(axis=1)
    target, columns, sample, of = target[kept], columns[kept], sample[kept], of[kept]
    n = len(target)
    if n < 3 * columns.shape[1] + 2 * ENDS:
        return None
    first = np.diff(of, prepend=-1) != 0
    q = basis(columns)
    target = _without_lone(target - q @ (q.T @ target))
    at, step, gain, correlation = n // 2, np.zeros(len(own)), 0.0, 0.0
    for _ in range(3):
        found = _step_of(target, columns, first, correlation)
        if found is None:
            break
        at, step, gain = found
        left = target - step * (np.arange(n) >= at)[:, None]
        left -= q @ (q.T @ left)
        square = float(np.sum(left**2))
        correlation = min(max(float(np.sum(left[1:] * left[:-1])) / max(square, 1e-300), 0.0), 0.98)
    moved = dict(zip(axes, step.tolist(), strict=True))
    moment = recordings.moment(members[of[at]].name, int(sample[at]))
    return Slip(number, axes, moment, (moved.get("y", 0.0), moved.get("z", 0.0)), gain, n - 2 * ENDS)


def _step_of(
    target: Array, columns: Array, first: Array, correlation: float
) -> tuple[int, Array, float] | None:
    """Sample of the step in all channels (n, c) that gains most chi squared, its sizes (c,), the gain.

    Beside columns (n, d); first (n,): where records begin; correlation: of noise from sample to sample, by
    which it is whitened. None where no residual is left.
    """
    n = len(target)
    start = math.sqrt(1.0 - correlation**2)

    def white(v: Array) -> Array:
        found = v.copy()
        found[1:] -= correlation * v[:-1]
        found[first] = start * v[first]
        return found

    # A step is so much in every sample after its own, and `jump` in its own.
    later = np.where(first, start, 1.0 - correlation)
    jump = np.where(first, start, 1.0)

    def along(v: Array, power: int) -> Array:
        """Sums (n, d) of v (n, d) with the whitened step from each sample on, to that power."""
        after = np.cumsum((later**power)[::-1, None] * v[::-1], axis=0)[::-1]
        return after + (jump**power - later**power)[:, None] * v

    q = basis(white(columns))
    r = white(target)
    r -= q @ (q.T @ r)
    whole = along(np.ones((n, 1)), 2)[:, 0]
    length = whole - np.sum(along(q, 1) ** 2, axis=1)
    resolved = length > 1e-3 * whole
    resolved[:ENDS] = resolved[n - ENDS :] = False
    products = along(r, 1)
    total = np.sum(r**2, axis=0)
    if not resolved.any() or not (total > 0.0).all():
        return None
    squares = np.where(resolved[:, None], products**2 / np.where(resolved, length, 1.0)[:, None], 0.0)
    # Noise is the step's residual: separate for each channel.
    rest = np.maximum(total - squares, 1e-12 * total) / max(n - q.shape[1] - 1, 1)
    gains = np.sum(squares / rest, axis=1)
    at = int(np.argmax(gains))
    return at, products[at] / length[at], float(gains[at])


def _without_lone(left: Array) -> Array:
    """Residuals (n, c) with isolated readings replaced by the median of them and their neighbours."""
    middle = left.copy()
    middle[1:-1] = np.median(np.stack([left[:-2], left[1:-1], left[2:]]), axis=0)
    apart = np.abs(left - middle)
    # Half of all readings are their own neighbourhood's median, so the mean gives their spread.
    alone = apart > ALONE * np.maximum(apart.mean(axis=0), 1e-300) * 2.0
    return np.where(alone, middle, left)


def _whose(e: Experiment) -> tuple[str, float]:
    return e.specimen, e.scale


EFFECT = Declaration(
    mechanism="a marker slips on the unit's surface at one moment and stays there",
    reveals=(
        "a mark drawn next to the marker; the marker glued again, and the records after that moment repeated"
    ),
    remedy="leave this marker out from that moment on, or glue it again and repeat the later records",
    of=ALL,
    instrument=True,
    laws=(Law(CYCLED, (), {"surface": _slipped}, offered=_offered),),
)
