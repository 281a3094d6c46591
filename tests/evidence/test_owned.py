"""What one specimen or one experiment has and the others have not; data made by formulas of their own."""

import attrs
import numpy as np
import pytest

from mu_addon.diagnose.words import sentence
from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.extended import extended_model
from mu_addon.evidence.owned import owned_effects
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment
from tests.evidence.test_instruments import judged, noise

CLOCK = np.arange(0.0, 300.0, 2.0)


def chambers(leaks, seed=0, again=1):
    """Holds of chambers A, B, ..., each emptying by its share a second: the laminar law, stepped through."""
    rng = np.random.default_rng(seed)
    found = []
    for i, loss in enumerate(leaks):
        for k in range(again):
            p, course = 50.0 + 2.0 * k, []
            for _ in CLOCK:
                course.append(p)
                for _ in range(200):
                    p -= 0.01 * loss * p * (p + 202.65) / 202.65
            read = np.array(course) + noise(rng, 0.05, len(CLOCK))
            found.append(
                experiment(
                    "pressure_hold",
                    {"time_s": CLOCK, "pressure_kPa": read},
                    f"hold {i}{'abc'[k]}",
                    specimen="ABCDEF"[i],
                )
            )
    return found


@pytest.mark.parametrize(
    "again", [1, pytest.param(2, marks=pytest.mark.nightly("test_the_one_chamber_that_leaks_is_named"))]
)
def test_the_one_chamber_that_leaks_is_named(again):
    found = judged(chambers([0.0, 1e-3, 0.0], again=again))
    assert (found.kind, found.names) == ("named", ("leak",))
    (cause,) = found.selection.causes
    assert cause.effect.whose == "specimen B"
    assert found.selection.chosen.values["leak.loss_per_s of specimen B"] == pytest.approx(1e-3, rel=0.05)
    written = found.as_json()["causes"][0]
    assert written["of"] == "specimen B"
    assert set(written["parameters"]) == {"loss_per_s", "inertia"}
    headline, words = sentence(found)
    assert headline == "leak of specimen B"
    assert "in specimen B only" in words
    # A simulation is of any specimen.
    assert not extended_model(found).effects


def test_a_leak_of_all_is_nobody_s_own():
    found = judged(chambers([1e-3, 1e-3, 1e-3]))
    assert found.names == ("leak",)
    assert not found.selection.causes[0].effect.whose


@pytest.mark.parametrize(
    ("seeds", "count"),
    [
        (range(1), 3),
        pytest.param(
            range(6),
            5,
            marks=pytest.mark.nightly("test_the_choice_of_a_specimen_names_nothing_in_clean_sets"),
        ),
    ],
)
def test_the_choice_of_a_specimen_names_nothing_in_clean_sets(seeds, count):
    for seed in seeds:
        assert judged(chambers([0.0] * count, seed=seed)).kind == "none"


@pytest.mark.nightly("test_a_leak_of_all_is_nobody_s_own")
def test_a_gauge_that_slipped_in_one_hold_is_no_effect_of_its_specimen():
    """At one moment: neither a leak nor a drift."""
    made = chambers([0.0, 0.0, 0.0])
    slipped = made[1]["pressure_kPa"] - 1.5 * (CLOCK > 130.0)
    made[1] = attrs.evolve(made[1], columns=made[1].columns | {"pressure_kPa": slipped})
    assert judged(made).kind == "unexplained"


def strips(moduli, seed=0):
    """Neo-Hookean strips, one a specimen, pulled and let go."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 120.0, 0.4)
    strain = 0.4 * (1.0 - np.abs(t / 60.0 - 1.0))
    stretch = 1.0 + strain
    return [
        experiment(
            "coupon",
            {
                "time_s": t,
                "strain": strain,
                "stress_kPa": modulus / 3.0 * (stretch - stretch**-2.0) + noise(rng, 0.3, len(t)),
            },
            f"strip {i}",
            specimen="ABCDEF"[i],
            section_mm=(10.0, 4.0),
            length_mm=30.0,
            mode="uniaxial",
        )
        for i, modulus in enumerate(moduli)
    ]


def test_a_specimen_that_is_softer_is_another_batch_or_at_least_may_be():
    found = judged(strips([1200.0, 1200.0, 1080.0, 1200.0]))
    titles = {c.effect.title for c in found.selection.causes} | {
        r for c in found.selection.causes for r in c.rivals
    }
    assert found.kind in ("named", "ambiguous")
    assert "batch_variation of specimen C" in titles
    # A load cell that was off in its only test does the same.
    cell = {t for t in titles if t.startswith("force_scale of experiment")}
    assert len(cell) < 2
    assert all(title.endswith("of specimen C") for title in titles - cell)


def test_owners_are_specimens_and_for_instruments_experiments():
    size = Parameter("size", "", -1.0, 1.0, 0.0, (0.1,))
    made = chambers([0.0, 0.0], again=2)
    of = {
        name: [
            e.whose
            for e in owned_effects([Effect(name, (size,), ("pressure_hold",))], made)
            if e.name == name
        ]
        for name in ("viscoelasticity", "pressure_drift", "leak", "gravity")
    }
    each = [f"experiment {e.name}" for e in made]
    assert of == {
        "viscoelasticity": ["specimen A", "specimen B"],
        "pressure_drift": each,
        "leak": ["specimen A", "specimen B", *each],
        "gravity": [],
    }
    assert not owned_effects([Effect("leak", (size,), ("pressure_hold",))], made[:1])


def test_a_value_of_one_specimen_moves_its_predictions_alone():
    made = strips([1200.0, 1200.0])
    model = Composite(bench_simulators(made))
    base = {"coupon_modulus_kPa": 1200.0}
    before = [model.predict(e, base) for e in made]
    after = [model.predict(e, {**base, "batch_variation.change of specimen B": 0.1}) for e in made]
    assert after[0] is before[0]
    np.testing.assert_allclose(after[1], 1.1 * before[1])
    stiffer = [
        model.predict(e, {**base, "strain_stiffening.c2_over_c1 of experiment strip 0": 0.1}) for e in made
    ]
    assert stiffer[1] is before[1]
    assert (stiffer[0][0, 1:] > before[0][0, 1:]).any()
