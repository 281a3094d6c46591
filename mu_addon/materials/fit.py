"""Laws fitted to coupons: parameters with intervals, errors for each mode, stability."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import HIGHEST_POISSON
from ..errors import InputError
from .coupon import Coupon, binned, incompressible
from .intervals import Parameter, intervals
from .law_forms import Form
from .regression import Problem, best_exponents
from .settings import WEIGHTS
from .stability import Stability, check_stability, whole_ranges

# Coupons do not determine the bulk modulus; this ratio, the highest that a unit takes, sets it.
POISSON = HIGHEST_POISSON
# A law fails a mode whose stresses it misses by more than this share, norm over norm.
TOLERANCE = 0.10
# Relative weights never ask for more than this share of a coupon's largest stress.
FLOOR = 0.05


@attrs.frozen
class ModeError:
    """Misfit of a law to one coupon.

    rms_MPa: root mean square of the deviation in MPa; share: norm of the deviations over the norm of the
    stresses; worst: largest deviation over the largest stress; fitted: True if the law was fitted to the
    coupon.
    """

    coupon: str
    mode: str
    fitted: bool
    rms_MPa: float
    share: float
    worst: float


@attrs.frozen(eq=False)
class Fit:
    """A law fitted to coupons.

    parameters: the law's row (count,), in the units that its names give. rss: sum of squared weighted
    residuals of n values, without unit. memory: number of correlated values equivalent to one independent
    value. errors: of every coupon, fitted or held out. stability: over each mode's range. invalid: why the
    law rejects the parameters, or "".
    """

    form: Form
    parameters: Array
    intervals: tuple[Parameter, ...]
    weights: str
    rss: float
    n: int
    memory: float
    errors: tuple[ModeError, ...]
    stability: tuple[Stability, ...]
    invalid: str = ""

    @property
    def stable(self) -> bool:
        """True if the parameters are valid and the law is stable over all ranges that were checked."""
        return not self.invalid and all(s.stable for s in self.stability)

    @property
    def fails(self) -> tuple[str, ...]:
        """Modes in which the law misses a coupon by a share of more than TOLERANCE, fitted or held out."""
        return tuple(dict.fromkeys(e.mode for e in self.errors if not e.share <= TOLERANCE))

    @property
    def follows(self) -> bool:
        """True if the law misses no coupon that it was fitted to by a share of more than TOLERANCE."""
        return all(e.share <= TOLERANCE for e in self.errors if e.fitted)

    @property
    def n_effective(self) -> float:
        """Effective number of independent values, n over `memory`."""
        return self.n / self.memory

    def aicc(self, n: float) -> float:
        """AICc with the likelihood of n independent values, without unit; inf where they are too few.

        Source: Hurvich and Tsai, Biometrika 76 (1989) 297; the number of parameters includes the variance.
        """
        k = self.form.count + 1
        if self.n - k - 1 <= 0:
            return np.inf
        return float(n * np.log(self.rss / self.n) + 2 * k + 2 * k * (k + 1) / (self.n - k - 1))

    def held_out(self) -> float:
        """Relative error on the held-out coupons: root mean square of their shares; nan without any."""
        shares = [e.share for e in self.errors if not e.fitted]
        return float(np.sqrt(np.mean(np.square(shares)))) if shares else np.nan

    def instability(self) -> str:
        """Reason why the law is unstable; "" if it is stable."""
        if self.invalid:
            return self.invalid
        return "; ".join(s.where() for s in self.stability if not s.stable)

    def stress(self, mode: str, stretch: Array) -> Array:
        """Nominal stress (n,) in MPa at stretches (n,) along axis 1 of a mode, at constant volume.

        Raises InputError as `incompressible` does.
        """
        return incompressible(self.form.law, self.parameters, mode, stretch)


def fit_coupons(
    form: Form,
    coupons: Sequence[Coupon],
    held_out: Sequence[Coupon] = (),
    weights: str = WEIGHTS.default,
    profile: bool = False,
) -> Fit:
    """Fit a law to coupons by least squares, all modes at once, at constant volume.

    weights: "absolute", residuals over the largest stress of their coupon, as a load cell's errors scale with
    its range; "relative", residuals over the stress itself, or FLOOR of the largest if that is larger.
    `POISSON` sets the bulk modulus. Factors follow from exponents by linear least squares within their
    bounds, exponents by nonlinear least squares from the best combinations on a grid. Intervals of 95 %:
    linearised, or by `profile` for Ogden laws, with Student's t, widened where successive residuals are
    correlated. They hold for noise only, not where the law itself is wrong, which a large `memory` indicates.
    Raises InputError for unknown weights, too few values, or a coupon without stress.
    """
    WEIGHTS.checked(weights)
    n = sum(len(c.stretch) for c in coupons)
    if n <= form.count:
        raise InputError(
            f"{n} values do not determine the {form.count} parameters of {form.title}",
            ", ".join(c.name for c in coupons) or "no coupon",
            "measure more, or fit a law with fewer parameters",
        )
    problem = Problem.of(form, coupons, _weights(coupons, weights))
    fewer = _fewer(form, coupons, weights)
    exponents = best_exponents(fewer) if form.exponents else np.zeros(0)
    factors, residual = problem.solve(exponents)
    row = form.parameters(factors, exponents, POISSON)
    memory = _memory(residual, coupons)
    return Fit(
        form=form,
        parameters=row,
        intervals=intervals(problem, row, residual, memory, fewer if profile else None),
        weights=weights,
        rss=float(residual @ residual),
        n=n,
        memory=memory,
        errors=tuple(
            mode_error(form, row, c, fitted)
            for group, fitted in ((coupons, True), (held_out, False))
            for c in group
        ),
        stability=_stability(form, row, coupons),
        invalid=_invalid(form, row),
    )


def leave_one_mode_out(
    form: Form, coupons: Sequence[Coupon], weights: str = WEIGHTS.default
) -> dict[str, float]:
    """Leave-one-out error of each mode, as a share of its stresses, with the law fitted to the others.

    {} where the coupons are of a single mode. Raises InputError and ConvergenceError as the fits do.
    """
    modes = dict.fromkeys(c.mode for c in coupons)
    found = {}
    for mode in modes if len(modes) > 1 else ():
        rest = [c for c in coupons if c.mode != mode]
        out = [c for c in coupons if c.mode == mode]
        found[mode] = fit_coupons(form, rest, out, weights).held_out()
    return found


def mode_error(form: Form, row: Array, coupon: Coupon, fitted: bool) -> ModeError:
    """Misfit of a law with a row of parameters (count,) to a coupon, in MPa and as shares.

    Raises InputError as `incompressible` does.
    """
    off = incompressible(form.law, row, coupon.mode, coupon.stretch) - coupon.stress_MPa
    size = np.abs(coupon.stress_MPa)
    return ModeError(
        coupon.name,
        coupon.mode,
        fitted,
        float(np.sqrt(np.mean(off**2))),
        float(np.linalg.norm(off) / np.linalg.norm(size)),
        float(np.abs(off).max() / size.max()),
    )


def _weights(coupons: Sequence[Coupon], weights: str) -> Array:
    """Divisors of the residuals, (n,) in MPa."""
    parts = []
    for c in coupons:
        size = np.abs(c.stress_MPa)
        if not size.max() > 0:
            raise InputError("every stress is 0", f"coupon {c.name!r}", "leave this coupon out")
        least = size.max() if weights == "absolute" else FLOOR * size.max()
        parts.append(np.maximum(size, least))
    return np.concatenate(parts)


def _fewer(form: Form, coupons: Sequence[Coupon], weights: str) -> Problem:
    """The problem with long records in bins, within which a law is almost straight."""
    parts = [binned(c) for c in coupons]
    means = [c for c, _ in parts]
    scale = np.concatenate([_weights([c], weights) for c in means])
    return Problem.of(form, means, scale / np.sqrt(np.concatenate([count for _, count in parts])))


def _memory(residual: Array, coupons: Sequence[Coupon]) -> float:
    """1 + 2 times the sum of the residuals' autocorrelation, pooled, up to where it first is not positive.

    Source: Geyer, Statist. Sci. 7 (1992) 473, for means of correlated series.
    """
    longest = max(len(c.stretch) for c in coupons)
    product, pairs = np.zeros(longest), np.zeros(longest)
    start = 0
    for c in coupons:
        n = len(c.stretch)
        transformed = np.fft.rfft(residual[start : start + n], 2 * n)
        product[:n] += np.fft.irfft(np.abs(transformed) ** 2)[:n]
        pairs[:n] += np.arange(n, 0, -1)
        start += n
    if product[0] == 0:
        return 1.0
    correlation = (product / pairs)[1 : max(longest // 2, 2)] / (product[0] / pairs[0])
    end = np.flatnonzero(correlation <= 0)
    return float(1 + 2 * correlation[: end[0] if len(end) else None].sum())


def _stability(form: Form, row: Array, coupons: Sequence[Coupon]) -> tuple[Stability, ...]:
    if _invalid(form, row):
        return ()
    return tuple(
        check_stability(form.law, row, mode, low, high)
        for mode, (low, high) in whole_ranges(ranges(coupons)).items()
    )


def ranges(coupons: Sequence[Coupon]) -> dict[str, tuple[float, float]]:
    """Lowest and highest stretch, by mode, that coupons reach, the undeformed state (1) included."""
    found: dict[str, tuple[float, float]] = {}
    for c in coupons:
        low, high = found.get(c.mode, (1.0, 1.0))
        found[c.mode] = (min(low, float(c.stretch.min())), max(high, float(c.stretch.max())))
    return found


def _invalid(form: Form, row: Array) -> str:
    try:
        form.law.valid(row[None])
    except InputError as error:
        return error.what
    return ""
