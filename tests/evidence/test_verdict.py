"""Verdicts on benches whose fault is known."""

import json

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose, noise_of
from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.extended import ExtendedModel, Fitted, extended_model, load_model, stacked
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.record import record
from mu_addon.evidence.sensitivity import best_seen, sensitivities, similarity
from mu_addon.evidence.simulator import Composite
from tests.evidence import analytic
from tests.evidence.bench import experiment

BASE = {"modulus_factor": 1.05}


def bench(seed, values=None, **more):
    return analytic.measured(
        np.random.default_rng(seed), BASE | (values or {}), **({"dt": 0.25, "count": 3} | more)
    )


def verdict(made):
    return diagnose(made, analytic.simulator(made))


@pytest.fixture(scope="module")
def lagging():
    made = bench(5, {"rate_independent_hysteresis.share": 0.05}, count=4)
    held = [
        attrs.evolve(e, name=f"{e.name}, later", role="held_out")
        for e in bench(6, {"rate_independent_hysteresis.share": 0.05}, count=3)
    ]
    return made, verdict([*made, *held])


def test_nothing_wrong_is_called_none():
    found = verdict(bench(1))
    assert (found.kind, found.names) == ("none", ())
    assert not found.selection.left
    # What these data cannot show is said all the same, and why.
    assert "modulus" in found.identifiability["pressure_gain"]
    assert "zero" in found.identifiability["angle_offset"]
    assert found.in_question == frozenset()


def test_one_effect_is_named_with_its_size(lagging):
    found = lagging[1]
    assert (found.kind, found.names) == ("named", ("rate_independent_hysteresis",))
    low, high = found.intervals["rate_independent_hysteresis.share"]
    assert low < 0.05 < high
    assert high - low < 0.04
    # What a first look at each effect leaves out is asked for no more than this.
    assert "rate_independent_hysteresis" in found.in_question
    assert "clogged_chamber" not in found.in_question


def test_a_gain_is_measured_where_nothing_was_fitted(lagging):
    gained = lagging[1].gain.held_out
    assert gained.unit == "deg"
    assert gained.after < gained.before
    assert 0.0 < gained.low95 < gained.before - gained.after < gained.high95
    assert gained.after < min(gained.permuted, gained.black_box)


def test_the_file_says_what_the_design_asks(lagging):
    written = json.loads(json.dumps(lagging[1].as_json()))
    assert set(written) == {
        "verdict",
        "causes",
        "partly_explained_by",
        "remaining_structure",
        "gain",
        "residual_table",
        "nearest",
        "next_experiment",
        "identifiability",
    }
    assert set(written["nearest"]) == {"effect", "share"}
    assert written["partly_explained_by"] == []
    cause = written["causes"][0]
    assert set(cause) == {"effect", "mechanism", "parameters", "p_value", "rivals", "share", "of", "among"}
    assert 0.9 < cause["share"] <= 1.0
    assert set(written["remaining_structure"]) == {"detected", "where", "size", "unit"}
    assert set(cause["parameters"]["share"]) == {"value", "low95", "high95"}
    assert {d["against"] for d in written["residual_table"]} >= {"pressure", "loading_direction", "time"}


def test_the_extended_model_comes_back_from_its_file(lagging, tmp_path):
    model = extended_model(lagging[1])
    model.save(tmp_path / "model.toml")
    back = load_model(tmp_path / "model.toml")
    assert back.values == model.values
    assert back.effects == model.effects
    (tmp_path / "model.toml").write_text('verdict = "named"\n[effect.magic.size]\nvalue = 1.0\n')
    with pytest.raises(InputError, match="magic"):
        load_model(tmp_path / "model.toml")


def test_rivals_are_listed_with_an_experiment_between_them():
    made = bench(8, {"line_lag.time_s": 0.01}, count=3)
    found = verdict(made)
    assert found.kind == "ambiguous"
    assert {"line_lag", "clock_offset"} <= found.ambiguity
    assert found.proposal is not None
    assert {"line_lag", "clock_offset"} <= set(found.proposal.separates)


def test_a_gain_of_the_gauge_is_refused_until_a_dead_load_is_added():
    made = bench(9, {"pressure_gain.gain": 0.08})
    found = verdict(made)
    assert "pressure_gain" not in found.ambiguity
    assert "pressure_gain" in found.identifiability
    mass = np.arange(0.0, 110.0, 10.0)
    rng = np.random.default_rng(0)
    sag = 0.4 * mass / BASE["modulus_factor"] + rng.normal(0.0, 0.05, len(mass))
    loads = [
        experiment(
            "beam_deadweight",
            {"added_mass_g": mass, "tip_deflection_mm": sag + rng.normal(0.0, 0.05, len(mass))},
            f"dead load {k}",
        )
        for k in range(2)
    ]
    both = [*made, *loads]
    both_ways = Composite(
        {
            "unit_pressure": UnitPressure([analytic.response()], both),
            "beam_deadweight": analytic.DeadLoad(),
        }
    )
    found = diagnose(both, both_ways)
    assert "pressure_gain" in found.ambiguity
    assert "pressure_gain" not in found.identifiability
    low, high = found.intervals.get("pressure_gain.gain", (0.08, 0.08))
    assert low <= 0.08 <= high


@pytest.mark.parametrize(
    ("gain", "kind", "causes"),
    [
        (0.045, "unidentifiable", set()),
        pytest.param(
            0.2,
            "ambiguous",
            {"pressure_gain", "leak"},
            marks=pytest.mark.nightly("test_a_nuisance_far_from_what_was_known_of_it_is_no_clean_bill"),
        ),
    ],
)
def test_a_nuisance_far_from_what_was_known_of_it_is_no_clean_bill(gain, kind, causes):
    """A modulus known to 3 % is 3.2 and 8.6 spreads off; only the latter is too much for chance.

    Resin that relaxes from its latest onset on fits worse by 9.0 to 9.5 of chi squared, which is the limit.
    """
    made = bench(10, {"pressure_gain.gain": gain})

    class Known(UnitPressure):
        def __init__(self, *args):
            super().__init__(*args)
            first, *zeros = self.nuisances
            self.nuisances = (attrs.evolve(first, spread=0.03), *zeros)

    found = diagnose(made, Composite({"unit_pressure": Known([analytic.response()], made)}))
    assert found.kind == kind
    assert found.ambiguity - {"viscoelasticity"} == causes


BY_NIGHT = pytest.mark.nightly("test_what_does_not_matter_does_not_change_the_verdict")


@pytest.mark.parametrize(
    "change",
    [
        pytest.param("later", marks=BY_NIGHT),
        pytest.param("shuffled", marks=BY_NIGHT),
        "doubled marker",
        pytest.param("every second sample", marks=BY_NIGHT),
    ],
)
def test_what_does_not_matter_does_not_change_the_verdict(lagging, change):
    made, before = lagging
    changed = []
    for e in made:
        columns = dict(e.columns)
        if change == "later":
            columns["time_s"] = columns["time_s"] + 4321.0
        if change == "doubled marker":
            columns |= {f"marker2_{a}_mm": columns[f"marker1_{a}_mm"] for a in "yz"}
        rows = e.rows
        if change == "every second sample":
            columns, rows = {k: v[::2] for k, v in columns.items()}, rows[::2]
        changed.append(attrs.evolve(e, columns=columns, rows=rows))
    if change == "doubled marker":
        # The same with the marker once.
        once = [
            attrs.evolve(e, columns={k: v for k, v in e.columns.items() if "marker2" not in k}) for e in made
        ]
        assert len(record(changed, analytic.simulator(changed))) == len(
            record(once, analytic.simulator(once))
        )
    if change == "shuffled":
        changed = changed[::-1]
    after = verdict(changed)
    assert (after.kind, after.names) == (before.kind, before.names)


def test_signatures_that_nuisances_absorb_are_found_by_projection():
    made = bench(2, count=5)
    model = analytic.simulator(made)
    data = record(made, model)
    seen = best_seen(sensitivities(Fitter(data, model, noise_of(data, model)), BASE))
    assert seen["pressure_gain"].unabsorbed < 1e-5
    assert seen["pressure_gain"].absorbed_by[0] == "modulus_factor"
    assert seen["leak"].unabsorbed < 1e-4
    assert not seen["angle_offset"].identifiable
    assert seen["clogged_chamber"].identifiable
    shown = [s for s in seen.values() if s.identifiable]
    cosines = np.abs(similarity(shown))
    np.testing.assert_allclose(np.diag(cosines), 1.0)
    lag = [s.effect.name for s in shown].index("line_lag")
    alike = [shown[i].effect.name for i in np.argsort(-cosines[lag])[1:3]]
    assert set(alike) == {"clock_offset", "viscoelasticity"}


def test_an_effect_of_other_parameters_elsewhere_is_another_of_its_name():
    made = bench(9)
    one = analytic.simulator(made)
    effect = Effect("leak", (Parameter("loss_per_s", "1/s", 0.0, 0.2, 0.0, (0.01,)),), ("beam_deadweight",))
    gravity = Parameter("density_kg_m3", "kg/m3", 0.0, 4000.0, 0.0, (900.0,), "elastomers")

    class Other(analytic.DeadLoad):
        effects = (effect, Effect("gravity", (gravity,), ("beam_deadweight",)))

    both = Composite({"unit_pressure": UnitPressure([analytic.response()], made), "beam_deadweight": Other()})
    assert [e.name for e in both.effects].count("leak") == 2
    shared = next(e for e in both.effects if e.name == "gravity")
    assert shared.kinds == ("unit_pressure", "beam_deadweight")
    assert (shared.parameters[0].low, shared.parameters[0].high) == (0.0, 2500.0)
    assert len(both.effects) == len(one.effects) + 1


def test_one_mechanism_found_in_two_kinds_keeps_both_sizes(tmp_path):
    """A later diagnosis of another kind of experiment may find a mechanism by parameters of its own."""

    def of(effects):
        return ExtendedModel("named", effects, {})

    share, rate = Fitted(0.3, 0.01, 0.28, 0.32), Fitted(0.02, 0.001, 0.018, 0.022, "1/s")
    before = of({"leak": {"share": share}, "gravity": {"density_kg_m3": Fitted(1e3, 1.0, 998.0, 1002.0)}})
    both = stacked(before, of({"leak": {"loss_per_s": rate}}))
    assert both.effects == {**before.effects, "leak": {"share": share, "loss_per_s": rate}}
    both.save(tmp_path / "model.toml")
    assert load_model(tmp_path / "model.toml").of_effects == both.of_effects
