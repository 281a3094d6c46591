"""A specimen in a testing machine: from the law of its material to the stress that the machine records."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import attrs
import numpy as np

from ...errors import ConvergenceError
from ...measured import Experiment
from ..effect import Effect, Parameter
from .drift import drift, drifts, largest_reading
from .effective_pressure import decades_lag, first_order_lag, spread_lag
from .instants import finer
from .instruments import FILTERED, amplified, amplifier, filtered
from .unit_pressure import REFERENCE_C, RELAXING, SPREADING, TIMED
from .yielding import bouc_wen, elastic_strain, yielded, yielding

Array = np.ndarray[Any, Any]
# Stress (n,) in kPa of strain (n,) at rest: 0 at 0, and rising.
Law = Callable[[Array], Array]

# Length of a specimen at 1.0x whose length is not given.
LENGTH_mm = 25.0
# A preload needs faces to carry it: it builds up over this share of the gap, so that seating has one size.
ONSET_mm = 0.01
# Rows of a record from which its load cell has a fitted zero.
FEWEST = 20
# Of the largest load: drift of zero allowed by such cells' data sheets, and errors of zeroing by hand.
ZERO_SHARE = 0.01
# Iterations for the frame's share.
_MOST = 200
# Share of the change of slope at a turn by which slopes beside it may differ from straight lines'.
STRAIGHT = 0.2
# Strain up to which a preload is sought.
FARTHEST = 0.5
FRAME = Parameter("mm_per_N", "mm/N", 0.0, 0.1, 0.0, (0.005,), "steel 1e-5, printed plates 0.1")
# A compliance that falls with the load: grips that settle, wedges that bite. Source of its form: a hyperbolic
# tangent, as the toe of such records has one scale of load.
SETTLING = (
    Parameter("settling_mm_N", "mm/N", 0.0, 5.0, 0.0, (0.01, 0.3), "at no load; printed plates 0.1"),
    Parameter(
        "settled_at", "", 0.005, 1.0, 0.1, (0.05, 0.3), "of the largest load, where grips have settled"
    ),
    Parameter("stays", "", 0.0, 1.0, 0.0, (0.0, 0.3), "share of that compliance that does not settle"),
)
_TIMED = {e.name: e.parameters for e in TIMED}
# Another law of Mullins softening, by the largest strain so far, tried where the first is found.
BY_PEAK = (
    Parameter("by_peak", "", 0.0, 5.0, 0.0, (0.3,), "b of Beatty and Krishnaswamy 2000, over strain^power"),
    Parameter("power", "", 0.2, 2.0, 0.5, (0.5, 1.0), "one half in Beatty and Krishnaswamy 2000"),
)
# And one that saturates, by the distance below the largest strain over that strain.
BY_SHARE = (
    Parameter("lost", "", 0.0, 0.95, 0.0, (0.2,), "largest share of the stress lost by softening"),
    Parameter("width", "", 0.02, 5.0, 0.4, (0.3,), "of the largest strain: m of Dorfmann and Ogden 2004"),
    Parameter("shape", "", 0.2, 3.0, 1.0, (1.0,), "Weibull's, of the spread of chains that give way"),
)
# Gauss-Legendre points on 0..1 for the energy: exact for laws up to degree 15.
_AT, _WEIGHT = np.polynomial.legendre.leggauss(8)
_AT, _WEIGHT = (_AT + 1) / 2, _WEIGHT / 2


def machine(kind: str) -> tuple[Effect, ...]:
    """Effects, for a kind, of the testing machine, of layers, and of the material in time."""
    in_time = ("viscoelasticity", "mullins_softening", "fatigue_drift", "temperature_drift")
    return (
        *(Effect(name, _TIMED[name], (kind,)) for name in in_time),
        *(
            Effect(e.name, e.parameters, (kind,), e.mechanism, refines=e.refines)
            for e in (RELAXING, SPREADING)
        ),
        Effect(
            "mullins_softening",
            BY_PEAK,
            (kind,),
            "loading softens all later loading below its largest strain",
            refines=True,
        ),
        Effect(
            "mullins_softening",
            BY_SHARE,
            (kind,),
            "loading softens all later loading below its largest strain, by a share that ends",
            refines=True,
        ),
        yielding(kind),
        bouc_wen(kind),
        Effect(
            "anisotropy",
            # One for x and y alike: with one each, an axis left out could not be predicted from the others.
            (
                Parameter(
                    "in_plane", "", -0.9, 9.0, 0.0, (-0.3, 0.5), "modulus along x and y over z's, less 1"
                ),
            ),
            (kind,),
        ),
        Effect(
            "seating",
            (
                Parameter(
                    "gap_mm", "mm", 0.0, 3.0, 0.0, (0.3,), "rough faces, loose grips: toe of ASTM D695"
                ),
                Parameter("preload_kPa", "kPa", 0.0, 20.0, 0.0, (0.0, 1.0), "machines start at a preload"),
            ),
            (kind,),
        ),
        Effect("frame_compliance", (FRAME,), (kind,)),
        Effect(
            "frame_compliance",
            SETTLING,
            (kind,),
            "the testing machine and its grips deform, less the larger the load",
            refines=True,
        ),
    )


@attrs.frozen
class StrainHistory:
    """History of a specimen before an experiment: number of tests, largest absolute strain (no unit)."""

    tests: int = 0
    strain: float = 0.0


NEW = StrainHistory()


def strain_histories(experiments: Sequence[Experiment], kind: str) -> dict[str, StrainHistory]:
    """The history of each experiment of a kind, by its name.

    experiments: in the order they were run. Those of one specimen and scale follow one another; an experiment
    without a specimen's name has a new one.
    """
    found: dict[str, StrainHistory] = {}
    now: dict[Any, StrainHistory] = {}
    for e in experiments:
        if e.kind != kind:
            continue
        # A specimen without a name is assumed to be new.
        whose = (e.specimen or e.name, e.scale)
        past = found[e.name] = now.get(whose, NEW)
        now[whose] = StrainHistory(past.tests + 1, max(past.strain, float(np.abs(e["strain"]).max())))
    return found


def load_zeros(experiments: Sequence[Experiment], kind: str) -> tuple[Parameter, ...]:
    """The load cell's zero in each experiment of a kind that was recorded over time, as stress in kPa.

    Load cells are set to zero before each test, to within a share of the load (`ZERO_SHARE`): an unknown zero
    would imitate closing faces. Between plates a preload defines zero (`seating`), and load cells have no
    zero parameter. Records of a few rows, and those of given spread, cannot determine it.
    """
    found = []
    for e in experiments:
        timed = {"time_s", "stress_kPa"} <= set(e.columns) and "stress_sd_kPa" not in e.columns
        if e.kind != kind or not timed or len(e) < FEWEST:
            continue
        most = float(np.nanmax(np.abs(e["stress_kPa"]))) or 1.0
        spread = ZERO_SHARE * most
        zero = Parameter(_zero(e), "kPa", -most, most, 0.0, (), "set by hand", spread=spread)
        found.append(attrs.evolve(zero, experiment=e.name))
    return tuple(found)


def _zero(experiment: Experiment) -> str:
    return f"zero_kPa of {experiment.name}"


def load_cell(experiments: Sequence[Experiment], kind: str) -> tuple[Effect, ...]:
    """Effects, for a kind, of the load cell that reads experiments over time: zero, gain and lag.

    One cell reads all specimens, so that its zero drifts in N. A specimen whose section is not given is taken
    for a cube of `LENGTH_mm`.
    """
    timed = _timed(experiments, kind)
    if not timed:
        return ()
    most = ZERO_SHARE * largest_N(experiments, kind)
    return (*drifts("force_drift", "N", most, kind, timed), *amplifier(kind))


def largest_N(experiments: Sequence[Experiment], kind: str) -> float:
    """The largest force in N that a load cell read over time in experiments of a kind; 0 without any."""
    found = (largest_reading("stress_kPa", kind, [e]) / _kPa_per_N(e) for e in _timed(experiments, kind))
    return max(found, default=0.0)


def _timed(experiments: Sequence[Experiment], kind: str) -> list[Experiment]:
    return [e for e in experiments if e.kind == kind and {"time_s", "stress_kPa"} <= set(e.columns)]


def _kPa_per_N(experiment: Experiment) -> float:
    section = experiment.section_mm or (LENGTH_mm * experiment.scale,) * 2
    return 1e3 / math.prod(section)


def recorded(
    experiment: Experiment,
    law: Law,
    values: Mapping[str, float],
    past: StrainHistory = NEW,
    largest_N: float = 0.0,
) -> Array:
    """Nominal stress (n,) in kPa that the machine records at the experiment's strains, its zero included.

    law: stress (n,) in kPa of strain (n,) in slow loading. largest_N: force at which the load cell's curve is
    straight again. Faces close a gap g while the load builds up: the specimen strains by
    e - g/L (1 - exp(-e L/g)). The machine's zero is where the preload was reached. A frame of compliance c in
    series leaves the specimen e - c A s/L, one that settles (`SETTLING`) less of it. Relaxation needs time_s,
    the frame section_mm and length_mm; without them they have no effect. Raises ConvergenceError where the
    frame's share is not found.
    """
    timed = "time_s" in experiment.columns
    if timed and any(values.get(key) for key in FILTERED):
        # A filter also depends on where the machine turned.
        dense, rows = _with_turns(experiment)
        found = filtered(dense["time_s"], _borne(dense, law, values, past, largest_N), values)[rows]
    else:
        found = _borne(experiment, law, values, past, largest_N)
    if timed:
        found = amplified(found, values, largest_N * _kPa_per_N(experiment))
        found = found + _kPa_per_N(experiment) * drift("force_drift", experiment["time_s"], values)
    zero = values.get(_zero(experiment), 0.0)
    return found + zero if zero else found


def _with_turns(experiment: Experiment) -> tuple[Experiment, Array]:
    """The experiment with rows where strain turned between samples (`finer`), and its rows among them."""
    time, strain, rows = finer(experiment["time_s"], experiment["strain"])
    if len(time) == len(experiment):
        return experiment, rows
    columns = {c: np.full(len(time), np.nan) for c in experiment.columns} | {"time_s": time, "strain": strain}
    return attrs.evolve(experiment, columns=columns, rows=np.arange(len(time))), rows


def _borne(
    experiment: Experiment, law: Law, values: Mapping[str, float], past: StrainHistory, largest_N: float
) -> Array:
    """Nominal stress (n,) in kPa of the specimen in the machine, as `recorded` without its zero."""
    strain = experiment["strain"]
    factor = _factor(experiment, values, past)
    seated = _seated(experiment, (lambda e: factor * law(e)) if factor != 1 else law, values)
    compliance = values.get("frame_compliance.mm_per_N", 0.0)
    settling = values.get("frame_compliance.settling_mm_N", 0.0)
    stress = _remembering(experiment, seated, strain, values, past)
    if not (compliance or settling) or experiment.section_mm is None or experiment.length_mm is None:
        return stress
    # Strain the frame takes a kPa, which is 1e-3 N/mm2.
    per_kPa = 1e-3 * experiment.section_mm[0] * experiment.section_mm[1] / experiment.length_mm
    stays = values.get("frame_compliance.stays", 0.0) if settling else 1.0
    at = values.get("frame_compliance.settled_at", 0.1) * (largest_N or 1.0) * _kPa_per_N(experiment)
    first = per_kPa * (settling or compliance)

    def taken(stress: Array) -> Array:
        """Strain (n,) that the frame takes at stresses (n,) in kPa."""
        linear = stays * stress
        return first * (linear if stays == 1.0 else linear + (1.0 - stays) * at * np.tanh(stress / at))

    return _shared(
        stress, strain, first, taken, seated, lambda e: _remembering(experiment, seated, e, values, past)
    )


def _shared(
    alone: Array,
    strain: Array,
    give: float,
    taken: Callable[[Array], Array],
    law: Law,
    stress_of: Callable[[Array], Array],
) -> Array:
    """Stress s (n,) in kPa with s = stress_of(strain - taken(s)): a specimen in series with a frame.

    alone (n,): in kPa, without the frame. strain (n,): of both. taken: strain (n,) that the frame takes, at
    most `give` a kPa. law: in slow loading; stress_of: with history, whose slope by a sample's own strain is
    not known, and arbitrary where it turns. So the slope between each sample's last two values is used, which
    changes little at a time. Raises ConvergenceError.
    """
    small = 1e-6
    slope = np.maximum((law(strain + small) - law(strain - small)) / (2 * small), 0.0)
    chord = np.divide(alone, strain, out=np.zeros_like(alone), where=strain != 0.0)
    stress, rate = alone / (1 + give * np.maximum(chord, 0.0)), 1 + give * slope
    step = miss = np.zeros_like(alone)
    for _ in range(_MOST):
        off = stress - stress_of(strain - taken(stress))
        if np.abs(off).max() <= 1e-11 * np.abs(stress).max():
            return stress
        seen = np.divide(off - miss, step, out=rate.copy(), where=step != 0.0)
        rate = np.clip(seen, np.maximum(0.5 * rate, 1.0), 4.0 * rate)
        step, miss = -off / rate, off
        stress = stress + step
    raise ConvergenceError(
        "the frame's share of the displacement was not found",
        "frame_compliance",
        "leave frame_compliance out",
    )


def _factor(experiment: Experiment, values: Mapping[str, float], past: StrainHistory) -> float:
    """Factor on the modulus by direction, temperature and earlier tests."""
    factor = 1.0
    if experiment.axis in ("x", "y"):
        factor *= 1 + values.get("anisotropy.in_plane", 0.0)
    if (per_K := values.get("temperature_drift.per_K", 0.0)) and math.isfinite(experiment.temperature_C):
        factor *= 1 + per_K * (experiment.temperature_C - REFERENCE_C)
    if per_decade := values.get("fatigue_drift.per_decade", 0.0):
        factor *= 1 - per_decade * math.log10(1 + past.tests)
    return max(factor, 1e-3)


def _seated(experiment: Experiment, law: Law, values: Mapping[str, float]) -> Law:
    """The law between faces that close, with strain counted from the preload."""
    gap = values.get("seating.gap_mm", 0.0)
    toe = gap / (experiment.length_mm or LENGTH_mm * experiment.scale)
    if not toe:
        return law

    def closing(strain: Array) -> Array:
        return law(np.sign(strain) * (np.abs(strain) + toe * np.expm1(-np.abs(strain) / toe)))

    preload = values.get("seating.preload_kPa", 0.0) * min(1.0, gap / ONSET_mm)
    if not preload:
        return closing
    low, high = 0.0, FARTHEST
    for _ in range(3):
        grid = np.linspace(low, high, 200)
        k = int(np.clip(np.searchsorted(closing(grid), preload), 1, len(grid) - 1))
        low, high = grid[k - 1], grid[k]
    below, above = closing(np.array([low, high]))
    zero = low + (high - low) * min(max((preload - below) / (above - below), 0.0), 1.0)
    return lambda strain: closing(strain + zero)


def _remembering(
    experiment: Experiment, law: Law, strain: Array, values: Mapping[str, float], past: StrainHistory
) -> Array:
    """Stress (n,) of a specimen of known strain (n,), with its history of earlier strain."""
    strain = elastic_strain(strain, values)
    stress = yielded(strain, law, values)
    if softening := values.get("mullins_softening.softening", 0.0):
        from scipy.special import erf

        energy = _energy(law, strain)
        before = float(_energy(law, np.array([past.strain * (np.sign(strain.sum()) or 1.0)]))[0])
        most = np.maximum(np.maximum.accumulate(energy), before)
        width = values.get("mullins_softening.energy_share", 0.3) * (float(most.max()) or 1.0)
        stress = stress * (1 - softening * erf((most - energy) / width))
    if rate := values.get("mullins_softening.by_peak", 0.0):
        below, _ = _below(experiment, strain, past)
        stress = stress * np.exp(-rate * below ** values.get("mullins_softening.power", 0.5))
    if lost := values.get("mullins_softening.lost", 0.0):
        below, most = _below(experiment, strain, past)
        way = below / np.maximum(values.get("mullins_softening.width", 0.4) * most, 1e-12)
        stress = stress * (1 + lost * np.expm1(-(way ** values.get("mullins_softening.shape", 1.0))))
    if (share := values.get("viscoelasticity.share", 0.0)) and "time_s" in experiment.columns:
        # Relaxation from equilibrium: sigma = sigma_0 - share of the dashpot's strain.
        stress = stress - share * first_order_lag(
            experiment["time_s"], stress, values.get("viscoelasticity.time_s", 1.0)
        )
    if (share := values.get("viscoelasticity.per_decade", 0.0)) and "time_s" in experiment.columns:
        onset = values.get("viscoelasticity.onset_s", 1.0)
        stress = stress - share * decades_lag(experiment["time_s"], stress, onset)
    if (share := values.get("viscoelasticity.spread_share", 0.0)) and "time_s" in experiment.columns:
        stress = stress - share * spread_lag(experiment["time_s"], stress, values)
    return stress


def _below(experiment: Experiment, strain: Array, past: StrainHistory) -> tuple[Array, Array]:
    """Amount (n,) by which strains (n,) are below the largest so far in size, and that largest (n,)."""
    size = np.abs(strain)
    timed = "time_s" in experiment.columns and len(strain) > 5
    most = _largest(experiment["time_s"].tobytes() if timed else b"", size.tobytes(), past.strain)
    return most - size, most


# Unless the material yields, of each experiment alone.
@lru_cache(maxsize=256)
def _largest(t: bytes, size: bytes, before: float) -> Array:
    """The largest (n,) so far, read-only, of sizes (n,) at times (n,) if any, in bytes, and `before`."""
    so_far = found = np.frombuffer(size)
    if t:
        so_far = np.maximum(found, turns(np.frombuffer(t), found))
    found = np.maximum(np.maximum.accumulate(so_far), before)
    found.flags.writeable = False
    return found


def turns(t: Array, x: Array) -> Array:
    """The largest value (n,) since the sample before, where x turns downward between two samples.

    t (n,), x (n,): times and samples. A machine moves straight to a turning point and back, seldom at a
    sample: lines through the samples on either side meet there. x itself elsewhere, and where x is round.
    """
    found = x.copy()
    step = np.diff(t)
    slope = np.diff(x) / step
    # Five steps: two on the way up, that of the turn, two on the way down.
    before, up, down, after = slope[:-4], slope[1:-3], slope[3:-1], slope[4:]
    first, last, h = x[2:-3], x[3:-2], step[2:-2]
    bend = up - down
    straight = np.maximum(np.abs(before - up), np.abs(after - down)) < STRAIGHT * bend
    at = np.divide(last - down * h - first, bend, out=np.zeros_like(h), where=straight)
    turned = straight & (up > 0) & (down < 0) & (at > 0) & (at < h)
    found[3:-2][turned] = (first + up * at)[turned]
    return np.maximum(found, x)


def _energy(law: Law, strain: Array) -> Array:
    """Energy (n,) in kJ/m3 of straining from 0."""
    return strain * (law((strain[:, None] * _AT).ravel()).reshape(len(strain), -1) @ _WEIGHT)
