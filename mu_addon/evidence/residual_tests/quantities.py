"""Tests against quantities of each reading, of each experiment, and the chamber that markers stand on."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...arrays import Array
from ...design.parameters import Chambers
from ...errors import InputError
from ...measured import Experiment
from ...measured.pose import at_rest
from ..lags import DEADBAND_kPa, cycles, play_operator
from ..prediction.unit_pressure import KIND as UNIT
from ..record import KNOWN, Record
from ..spanned import unit
from .dependence import Dependence, by_gain, jointly
from .left import Left

ANGLE = "angle_deg"
# The pitch of chambers at 1.0x.
PITCH_MM = Chambers().cell_mm


def _rate(e: Experiment) -> Array:
    p = e["pressure_kPa"]
    return np.gradient(p, e["time_s"])


def _direction(e: Experiment) -> Array:
    return np.sign(np.gradient(play_operator(e["pressure_kPa"], DEADBAND_kPa)))


def _most(e: Experiment) -> Array:
    return np.maximum.accumulate(np.abs(np.nan_to_num(e["angle_deg"])))


# Quantities of a sample that the residual must not depend on, by the columns they need.
COVARIATES = (
    ("pressure", ("pressure_kPa",), lambda e: e["pressure_kPa"]),
    ("pressure_rate", ("pressure_kPa", "time_s"), _rate),
    ("loading_direction", ("pressure_kPa", "time_s"), _direction),
    ("largest_angle", ("angle_deg", "time_s"), _most),
    ("strain", ("strain",), lambda e: e["strain"]),
    ("added_mass", ("added_mass_g",), lambda e: e["added_mass_g"]),
    ("time", ("time_s",), lambda e: e["time_s"] - e["time_s"][0]),
    ("cycle", ("pressure_kPa", "time_s"), lambda e: cycles(e["pressure_kPa"])),
)
# Quantities of a whole experiment.
CONDITIONS = (
    ("orientation", lambda e, i: e.orientation_deg),
    ("scale", lambda e, i: e.scale),
    ("temperature", lambda e, i: e.temperature_C if math.isfinite(e.temperature_C) else 23.0),
    ("run_order", lambda e, i: float(i)),
)


def by_quantities(left: Left) -> list[Dependence]:
    """Tests against every quantity of `COVARIATES`, the predicted angle, and `CONDITIONS`."""
    record, found = left.record, []
    for name, needs, of in COVARIATES:
        held = {
            i: np.asarray(of(e), float)
            for i, e in enumerate(record.experiments)
            if all(c in e.columns for c in needs)
            and ("pressure_kPa" not in needs or record.driven(i, "pressure_kPa"))
        }
        found += _by_channel(left, name, _powers(record, held))
    found += _by_channel(left, "angle", _powers(record, _angles(left)))
    for name, condition in CONDITIONS:
        values = np.array([condition(e, i) for i, e in enumerate(record.experiments)], float)
        found += _by_channel(left, name, _by_condition(record, values, left.response))
    return found


def _angles(left: Left) -> dict[int, Array]:
    """Angle (n,) at each sample, by experiments that have one: as predicted, which has no noise.

    A measured angle has the noise of the residual that it would be compared with, but as a drive it has no
    noise.
    """
    row = {s.experiment: s.row for s in reversed(left.record.series) if s.channel == ANGLE}
    simulator, values = left.fitter.simulator, left.fit.values
    return {
        i: simulator.predict(e, values)[row[i]] if i in row else np.nan_to_num(e[ANGLE])
        for i, e in enumerate(left.record.experiments)
        if ANGLE in e.columns and "time_s" in e.columns
    }


def _powers(record: Record, values: Mapping[int, Array], degree: int = 4) -> Array | None:
    """Chebyshev powers (N, d) of a covariate's samples (n,) by experiment; None where it does not vary."""
    if not values:
        return None
    low, high = min(v.min() for v in values.values()), max(v.max() for v in values.values())
    if not high > low:
        return None
    few = len(np.unique(np.concatenate([np.unique(v)[:20] for v in values.values()])))
    degree = min(degree, few - 1)

    def powers(i: int) -> Array:
        if i not in values:
            return np.zeros((degree, len(record.experiments[i])))
        x = 2.0 * (values[i] - low) / (high - low) - 1.0
        return np.polynomial.chebyshev.chebvander(x, degree)[:, 1:].T

    return record.laid_out(powers)


def _by_condition(record: Record, values: Array, response: Array) -> Array | None:
    """The response (N,) to the modulus, stronger or weaker by a condition of whole experiments: (N, 2)."""
    if len(np.unique(values)) < 2:
        return None
    x = (values - values.mean()) / np.ptp(values)
    return np.asarray(response[:, None] * x[record.of_experiment][:, None] ** np.arange(1, 3))


def _by_channel(left: Left, name: str, columns: Array | None) -> list[Dependence]:
    """Joint test of all channels and the best single one, each at half of the false-alarm rate.

    columns (N, d): of all channels, each with separate sizes.
    """
    if columns is None:
        return []
    # Series are whitened separately, so one pass serves all channels.
    white, singles, groups = left.fitter.whitened(columns), [], {}
    group = {s.channel: s.group for s in left.record.series}
    for channel, rows in left.channels.items():
        gain, dof = left.gained(white[rows], rows)
        if dof:
            groups[group[channel]] = left.spare[group[channel]]
            singles.append(by_gain(name, gain, dof, groups[group[channel]], channel))
    return jointly(name, singles, sum(groups.values()), "all channels")


def by_chamber(left: Left) -> list[Dependence]:
    """Test whether markers' response to the modulus depends on their chamber.

    A chamber that bends unlike the rest moves the markers beyond it, and none before it. `where` names the
    marker that deviates most, and its position at rest in chambers from the inlet.
    """
    record = left.record
    place = _marker_places(record)
    levels = np.unique(list(place.values()))
    if len(levels) < 2:
        return []
    members = [s for s in record.series if s.channel in place and s.group != KNOWN]
    chamber = np.full(len(record), -1)
    for s in members:
        chamber[s.at] = np.searchsorted(levels, place[s.channel])
    x = 2.0 * (levels[chamber] - levels[0]) / (levels[-1] - levels[0]) - 1.0
    response = np.where(chamber < 0, 0.0, left.response)[:, None]
    along = response * x[:, None] ** np.arange(1, min(2, len(levels) - 1) + 1)
    gain, dof = left.gained(left.fitter.project(along))
    if not dof:
        return []
    each = left.fitter.project(response * (chamber[:, None] == np.arange(len(levels))))
    most = levels[int(np.argmax(np.abs(unit(each).T @ left.residual)))]
    named = next(c for c, level in place.items() if level == most).partition("_")[0]
    where = f"{named}, {most:g} chambers from the inlet"
    return [by_gain("chamber", gain, dof, left.saved(members), where)]


def _marker_places(record: Record) -> dict[str, float]:
    """Positions of the markers on the axis at rest, by their channels, in chambers from the inlet."""
    bent = [e for e in record.experiments if e.kind == UNIT]
    try:
        seen = at_rest(bent)
    except InputError:
        # Without a moment of rest the markers' positions are unknown.
        return {}
    scale = {e.name: e.scale for e in bent}
    # To half a chamber: positions of glued markers are no more accurate.
    chamber = {n: round(2 * z / (PITCH_MM * scale[name])) / 2 for n, (_, (*_, z), name) in seen.items()}
    channels = dict.fromkeys(s.channel for s in record.series if s.group != KNOWN)
    return {c: chamber[n] for c in channels for n in chamber if c.startswith(f"marker{n}_")}
