"""What coincides is told: a cause of the same tests as a specimen, a height or a change is not alone."""

import attrs
import numpy as np

from mu_addon.diagnose.words import sentence, to_do
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import FORCE_SCALE, offered
from mu_addon.evidence.effects.declaration import Data
from mu_addon.evidence.effects.gravity import DENSITY
from mu_addon.evidence.effects.rate_independent_hysteresis import _borne_by_one
from mu_addon.evidence.effects.self_heating import strain_rate
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.found_causes import Selection
from mu_addon.evidence.noise import Source
from mu_addon.evidence.owned import coincident_effects, owned_effects
from mu_addon.evidence.plausibility import value_at_a_bound
from mu_addon.evidence.pooled import pooled_effects
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.pressure_hold import ChamberPressure
from mu_addon.evidence.record import record
from mu_addon.evidence.rivals import causes_of, with_promising_rivals
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment

T = np.linspace(0.0, 60.0, 100)


def pressed(axis="z", modulus=40.0, name="block", seconds=60.0, noise=0.02, seed=0, **fields):
    strain = 0.15 * T / 60.0
    stress = modulus * strain + noise * np.random.default_rng(seed).normal(size=len(T))
    columns = {"time_s": T * seconds / 60.0, "strain": strain, "stress_kPa": stress}
    return experiment(
        "lattice_compression",
        columns,
        name,
        axis=axis,
        section_mm=(30.0, 30.0),
        length_mm=30.0,
        **fields,
    )


def titles(found):
    return {c.effect.title for c in found.selection.causes} | {
        r for c in found.selection.causes for r in c.rivals
    }


def test_one_block_a_direction_does_not_tell_direction_from_specimen():
    made = [
        pressed(name="b0", specimen="S0", seed=1),
        pressed("x", 37.0, "b1", specimen="S1", seed=2),
        pressed(name="b2", specimen="S2", seed=3),
    ]
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind == "ambiguous"
    assert {"anisotropy", "geometry_as_typed of specimen S1", "batch_variation of specimen S1"} <= titles(
        found
    )
    assert "calliper" in found.proposal.what or "clamped again" in found.proposal.what
    assert "model is wrong" not in sentence(found)[1]


def test_fast_tests_that_are_the_soft_ones_are_told_by_their_rate():
    made = [
        pressed(name=f"b{i}", modulus=38.0 if fast else 40.0, seconds=6.0 if fast else 60.0, specimen="S",
                   seed=i)
        for i, fast in enumerate([False, True, False, True, False, True])
    ]  # fmt: skip
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind in ("named", "ambiguous")
    assert any(t.startswith("self_heating of tests at ") for t in titles(found))


def test_a_scale_of_force_is_called_by_what_can_differ_so():
    cell = "the force is scaled: load cell, clamping or a mix-up of specimens"
    every = "the force is scaled: load cell, section as typed, clamping or specimen"
    made = [
        pressed(name="a", specimen="S0"),
        pressed(name="b", specimen="S0"),
        pressed(name="c", specimen="S1"),
    ]
    scales = [e for e in Composite(bench_simulators(made)).effects if e.name == FORCE_SCALE]
    assert len(scales) == 1
    found = {e.whose: e.mechanism for e in owned_effects(scales, made) if e.name == FORCE_SCALE}
    assert found == {"experiment a": cell, "experiment b": cell, "experiment c": every}
    (among,) = (e for e in pooled_effects(scales, made) if e.name == FORCE_SCALE)
    assert (among.among, among.mechanism) == ("experiment", cell)
    apart = [pressed(name=n, specimen=n, session=n) for n in "abc"]
    (among,) = (e for e in pooled_effects(scales, apart) if e.name == FORCE_SCALE)
    assert among.mechanism == every
    alone = [pressed(name=n, specimen="S") for n in "abc"]
    (among,) = (e for e in pooled_effects(scales, alone) if e.name == FORCE_SCALE)
    assert among.mechanism == "the force is scaled: load cell or clamping"


def test_one_scaled_test_of_a_specimen_is_no_matter_of_its_section():
    made = [pressed(name=f"b{i}", modulus=44.0 if i == 2 else 40.0, specimen="S", seed=i) for i in range(5)]
    found = diagnose(made, Composite(bench_simulators(made)))
    assert "force scale (load cell or clamping) of experiment b2" in sentence(found)[0]
    # And where each test has its own specimen it may be.
    made = [attrs.evolve(e, specimen=e.name) for e in made]
    found = diagnose(made, Composite(bench_simulators(made)))
    assert "batch_variation of specimen b2" in titles(found)


def test_causes_that_are_not_accepted_have_their_rivals_too():
    """A softer block along x, between faces that close: its direction may as well be its batch or height."""
    plain = [
        pressed(name="b0", specimen="S0", seed=1),
        pressed("x", 40.0, "b1", specimen="S1", seed=2),
        pressed(name="b2", specimen="S2", seed=3),
    ]
    model = Composite(bench_simulators(plain))
    hidden = {"anisotropy.in_plane": -0.08, "seating.gap_mm": 0.3}
    made = [
        attrs.evolve(
            e,
            columns={
                **e.columns,
                "stress_kPa": model.predict(e, hidden)[0] + 0.02 * np.random.default_rng(i).normal(size=100),
            },
        )
        for i, e in enumerate(plain)
    ]
    model = Composite(bench_simulators(made))
    data = record(made, model)
    fitter = Fitter(data, model, {g: Source(0.02, 1e-6, 1.0) for g in data.groups})
    base = fitter.fit()
    offered = [*model.effects, *owned_effects(model.effects, made)]
    chosen = fitter.best(
        [e for e in model.effects if e.name in ("anisotropy", "seating")], [{**base.values, **hidden}]
    )
    assert chosen.names == ("anisotropy", "seating")
    singles = tuple(fitter.best([e], [{**base.values, **s} for s in e.starts()]) for e in offered)
    causes = causes_of(fitter, offered, base, chosen, [0.0, 0.0], [singles], accepted=False)
    assert all(not c.rivals for c in causes)
    found = with_promising_rivals(fitter, Selection(base, chosen, causes, singles, (), (), 0.0))
    rivals = {c.effect.name: c.rivals for c in found.causes}
    assert {"batch_variation of specimen S1", "geometry_as_typed of specimen S1"} <= set(rivals["anisotropy"])


def test_groups_are_heights_changes_and_rates():
    made = [
        pressed(name="a", specimen="S0"),
        pressed(name="b", specimen="S1", seconds=6.0),
        pressed(name="c", specimen="S1"),
    ]
    groups = {(e.name, e.whose): set(names) for e, names in coincident_effects(made).items()}
    assert groups == {
        ("geometry_as_typed", "specimen S0"): {"a"},
        ("geometry_as_typed", "specimen S1"): {"b", "c"},
        ("step_change", "tests from b on"): {"b", "c"},
        ("step_change", "tests from c on"): {"c"},
        ("self_heating", "tests at 2.5 %/s or faster"): {"b"},
    }
    np.testing.assert_allclose(10.0 * strain_rate(made[0]), strain_rate(made[1]))


def test_a_height_scales_the_strain_of_its_specimen_alone():
    made = [pressed(name="a", specimen="S0"), pressed(name="b", specimen="S1")]
    model = Composite(bench_simulators(made))
    plain = {"lattice_modulus_kPa": 40.0}
    typed = {**plain, "geometry_as_typed.height of specimen S1": 0.25}
    np.testing.assert_array_equal(model.predict(made[0], typed), model.predict(made[0], plain))
    np.testing.assert_allclose(1.25 * model.predict(made[1], typed), model.predict(made[1], plain))


def test_a_gauge_is_not_off_by_a_fifth_of_what_it_reads():
    made = [experiment("pressure_hold", {"time_s": T, "pressure_kPa": 35.0 + 0.0 * T})]
    (offset,) = (
        e for e in offered(Data(kind="pressure_hold", experiments=made)) if e.name == "pressure_offset"
    )
    assert (offset.parameters[0].low, offset.parameters[0].high) == (-3.5, 3.5)


def test_a_density_that_no_resin_has_is_no_cause():
    assert value_at_a_bound(DENSITY, 3710.0)
    assert not value_at_a_bound(DENSITY, 1070.0)


def test_gas_warms_with_its_room_as_logged_or_as_fitted():
    log = 20.0 + 3.0 * T / 60.0
    plain = experiment("pressure_hold", {"time_s": 60.0 * T, "pressure_kPa": 100.0 + 0.0 * T})
    logged = attrs.evolve(plain, columns={**plain.columns, "room_C": log})
    model = ChamberPressure([plain])
    by_log = model.predict(logged, {})[0]
    np.testing.assert_allclose(by_log + 101.325, 201.325 * (1.0 + (log - 20.0) / 296.0))
    by_rate = model.predict(plain, {"temperature_drift.room_K_per_hour": 3.0})[0]
    np.testing.assert_allclose(by_rate, by_log)


def test_one_element_that_yields_unloads_elastically_and_ends():
    x = np.array([0.0, 1.0, 1.0, 0.5, -0.2, -4.0, -3.9])
    z = _borne_by_one(x.tobytes(), 1.0)
    # First loading of power 1 is 1 - exp(-x).
    first = 1.0 - np.exp(-1.0)
    back = first - 0.5
    np.testing.assert_allclose(z[:4], [0.0, first, first, back], atol=1e-5)
    np.testing.assert_allclose(z[5], -(1.0 - np.exp(-(4.0 + 1.0 - first))), atol=1e-4)
    np.testing.assert_allclose(z[6] - z[5], 0.1, atol=1e-4)


def test_what_is_not_explained_says_how_far_the_model_misses():
    strain = T / 60.0
    made = [pressed(name="a", specimen="S", seed=1)]
    stress = made[0]["stress_kPa"] + 1.5 * np.sin(9.0 * strain)
    made = [attrs.evolve(made[0], columns={**made[0].columns, "stress_kPa": stress})]
    found = diagnose(made, Composite(bench_simulators(made)))
    assert found.kind == "unexplained"
    _, words = sentence(found)
    assert "kPa, and no effect of the library explains that" in words
    assert "Do not trust the simulation to better than" in to_do(found)
