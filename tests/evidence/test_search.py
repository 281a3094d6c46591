"""Effects found one after the other, and what a renewed noise lets be seen."""

import math

import attrs
import numpy as np
import pytest

from mu_addon.evidence.detection_limits import LEFT, with_true_limits
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.gain_on_unseen import gain
from mu_addon.evidence.hypotheses import beside, hypotheses, ranked
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.record import record
from mu_addon.evidence.residual_tests.table import dependence_table, strict_table, structure
from mu_addon.evidence.search import one_more, reselected, select
from mu_addon.evidence.sensitivity import SEEN, best_seen, sensitivities
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import experiment

RUBBING = {"rate_independent_hysteresis.share": 0.25, "rate_independent_hysteresis.threshold_kPa": 3.0}
HEAVY = {"gravity.density_kg_m3": 150.0}


def fitter_of(values, noise=1.0, seed=0):
    """A fitter of a bench whose noise is believed to be so many times what it is."""
    made = analytic.measured(np.random.default_rng(seed), {"modulus_factor": 1.05} | values, dt=0.4, count=5)
    model = analytic.simulator(made)
    data = record(made, model)
    level = {"unit_pressure angle": 0.3, "unit_pressure marker": 0.1}
    sources = {
        g: Source(noise * v * math.sqrt(0.3), noise * v * math.sqrt(0.7), -0.4 / math.log(0.9))
        for g, v in level.items()
    }
    return Fitter(data, model, sources)


def few(fitter, *names):
    """What those effects do to the data."""
    seen = sensitivities(fitter, {"modulus_factor": 1.05})
    return [s for s in seen if s.effect.name in names]


LIBRARY = ("rate_independent_hysteresis", "gravity", "overcure", "pressure_offset")


@pytest.mark.parametrize(
    ("hidden", "found"),
    [
        (RUBBING | HEAVY, {"rate_independent_hysteresis", "gravity"}),
        (RUBBING, {"rate_independent_hysteresis"}),
    ],
    ids=["a second effect", "no second effect"],
)
def test_what_a_smaller_noise_shows_is_looked_for_and_nothing_else(hidden, found):
    loud, quiet = fitter_of(hidden, noise=15.0), fitter_of(hidden)
    before = select(loud, few(loud, *LIBRARY))
    assert before.chosen.names == ("rate_independent_hysteresis",)
    seen = few(quiet, *LIBRARY)
    again = reselected(quiet, seen, before)
    assert bool(again.left) == (len(found) > 1)
    after = one_more(quiet, seen, again)
    assert set(after.chosen.names) == found
    assert not after.left
    assert {c.effect.name for c in after.causes} == found


def test_an_effect_that_leaves_structure_is_not_added():
    quiet = fitter_of(RUBBING | {"gravity.density_kg_m3": 300.0})
    seen = few(quiet, "rate_independent_hysteresis", "pressure_offset")
    base = select(quiet, few(quiet, "rate_independent_hysteresis"))
    assert base.left
    assert one_more(quiet, seen, base) is base


def test_the_base_model_s_table_shows_what_the_data_depend_on():
    """By the noise that is believed: estimated from the residual itself it would hide nearly all of it."""
    fitter = fitter_of(RUBBING)
    found = select(fitter, few(fitter, "rate_independent_hysteresis", "overcure"))
    assert found.chosen.names == ("rate_independent_hysteresis",)
    assert "loading_direction" in structure(found.table_base)
    assert not structure(found.table)
    clean = fitter_of({})
    none = select(clean, few(clean, "rate_independent_hysteresis", "overcure"))
    assert not structure(none.table_base)


def test_strict_tests_doubt_what_a_slower_noise_would_do():
    """Noise five times as slow as is believed looks like structure; re-estimated, it does not."""
    made = analytic.measured(np.random.default_rng(3), {}, dt=0.4, count=4, rho=0.98, slow_share=0.9)
    model = analytic.simulator(made)
    data = record(made, model)
    wrong = {g: Source(s, s, 1.0) for g, s in zip(data.groups, (0.2, 0.07), strict=True)}
    fitter = Fitter(data, model, wrong)
    base = fitter.fit()
    fitted = {"pressure", "time", "loading_direction", "pressure_rate", "cycle", "largest_angle"}
    plain, strict = (structure(t(fitter, base)) for t in (dependence_table, strict_table))
    assert fitted & set(plain)
    assert not fitted & set(strict)


def test_a_chamber_that_bends_otherwise_is_what_the_residual_depends_on():
    """The third of six is weaker: markers beyond it answer more than the one before."""
    weaker = fitter_of({"clogged_chamber.share_lost": 0.2})
    found = min(dependence_table(weaker, weaker.fit()), key=lambda d: d.p_value)
    assert found.against == "chamber"
    assert found.p_value < 1e-10
    assert found.where == "marker1, 2 chambers from the inlet"
    clean = fitter_of({})
    alike = {d.against: d for d in dependence_table(clean, clean.fit())}
    assert alike["chamber"].p_value > 0.01


def test_an_angle_that_is_read_too_far_where_it_is_large_depends_on_the_angle():
    """By the angle as predicted: as read, it shares its noise with what is left."""
    clean = fitter_of({})
    table = {d.against: d for d in dependence_table(clean, clean.fit())}
    assert table["angle"].p_value > 0.01
    wrong = []
    for e in clean.record.experiments:
        angle = e["angle_deg"]
        wrong.append(attrs.evolve(e, columns=e.columns | {"angle_deg": angle + 2.0 * (angle / 30.0) ** 3}))
    model = analytic.simulator(wrong)
    misread = Fitter(record(wrong, model), model, clean.sources)
    found = {d.against: d for d in dependence_table(misread, misread.fit())}["angle"]
    assert found.p_value < 1e-6


@pytest.mark.nightly(
    "tests/evidence/test_marker_slip.py::test_a_slip_of_a_third_of_a_millimetre_is_named_with_size_way_and_moment"
)
def test_a_marker_glued_anew_between_two_experiments_is_a_jump():
    """Within each experiment it keeps still; all share one zero."""
    clean = fitter_of({})
    assert {d.against: d for d in dependence_table(clean, clean.fit())}["jump"].p_value > 0.01
    moved = [
        attrs.evolve(e, columns=e.columns | {"marker2_y_mm": e["marker2_y_mm"] + 0.3 * (i > 1)})
        for i, e in enumerate(clean.record.experiments)
    ]
    model = analytic.simulator(moved)
    found = Fitter(record(moved, model), model, clean.sources)
    (jump,) = (d for d in strict_table(found, found.fit()) if d.against == "jump")
    assert jump.p_value < 1e-6
    assert jump.where == f"marker2_y_mm, from {moved[2].name} on"
    assert diagnose(moved, model).kind == "unexplained"


def test_a_modulus_at_its_bound_hides_nothing_more():
    """A gauge's gain is absorbed by the modulus as long as that may move, and no longer."""
    fitter = fitter_of({})
    low = next(p.low for p in fitter.curved if p.name == "modulus_factor")
    for modulus, hidden in ((1.05, True), (low, False)):
        seen = sensitivities(fitter, {"modulus_factor": modulus})
        gain_of_gauge = next(s for s in seen if s.effect.name == "pressure_gain")
        assert (gain_of_gauge.unabsorbed < 1e-3) is hidden


def test_a_record_that_is_never_at_rest_has_no_chambers():
    fitter = fitter_of({})
    moving = [
        attrs.evolve(e, columns=e.columns | {"pressure_kPa": e["pressure_kPa"] + 20.0})
        for e in fitter.record.experiments
    ]
    model = analytic.simulator(moving)
    again = Fitter(record(moving, model), model, fitter.sources)
    assert "chamber" not in {d.against for d in dependence_table(again, again.fit())}


@pytest.fixture(scope="module")
def both_kinds():
    """A dead load beside the unit: its sag comes first by name, and no friction of the unit changes it."""
    made = analytic.measured(np.random.default_rng(0), RUBBING, dt=0.4, count=3)
    mass = np.arange(0.0, 60.0, 10.0)
    sag = 0.4 * mass + np.random.default_rng(1).normal(0.0, 0.05, len(mass))
    load = experiment("beam_deadweight", {"added_mass_g": mass, "tip_deflection_mm": sag}, "load")
    held = [attrs.evolve(e, name=f"{e.name}, later", role="held_out") for e in (made[0], load)]
    simulators = {
        "unit_pressure": UnitPressure([analytic.response()], made),
        "beam_deadweight": analytic.DeadLoad(),
    }
    model = Composite(simulators)
    data = record([*made, load], model)
    level = {"beam_deadweight tip": 0.05, "unit_pressure angle": 0.3, "unit_pressure marker": 0.1}
    sources = {g: Source(level.get(g, 0.05), 1e-3, 1.0) for g in data.groups}
    return Fitter(data, model, sources), held


def test_a_gain_is_told_of_every_quantity_and_first_of_one_that_changed(both_kinds):
    fitter, held = both_kinds
    rubbing = next(e for e in fitter.simulator.effects if e.name == "rate_independent_hysteresis")
    base, extended = fitter.fit(), fitter.best([rubbing], list(rubbing.starts()))
    assert fitter.record.groups[0].startswith("beam_deadweight")
    found = gain(fitter, base, extended, held)
    assert found.fit.unit == found.held_out.unit == "deg"
    assert set(found.by_quantity) == set(fitter.record.groups)
    for name, (fit, unseen) in found.by_quantity.items():
        if name.startswith("unit_pressure"):
            assert fit.after < 0.9 * fit.before
            assert unseen.after < 0.9 * unseen.before
    sag = found.by_quantity[fitter.record.groups[0]][1]
    assert sag.unit == "mm"
    assert sag.after == pytest.approx(0.05, rel=0.5)
    written = found.as_json()
    assert written["by_quantity"]["unit_pressure angle"]["held_out"] == written["held_out"]
    # A kind of which nothing was held out has no error there.
    alone = gain(fitter, base, extended, held[1:])
    assert alone.by_quantity["unit_pressure angle"][1] is None
    assert alone.held_out == alone.by_quantity[fitter.record.groups[0]][1]


def test_a_pair_is_fitted_once_from_whichever_effect_it_begins():
    fitter = fitter_of(RUBBING | HEAVY)
    effects = [s.effect for s in few(fitter, *LIBRARY)]
    base = fitter.fit()
    first, second = ranked(beside(fitter, (), e, base.values) for e in effects)[:2]
    tried = []
    pool = hypotheses(fitter, [first], effects, tried.append)
    once = len(tried)
    assert once == len(pool) > 1
    again = hypotheses(fitter, [second], effects, tried.append, known=pool)
    pairs = [frozenset(f.names) for f in again]
    assert len(pairs) == len(set(pairs)) == len(tried)
    assert {id(f) for f in pool} <= {id(f) for f in again}
    # What promises less than half of the way to the best pair is left alone.
    alone = hypotheses(fitter, [second], effects)
    assert len(tried) - once < len(alone)


def test_data_made_with_an_effect_of_its_limit_are_missed_by_the_base_model():
    """Other values follow a large effect further than to first order: noisy data, large limits."""
    fitter = fitter_of({}, noise=30.0)
    values = {p.name: fitter.fit().values[p.name] for p in fitter.curved}
    before = sensitivities(fitter, values)
    after = best_seen(with_true_limits(fitter, values, before))
    raised = [name for name, s in best_seen(before).items() if after[name].limit > s.limit]
    assert "contact" in raised
    for name in [*raised, "wall_thickness", "viscoelasticity"]:
        s = after[name]
        p = s.effect.parameters[0]
        for size in (p.null - s.limit, p.null + s.limit):
            if p.low <= size <= p.high:
                made = fitter.predict({**values, **s.shape, s.effect.keys[0]: size})
                imagined = attrs.evolve(fitter.record, values=made)
                assert Fitter(imagined, fitter.simulator, fitter.sources).fit().chi2 > LEFT * SEEN**2 * 0.99
