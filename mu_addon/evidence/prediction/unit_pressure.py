"""unit_pressure: quasi-static response of the unit, with effects in time before and after it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...measured import Experiment
from ...measured.pose import Direction, X, down
from ..drawn import Surface
from ..effect import Effect, Parameter, laws
from ..effects import acted
from .camera import camera_effects, read_by_camera
from .drift import drift, drifts, largest_reading, zeroed
from .effective_pressure import in_the_chambers, play_operator, remembered
from .flat_obstacle import NAME as CONTACT
from .flat_obstacle import ObstacleResponse, contact_effect
from .instruments import before_the_gauge, gauge
from .marker_slip import Recordings, slip_effects, slipped

Array = np.ndarray[Any, Any]

KIND = "unit_pressure"
# Kinds that drive a unit over time, with history.
DRIVEN = (KIND, "pressure_step", "blocked_force")
REFERENCE_C = 23.0
# Smaller reversals are noise of the gauge.
DEADBAND_kPa = 0.2
# Factor on the last computed pressure up to which the response is extrapolated along its end's slope.
BEYOND = 1.25
# Of the largest reading, possible drift of a gauge's zero: data sheets allow 0.25 to 2 % of full scale, a few
# times the reading.
GAUGE_SHARE = 0.05
# Sizes of variants whose curves a response keeps.
REMEMBERED = 64


def _float64(values: Any) -> Array:
    return np.ascontiguousarray(values, np.float64)


@attrs.frozen(eq=False)
class Variant:
    """The unit's response with one static effect, at m sizes of it.

    at (m,): values of `parameter` in its unit, ascending, its null among them. values (m, c, k): c channels
    in their units at the k pressures of the response; at the null they are the base's. A parameter with a
    spread is a model error of known size, and is fitted with every hypothesis. Raises InputError for fewer
    than two sizes, or if they do not ascend through the null.
    """

    parameter: Parameter
    at: Array = attrs.field(converter=_float64)
    values: Array = attrs.field(converter=_float64)

    def __attrs_post_init__(self) -> None:
        if len(self.at) < 2 or not (np.diff(self.at) > 0).all() or self.parameter.null not in self.at:
            raise InputError(
                f"variants of {self.parameter.name} do not ascend through their null",
                "unit response",
                "run the unit at the null and at one more value at least",
            )


@attrs.frozen(eq=False)
class UnitResponse:
    """Quasi-static response of the unit: values (c, k) of channels at pressures (k,) in kPa ascending.

    channels: columns as measured (angle_deg, marker1_y_mm, ...), which give the units. variants: by the name
    of their effect. orientation_deg, orientation_axis: see `unit_pose.down`. walls: by their side of the
    unit, 1 for +y and -1 for -y. Interpolated by cubic splines, and linearly beyond the last pressures.
    discrepancy: standard deviation between codes of the same physics, as a smooth change of the pressure over
    the largest one; 0 if the response is exact. gap_mm: of the load cell that holds the tip, if any. drawn:
    the response of units of another design; what an effect changes then grows as each channel's range does.
    Raises InputError for fewer than four pressures and for shapes that do not match.
    """

    channels: tuple[str, ...]
    pressures_kPa: Array = attrs.field(converter=_float64)
    values: Array = attrs.field(converter=_float64)
    variants: Mapping[str, Variant] = attrs.field(factory=dict)
    scale: float = 1.0
    orientation_deg: float = 0.0
    orientation_axis: Direction = X
    walls: Mapping[int, ObstacleResponse] = attrs.field(factory=dict)
    discrepancy: float = 0.0
    gap_mm: float = 0.0
    drawn: Surface | None = None
    _splines: Mapping[str, Any] = attrs.field(init=False, repr=False)
    _curves: dict[Any, Any] = attrs.field(init=False, repr=False, factory=dict)

    def __attrs_post_init__(self) -> None:
        from scipy.interpolate import CubicSpline

        k, shape = len(self.pressures_kPa), (len(self.channels), len(self.pressures_kPa))
        wrong = [n for n, v in self.variants.items() if v.values.shape != (len(v.at), *shape)]
        if self.values.shape != shape or k < 4 or wrong:
            raise InputError(
                f"{shape[0]} channels at {k} pressures do not fit their values {' '.join(wrong)}",
                "unit response",
                "give values (channels, pressures) at four pressures or more",
            )
        splines: dict[str, Any] = {"": CubicSpline(self.pressures_kPa, self.values, axis=1).c}
        for name, v in self.variants.items():
            base = v.values[int(np.argmin(np.abs(v.at - v.parameter.null)))]
            c = CubicSpline(self.pressures_kPa, v.values - base, axis=2).c
            # c is (4, k - 1, m, channels); in the parameter it is a spline again.
            splines[name] = CubicSpline(v.at, np.moveaxis(c, 2, 0), axis=0)
        object.__setattr__(self, "_splines", MappingProxyType(splines))

    def at(self, pressure_kPa: Array, sizes: Mapping[str, float]) -> Array:
        """Channels (c, n) in their units at effective pressures (n,) in kPa, with static effects.

        sizes: by name of the effect, in its parameter's unit; effects without a variant are ignored.
        """
        known = self.variants
        curve = self._curve(
            tuple((n, v) for n, v in sizes.items() if n in known and v != known[n].parameter.null),
            tuple((p.name, sizes[p.name]) for p in self.of_design if p.name in sizes),
        )
        low, high = self.pressures_kPa[0], self.pressures_kPa[-1]
        within = low <= pressure_kPa.min() and pressure_kPa.max() <= high
        inside = pressure_kPa if within else np.clip(pressure_kPa, low, high)
        found: Array = curve(inside).T
        if not within:
            ends = curve(np.array([low, high]), 1).T
            beyond = pressure_kPa - inside
            found = found + np.where(beyond < 0, ends[:, :1], ends[:, 1:]) * beyond
        if not self.walls:
            return found
        side = self.walls.get(int(np.sign(sizes.get(CONTACT, 0.0))))
        return found if side is None else found + side.change(pressure_kPa, abs(sizes[CONTACT]))

    @property
    def of_design(self) -> tuple[Parameter, ...]:
        """Parameters of the unit's design that may be fitted."""
        return self.drawn.parameters if self.drawn else ()

    @cached_property
    def rest(self) -> Array:
        """Channels (c,) in their units without pressure and effects."""
        return self.at(np.zeros(1), {})[:, 0]

    def _curve(self, sizes: tuple[tuple[str, float], ...], design: tuple[tuple[str, float], ...] = ()) -> Any:
        """Response over pressure with variants of given sizes, cached as many experiments use the same.

        design: values by name of `of_design`.
        """
        from scipy.interpolate import CubicSpline, PPoly

        key = sizes, design
        if key not in self._curves:
            if len(self._curves) >= REMEMBERED:
                self._curves.clear()
            c, grown = self._splines[""], 1.0
            values = self.drawn.of(dict(design)) if self.drawn and design else None
            if values is not None:
                c = CubicSpline(self.pressures_kPa, values, axis=1).c
                grown = np.ptp(values, axis=1) / np.maximum(np.ptp(self.values, axis=1), np.finfo(float).tiny)
            for name, size in sizes:
                c = c + grown * self._splines[name](size)
            self._curves[key] = PPoly.construct_fast(c, self.pressures_kPa, extrapolate=True, axis=0)
        return self._curves[key]


@attrs.frozen
class PressureHistory:
    """History of a specimen before an experiment: pressure cycles, lowest and highest pressure in kPa."""

    cycles: float = 0.0
    trough_kPa: float = 0.0
    peak_kPa: float = 0.0


def pressure_histories(experiments: Sequence[Experiment]) -> dict[str, PressureHistory]:
    """The history of each experiment of a kind in `DRIVEN`, by its name.

    experiments: in the order they were run; those of one specimen and scale follow one another.
    """
    found: dict[str, PressureHistory] = {}
    now: dict[tuple[str, float], PressureHistory] = {}
    for e in experiments:
        if e.kind not in DRIVEN:
            continue
        p = e["pressure_kPa"]
        whose = (e.specimen, e.scale)
        past = now.get(whose, PressureHistory())
        found[e.name] = past
        now[whose] = PressureHistory(
            past.cycles + float(cycles(p)[-1]),
            min(past.trough_kPa, float(p.min())),
            max(past.peak_kPa, float(p.max())),
        )
    return found


MODULUS = Parameter("modulus_factor", "", 0.2, 5.0, 1.0, (1.0,), "batches of resin differ")


def nuisances(channels: Sequence[str]) -> tuple[Parameter, ...]:
    """Parameters free in every fit of a unit: modulus factor, and each channel's zero in its unit."""
    zeros = [
        Parameter(zero_of(c), c.rpartition("_")[2], -most, most, 0.0, source=f"set by the {by}", linear=True)
        for c in channels
        for most, by in [(1e6, "syringe") if c.startswith("volume") else (1e3, "camera")]
    ]
    return (MODULUS, *zeros)


def believed(
    free: tuple[Parameter, ...], asked: Sequence[tuple[UnitResponse, Experiment]]
) -> tuple[Parameter, ...]:
    """Nuisances, with the modulus bounded so that no response has to be extrapolated far.

    free: the modulus first. asked: experiments, each with the response that predicts it. A softer unit has
    the state of this one at a higher pressure, and beyond the computed pressures it may balloon or collapse.
    """
    low = free[0].low
    for response, e in asked:
        at, p = response.pressures_kPa, e["pressure_kPa"]
        ends = ((p.min(), at[0]), (p.max(), at[-1]))
        low = max([low, *(read / (BEYOND * known) for read, known in ends if read * known > 0)])
    low = min(low, 1.0)
    modulus = attrs.evolve(free[0], low=low, source=f"batches of resin differ; above {low:.2g} computed")
    return (modulus, *free[1:])


DISCREPANCIES = ("discrepancy_second", "discrepancy_third")


def discrepancies(spread: float) -> tuple[Parameter, ...]:
    """Smooth discrepancies of any unit's model, by the square and the cube of the pressure; none at 0.

    spread: standard deviation of each at the largest pressure, as a share of it. Kennedy and O'Hagan, J. R.
    Stat. Soc. B 63 (2001) 425: a discrepancy of known size in every hypothesis, so that no cause is named for
    less.
    """
    if not spread:
        return ()
    most = 10.0 * spread
    return tuple(
        Parameter(name, "", -most, most, 0.0, (), "between codes of the same physics", spread=spread)
        for name in DISCREPANCIES
    )


def zero_of(channel: str) -> str:
    """Name of a channel's zero among the nuisances."""
    head, _, unit = channel.rpartition("_")
    return f"{head}_zero_{unit}"


# Effects in time; those of the unit itself come as variants of its response.
TIMED = (
    Effect(
        "viscoelasticity",
        (
            Parameter("share", "", 0.0, 0.7, 0.0, (0.1,), "share of the instantaneous modulus that relaxes"),
            Parameter("time_s", "s", 0.02, 1000.0, 1.0, (0.5, 5.0, 50.0), "relaxation time"),
        ),
        (KIND,),
    ),
    Effect(
        "rate_independent_hysteresis",
        (
            Parameter("share", "", 0.0, 0.6, 0.0, (0.1,), "share of the stiffness carried by friction"),
            Parameter("threshold_kPa", "kPa", 0.05, 30.0, 2.0, (0.7, 3.0, 9.0), "pressure at which it slips"),
        ),
        (KIND,),
    ),
    Effect(
        "mullins_softening",
        (
            Parameter("softening", "", 0.0, 0.7, 0.0, (0.1,), "1/r of Ogden and Roxburgh 1999"),
            Parameter("energy_share", "", 0.02, 2.0, 0.3, (0.1, 0.6), "m of Ogden and Roxburgh 1999"),
        ),
        (KIND,),
    ),
    Effect(
        "fatigue_drift",
        (Parameter("per_decade", "", 0.0, 0.4, 0.0, (0.03,), "modulus lost in ten times the cycles"),),
        (KIND,),
    ),
    Effect(
        "temperature_drift",
        (Parameter("per_K", "1/K", -0.05, 0.05, 0.0, (-0.005,), "modulus lost a kelvin"),),
        (KIND,),
    ),
    *gauge(KIND),
    Effect(
        "line_lag",
        (Parameter("time_s", "s", 0.0, 5.0, 0.0, (0.05, 0.5), "resistance times the chambers' volume"),),
        (KIND,),
    ),
    Effect(
        "leak",
        (Parameter("conductance_ratio", "", 0.0, 1.0, 0.0, (0.1,), "of the leak over the line"),),
        (KIND,),
    ),
    Effect(
        "angle_offset", (Parameter("offset_deg", "deg", -30.0, 30.0, 0.0, (1.0,), "camera frame"),), (KIND,)
    ),
    Effect(
        "clock_offset",
        (Parameter("offset_s", "s", -2.0, 2.0, 0.0, (-0.1, 0.1), "clocks set by hand"),),
        (KIND,),
    ),
)


# A second law of viscoelasticity: polymers relax over many decades of time, and if one relaxation time is too
# few a drift of the gauge would be named instead.
RELAXING = Effect(
    "viscoelasticity",
    (
        Parameter("per_decade", "", 0.0, 0.2, 0.0, (0.03,), "share of the modulus that relaxes in a decade"),
        Parameter("onset_s", "s", 0.02, 1000.0, 1.0, (0.5, 5.0), "when that begins"),
    ),
    (KIND,),
    "all moduli relax with time, equally in each decade",
)


# A third one with a parameter more, tried where one of the two is found: relaxation times evenly by their
# logarithms over some decades, which is near a stretched exponential and a Prony series of any length.
SPREADING = Effect(
    "viscoelasticity",
    (
        Parameter("spread_share", "", 0.0, 0.9, 0.0, (0.15,), "share of the modulus that relaxes in all"),
        Parameter("middle_s", "s", 0.02, 1000.0, 1.0, (0.5, 10.0), "middle of the relaxation times"),
        Parameter("decades", "", 0.0, 8.0, 0.0, (2.0,), "over which they spread"),
    ),
    (KIND,),
    "all moduli relax with time, by times spread over some decades",
    refines=True,
)


# A second law of the line: the volume before the chambers (tube, filter, manifold) fills first. Two volumes,
# each behind a resistance, have two real time constants, whatever their sizes.
TWO_VOLUMES = Effect(
    "line_lag",
    (
        Parameter("slower_s", "s", 0.0, 5.0, 0.0, (0.05, 0.5), "slower time of two volumes in a row"),
        Parameter("faster_share", "", 0.0, 0.99, 0.3, (0.3,), "the other time, of the slower one"),
    ),
    (KIND,),
    "two volumes of the air line fill in a row, so that the chamber pressure lags behind the gauge",
    refines=True,
)


class UnitPressure:
    """Predicts unit_pressure experiments from responses of the unit, one for each scale and orientation.

    The gauge's reading becomes the pressure in the chambers (offset, gain, and with an open valve leak and
    lag). That becomes the pressure at which the uncorrected unit has the state of the real one. Moduli scaled
    by one factor are the pressure divided by it: exactly at rest, and to first order of the hereditary
    integral for moduli that relax by one factor. That pressure is looked up in the response. Each record
    starts in equilibrium. experiments: in the order they were run, for the history of each specimen. Raises
    InputError without a response.
    """

    kind = KIND

    def __init__(self, responses: Sequence[UnitResponse], experiments: Sequence[Experiment] = ()) -> None:
        if not responses:
            raise InputError("no response of the unit is given", self.kind, "simulate the unit first")
        self._responses = tuple(responses)
        self._past = pressure_histories(experiments)
        self._nearest: dict[tuple[float, float, Direction], UnitResponse] = {}
        self._zeros = {r.channels: tuple(map(zero_of, r.channels)) for r in self._responses}
        self.channels_known = self._responses[0].channels
        self.nuisances = (
            *believed(
                nuisances(self.channels_known),
                [(self._response(e), e) for e in experiments if e.kind == self.kind],
            ),
            *discrepancies(max(r.discrepancy for r in self._responses)),
        )
        known: dict[str, Parameter] = {}
        for r in self._responses:
            for name, v in r.variants.items():
                p = v.parameter
                known[name] = known[name].narrowed(p.low, p.high) if name in known else p
        errors = {name: p for name, p in known.items() if math.isfinite(p.spread)}
        self.surfaces = tuple(r.drawn for r in self._responses if r.drawn)
        of_design = {p.name: p for r in self._responses for p in r.of_design}
        self.nuisances = (*self.nuisances, *errors.values(), *of_design.values())
        static = {name: Effect(name, (p,), (self.kind,)) for name, p in known.items() if name not in errors}
        walls = [wall for r in self._responses for wall in r.walls.items()]
        if walls:
            static[CONTACT] = contact_effect(walls, self.kind)
        self._largest_kPa = largest_reading("pressure_kPa", self.kind, experiments)
        drifting = drifts("pressure_drift", "kPa", GAUGE_SHARE * self._largest_kPa, self.kind, experiments)
        camera = camera_effects(self.channels_known, self.kind, experiments)
        self._recordings = Recordings(experiments)
        slips = slip_effects(self.channels_known, self.kind, self._recordings)
        timed = zeroed(TIMED, self.kind, experiments)
        self.effects = (
            *timed,
            RELAXING,
            SPREADING,
            TWO_VOLUMES,
            *static.values(),
            *drifting,
            *laws(self.kind, experiments),
            *camera,
            *slips,
        )
        own = {n: p.name for n, p in errors.items()} | {name: name for name in of_design}
        self._sizes = {e.name: e.keys[0] for e in static.values()} | own
        after = (e.name for e in (*camera, *slips))
        self._after = (*after, *self._sizes.values(), *self._zeros[self.channels_known], *DISCREPANCIES)
        self._effective: dict[Any, tuple[Experiment, Array]] = {}
        self.reference_kPa = max(float(np.abs(r.pressures_kPa).max()) for r in self._responses)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The experiment's columns that the response at its scale and orientation predicts.

        Raises InputError where no response is near that scale and orientation.
        """
        return tuple(c for c in self._response(experiment).channels if c in experiment.columns)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Prediction (channels, n), angles in degrees and marker positions in mm; values as in `Simulator`.

        Raises InputError where no response is near the experiment's scale and orientation.
        """
        response = self._response(experiment)
        pressure = self.discrepant(self._remembered_kPa(experiment, values), values)
        static = self.static(values)
        if "gravity" in static:
            # Weight bends a stiffer unit less, in proportion.
            static["gravity"] = static["gravity"] / values.get("modulus_factor", 1.0)
        zeros = [
            values.get(zero, 0.0) + (values.get("angle_offset.offset_deg", 0.0) if c == "angle_deg" else 0.0)
            for c, zero in zip(response.channels, self._zeros[response.channels], strict=True)
        ]
        y = self._moving(experiment, response.at(pressure, static), values)
        y = read_by_camera(response.channels, y, experiment["time_s"], experiment.scale, values)
        y = slipped(response.channels, y, response.rest, experiment, self._recordings, values)
        y = np.add(y, np.array(zeros)[:, None], order="C")
        kept = [i for i, c in enumerate(response.channels) if c in experiment.columns]
        return y if len(kept) == len(y) else y[kept]

    def _moving(self, experiment: Experiment, still: Array, values: Mapping[str, float]) -> Array:
        """Channels (c, n) of a moving unit from those in equilibrium (c, n): the same, without inertia."""
        return still

    def static(self, values: Mapping[str, float]) -> dict[str, float]:
        """Sizes by name of the response's variants, from values by key."""
        return {name: values[key] for name, key in self._sizes.items() if key in values}

    def discrepant(self, pressure: Array, values: Mapping[str, float]) -> Array:
        """Effective pressures (n,) in kPa with the discrepancy of the model's response."""
        second, third = (values.get(name, 0.0) for name in DISCREPANCIES)
        if not (second or third):
            return pressure
        x = pressure / self.reference_kPa
        return np.asarray(pressure + self.reference_kPa * (second * x**2 + third * x**3))

    def _remembered_kPa(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """`effective_kPa`, cached: derivatives by later effects (camera, static effects) need it again."""
        own = frozenset((k, v) for k, v in values.items() if not k.startswith(self._after))
        key = experiment.name, id(experiment), own
        if key not in self._effective:
            if len(self._effective) >= REMEMBERED:
                self._effective.clear()
            # With the experiment, whose identity could otherwise be reused.
            self._effective[key] = experiment, self.effective_kPa(experiment, values)
        return self._effective[key][1]

    def effective_kPa(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Pressure (n,) in kPa at which the base unit has the state of the unit with these values.

        values: by key, as in `Simulator`. Applied in this order: clock offset, drift, offset, gain and curve
        of the gauge, limits of the supply, leak and line lag (with an open valve), modulus with temperature
        and fatigue, viscoelasticity, hysteresis, Mullins softening.
        """
        t, p = experiment["time_s"], experiment["pressure_kPa"]
        past = self._past.get(experiment.name, PressureHistory())
        get = values.get
        if delay := get("clock_offset.offset_s", 0.0):
            p = np.interp(t - delay, t, p)
        p = p - drift("pressure_drift", t, values)
        p = before_the_gauge(p, values, self._largest_kPa)
        p = acted("pressure", experiment, p, values, self._largest_kPa)
        # With a valve shut nothing flows between gauge and chambers: both see a leak.
        if experiment.valve != "shut":
            p = in_the_chambers(t, p, values)
        modulus: Any = get("modulus_factor", 1.0)
        if per_K := get("temperature_drift.per_K", 0.0):
            kelvin = experiment.temperature_C - REFERENCE_C
            modulus = modulus * (1.0 + per_K * (kelvin if math.isfinite(kelvin) else 0.0))
        if per_decade := get("fatigue_drift.per_decade", 0.0):
            done = past.cycles + cycles(experiment["pressure_kPa"])
            modulus = modulus * (1.0 - per_decade * np.log10(1.0 + done))
        p = p / modulus
        before = max(past.peak_kPa, -past.trough_kPa) / get("modulus_factor", 1.0)
        return remembered(t, p, values, self.reference_kPa, before)

    def _response(self, experiment: Experiment) -> UnitResponse:
        how = experiment.scale, experiment.orientation_deg, experiment.orientation_axis
        if how not in self._nearest:
            self._nearest[how] = self._found(experiment)
        return self._nearest[how]

    def _found(self, experiment: Experiment) -> UnitResponse:
        here = down(experiment.orientation_deg, experiment.orientation_axis)
        apart = [
            abs(r.scale - experiment.scale)
            + float(np.linalg.norm(down(r.orientation_deg, r.orientation_axis) - here))
            for r in self._responses
        ]
        nearest = int(np.argmin(apart))
        if apart[nearest] > 0.02:
            raise InputError(
                f"no response at scale {experiment.scale:g}, orientation {experiment.orientation_deg:g} deg",
                experiment.name,
                "simulate the unit there, or leave the experiment out",
            )
        return self._responses[nearest]


def cycles(p: Array) -> Array:
    """Number of cycles completed (n,): travel of the pressure p (n,) in kPa over twice its range.

    Reversals smaller than `DEADBAND_kPa` are ignored.
    """
    smooth = play_operator(p, DEADBAND_kPa)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(smooth)))])
    extent = float(np.ptp(smooth))
    return travel / (2.0 * extent) if extent else travel
