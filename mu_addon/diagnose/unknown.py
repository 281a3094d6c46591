"""Parameters of a unit's design that nobody measured: their file, the designs to simulate, and which fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..design.printing.finding import counted
from ..design.quantity import described
from ..errors import InputError
from ..evidence.diagnosis import noise_of
from ..evidence.drawn import LEADING, ROUNDS, Designs, Surface, require_enough
from ..evidence.effect import Parameter
from ..evidence.fit import Fit, Fitter, interval
from ..evidence.prediction.unit_pressure import MODULUS, zero_of
from ..evidence.record import record
from ..evidence.simulator import Composite
from ..evidence.simulators import of_a_unit
from ..evidence.unit_settings import UnitSettings
from ..measured import Experiment
from ..optimization.freedoms import Freedom, changed_unit, read_freedoms
from ..reading import text_in
from ..run.study import Tell
from ..toml_reader import parsed_toml

COUNT = described(
    "designs", 16, "units drawn within the bounds and simulated before the search goes on where they fit",
    low=4, high=1000,
)  # fmt: skip
SECTIONS = ("chambers", "lattice")
"""Sections of a unit whose parameters may be unknown: moduli are fitted anyway, and print is an effect's."""
DIGITS = 3
"""Of a proposed length: more would make another unit of the same shape."""
CORNERS = 3
"""Parameters whose bounds are starts of a fit, in every combination."""


@attrs.frozen(eq=False)
class Unknown:
    """The content of a file of unknown parameters: [[freedom]] tables, as of `optimize`.

    text: the file. freedoms: numbers of a unit's chambers or lattice. count: designs to begin with.
    """

    text: str
    freedoms: tuple[Freedom, ...]
    count: int = COUNT.default

    def parameters(self, unit: Unit) -> tuple[Parameter, ...]:
        """One nuisance a freedom, whose null is the unit's own value, by the name of its parameter.

        Raises InputError where that is out of the freedom's bounds.
        """
        found = []
        for f in self.freedoms:
            low, high = (min(f.values), max(f.values)) if f.discrete else (f.low, f.high)
            own = float(f.value_of(unit))
            if not low <= own <= high:
                raise InputError(
                    f"{f.name} = {own:g} of the unit is out of {low:g} to {high:g}",
                    "unknown parameters",
                    "give bounds around the unit's own value, or a unit within them",
                )
            source = f"not measured: {low:g} to {high:g} {f.unit}".rstrip()
            found.append(Parameter(_short(f), f.unit, float(low), float(high), own, source=source))
        return tuple(found)

    def drawn(self, unit: Unit, values: Sequence[float]) -> Unit:
        """The unit with these values; raises InputError where it cannot be drawn."""
        whole = [_nearest(f, v) if f.discrete else v for f, v in zip(self.freedoms, values, strict=True)]
        return changed_unit(unit, self.freedoms, whole)

    def designs(self, unit: Unit) -> Designs:
        """The unit as given and `count` units within the bounds, less those that no rule allows.

        First the centre and corners, a two-level screening of the parameters, then a Sobol sequence.
        """
        parameters = self.parameters(unit)
        at, units = [tuple(p.null for p in parameters)], [unit]
        for place in _places(len(parameters), self.count).tolist():
            values = [_at(f, x) for f, x in zip(self.freedoms, place, strict=True)]
            try:
                drawn = self.drawn(unit, values)
            except InputError:
                continue
            if drawn not in units:
                at.append(tuple(map(float, values)))
                units.append(drawn)
        require_enough(len(units), len(parameters))
        return Designs(parameters, tuple(at), tuple(units))


def _places(dimensions: int, count: int) -> Array:
    """Places (count, dimensions), 0 to 1: the centre, corners by Hadamard's matrix, then Sobol's sequence.

    Corners in bit-reversed order, so that any number of them lies apart.
    """
    from scipy.linalg import hadamard
    from scipy.stats import qmc

    bits = math.ceil(math.log2(dimensions + 1))
    order = [int(f"{row:0{bits}b}"[::-1], 2) for row in range(2**bits)]
    corners = (1.0 - hadamard(2**bits)[order, 1 : dimensions + 1]) / 2.0
    # Its first point is a corner, its second one the centre.
    inside = qmc.Sobol(dimensions, scramble=False).random(2 ** math.ceil(math.log2(count + 2)))[1:]
    return np.concatenate([inside[:1], corners, inside[1:]])[:count]


def _short(freedom: Freedom) -> str:
    return freedom.name.partition(".")[2]


def _nearest(freedom: Freedom, value: float) -> Any:
    return min(freedom.values, key=lambda v: abs(v - value))


def _at(freedom: Freedom, place: float) -> Any:
    if freedom.discrete:
        return freedom.values[min(int(place * len(freedom.values)), len(freedom.values) - 1)]
    return freedom.at(place)


def read_unknown(text: str, origin: str, unit: Unit) -> Unknown:
    """The unknown parameters of a file's text, of a unit; raises InputError."""
    document = parsed_toml(text, origin).only(("designs", "freedom"))
    count, freedoms = document.setting(COUNT), read_freedoms(document.tables("freedom"), unit)
    for f in freedoms:
        numbers = all(type(v) in (int, float) for v in f.values)
        if f.name.partition(".")[0] not in SECTIONS or not numbers:
            raise InputError(
                f"{f.name} is not fitted: moduli are anyway, and what a print adds is an effect",
                f"{origin}, [[freedom]]",
                f"name numbers of {' and '.join(SECTIONS)}",
            )
    found = Unknown(text, tuple(freedoms), count)
    found.parameters(unit)
    return found


def unknown_of(path: Path, unit: Unit) -> Unknown:
    """The unknown parameters of a file; raises InputError."""
    text = text_in(path, "unknown parameters", "give a file of [[freedom]] tables")
    return read_unknown(text, str(path), unit)


@attrs.frozen(eq=False)
class Shape:
    """Values of the unknown parameters, by name, with all else fitted.

    simulated: the unit itself was, else its response is the surface's. fails: its simulation ends before the
    readings do. misfit: chi squared. predicted: mean of the first channel by experiment, in its unit, its
    zero included. ends: parameters at a bound.
    """

    values: dict[str, float]
    modulus: float
    zero: float
    misfit: float
    predicted: dict[str, float]
    ends: tuple[str, ...]
    simulated: bool
    fails: bool = False


@attrs.frozen(eq=False)
class Shapes:
    """What the data say about unknown parameters.

    fitted: the best for each combination of whole numbers, the best first; simulated: of each design,
    likewise. readings: values that the misfit is of. intervals: 95 % by name, whole numbers taken as
    continuous. error: root mean square of the surface at each design left out, in the channel's unit, at the
    pressure where it is largest.
    """

    fitted: tuple[Shape, ...]
    simulated: tuple[Shape, ...]
    readings: int
    intervals: dict[str, tuple[float, float]]
    error: float
    channel: str

    def words(self) -> str:
        """A sentence on what fits best of the shapes whose simulation does not fail."""
        best = min((*self.fitted, *self.simulated), key=lambda s: (s.fails, s.misfit))
        failing = sum(s.fails and s.misfit < best.misfit for s in self.fitted)
        better = (
            f"; {counted(failing, 'shape that fits', 'shapes that fit')} better found no equilibrium at some "
            "pressure when simulated"
            if failing
            else ""
        )
        unit = self.channel.rpartition("_")[2]
        shape = ", ".join(
            f"{n.replace('_', ' ')} {v:.3g} ({low:.3g} to {high:.3g})"
            for (n, v), (low, high) in zip(best.values.items(), self.intervals.values(), strict=True)
        )
        ends = f"; at a bound: {', '.join(best.ends).replace('_', ' ')}" if best.ends else ""
        how = "simulated itself" if best.simulated else "between simulated units"
        return (
            f"of the unknown parameters, what fits best ({how}) is {shape}, modulus factor "
            f"{best.modulus:.3g}{ends}; "
            f"chi squared {best.misfit:.3g} is left of {self.readings} readings; "
            f"the surface between {len(self.simulated)} units is off by {self.error:.2g} {unit}{better}"
        )

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return attrs.asdict(self) | {"words": self.words()}

    def table(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Columns and rows, a row a shape, what is fitted before what is simulated."""
        names, experiments = list(self.fitted[0].values), list(self.fitted[0].predicted)
        head = ["of", *names, "modulus_factor", "zero", "misfit", "at_a_bound", "fails", *experiments]
        rows = [
            (
                of,
                *s.values.values(),
                s.modulus,
                s.zero,
                s.misfit,
                " ".join(s.ends),
                "yes" if s.fails else "",
                *s.predicted.values(),
            )
            for of, every in (("fit", self.fitted), ("simulation", self.simulated))
            for s in every
        ]
        return head, rows


def shapes(
    unknown: Unknown,
    designs: Designs,
    surfaces: Sequence[Surface],
    simulator: Composite,
    experiments: Sequence[Experiment],
) -> Shapes:
    """Fit the unknown parameters to the experiments that are fitted, without effects.

    surfaces: of the responses, one a scale; simulator: with them.
    """
    measured = record([e for e in experiments if e.role == "fit"], simulator)
    fitter = Fitter(measured, simulator, noise_of(measured, simulator))
    names = [p.name for p in designs.parameters]
    whole = [(_short(f), f.values) for f in unknown.freedoms if f.discrete]
    smooth = [p for p in designs.parameters if p.name not in dict(whole)]

    channel = measured.series[0].channel
    zero = zero_of(channel)

    known = set.intersection(*({tuple(place) for place in s.at.tolist()} for s in surfaces))
    failed = set(designs.at) - known

    def shape(fit: Fit, simulated: bool) -> Shape:
        values = {n: float(fit.values[n]) for n in names}
        free = [p for p in fitter.curved if p.name in fit.keys and p.name in (*names, MODULUS.name)]
        first: dict[str, float] = {}
        for s in measured.series:
            # Not the record's values, which are in standard deviations where a folder states them.
            experiment = measured.experiments[s.experiment]
            found = simulator.predict(experiment, fit.values)[s.row]
            first.setdefault(experiment.name, float(np.nanmean(found)))
        ends = tuple(p.name for p in free if _at_an_end(p, fit.values[p.name]))
        modulus, offset = (float(fit.values.get(n, null)) for n, null in ((MODULUS.name, 1.0), (zero, 0.0)))
        fails = _proposed(unknown, values) in failed
        return Shape(values, modulus, offset, fit.chi2, first, ends, simulated, fails)

    starts: list[dict[str, float]] = [{}]
    corners = itertools.product(*((p.low, p.high) for p in smooth[:CORNERS]))
    starts += [dict(zip((p.name for p in smooth), c, strict=False)) for c in corners]
    fits = []
    for values in itertools.product(*(v for _, v in whole)):
        fixed = {n: float(v) for (n, _), v in zip(whole, values, strict=True)}
        fits.append(min((fitter.fit((), start, fixed) for start in starts), key=lambda f: f.chi2))
    fits.sort(key=lambda f: f.chi2)
    solved = [shape(fitter.fit((), None, dict(zip(names, at, strict=True))), True) for at in sorted(known)]
    free = fitter.fit((), fits[0].values)
    return Shapes(
        tuple(shape(f, False) for f in fits),
        tuple(sorted(solved, key=lambda s: s.misfit)),
        len(measured.values),
        {n: interval(fitter, free, n) for n in names},
        max(_error(s) for s in surfaces),
        channel,
    )


def _at_an_end(p: Parameter, value: float) -> bool:
    return min(abs(value - p.low), abs(value - p.high)) < 1e-3 * (p.high - p.low)


def _proposed(unknown: Unknown, values: Mapping[str, float]) -> tuple[float, ...]:
    """Values of a fit as the shape is simulated: lengths to `DIGITS`."""
    return tuple(
        v if f.discrete else float(f"{v:.{DIGITS}g}")
        for f, v in zip(unknown.freedoms, values.values(), strict=True)
    )


def _error(surface: Surface) -> float:
    """Root mean square over designs left out, of the first channel, at the pressure where it is largest."""
    return float(np.sqrt(np.nanmean(surface.errors[:, 0] ** 2, axis=0)).max())


def leading(found: Shapes, unknown: Unknown, designs: Designs, unit: Unit) -> Designs | None:
    """The designs with those that fit best, to be simulated; None where they are there or not allowed."""
    at: list[tuple[float, ...]] = []
    units: list[Unit] = []
    for s in found.fitted[:LEADING]:
        values = _proposed(unknown, s.values)
        try:
            drawn = unknown.drawn(unit, values)
        except InputError:
            continue
        if drawn not in (*designs.units, *units):
            at.append(values)
            units.append(drawn)
    return designs.also(at, units) if units else None


@attrs.frozen(eq=False)
class Shaped:
    """What fits, and settings of the unit's simulation with every design that was simulated."""

    settings: UnitSettings
    fits: Shapes


def shaped(
    unknown: Unknown, settings: UnitSettings, unit: Unit, experiments: Sequence[Experiment], tell: Tell
) -> Shaped:
    """What the data say about unknown parameters without effects.

    Where the surface between designs fits best, units are simulated and it is laid anew.
    """
    for round_ in range(ROUNDS + 1):
        assert settings.designs is not None
        alone = attrs.evolve(settings, effects=())
        simulators, _ = of_a_unit(experiments, unit, tell.cache, tell, alone)
        surfaces = [s for simulator in simulators.values() for s in getattr(simulator, "surfaces", ())]
        found = shapes(unknown, settings.designs, surfaces, Composite(simulators), experiments)
        more = leading(found, unknown, settings.designs, unit)
        if more is None or round_ == ROUNDS:
            break
        settings = attrs.evolve(settings, designs=more)
    return Shaped(settings, found)
