"""unit_pressure: quasi-static response of the unit, with effects in time before and after it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ...arrays import Array, float64
from ...errors import InputError
from ...measured import Experiment
from ...measured.pose import Direction, X, down
from ..camera import View
from ..drawn import Surface
from ..effect import Effect, offered
from ..effects import LOADS, Acting
from ..effects.declaration import DRIVEN, Data, Setting
from ..effects.marker_slip import Recordings
from ..lags import cycles
from ..parameter import Parameter
from .flat_obstacle import CONTACT, ObstacleResponse

KIND = "unit_pressure"
# Factor on the last computed pressure up to which the response is extrapolated along its end's slope.
BEYOND = 1.25
# Sizes of variants whose curves a response keeps.
REMEMBERED = 64


@attrs.frozen(eq=False)
class Variant:
    """The unit's response with one static effect, at m sizes of it.

    at (m,): values of `parameter` in its unit, ascending, its null among them. values (m, c, k): c channels
    in their units at the k pressures of the response; at the null they are the base's. A parameter with a
    spread is a model error of known size, and is fitted with every hypothesis. Raises InputError for fewer
    than two sizes, or if they do not ascend through the null.
    """

    parameter: Parameter
    at: Array = attrs.field(converter=float64)
    values: Array = attrs.field(converter=float64)

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
    pressures_kPa: Array = attrs.field(converter=float64)
    values: Array = attrs.field(converter=float64)
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


# Where effects act on a pressure, up to the supply; on that in the chambers; and on a modulus's pressure.
TO_THE_SUPPLY = ("clock", "drift", "zero", "gain", "curve", "supply")
IN_THE_LINE = ("leak", "line")
IN_MEMORY = ("relaxation", "friction", "softening")


def driving_kPa(acting: Acting) -> Array:
    """Pressure (n,) in kPa in the chambers, of the gauge's reading in an experiment."""
    p = acting.along(acting.setting.experiment["pressure_kPa"], *TO_THE_SUPPLY)
    # With a valve shut nothing flows between gauge and chambers: both see a leak.
    return np.asarray(p if acting.setting.experiment.valve == "shut" else acting.along(p, *IN_THE_LINE))


def remembered_kPa(time_s: Array, pressure_kPa: Array, values: Mapping[str, float]) -> Array:
    """Pressure (n,) in kPa at which a unit without memory has the state of one whose supply gives these.

    time_s (n,): in s; values: by "effect.parameter". From rest; moduli as they are.
    """
    largest = float(np.abs(pressure_kPa).max())
    setting = Setting(time_s=time_s, fed=1.0, reference_kPa=largest, before_kPa=0.0)
    return np.asarray(Acting(KIND, values, setting).along(pressure_kPa, *IN_THE_LINE, *IN_MEMORY))


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
        self._recordings = Recordings(experiments)
        data = Data(kind=self.kind, experiments=experiments, channels=self.channels_known, walls=tuple(walls))
        self._largest_kPa = data.largest("pressure_kPa")
        self.effects = (*static.values(), *offered(data))
        own = {n: p.name for n, p in errors.items()} | {name: name for name in of_design}
        static |= {e.name: e for e in self.effects if walls and e.name == CONTACT}
        self._sizes = {e.name: e.keys[0] for e in static.values()} | own
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
        acting = Acting(self.kind, values, self._setting(experiment, response, values))
        pressure = self.discrepant(self._remembered_kPa(acting, values), values)
        y = response.at(pressure, self.static(values, values.get("modulus_factor", 1.0)))
        y = acting.along(y, "swing")
        if acting.at("view"):
            y = acting.along(View(), "view").read(response.channels, y, experiment.scale)
        y = acting.along(y, "surface")
        zeros = np.array([values.get(zero, 0.0) for zero in self._zeros[response.channels]])
        y = acting.along(np.add(y, zeros[:, None], order="C"), "read")
        kept = [i for i, c in enumerate(response.channels) if c in experiment.columns]
        return y if len(kept) == len(y) else y[kept]

    def _setting(
        self, experiment: Experiment, response: UnitResponse, values: Mapping[str, float]
    ) -> Setting:
        past = self._past.get(experiment.name, PressureHistory())
        return Setting(
            experiment=experiment,
            time_s=experiment["time_s"],
            largest=self._largest_kPa,
            fed=1.0,
            past=past,
            reference_kPa=self.reference_kPa,
            before_kPa=max(past.peak_kPa, -past.trough_kPa) / values.get("modulus_factor", 1.0),
            channels=response.channels,
            rest=response.rest,
            recordings=self._recordings,
        )

    def static(self, values: Mapping[str, float], modulus: Any = 1.0) -> dict[str, Any]:
        """Sizes by name of the response's variants, from values by key, at a factor on the modulus.

        Weight bends a stiffer unit less, in proportion.
        """
        sizes = {name: values[key] for name, key in self._sizes.items() if key in values}
        return {name: size / modulus if name in LOADS else size for name, size in sizes.items()}

    def discrepant(self, pressure: Array, values: Mapping[str, float]) -> Array:
        """Effective pressures (n,) in kPa with the discrepancy of the model's response."""
        second, third = (values.get(name, 0.0) for name in DISCREPANCIES)
        if not (second or third):
            return pressure
        x = pressure / self.reference_kPa
        return np.asarray(pressure + self.reference_kPa * (second * x**2 + third * x**3))

    def _remembered_kPa(self, acting: Acting, values: Mapping[str, float]) -> Array:
        """`effective_kPa`, cached: derivatives by later effects (camera, static effects) need it again."""
        experiment, modulus = acting.setting.experiment, values.get("modulus_factor", 1.0)
        own = acting.at(*TO_THE_SUPPLY, *IN_THE_LINE, "modulus", *IN_MEMORY)
        key = experiment.name, id(experiment), modulus, own
        if key not in self._effective:
            if len(self._effective) >= REMEMBERED:
                self._effective.clear()
            # With the experiment, whose identity could otherwise be reused.
            self._effective[key] = experiment, self._effective_kPa(acting, modulus)
        return self._effective[key][1]

    def effective_kPa(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Pressure (n,) in kPa at which the base unit has the state of the unit with these values.

        values: by key, as in `Simulator`.
        """
        setting = self._setting(experiment, self._response(experiment), values)
        return self._effective_kPa(Acting(self.kind, values, setting), values.get("modulus_factor", 1.0))

    def _effective_kPa(self, acting: Acting, modulus: float) -> Array:
        p = driving_kPa(acting) / acting.along(modulus, "modulus")
        return np.asarray(acting.along(p, *IN_MEMORY))

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
