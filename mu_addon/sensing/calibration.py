"""Bending angle from voltage: a monotone map fitted to sweeps, with a band that new sweeps keep to.

Model of the signal less its dark level: (1 + drift t) f(angle), with f a cubic spline. Its coefficients are
monotonic, and therefore f is. Each voltage has one angle, or one interval where the sensor is blind. The band
comes from sweeps left out of the fit: the error common to a sweep (mounting, drift, rate) and the error
within it (noise, hysteresis).

Source: Ramsay, Statistical Science 3 (1988) 425, for monotone splines by increments of one sign.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import minimize_scalar, nnls
from scipy.special import stdtrit

from ..arrays import Array
from ..errors import InputError
from ..files import write_text
from ..toml_reader import TomlTable, read_toml
from ..toml_writer import Commented, toml_text

VERSION = 1
_DEGREE = 3
_INTERVALS = (1, 2, 3, 4, 6, 8, 12)
_TABLE = 2001
# At a larger drift the light would be gone within a day.
_MOST_DRIFT_PER_H = 1.0
_FEWEST = 8
# Singular values of the spline's basis: 0.2 of the largest or more where angles are swept, however many
# intervals; 0.03 or less where intervals outnumber the angles held.
_DETERMINED = 0.05
# A drift is believed if it leaves less than this share of the mean square in left-out sweeps.
_CLEARLY = 0.25


@attrs.frozen(eq=False)
class CalibrationSweep:
    """One bending back and forth: time_s in s, angle_deg in degrees and voltage_V in V, (n,) each.

    The dark level is already subtracted from the voltages.
    """

    time_s: Array
    angle_deg: Array
    voltage_V: Array


@attrs.frozen(eq=False)
class Calibration:
    """A fitted map; `angle_of` turns voltages into angles, `voltage_of` angles into voltages.

    knots (m + 7,) in degrees and coefficients (m + 3,) in V of a cubic spline on `range_deg`; band_V: a new
    reading lies within that of the map with 95 % probability; drift_per_h: relative change of the light an
    hour that was found and removed; gain: divisor of the signal before it is converted, 1 at calibration,
    changed by `zeroed`; channel and dark: columns of the recording, or the dark level in V.
    """

    knots: Array
    coefficients: Array
    band_V: float
    drift_per_h: float
    channel: str
    dark: str | float = 0.0
    gain: float = 1.0
    error_deg: float = math.nan
    """Root mean square error in sweeps left out of the fit."""
    sweeps: int = 0

    @property
    def range_deg(self) -> tuple[float, float]:
        """Lowest and highest angle in degrees of the sweeps, between which the map holds."""
        return float(self.knots[_DEGREE]), float(self.knots[-_DEGREE - 1])

    def voltage_of(self, angle_deg: Array) -> Array:
        """Voltages (n,) in V, dark level subtracted, at angles (n,) in degrees.

        Angles outside `range_deg` are moved to its ends.
        """
        low, high = self.range_deg
        clipped = np.clip(np.asarray(angle_deg, float), low, high)
        return np.asarray(BSpline(self.knots, self.coefficients, _DEGREE)(clipped)) * self.gain

    def angle_of(self, voltage_V: Array) -> tuple[Array, Array, Array, Array]:
        """Angles, and low and high ends of their 95 % intervals (n,) in degrees, and a validity mask (n,).

        voltage_V (n,): in V, dark level subtracted. The mask is True where the map, within `band_V`, can give
        the voltage. Where the map is flat, the angle is the middle of that interval. At low and high the map
        reaches the voltage minus and plus `band_V`.
        """
        voltage = np.asarray(voltage_V, float) / self.gain
        angles = np.linspace(*self.range_deg, _TABLE)
        volts = np.asarray(BSpline(self.knots, self.coefficients, _DEGREE)(angles))
        if volts[-1] < volts[0]:
            volts, angles = volts[::-1], angles[::-1]
        first, last = _interval(volts, angles, voltage)
        near, _ = _interval(volts, angles, voltage - self.band_V)
        _, far = _interval(volts, angles, voltage + self.band_V)
        slack = self.band_V + 1e-9 * (volts[-1] - volts[0])
        possible = (voltage >= volts[0] - slack) & (voltage <= volts[-1] + slack)
        return (first + last) / 2, np.minimum(near, far), np.maximum(near, far), possible

    @property
    def insensitive_deg(self) -> list[float]:
        """Widest interval in degrees that the band cannot resolve, if it is a fifth of the range or more."""
        low, high = self.range_deg
        _, near, far, _ = self.angle_of(self.voltage_of(np.linspace(low, high, 401)))
        widest = int(np.argmax(far - near))
        wide = far[widest] - near[widest] > (high - low) / 5
        return [float(near[widest]), float(far[widest])] if wide else []

    def zeroed(self, voltage_V: float, angle_deg: float = 0.0) -> Calibration:
        """The same map with `gain` set from one voltage at a known angle: light became stronger or weaker.

        voltage_V: in V, dark level subtracted; angle_deg: in degrees. Raises InputError unless the gain is
        between 0.05 and 20.
        """
        expected = float(attrs.evolve(self, gain=1.0).voltage_of(np.array([angle_deg]))[0])
        gain = voltage_V / expected if expected else math.nan
        if not 0.05 < gain < 20:
            raise InputError(
                f"{voltage_V:.3g} V at {angle_deg:g} degrees, where the calibration has {expected:.3g} V",
                "zero",
                "check the cable and the light, then calibrate again",
            )
        return attrs.evolve(self, gain=gain)


def _interval(volts: Array, angles: Array, at: Array) -> tuple[Array, Array]:
    """First and last angle (n,) at which a rising table has the voltages `at` (n,), its ends beyond them."""
    inside = np.clip(at, volts[0], volts[-1])
    last = np.clip(np.searchsorted(volts, inside, side="right"), 1, len(volts) - 1)
    first = np.clip(np.searchsorted(volts, inside, side="left"), 1, len(volts) - 1)

    def crossing(upper: Array) -> Array:
        step = volts[upper] - volts[upper - 1]
        share = np.divide(inside - volts[upper - 1], step, out=np.ones_like(inside), where=step > 0)
        return np.asarray(angles[upper - 1] + np.clip(share, 0, 1) * (angles[upper] - angles[upper - 1]))

    return crossing(first), crossing(last)


def calibrate(sweeps: Sequence[CalibrationSweep], channel: str, dark: str | float = 0.0) -> Calibration:
    """Fit a monotonic map from voltage to bending angle, with its 95 % band, to two sweeps or more.

    channel: column of the recording that is calibrated; dark: the column of the dark level, or its value in
    V. The number of spline intervals minimises the leave-one-out error. Drift of the light is removed if that
    reduces the squared error of left-out sweeps to a quarter. Raises InputError for fewer than two sweeps,
    too few readings or angles in one, values that are not numbers, or no signal.
    """
    _require(sweeps)
    middle = float(np.mean(np.concatenate([s.time_s for s in sweeps])))
    sweeps = [attrs.evolve(s, time_s=s.time_s - middle) for s in sweeps]
    drift = _drift(sweeps) if len(sweeps) > 2 else 0.0
    steady, drifting = (_best(sweeps, d) for d in (0.0, drift))
    # A line through a handful of sweeps always takes some of their scatter.
    if drift and drifting[0] > _CLEARLY * steady[0]:
        drift = 0.0
    _, intervals, off = drifting if drift else steady
    knots = _knots(sweeps, intervals)
    coefficients, _ = _monotone([_triangle(s, knots, drift) for s in sweeps])
    span, band = float(np.ptp(coefficients)), _band(off)
    if span <= 2 * band:
        raise InputError(
            f"the voltage changes by {span:.3g} V over the sweep and scatters by {band:.3g} V",
            channel,
            "choose the channel of the light sensor, or bend further",
        )
    result = Calibration(knots, coefficients, band, drift, channel, dark, sweeps=len(sweeps))
    errors = [
        attrs.evolve(result, knots=k, coefficients=c).angle_of(s.voltage_V / _gain(s.time_s, drift))[0]
        - s.angle_deg
        for s, (k, c) in zip(sweeps, _without_each(sweeps, intervals, drift), strict=True)
    ]
    return attrs.evolve(result, error_deg=float(np.sqrt(np.mean(np.concatenate(errors) ** 2))))


def _best(sweeps: Sequence[CalibrationSweep], drift: float) -> tuple[float, int, list[Array]]:
    """Mean square in left-out sweeps, the number of intervals that makes it least, and the residuals."""
    tried = [(m, _left_out(sweeps, m, drift)) for m in _INTERVALS if m == 1 or _determined(sweeps, m)]
    squares = [float(np.mean(np.concatenate(off) ** 2)) for _, off in tried]
    best = int(np.argmin(squares))
    return squares[best], *tried[best]


def _determined(sweeps: Sequence[CalibrationSweep], intervals: int) -> bool:
    """True if the visited angles determine each coefficient of a spline of so many intervals.

    Sweeps that hold a few angles have no data between these. Sweeps left out hold the same angles, so they
    cannot show that a spline is stepped there.
    """
    knots = _knots(sweeps, intervals)
    basis = BSpline.design_matrix(np.concatenate([s.angle_deg for s in sweeps]), knots, _DEGREE).toarray()
    values = np.linalg.svd(basis, compute_uv=False)
    return len(basis) >= basis.shape[1] and bool(values[-1] > _DETERMINED * values[0])


def _require(sweeps: Sequence[CalibrationSweep]) -> None:
    if len(sweeps) < 2:
        raise InputError(
            f"{len(sweeps)} sweep",
            "calibration",
            "record two or more: repeatability cannot be estimated from one sweep",
        )
    for number, sweep in enumerate(sweeps, 1):
        if len(sweep.angle_deg) < _FEWEST or np.ptp(sweep.angle_deg) <= 0:
            raise InputError(
                f"sweep {number} has {len(sweep.angle_deg)} readings over {np.ptp(sweep.angle_deg):.3g} deg",
                "calibration",
                f"{_FEWEST} readings or more at different angles are needed",
            )
        if not np.isfinite(sweep.voltage_V).all():
            raise InputError(
                f"sweep {number} has readings that are not numbers", "calibration", "leave them out"
            )


def _gain(time_s: Array, drift_per_h: float) -> Array:
    return np.asarray(1 + drift_per_h * time_s / 3600)


def _knots(sweeps: Sequence[CalibrationSweep], intervals: int) -> Array:
    low, high = (f(float(f(s.angle_deg)) for s in sweeps) for f in (min, max))
    return np.concatenate([[low] * _DEGREE, np.linspace(low, high, intervals + 1), [high] * _DEGREE])


def _triangle(sweep: CalibrationSweep, knots: Array, drift_per_h: float) -> Array:
    """The sweep's least-squares problem (p, p + 1), reduced by QR, for a first coefficient and increments."""
    asked = _within(sweep, knots)
    basis = BSpline.design_matrix(sweep.angle_deg[asked], knots, _DEGREE).toarray()
    basis *= _gain(sweep.time_s[asked], drift_per_h)[:, None]
    sums = np.cumsum(basis[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(np.linalg.qr(np.column_stack([sums, sweep.voltage_V[asked]]), mode="r"))


def _monotone(triangles: Sequence[Array]) -> tuple[Array, float]:
    """Coefficients of the best spline that only rises or only falls, and the sum of squares it leaves."""
    stacked = np.vstack(triangles)
    matrix, target = stacked[:, :-1], stacked[:, -1]
    best: tuple[Array, float] | None = None
    for sign in (1.0, -1.0):
        # The first coefficient may have either sign: it is a difference of two that have not.
        x, left = nnls(np.column_stack([-matrix[:, :1], matrix[:, :1], sign * matrix[:, 1:]]), target)
        if best is None or left**2 < best[1]:
            best = np.cumsum(np.concatenate([[x[1] - x[0]], sign * x[2:]])), float(left**2)
    assert best is not None
    return best


def _within(sweep: CalibrationSweep, knots: Array) -> Array:
    return np.asarray((sweep.angle_deg >= knots[0]) & (sweep.angle_deg <= knots[-1]))


def _drift(sweeps: Sequence[CalibrationSweep]) -> float:
    """The drift an hour with the least residual, with a spline of medium size."""
    knots = _knots(sweeps, 4)
    hours = max(max(float(np.abs(s.time_s).max()) for s in sweeps) / 3600, 1e-6)
    most = min(_MOST_DRIFT_PER_H, 0.5 / hours)

    def left(drift: float) -> float:
        return _monotone([_triangle(s, knots, drift) for s in sweeps])[1]

    return float(minimize_scalar(left, bounds=(-most, most), method="bounded").x)


def _without_each(
    sweeps: Sequence[CalibrationSweep], intervals: int, drift: float
) -> list[tuple[Array, Array]]:
    """Knots and coefficients of the fits to all sweeps but one."""
    result = []
    for k in range(len(sweeps)):
        others = [s for j, s in enumerate(sweeps) if j != k]
        knots = _knots(others, intervals)
        result.append((knots, _monotone([_triangle(s, knots, drift) for s in others])[0]))
    return result


def _left_out(sweeps: Sequence[CalibrationSweep], intervals: int, drift: float) -> list[Array]:
    """Error in V of each sweep against the fit to the others, at angles that these reach."""
    result = []
    for sweep, (knots, coefficients) in zip(sweeps, _without_each(sweeps, intervals, drift), strict=True):
        asked = _within(sweep, knots)
        predicted = BSpline(knots, coefficients, _DEGREE)(sweep.angle_deg[asked])
        result.append(sweep.voltage_V[asked] / _gain(sweep.time_s[asked], drift) - predicted)
    return result


def _band(off: Sequence[Array]) -> float:
    """Half width in V that holds 95 % of a new sweep's readings, from left-out sweeps' errors (n_k,) each.

    A sweep is off as a whole, with variance B known from few sweeps, and within, with variance E known from
    many readings; Satterthwaite's degrees of freedom weigh the two.
    """
    whole = np.array([o.mean() for o in off if len(o)])
    within = [o - o.mean() for o in off if len(o)]
    B = float(np.mean(whole**2))
    E = float(np.mean(np.concatenate(within) ** 2))
    readings = sum(_independent(o) for o in within)
    if B + E == 0:
        return 0.0
    freedom = (B + E) ** 2 / (B**2 / max(len(whole) - 1, 1) + E**2 / max(readings, 1.0))
    return math.sqrt(B + E) * float(stdtrit(max(freedom, 1.0), 0.975))


def _independent(off: Array) -> float:
    """Number of independent readings worth these correlated ones, by their lag-one correlation.

    At least one and one a wave: a smooth error, as of hysteresis without noise, repeats in every sweep.
    """
    if len(off) < 3 or not off.any():
        return float(len(off))
    rho = float(np.clip(off[1:] @ off[:-1] / (off @ off), 0.0, 0.999))
    return max(len(off) * (1 - rho) / (1 + rho), 1 + np.count_nonzero(off[1:] * off[:-1] < 0) / 2)


def sweeps_of(time_s: Array, angle_deg: Array, voltage_V: Array, fewest: int = 2) -> list[CalibrationSweep]:
    """Cut one record into sweeps, each back and forth.

    time_s in s, angle_deg in degrees and voltage_V in V, (n,) each; rows with a value that is not finite are
    left out. It is cut at the lowest angle between two visits to the upper third of its range, so that noise
    and pauses do not count as turns. Raises InputError for fewer than `fewest` sweeps.
    """
    good = np.isfinite(angle_deg) & np.isfinite(voltage_V) & np.isfinite(time_s)
    time_s, angle_deg, voltage_V = time_s[good], angle_deg[good], voltage_V[good]
    third = np.ptp(angle_deg) / 3 if len(angle_deg) else 0.0
    zone = np.zeros(len(angle_deg), int)
    if third > 0:
        zone[angle_deg >= angle_deg.max() - third] = 1
        zone[angle_deg <= angle_deg.min() + third] = -1
    there = np.flatnonzero(zone)
    changes = np.flatnonzero(np.diff(zone[there])) + 1
    visits = [visit for visit in np.split(there, changes) if len(visit)]
    cuts = [0, len(angle_deg)]
    for before, visit, after in zip(visits, visits[1:], visits[2:], strict=False):
        if zone[visit[0]] == -1:
            inside = np.arange(before[-1], after[0])
            cuts.insert(-1, int(inside[np.argmin(angle_deg[inside])]))
    result = [
        CalibrationSweep(time_s[a:b], angle_deg[a:b], voltage_V[a:b]) for a, b in itertools.pairwise(cuts)
    ]
    if len(result) < fewest:
        raise InputError(
            f"{len(result)} sweep in that record",
            "angle_deg",
            "bend back and forth at least twice in one record",
        )
    return result


def write_calibration(path: Path, calibration: Calibration, about: str = "") -> None:
    """Write a calibration to the TOML file `path`, headed by the lines of `about`; raises OutputError."""
    c = calibration
    low, high = c.range_deg
    values = {
        "version": VERSION,
        "channel": c.channel,
        "dark": Commented(c.dark, beside="a channel, or a level in V"),
        "range_deg": [low, high],
        "knots_deg": c.knots,
        "coefficients_V": c.coefficients,
        "band_V": Commented(c.band_V, beside="95 %"),
        "drift_per_h": c.drift_per_h,
        "gain": c.gain,
        "sweeps": c.sweeps,
        "error_deg": Commented(c.error_deg, beside="root mean square, in sweeps left out"),
    }
    head = ["A sensor's map from voltage to bending angle.", *about.splitlines()]
    write_text(path, toml_text(values, "\n".join(line for line in head if line)))


def read_calibration(path: Path) -> Calibration:
    """Read a file of `write_calibration`.

    Raises InputError if it cannot be read, has another version, lacks a number, or has a map that is not
    monotonic.
    """
    table = read_toml(path, "calibration", "give the calibration.toml that `calibrate` writes")
    try:
        return _calibration(table, path)
    except InputError as error:
        # A panel shows what is wrong alone, and not where.
        raise InputError(f"the calibration is invalid: {error.what}", error.where, error.remedy) from None


def _calibration(table: TomlTable, path: Path) -> Calibration:
    if table.take("version", int) != VERSION:
        what = f"version {table.values['version']} is not known"
        raise InputError(what, table.at("version"), "calibrate again")
    dark: str | float = table.take("dark", str if isinstance(table.values.get("dark"), str) else float)
    result = Calibration(
        np.array(table.take("knots_deg", tuple[float, ...])),
        np.array(table.take("coefficients_V", tuple[float, ...])),
        table.take("band_V", float),
        table.take("drift_per_h", float),
        table.take("channel", str),
        dark,
        table.take("gain", float),
        table.take("error_deg", float),
        table.take("sweeps", int),
    )
    steps = np.diff(result.coefficients)
    sound = (
        len(result.knots) == len(result.coefficients) + _DEGREE + 1 >= 2 * (_DEGREE + 1)
        and np.isfinite(result.knots).all()
        and np.isfinite(result.coefficients).all()
        and (np.diff(result.knots) >= 0).all()
        and ((steps >= 0).all() or (steps <= 0).all())
        and result.band_V >= 0
        and result.gain > 0
    )
    if not sound:
        raise InputError(
            "its map is not monotonic, or its numbers are inconsistent", str(path), "calibrate again"
        )
    return result


def deriver(calibration: Calibration) -> Any:
    """A function for `run_session` that adds angle_deg, its 95 % interval in degrees, and in_range.

    in_range is 1 where the map can give the voltage. The function takes columns and values (n, c) and returns
    names and values (n, 4); it raises InputError where the stream lacks the calibrated channel.
    """
    names = ("angle_deg", "angle_low_deg", "angle_high_deg", "in_range")

    def derive(columns: tuple[str, ...], values: Array) -> tuple[tuple[str, ...], Array]:
        return names, np.column_stack(calibration.angle_of(light_of(calibration, columns, values)))

    return derive


def light_of(calibration: Calibration, columns: Sequence[str], values: Array) -> Array:
    """Voltages (n,) in V of the calibrated channel, dark level subtracted.

    columns: c names; values (n, c): in V. Raises InputError where the channel, or the dark level's, is
    missing.
    """
    level: Any = calibration.dark
    for name in (calibration.channel, *([level] if isinstance(level, str) else [])):
        if name not in columns:
            raise InputError(
                f"the stream has no channel {name}",
                ", ".join(columns),
                "connect the sensor that was calibrated",
            )
    if isinstance(level, str):
        level = values[:, list(columns).index(level)]
    return np.asarray(values[:, list(columns).index(calibration.channel)] - level)
