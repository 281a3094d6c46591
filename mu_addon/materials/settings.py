"""Settings of a fit of laws to coupon tests."""

from __future__ import annotations

from ..design.quantity import described

WEIGHTS = described(
    "weights",
    "absolute",
    "weights of the residuals: absolute divides them by the test's largest stress, relative by the "
    "stress itself",
    choices=("absolute", "relative"),
)
