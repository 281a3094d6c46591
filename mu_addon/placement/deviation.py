"""Deviation of a sensorised unit's backbone from the baseline's, as in the paper's Algorithm 1."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..arrays import Array


def centreline(points: Array, stations: int) -> Array:
    """Positions (k, j, 3) in mm at j uniform normalised arc lengths of polylines (k, N, 3) in mm.

    NaN at times of NaN. Cubic splines (not-a-knot) through the monitored nodes, by chord length normalised to
    [0, 1], the usual approximation of arc length.

    >>> line = np.array([[[0.0, 0.0, z] for z in (0.0, 1.0, 2.0, 4.0)]])
    >>> centreline(line, 3)[0, :, 2].round(9).tolist()
    [0.0, 2.0, 4.0]
    """
    from scipy.interpolate import CubicSpline

    at = np.linspace(0.0, 1.0, stations)
    curves = np.full((len(points), stations, 3), np.nan)
    for m, polyline in enumerate(points):
        if np.isnan(polyline).any():
            continue
        chord = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
        length = np.concatenate([[0.0], np.cumsum(chord)])
        spline = CubicSpline(length / length[-1], polyline)
        curves[m] = spline(_arc_length_parameters(spline, at))
    return curves


def _arc_length_parameters(spline: Any, at: Array) -> Array:
    """Spline parameters at which the normalised arc length of the curve itself equals `at`."""
    t = np.linspace(0.0, 1.0, 401)
    speed = np.linalg.norm(spline(t, 1), axis=1)
    length = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(t))])
    return np.interp(at, length / length[-1], t)


@attrs.frozen(eq=False)
class Deviation:
    """Distance Delta (k, j) in mm between two centrelines at k times and j stations, and its means in mm.

    over_time (k,): mean over length; over_length (j,): mean over time; J_hat: mean of all; J_cont: root
    mean square by trapezoidal integration. Times that are not compared are NaN and in no mean. Source: the
    paper's ||r_alpha - r_A|| and its discrete and continuous objectives.
    """

    delta: Array
    over_time: Array
    over_length: Array
    J_hat: float
    J_cont: float


def centreline_deviation(candidate: Array, baseline: Array) -> Deviation:
    """Deviation of a candidate's centreline from the baseline's, (k, j, 3) in mm each.

    >>> apart = centreline_deviation(np.full((2, 3, 3), 1.0), np.zeros((2, 3, 3)))
    >>> round(apart.J_hat, 6)
    1.732051
    """
    return deviation_of(np.linalg.norm(candidate - baseline, axis=2))


def deviation_of(delta: Array) -> Deviation:
    """Marginal means and objectives in mm of distances Delta (k, j) in mm at k times and j stations."""
    from scipy.integrate import trapezoid

    over_time = delta.mean(axis=1)
    compared = delta[np.isfinite(over_time)]
    k, j = compared.shape
    square = trapezoid(trapezoid(compared**2, np.linspace(0, 1, j), axis=1), np.linspace(0, 1, k))
    return Deviation(
        delta=delta,
        over_time=over_time,
        over_length=compared.mean(axis=0),
        J_hat=float(compared.mean()),
        J_cont=float(np.sqrt(square)),
    )


def rank(J_hat: Array) -> Array:
    """Rank (n,) of each candidate by J_hat (n,), 1 for the smallest; equal values keep their order.

    >>> rank(np.array([0.3, 0.1, 0.2])).tolist()
    [3, 1, 2]
    """
    order = np.argsort(J_hat, kind="stable")
    ranks = np.empty(len(J_hat), dtype=int)
    ranks[order] = np.arange(1, len(J_hat) + 1)
    return ranks
