"""Parameters of a unit's design that nobody measured, fitted beside every cause."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.drawn import Designs, Surface
from mu_addon.evidence.effect import Parameter
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic

WALL = Parameter("wall_mm", "mm", 0.4, 1.0, 0.9)
CELLS = Parameter("cells_y_plus", "", 2.0, 4.0, 2.0)
BOTH = (WALL, CELLS)


def grown(wall, cells):
    """Factor on every bend of the analytic unit."""
    return 0.9 / wall * (1.0 + 0.1 * (cells - 2.0))


def surface(response, walls=(0.4, 0.6, 0.75, 0.9, 1.0), cells=(2.0, 3.0, 4.0)):
    at = np.array([(w, c) for w in walls for c in cells])
    rest = response.values[:, [int(np.argmin(np.abs(response.pressures_kPa)))]]
    values = [rest + grown(*place) * (response.values - rest) for place in at]
    return Surface(BOTH, at, np.array(values))


@given(st.floats(0.4, 1.0), st.floats(2.0, 4.0))
@settings(max_examples=20, deadline=None)
def test_a_plane_is_found_again_between_designs_and_from_all_but_one(wall, cells):
    rng = np.random.default_rng(1)
    at = np.array([(w, c) for w in (0.4, 0.7, 1.0) for c in (2.0, 3.0, 4.0)])
    slope = rng.normal(size=(2, 3, 5))
    plane = Surface(BOTH, at, np.einsum("nd,dck->nck", at, slope))
    found = plane.of({"wall_mm": wall, "cells_y_plus": cells})
    wanted = np.einsum("d,dck->ck", np.array([wall, cells]), slope)
    assert found is None or np.allclose(found, wanted, atol=1e-9)
    assert np.nanmax(np.abs(plane.errors)) < 1e-9


def test_a_surface_goes_through_its_designs_and_is_none_at_the_null():
    response = analytic.response()
    drawn = surface(response)
    for place, values in zip(drawn.at.tolist(), drawn.values, strict=True):
        found = drawn.of(dict(zip(("wall_mm", "cells_y_plus"), place, strict=True)))
        if found is None:
            assert place == [0.9, 2.0]
            found = response.values
        np.testing.assert_allclose(found, values, atol=1e-8)


def test_a_design_without_which_the_others_lie_in_a_plane_tells_no_error():
    # Of the paper's unknown shape: rounding hides that the others, in five dimensions, lie in a plane.
    ranges = ((0.4, 0.9), (9.0, 16.0), (0.4, 0.8), (2.0, 4.0), (3.0, 5.0))
    parameters = tuple(Parameter(f"p{i}", "", *ends, ends[0]) for i, ends in enumerate(ranges))
    centre, outer = (0.65, 12.5, 0.6, 3.0, 5.0), ((0.4, 9.0, 0.4, 2.0, 3.0), (0.4, 9.0, 0.4, 4.0, 5.0))
    thick = ((0.9, 9.0, 0.8, 2.0, 5.0), (0.9, 9.0, 0.8, 4.0, 3.0), (0.9, 16.0, 0.4, 2.0, 5.0))
    at = np.array([(0.9, 12.5, 0.6, 2.0, 3.0), centre, *outer, *thick])
    values = np.random.default_rng(2).normal(size=(len(at), 1, 3))
    found = Surface(parameters, at, values).errors
    assert np.flatnonzero(np.isnan(found).any(axis=(1, 2))).tolist() == [1, 4]
    assert np.nanmax(np.abs(found)) < 100.0


def test_too_few_designs_are_refused():
    unit = load_preset("mu-1.0x")
    with pytest.raises(InputError, match="too few"):
        Designs(BOTH, ((0.9, 2.0), (0.4, 2.0)), (unit, unit))


def test_a_thinner_wall_than_drawn_is_fitted_and_no_cause_named_for_it():
    hidden = {"wall_mm": 0.6, "cells_y_plus": 3.0}
    response = analytic.response()
    drawn = attrs.evolve(response, drawn=surface(response))
    rng = np.random.default_rng(4)
    experiments = []
    for name, t, p, how in analytic.protocols(0.4, 3):
        seen = {c: np.zeros(len(t)) for c in analytic.CHANNELS}
        e = analytic.experiment(name, t, p, seen, **how)
        y = UnitPressure([drawn], [e]).predict(e, hidden)
        noise = np.where(np.array(analytic.CHANNELS) == "angle_deg", 0.1, 0.03)[:, None]
        noisy = y + noise * rng.normal(size=y.shape)
        columns = {**e.columns, **dict(zip(analytic.CHANNELS, noisy, strict=True))}
        experiments.append(attrs.evolve(e, columns=columns))
    found = diagnose(experiments, Composite({"unit_pressure": UnitPressure([drawn], experiments)}))
    values = found.selection.base.values
    assert found.kind == "none"
    assert found.names == ()
    # Cells make all bends larger, as a thinner wall does: the two are known by their product.
    assert grown(values["wall_mm"], values["cells_y_plus"]) / values["modulus_factor"] == pytest.approx(
        grown(0.6, 3.0), rel=0.02
    )
    without = Composite({"unit_pressure": UnitPressure([response], experiments)})
    as_drawn = Fitter(record(experiments, without), without, found.sources).fit()
    assert as_drawn.chi2 > found.selection.base.chi2 + 100.0


def test_what_an_effect_changes_grows_with_the_range_of_the_unit():
    response = analytic.response()
    drawn = attrs.evolve(response, drawn=surface(response))
    at, sizes = np.array([20.0]), {"overcure": 0.1}
    change = drawn.at(at, sizes)[0] - drawn.at(at, {})[0]
    thin = {"wall_mm": 0.6, "cells_y_plus": 2.0}
    changed = drawn.at(at, sizes | thin)[0] - drawn.at(at, thin)[0]
    assert changed == pytest.approx(1.5 * change, rel=1e-6)
