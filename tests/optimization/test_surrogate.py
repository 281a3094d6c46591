"""The surrogate: through values and slopes, better by slopes, and silent where a slope is not known."""

import numpy as np
import pytest

from mu_addon.optimization.surrogate import Surrogate


def bowl(x):
    return np.sin(3 * x[:, 0]) + x[:, 1] ** 2 - x[:, 0] * x[:, 1]


def slopes(x):
    return np.column_stack([3 * np.cos(3 * x[:, 0]) - x[:, 1], 2 * x[:, 1] - x[:, 0]])


X = np.random.default_rng(3).random((6, 2))
AT = np.random.default_rng(4).random((200, 2))


def test_it_goes_through_values_and_slopes():
    model = Surrogate.of(X, bowl(X), slopes(X))
    np.testing.assert_allclose(model.mean(X), bowl(X), atol=1e-4)
    step = 1e-4
    for axis in range(2):
        moved = step * np.eye(2)[axis]
        found = (model.mean(X + moved) - model.mean(X - moved)) / (2 * step)
        np.testing.assert_allclose(found, slopes(X)[:, axis], atol=2e-3)


def test_slopes_tell_as_much_as_further_values():
    with_, without = (Surrogate.of(X, bowl(X), g) for g in (slopes(X), np.full((len(X), 2), np.nan)))
    errors = [np.abs(m.mean(AT) - bowl(AT)).max() for m in (with_, without)]
    assert errors[0] < 0.05
    assert errors[0] < 0.2 * errors[1]


def test_equal_values_are_continued_as_they_are():
    model = Surrogate.of(X, np.full(len(X), 2.5), np.zeros((len(X), 2)))
    assert model.mean(AT) == pytest.approx(np.full(len(AT), 2.5))
