"""How near a motion comes to tearing, in a study's summary, table and warnings."""

import attrs
import numpy as np
import pytest
from mu_addon.usecases.simulate_and_place.study import Study

from mu_addon.design.parameters import load_preset
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.studies.unit_ranking import UnitStudy
from mu_addon.usecases.simulate_and_place.motion_checks import doubts_of_motion

UNIT = load_preset("mu-1.0x").evolve(count=3)


def test_a_brittle_resin_is_warned_of(tmp_path):
    job = UnitStudy(
        unit=UNIT.evolve(elongation_at_break=0.01),
        protocol=Protocol(np.arange(2.0), np.array([0.0, 2.0])),
        mesh=MeshSettings(refine=0.35),
        times=2,
        self_contact=False,
        workers=1,
        stages=("design", "simulate"),
    )
    study = Study.open(job, tmp_path / "out", RunContext(Progress()))
    study.make_mesh()
    study.simulate()
    assert {row[1] for row in study.stretch} == {"wall", "struts", "joints"}
    most = study.context.summary["nearest_to_break"]
    exceeded = max(float(row[6]) for row in study.stretch)
    assert most["percent"] == pytest.approx(100.0 * (exceeded - 1.0) / 0.01, rel=0.01)
    assert most["pressure_kPa"] == 2.0
    (warning,) = (text for text in study.warnings if "tear" in text)
    assert most["part"] in warning
    tough = attrs.evolve(job, unit=UNIT)
    summary = {"nearest_to_break": {**most, "percent": most["percent"] / 160.0}}
    assert not [text for text in doubts_of_motion(tough, study.mesh, study.states, summary) if "tear" in text]
