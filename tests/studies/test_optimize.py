"""An optimisation in its folder: its table and report, resumed without computing again, its refusals."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.optimization import evaluation, read_design, robustness, unit_body
from mu_addon.optimization.design_file import parse_design
from mu_addon.optimization.evaluation import Evaluated, evaluate
from mu_addon.optimization.robust_search import observed
from mu_addon.optimization.robustness import Verified
from mu_addon.optimization.search import Found, Observed
from mu_addon.optimization.words import changes, outcome, reasons, verdict
from mu_addon.studies.optimize import NO_UNIT, Optimize, mechanics_of

from .unit_runs import ended

TEXT = """
format = 1
preset = "mu-1.0x"
evaluations = 7
refine = 0.2
check_refine = 0.3

[[target]]
kind = "angle"
pressure_kPa = 2.5
low = 1.0
tolerance = 0.05

[[target]]
kind = "mass"
objective = "maximise"

[[freedom]]
parameter = "chambers.wall_mm"
low = 0.7
high = 1.3
"""
SMALL = load_preset("mu-1.0x").evolve(count=3)


def design_of(text=TEXT, unit=SMALL):
    return parse_design(text, "design.toml", unit)


@pytest.fixture
def simulated(monkeypatch):
    """Walls in mm of the units that were simulated, by a formula, with the refinement of their mesh."""
    made = []

    def formula(unit, targets, freedoms, mechanics, with_gradient=True, uncertainty=None):
        wall, refine = unit.chambers.wall_mm, mechanics.settings.refine
        made.append((wall, refine))
        values = np.array([(1.9 - wall) * (1.06 - 0.2 * refine), 20.0 * wall])
        slopes = np.array([[0.2 * refine - 1.06], [20.0]])[:, : len(freedoms)]
        scatter = (np.array([0.03, 0.0]), np.array([0.04, 0.0])) if uncertainty else ()
        return Evaluated(values, slopes, "", 1, *scatter)

    monkeypatch.setattr(evaluation, "evaluate", formula)
    monkeypatch.setattr(robustness, "evaluate", formula)
    return made


def started(study, folder, report=True):
    context, messages = ended(study, folder, report)
    assert context.status == 0, messages[-1]
    return context.summary, (folder / "designs.csv").read_text()


@pytest.mark.parametrize("robust", [False, True])
def test_it_is_resumed_with_the_same_digits_and_nothing_computed_twice(robust, simulated, tmp_path):
    study = Optimize(design=design_of(("robust = true\n" if robust else "") + TEXT))
    summary, table = started(study, tmp_path)
    assert len(simulated) == len({*simulated}) + (1 if robust else 0), "only the check's errors are new"
    assert summary["feasible"]
    assert summary["designs"] == len(table.splitlines()) - 1 == summary["model_a"] <= 7
    # The thickest wall that still bends far enough; on the finer mesh only the robust one does.
    (proposal,) = summary["proposed"]
    angle = proposal["values"]["angle at 2.5 kPa"]
    assert angle > 1.1 if robust else angle < 1.0
    assert proposal["robust"] is robust
    assert any("wall_mm" in words for words in proposal["changes"]) is robust
    for name in ("proposed-1.toml", "proposed-1.png", "front.png"):
        assert (tmp_path / name).stat().st_size
    report = (tmp_path / "report.html").read_text()
    assert all(words in report for words in ("Optimisation of", "wall_mm", "Targets and errors", "<img"))

    simulated.clear()
    assert started(Optimize.read(tmp_path), tmp_path, False)[1] == table
    assert simulated == []
    # Killed: some of what was computed is lost, and comes back the same.
    lost = sorted((tmp_path / "cache").glob("units-*.npz"))[::3]
    for path in lost:
        path.unlink()
    again, same = started(Optimize.read(tmp_path), tmp_path, False)
    assert same == table
    assert len(simulated) == len(lost)
    assert again["proposed"] == summary["proposed"]


def test_a_bound_that_moves_makes_no_simulated_unit_stale(simulated, tmp_path):
    started(Optimize(design=design_of()), tmp_path, False)
    first = {*simulated}
    simulated.clear()
    started(Optimize(design=design_of(TEXT.replace("low = 1.0", "low = 0.9"))), tmp_path, False)
    assert simulated
    assert not {(wall, refine) for wall, refine in simulated if refine == 0.2} & first


def test_a_robust_search_judges_by_the_finer_mesh_and_within_its_uncertainty():
    found = Evaluated(np.array([2.0]), np.array([[-3.0]]), "", 1, np.array([0.03]), np.array([0.04]))
    seen = observed((0.9,), found, np.array([0.06]))
    np.testing.assert_allclose(seen.values, 2.12)
    np.testing.assert_allclose(seen.slopes, -3.18)
    np.testing.assert_allclose(seen.margins, 2 * (0.12**2 + 0.05**2) ** 0.5)


@pytest.mark.slow
def test_scatter_of_the_modulus_moves_an_angle_as_a_pressure_does():
    """A modulus 10 % higher bends the unit as a pressure does that is 10 % lower."""
    only_angle = TEXT[: TEXT.index('[[target]]\nkind = "mass"')] + TEXT[TEXT.index("[[freedom]]") :]
    design = design_of("robust = true\n" + only_angle)
    mechanics, _ = mechanics_of(design, None)
    raw = evaluate(SMALL, design.targets, (), mechanics, uncertainty=design.uncertainty)
    lower = design_of(only_angle.replace("pressure_kPa = 2.5", "pressure_kPa = 2.25"))
    less = raw.values[0] - evaluate(SMALL, lower.targets, (), mechanics).values[0]
    assert raw.by_resin[0] == pytest.approx(less, rel=0.05)
    assert raw.by_print[0] > 0


@pytest.mark.slow
def test_a_unit_straight_under_its_weight_is_asked_for_by_an_angle_at_rest():
    text = "orientation_deg = 90\n" + TEXT.replace("pressure_kPa = 2.5", "pressure_kPa = 0")
    level = design_of(text)
    found = evaluate(SMALL, level.targets[:1], level.freedoms, mechanics_of(level, None)[0])
    hanging = mechanics_of(attrs.evolve(level, orientation_deg=0.0), None)[0]
    other = evaluate(SMALL, level.targets[:1], (), hanging)
    # Level, with the side of more lattice up, it sags away from it; hanging its weight bends it less.
    assert found.values[0] < -0.3
    assert abs(other.values[0]) < 0.3 * abs(found.values[0])
    assert np.isfinite(found.gradient[0]).all()


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot read the design"):
        read_design(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="UTF-8"):
        read_design(tmp_path / "bad.toml")


def test_a_design_that_breaks_a_rule_is_a_row_and_not_the_end():
    design = design_of()
    found = Optimize.all_stages()["units"].method(None, (50.0,), 0.2, True, design.simulated, None)
    assert (found.why, found.model_a, found.gradient.shape) == (NO_UNIT, 0, (2, 1))
    assert not observed((50.0,), found, None).sound


def test_a_unit_that_does_not_bear_its_pressure_is_an_answer(monkeypatch):
    # To find the limit point itself takes half a minute.
    soon = attrs.evolve(unit_body.BODY_NEWTON, follow_snaps=False, min_step_MPa=2e-3)
    monkeypatch.setattr(unit_body, "BODY_NEWTON", soon)
    design = design_of(TEXT.replace("pressure_kPa = 2.5", "pressure_kPa = 60"))
    unit = SMALL.evolve(membrane_modulus_kPa=50.0)
    found = evaluate(unit, design.targets, design.freedoms, mechanics_of(design, None)[0])
    assert not found.sound
    assert "no equilibrium" in found.why
    assert np.isnan(found.values).all()


def test_words_say_what_changed_and_what_moved_it():
    d = design_of(TEXT.replace("low = 1.0", "low = 0.6"))
    seen = Observed((0.7,), np.array([6.0, 18.0]), np.array([[-10.0], [5.0]]))
    assert changes(d.freedoms, (0.9,), (0.7,)) == ["chambers.wall_mm: 0.9 to 0.7 mm (its lower bound)"]
    assert reasons(d.freedoms, d.targets, seen, (0.9,)) == [
        "angle at 2.5 kPa: chambers.wall_mm by +2 deg",
        "mass: chambers.wall_mm by -1 g",
    ]
    missed = Found(
        (Observed((0.7,), np.array([0.4, 18.0]), np.zeros((2, 1))),), (0,), False, ("angle at 2.5 kPa",)
    )
    words = outcome(missed, d.targets)
    assert "angle at 2.5 kPa is 0.4 instead of at least 0.6 deg" in words
    assert "Without angle at 2.5 kPa the others can be met" in words
    failed = Found((Observed((0.7,), np.full(2, np.nan), np.zeros((2, 1)), False),), (0,), False)
    assert "could be simulated" in outcome(failed, d.targets)
    assert failed.some(6) == []


def test_what_the_print_check_refuses_is_in_the_outcome():
    yes, zero = np.ones(2, bool), np.zeros(2)
    good = Verified(zero, zero, zero, zero, yes, yes)
    refused = Verified(zero, zero, zero, zero, np.array([True, False]), np.array([True, False]), "", "error")
    assert verdict([]) == ""
    assert verdict([good]) == "Met in full on a finer mesh: 1 of 1 proposed, robustly 1."
    words = verdict([good, refused])
    assert words.startswith("Met in full on a finer mesh: 1 of 2")
    assert words.endswith("refuses 1.")
