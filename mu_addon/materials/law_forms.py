"""The laws that can be fitted, as sums of terms; each has one factor and at most one exponent."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.declared_laws import form_names
from ..errors import InputError
from ..fem.laws import LAWS
from .coupon import isochoric_stress

# Exponents of Ogden terms are looked for between these.
EXPONENTS = (-15.0, 25.0)


@attrs.frozen
class Form:
    """A law in the form that is fitted: stress = sum over k of factor_k times a term of the stretches.

    names: parameters that are fitted. exponents: number of Ogden terms, each with a free exponent alpha_p and
    a factor c_p = mu_p alpha_p/2, its share of the shear modulus; 0 for a law whose terms are fixed. least:
    lower bounds of the factors. Ogden's are kept at c_p >= 0, which is sufficient for stability (Hill 1970;
    Ogden, Non-Linear Elastic Deformations, 1984, section 6.2.6).
    """

    name: str
    title: str
    law: Any
    names: tuple[str, ...]
    least: tuple[float, ...]
    exponents: int = 0

    @property
    def count(self) -> int:
        """Number of parameters that are fitted."""
        return len(self.names)

    def parameters(self, factors: Array, exponents: Array, poisson: float) -> Array:
        """The law's row (count,) of factors (k,) in MPa and exponents (k,), (0,) where terms are fixed.

        kappa, in MPa, follows from Poisson's ratio at small strain.
        """
        row = np.zeros(len(self.law.parameter_names))
        if self.exponents:
            order = np.argsort(-np.asarray(factors), kind="stable")
            # An absent term needs some exponent, which has no effect.
            row[1:6:2] = 1.0
            row[1 : 2 * self.exponents : 2] = exponents[order]
            row[0 : 2 * self.exponents : 2] = 2 * factors[order] / exponents[order]
        else:
            row[: len(factors)] = factors
        return with_bulk(self.law, row, poisson)

    def terms(self, stretches: Array, exponents: Array) -> Array:
        """Nominal stress (n, k) in MPa of every term with a factor of 1 MPa, at principal stretches (n, 3).

        exponents (k,): of the Ogden terms, not used where the terms are fixed. Raises InputError for a law
        that does not split the volume off.
        """
        k = len(exponents) if self.exponents else len(self.least)
        rows = np.zeros((k, len(self.law.parameter_names)))
        if self.exponents:
            rows[:, 1:6:2] = 1.0
            rows[:, 1] = exponents
            rows[:, 0] = 2 / np.asarray(exponents)
        else:
            rows[:, :k] = np.eye(k)
        n = len(stretches)
        return (
            isochoric_stress(self.law, np.repeat(rows, n, axis=0), np.tile(stretches, (k, 1))).reshape(k, n).T
        )


def with_bulk(law: Any, row: Array, poisson: float) -> Array:
    """A row (count,) with the bulk modulus that follows from Poisson's ratio; row (count,) is not changed.

    kappa = 2 mu (1 + nu)/(3 (1 - 2 nu)) in MPa, for a law that splits the volume off.
    """
    row = np.array(row, float)
    mu = abs(law.small_strain(row[None])[0, 0])
    row[law.bulk] = 2 * mu * (1 + poisson) / (3 * (1 - 2 * poisson))
    return row


def _forms(law: Any) -> list[Form]:
    """The forms in which a law can be fitted: of Ogden's, one for each number of terms."""
    key = law.name.lower()
    if not law.terms:
        names, least = zip(*law.fitted, strict=True) if law.fitted else ((), ())
        bounds = tuple(-np.inf if low is None else low for low in least)
        return [Form(key, law.name, law, names, bounds)] if names else []
    return [
        Form(
            f"{key}-{n}",
            f"{law.name}, {n} term{'s' if n > 1 else ''}",
            law,
            law.parameter_names[: 2 * n],
            (0.0,) * n,
            n,
        )
        for n in range(1, law.terms + 1)
    ]


_FOUND = {form.name: form for law in LAWS.values() for form in _forms(law)}
FORMS = {name: _FOUND[name] for name in form_names()}


def form(name: str) -> Form:
    """The form of this name. Raises InputError, which lists the valid names."""
    if name not in FORMS:
        raise InputError(f"unknown law {name!r}", "laws", f"choose from {', '.join(FORMS)}")
    return FORMS[name]
