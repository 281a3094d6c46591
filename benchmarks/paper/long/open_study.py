"""What the open values do to the table: shares of variance, and the set that agrees best."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError

from ..table.agreement import spearman
from ..table.published import Published, name_of
from .open_values import MOTION_KPA, OPEN, PointResult
from .surrogate import Shares, Surrogate, fit, shares

Array = np.ndarray[Any, Any]

# Of the surrogate, how many sets are looked at for the best; a power of two.
_SEARCHED = 1 << 13
# Fewest points that a surrogate is made of.
FEWEST = 24
# Name of the set that the surrogate proposes.
PROPOSED = "proposed"


@attrs.frozen(eq=False)
class OpenPoint:
    """One set of values and what it gave, or why it failed; `name` is that of a set told beside the design.

    values (d,): of OPEN. angle_deg (c, 3) at MOTION_KPA, crossing_kPa (c, 2), J_hat (c, paths) in mm.
    """

    name: str
    values: Array
    failed: str
    angle_deg: Array
    crossing_kPa: Array
    J_hat: Array

    @property
    def touches(self) -> bool:
        """Whether walls pass through each other somewhere in the range of bending."""
        return bool(np.isfinite(self.crossing_kPa).any())


def objective(ours: Array, theirs: Array, bending: Array, wanted: Array) -> Any:
    """How far sets of values are from the paper in all columns at once, (...); 0 were perfect.

    ours (..., c, n) and theirs (c, n): J_hat in mm by column; bending (..., c, 2) and wanted (c, 2): the
    angles in degrees at the ends of the paper's range. The mean over columns of 1 - Spearman, plus a tenth
    of the mean squares of two logarithms, ours over theirs: of a column's J_hat and of the angles. Rank
    comes first since it decides the path; a factor of two in every J_hat or angle weighs like 0.05 of rank.
    """
    rank = (1.0 - spearman(ours, theirs)).mean(axis=-1)
    size = (np.log(ours / theirs).mean(axis=-1) ** 2).mean(axis=-1)
    # An angle of the wrong sign has no logarithm; it counts like a hundredth of what is wanted.
    angle = (np.log(np.maximum(bending / wanted, 0.01)) ** 2).mean(axis=(-2, -1))
    return rank + 0.1 * (size + angle)


def point(name: str, values: Mapping[str, float], found: PointResult | str, samples_kPa: Array) -> OpenPoint:
    """A point of the table from what was solved; values that are not given are nan."""
    row = np.array([values.get(o.name, np.nan) for o in OPEN], float)
    if isinstance(found, str):
        none = np.empty((0, 0))
        return OpenPoint(name, row, found, none, none, none)
    return OpenPoint(name, row, "", found.angle_deg, found.crossing_kPa, found.J_hat(samples_kPa))


def columns(scales: Sequence[float], paths: Sequence[str]) -> list[str]:
    """Titles of the table of points."""
    found = ["name", *(o.name for o in OPEN), "failed"]
    for scale in scales:
        own = [f"angle_deg at {p:g} kPa" for p in MOTION_KPA]
        own += ["vacuum_touch_kPa", "pressure_touch_kPa", *(f"J_hat_mm {path}" for path in paths)]
        found += [f"{name_of(scale)} {title}" for title in own]
    return found


def to_rows(points: Iterable[OpenPoint], scales: Sequence[float], paths: Sequence[str]) -> list[list[str]]:
    """Rows of the table of points; what is not known is empty."""
    width = len(MOTION_KPA) + 2 + len(paths)
    rows = []
    for p in points:
        figures = (
            np.full(len(scales) * width, np.nan)
            if p.failed
            else np.hstack([p.angle_deg, p.crossing_kPa, p.J_hat]).ravel()
        )
        rows.append([p.name, *map(_cell, p.values), p.failed, *map(_cell, figures)])
    return rows


def _cell(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else ""


def from_text(text: str, scales: Sequence[float], paths: Sequence[str], where: Path) -> list[OpenPoint]:
    """Points from the text of their table, `#` comments allowed. Raises InputError."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    wanted = columns(scales, paths)
    try:
        head, *rows = csv.reader(io.StringIO("\n".join(lines)))
        if head != wanted:
            raise ValueError("its columns are others")
        return [_point(row, len(scales), len(paths)) for row in rows]
    except (ValueError, IndexError) as error:
        raise InputError(
            f"the table of open values cannot be read: {error}", str(where), "restore it"
        ) from error


def _point(row: Sequence[str], scales: int, paths: int) -> OpenPoint:
    d, angles = len(OPEN), len(MOTION_KPA)
    values = np.array([float(v) if v else np.nan for v in row[1 : 1 + d]])
    figures = np.array([float(v) if v else np.nan for v in row[2 + d :]]).reshape(scales, angles + 2 + paths)
    split = figures[:, :angles], figures[:, angles : angles + 2], figures[:, angles + 2 :]
    return OpenPoint(row[0], values, row[1 + d], *split)


def values_of(unit: Unit) -> dict[str, float]:
    """The open values that a unit has."""
    found = {}
    for o in OPEN:
        section, field = o.name.split(".")
        part = unit.chambers if section == "chambers" else unit.material
        found[o.name] = float(getattr(part, field))
    return found


def places(points: Sequence[OpenPoint]) -> Array:
    """Places (n, d) in [0, 1] of points in the open ranges."""
    found = np.empty((len(points), len(OPEN)))
    for i, o in enumerate(OPEN):
        v, values = o.variable, np.array([p.values[i] for p in points])
        assert v.low is not None
        assert v.high is not None
        if v.log:
            found[:, i] = np.log(values / v.low) / np.log(v.high / v.low)
        else:
            found[:, i] = (values - v.low) / (v.high - v.low)
    return found


def distance(p: OpenPoint, paper: Published) -> float:
    """`objective` of one point: how far it is from the paper in all columns at once."""
    return float(_distance(p.J_hat, p.angle_deg[:, [0, -1]], paper))


def _distance(J_hat: Array, bending: Array, paper: Published) -> Any:
    """The same of J_hat (..., c, paths) and angles (..., c, 2)."""
    theirs = np.array([paper.table_column(s) for s in paper.scales])
    wanted = np.array([paper.bending_deg[s] for s in paper.scales])
    # An end that lies beyond a limit point was not reached: it counts as a tenth of what is wanted.
    return objective(J_hat, theirs, np.where(np.isfinite(bending), bending, 0.1 * wanted), wanted)


def best(points: Sequence[OpenPoint], paper: Published) -> list[OpenPoint]:
    """Points whose walls do not pass through each other, those that agree best with the paper first."""
    sound = [p for p in points if not p.failed and not p.touches]
    return sorted(sound, key=lambda p: distance(p, paper))


@attrs.frozen(eq=False)
class Effect:
    """What the open values do to one figure: its range over the points, and shares of its variance.

    Q2: how much of the variance of points left out the surrogate predicts; without that, shares mean little.
    """

    name: str
    low: float
    high: float
    Q2: float
    shares: Shares


def effects(points: Sequence[OpenPoint], paper: Published) -> list[Effect]:
    """Effects on the angle's ends, on sizes and ranks of the table's columns, of points that were solved."""
    x = places(points)
    found = []
    middle = paper.scales.index(1.0)
    for column, pressure in ((0, MOTION_KPA[0]), (-1, MOTION_KPA[-1])):
        angle = np.array([p.angle_deg[middle, column] for p in points])
        known = np.isfinite(angle)
        if known.sum() > len(OPEN) + 2:
            found.append(_effect(f"angle at {pressure:g} kPa, 1.0x [deg]", x[known], angle[known]))
    J = np.array([p.J_hat for p in points])
    for i, scale in enumerate(paper.scales):
        found.append(_effect(f"mean J_hat, {name_of(scale)} [mm]", x, J[:, i].mean(axis=1)))
    found.append(_effect("mean J_hat of 1.5x over 0.75x", x, J[:, -1].mean(axis=1) / J[:, 0].mean(axis=1)))
    model = _models(x, J)
    for i, scale in enumerate(paper.scales):
        theirs = paper.table_column(scale)
        rank = spearman(J[:, i], theirs)
        predicted = _rank_of(model[i], theirs)
        varied = ((rank - rank.mean()) ** 2).sum()
        left = 1 - ((predicted(x) - rank) ** 2).sum() / varied if varied else 1.0
        name = f"rank correlation, {name_of(scale)}"
        found.append(Effect(name, rank.min(), rank.max(), float(left), shares(predicted, len(OPEN))))
    return found


def _effect(name: str, x: Array, values: Array) -> Effect:
    model = fit(x, values)
    return Effect(name, float(values.min()), float(values.max()), model.Q2, shares(model, len(OPEN)))


def _models(x: Array, J: Array) -> list[list[Surrogate]]:
    """Surrogates of the logarithm of every J_hat (n, c, paths), by column and path."""
    return [[fit(x, np.log(J[:, c, k])) for k in range(J.shape[2])] for c in range(J.shape[1])]


def _rank_of(models: Sequence[Surrogate], theirs: Array) -> Callable[[Array], Array]:
    """Rank correlation (n,) with the paper's column at places (n, d)."""

    def rank(at: Array) -> Array:
        J = np.array([m(at) for m in models]).T
        return np.asarray(spearman(J, theirs))

    return rank


def proposal(points: Sequence[OpenPoint], paper: Published) -> dict[str, float]:
    """The set that the surrogate of solved points believes to agree best; solve it before believing it."""
    from scipy.stats import qmc

    x = places(points)
    J = np.array([p.J_hat for p in points])
    models = _models(x, J)
    angles = np.array([p.angle_deg[:, [0, -1]] for p in points])
    ends = [
        [fit(x[np.isfinite(a)], a[np.isfinite(a)]) for a in (angles[:, c, 0], angles[:, c, 1])]
        for c in range(J.shape[1])
    ]
    at = qmc.Sobol(len(OPEN), seed=2).random(_SEARCHED)
    predicted = np.exp([[m(at) for m in row] for row in models])
    bending = np.array([[m(at) for m in row] for row in ends])
    far = _distance(np.moveaxis(predicted, -1, 0), np.moveaxis(bending, -1, 0), paper)
    found = at[int(np.argmin(far))]
    return {o.name: o.variable.at(float(u)) for o, u in zip(OPEN, found, strict=True)}
