"""Plans of runs: what makes a stage take longer."""

import attrs
import pytest

from mu_addon.design.parameters import Unit
from mu_addon.simulate_and_place.expected_seconds import SUCTION, WAY_CROSSING, WAY_TOUCHING, Size, work
from mu_addon.studies.unit_ranking import UnitStudy


@pytest.mark.parametrize("apart", [False, True])
def test_suction_takes_longest(apart):
    job = UnitStudy(unit=Unit(), self_contact=apart)
    size = Size.of(job)
    assert [work([p]) for p in (-20.0, -1.0, 0.0, 40.0)] == [SUCTION, 1.0, 0.0, 1.0]
    assert work(job.samples.distinct_kPa) == SUCTION + 1.0 + 4.0
    # Model A's two branches are solved side by side; suction is the longer one, by its way to -20 kPa.
    shipped = WAY_TOUCHING + 2.0
    assert size.factor("Model A") == ((WAY_TOUCHING if apart else WAY_CROSSING) + 2.0) / shipped
    more = attrs.evolve(size, pressures_kPa=(-15.0, *size.pressures_kPa))
    assert more.factor("Model A") - size.factor("Model A") == pytest.approx(1.0 / shipped)
    under_pressure = attrs.evolve(size, pressures_kPa=(10.0, 20.0, 30.0, 40.0))
    assert under_pressure.factor("Model A") == 4.0 / shipped


def test_a_plan_follows_what_is_asked_for():
    """Fewer chambers and paths, a coarser mesh, fewer pressures: each shortens it at once."""
    base = Size(6, 1.0, True, known=3)
    assert Size(6, 1.0, True).factor("Model A") == pytest.approx(1.0)
    assert Size(6, 1.0, True).factor("candidates") == pytest.approx(1.0)
    for other in (
        Size(3, 1.0, True, known=3),
        Size(6, 0.5, True, known=3),
        Size(6, 1.0, True, (10.0, 20.0), known=3),
    ):
        for stage in ("Model A", "candidates"):
            assert other.factor(stage) < 0.9 * base.factor(stage)
    # Three of ten paths are solved in suction, which is most of the work.
    suction = SUCTION + 1.0
    left_out = 0.7 * suction / (suction + 4)
    assert base.factor("candidates") == pytest.approx(1.0 - left_out)
    job = UnitStudy(unit=Unit(), self_contact=True)
    every = attrs.evolve(job, all_paths=True)
    assert job.expected()["candidates"] < every.expected()["candidates"]
