"""When a fit from another start may end before its minimum."""

import numpy as np
import pytest

from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment

KIND, STOP, SLOPE = "lattice_compression", "contact.reach_mm", "overcure.offset_mm"


class Stopped:
    """A force in proportion to the strain, up to a wall."""

    nuisances = ()
    effects = tuple(
        Effect(key.partition(".")[0], (Parameter(key.partition(".")[2], "mm", 0.0, 20.0, null),), (KIND,))
        for key, null in ((STOP, 20.0), (SLOPE, 1.0))
    )

    def channels(self, experiment):
        return ("stress_kPa",)

    def predict(self, experiment, values):
        free = values.get(SLOPE, 1.0) * experiment["strain"]
        return np.minimum(free, values.get(STOP, 20.0))[None]


@pytest.fixture
def fitter():
    """To a force that stops at 5, with a wave that no parameter takes."""
    strain = np.linspace(0.0, 10.0, 101)
    force = np.minimum(strain, 5.0) + 0.2 * np.sin(20.0 * strain)
    model = Composite({KIND: Stopped()})
    data = record([experiment(KIND, {"strain": strain, "stress_kPa": force})], model)
    return Fitter(data, model, dict.fromkeys(data.groups, Source(0.05, 1e-6, 1.0)))


def ended(fitter, key, start, reached):
    """Predictions of a fit from a start, and the fit."""
    effect = next(e for e in fitter.simulator.effects if e.keys == (key,))
    before = fitter.simulator.calls
    found = fitter.fit([effect], {key: start}, reached=reached)
    return fitter.simulator.calls - before, found


def test_a_wall_far_from_where_it_stands_is_not_given_up(fitter):
    """Its first step leaves several times what was reached, which is twice what it ends with."""
    _, whole = ended(fitter, STOP, 1.0, np.inf)
    _, found = ended(fitter, STOP, 1.0, 2.0 * whole.chi2)
    assert found.values[STOP] == pytest.approx(whole.values[STOP], abs=0.1)


def test_a_minimum_that_is_reached_already_is_not_sought_again(fitter):
    """Its start and one derivative tell."""
    _, whole = ended(fitter, SLOPE, 0.2, np.inf)
    predictions, found = ended(fitter, SLOPE, 1.9, whole.chi2)
    assert predictions == 2
    assert found.chi2 > whole.chi2 > len(fitter.record)
