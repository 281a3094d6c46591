"""What planned experiments would show."""

import warnings

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.assets import asset_root
from mu_addon.design.parameters import load_preset, read_unit
from mu_addon.design.settings import PRESET
from mu_addon.errors import InputError
from mu_addon.evidence import unit_fem
from mu_addon.measured import read_folder
from mu_addon.measured.kinds import NOISE
from mu_addon.studies.design_experiments import DesignExperiments, NoiseInput, plan
from tests.evidence import analytic

from .diagnosis_data import weighed_blocks
from .unit_runs import ended


def planned(count=2, **how):
    """Protocols of a unit that have not been measured yet."""
    tests = analytic.protocols(0.5, count)
    blank = dict.fromkeys(("angle_deg", "marker3_y_mm"), 0.0)
    return [
        analytic.experiment(n, t, p, {c: np.full(len(t), v) for c, v in blank.items()}, **(given | how))
        for n, t, p, given in tests
    ]


def limits(experiments, noise=NOISE):
    """The size each effect is seen from."""
    found = plan(experiments, analytic.simulator(experiments), noise)
    return {s.effect.name: s.limit for s in found.seen}


@given(st.floats(0.1, 10.0))
@settings(max_examples=5)
def test_limits_are_in_proportion_to_the_noise(factor):
    experiments = planned(1)
    once = limits(experiments)
    more = limits(experiments, {k: factor * v for k, v in NOISE.items()})
    finite = [n for n in once if np.isfinite(once[n])]
    assert finite
    assert [more[n] for n in finite] == pytest.approx([factor * once[n] for n in finite], rel=1e-6)


def test_one_more_experiment_hides_nothing():
    few, many = planned(2), planned(4)
    before, after = limits(few), limits(many)
    assert all(after[n] <= before[n] * (1 + 1e-6) for n in before)


def test_a_second_orientation_shows_weight():
    """Hanging, weight is nearly a stiffness; held level it is not."""
    hanging = planned(1)
    level = attrs.evolve(hanging[0], name="level", orientation_deg=90.0)
    assert limits([*hanging, level])["gravity"] < 0.5 * limits(hanging)["gravity"]


def test_what_was_measured_does_not_matter():
    experiments = planned(1)
    other = [
        attrs.evolve(e, columns={**e.columns, "angle_deg": np.sin(np.arange(len(e)))}) for e in experiments
    ]
    assert limits(experiments) == limits(other)


def test_it_leaves_a_table_and_a_report(tmp_path):
    folder = weighed_blocks(tmp_path / "data", 0.0)
    context, _ = ended(DesignExperiments(data=read_folder(folder)), tmp_path / "out")
    assert context.status == 0
    # Weighed, the two are no longer one.
    assert not {"overcure", "skin_cure"} <= {n for pair in context.summary["alike"] for n in pair[:2]}
    lines = context.console_summary(context.summary)
    assert any(line.startswith("overcure: detectable from offset 0.0") for line in lines)
    assert (tmp_path / "out" / "limits.csv").read_text().startswith("effect,parameter,unit,visible_from")
    assert "can detect" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_unit_is_simulated_once_and_what_that_leaves_out_is_noted(tmp_path, monkeypatch):
    def response(unit, experiments, settings, cache, progress, held):
        assert (len(experiments), settings.self_contact, cache) == (2, False, tmp_path / "out" / "cache")
        warnings.warn(
            "contact with 2 N is left out\n  where: unit", unit_fem.UnitResponseWarning, stacklevel=1
        )
        return [analytic.response()]

    monkeypatch.setattr(unit_fem, "unit_responses", response)
    measured = read_folder(asset_root() / "examples" / "paper-bending")
    whole = tuple(e for e in measured.experiments if e.scale == 1.0)
    study = DesignExperiments(data=attrs.evolve(measured, experiments=whole), self_contact=False)
    context, messages = ended(study, tmp_path / "out")
    assert context.status == 0
    assert [m["what"] for m in messages if m["type"] == "warning"] == ["contact with 2 N is left out"]
    assert "<p>contact with 2 N is left out</p>" in (tmp_path / "out" / "report.html").read_text()
    assert list(context.summary["seconds"]) == ["unit", "sensitivities", "report"]
    # Without a unit of its own, the preset's: it is among the inputs.
    assert read_unit(tmp_path / "out" / "unit.toml") == load_preset(PRESET)


@pytest.mark.parametrize("word", ["angle", "angle=", "angle=-1", "loudness=3", "angle=nan"])
def test_noise_that_is_none_is_refused(word):
    with pytest.raises(InputError, match="is not a noise level"):
        NoiseInput().made(([word],), {})
