"""All tests of a model's residual against what it should not depend on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..fit import Fit, Fitter
from ..record import KNOWN
from ..spanned import basis
from .dependence import Dependence, by_gain
from .left import NEAR, Left
from .quantities import by_chamber, by_quantities
from .time_series import (
    by_frequency,
    changed,
    cycles_alike,
    jumped,
    outliers,
    phase_of_cycle,
    repeats_alike,
    swinging,
)
from .without_clock import alternating, by_turn

# Share of clean data sets in which any structure may be reported.
FALSE_ALARM = 0.003
FITTED = (by_quantities, by_chamber, phase_of_cycle, changed, swinging)
"""Tests by columns that are fitted beside the model."""
PLAIN = (by_turn, jumped, by_frequency, cycles_alike, repeats_alike, alternating, outliers)
"""Tests of the residual as it stands."""


def dependence_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Every test of a fit's residual, in a fixed order, except for quantities that do not vary.

    The noise is the fitter's, estimated with every smooth cause set aside. A test therefore shows the model's
    misfit, and sometimes the slowest part of the noise, which such data hardly determine.
    """
    left = Left(fitter, fit, dict.fromkeys(fitter.deviance(fit), 0.0))
    return [*_fitted_tests(left), *_plain_tests(left)]


def strict_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """The tests of `dependence_table` under two estimates of the noise; the larger p-value of each counts.

    A dependence must gain more likelihood than the noise does when it is estimated from the residual itself,
    as if that had no cause. Tests without a fit are repeated under that second noise.
    """
    own, refitted = fitter.under_its_own_noise(fit)
    before, after = fitter.deviance(fit), own.deviance(refitted)
    left = Left(fitter, fit, {group: max(before[group] - after[group], 0.0) for group in before})
    both = zip(_plain_tests(left), _plain_tests(Left(own, refitted, {})), strict=True)
    return [*_fitted_tests(left), *(max(pair, key=lambda d: d.p_value) for pair in both)]


def _fitted_tests(left: Left) -> list[Dependence]:
    if all(s.group == KNOWN for s in left.record.series):
        return _spread(left)
    return [*_spread(left), *(d for test in FITTED for d in test(left))]


def _plain_tests(left: Left) -> list[Dependence]:
    return [d for test in PLAIN for d in test(left)]


def _spread(left: Left) -> list[Dependence]:
    """Test of the residual's size where an accuracy is stated; nothing elsewhere."""
    known = [s for s in left.record.series if s.group == KNOWN]
    if not known:
        return []
    square = sum(float(left.residual[s.at] @ left.residual[s.at]) for s in known)
    # A nuisance that no reading depends on, as a density without a mass, takes none.
    fitted = np.count_nonzero(left.fit.jacobian.any(axis=0))
    dof = max(sum(s.at.stop - s.at.start for s in known) - fitted, 1)
    return [by_gain("spread", square, dof, 0.0, "all")]


def structure(table: Sequence[Dependence]) -> tuple[str, ...]:
    """Quantities that the residual depends on, strongest first, at a false-alarm rate of `FALSE_ALARM`.

    The rate is divided by the number of tests (Bonferroni).
    """
    level = FALSE_ALARM / max(len(table), 1)
    return tuple(d.against for d in sorted(table, key=lambda d: d.p_value) if d.p_value < level)


def taken_by_scales(fitter: Fitter, fit: Fit) -> float:
    """Chi squared that a scale factor of each experiment's response takes from a fit's residual."""
    of, response = fitter.record.of_experiment, Left(fitter, fit, {}).response
    own = response[:, None] * (of[:, None] == np.arange(len(fitter.record.experiments)))
    return float(np.sum((basis(fitter.project(own), NEAR).T @ fit.residual) ** 2))
