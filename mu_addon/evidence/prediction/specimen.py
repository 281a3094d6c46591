"""A specimen in a testing machine: from the law of its material to the stress that the machine records."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ...errors import ConvergenceError
from ...measured import Experiment
from ..effects import Acting
from ..effects.declaration import Setting
from ..instants import finer
from ..load_cell import ZERO_SHARE, kPa_per_N
from ..parameter import Parameter

# Stress (n,) in kPa of strain (n,) at rest: 0 at 0, and rising.
Law = Callable[[Array], Array]

# Rows of a record from which its load cell has a fitted zero.
FEWEST = 20
# Iterations for the frame's share.
_MOST = 200


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


def specimen_setting(
    experiment: Experiment, past: StrainHistory = NEW, largest_N: float = 0.0, modulus_kPa: float = 0.0
) -> Setting:
    """Where effects act on a specimen; largest_N: force at which the load cell's curve is straight again."""
    section, length = experiment.section_mm, experiment.length_mm
    return Setting(
        experiment=experiment,
        time_s=experiment.columns.get("time_s"),
        past=past,
        mode=experiment.mode or "uniaxial",
        modulus_kPa=modulus_kPa,
        kPa_per_N=kPa_per_N(experiment),
        largest_N=largest_N,
        largest=largest_N * kPa_per_N(experiment),
        # Strain that a frame of 1 mm/N takes a kPa, which is 1e-3 N/mm2.
        strain_per_kPa_mm_N=1e-3 * section[0] * section[1] / length if section and length else 0.0,
    )


def recorded(acting: Acting, law: Law, values: Mapping[str, float]) -> Array:
    """Nominal stress (n,) in kPa that the machine records at the experiment's strains, its zero included.

    law: stress (n,) in kPa of strain (n,) in slow loading. Faces close a gap g while the load builds up: the
    specimen strains by e - g/L (1 - exp(-e L/g)). The machine's zero is where the preload was reached. A
    frame of compliance c in series leaves the specimen e - c A s/L. Relaxation needs time_s, the frame
    section_mm and length_mm; without them they have no effect. Raises ConvergenceError where the frame's
    share is not found.
    """
    setting = acting.setting
    experiment = setting.experiment
    if setting.time_s is not None:
        # A filter also depends on where the machine turned.
        dense, rows = _with_turns(experiment) if acting.at("filter") else (experiment, slice(None))
        setting.time_s = dense["time_s"]
        found = acting.along(_borne(acting, dense["strain"], law), "filter")[rows]
        setting.time_s = experiment["time_s"]
        found = acting.along(found, "cell_curve", "cell_gain", "cell_drift")
    else:
        found = _borne(acting, experiment["strain"], law)
    zero = values.get(_zero(experiment), 0.0)
    return found + zero if zero else found


def _with_turns(experiment: Experiment) -> tuple[Experiment, Array]:
    """The experiment with rows where strain turned between samples (`finer`), and its rows among them."""
    time, strain, rows = finer(experiment["time_s"], experiment["strain"])
    if len(time) == len(experiment):
        return experiment, rows
    columns = {c: np.full(len(time), np.nan) for c in experiment.columns} | {"time_s": time, "strain": strain}
    return attrs.evolve(experiment, columns=columns, rows=np.arange(len(time))), rows


def _borne(acting: Acting, strain: Array, law: Law) -> Array:
    """Nominal stress (n,) in kPa of the specimen in the machine at strains (n,), before its load cell."""
    factor = max(acting.along(1.0, "stiffness"), 1e-3)
    seated = acting.along((lambda e: factor * law(e)) if factor != 1 else law, "faces")
    stress = _remembering(acting, seated, strain)
    frame = acting.along(None, "frame") if acting.setting.strain_per_kPa_mm_N else None
    if frame is None:
        return stress
    give, taken = frame
    return _shared(stress, strain, give, taken, seated, lambda e: _remembering(acting, seated, e))


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


def _remembering(acting: Acting, law: Law, strain: Array) -> Array:
    """Stress (n,) of a specimen of known strain (n,), with its history of earlier strain."""
    setting = acting.setting
    setting.law, setting.path = law, acting.along(strain, "yielding_strain")
    places = ("yielding", "stress_softening", "stress_relaxation")
    return np.asarray(acting.along(law(setting.path), *places))
