"""How near a motion comes to tearing, in a study's summary, table and warnings."""

import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.kept_results import Results
from mu_addon.run.parts import Fact, Warn
from mu_addon.run.progress import Progress
from mu_addon.simulate_and_place.motion_checks import would_tear
from mu_addon.studies.unit_ranking import UnitStudy


def test_a_brittle_resin_is_warned_of(tmp_path):
    job = UnitStudy(
        unit=load_preset("mu-1.0x").evolve(count=3, elongation_at_break=0.01),
        protocol=Protocol(np.arange(2.0), np.array([0.0, 2.0])),
        mesh=MeshSettings(refine=0.35),
        times=2,
        workers=1,
        stages=("design", "simulate"),
    )
    results = Results(job, tmp_path, Progress())
    tasks = {"meshed": None, "states": 2.0, "motion": None, "motion_tables": None, "fields": None}
    found = {name: results.value((name, member)) for name, member in tasks.items()}
    del found["meshed"], found["states"]
    stretch, parts = found["motion_tables"].stretch, [*job.finished(**found)]
    assert {row[1] for row in stretch} == {"wall", "struts", "joints"}
    (most,) = (part.value for part in parts if isinstance(part, Fact) and part.key == "nearest_to_break")
    exceeded = max(float(row[6]) for row in stretch)
    assert most["percent"] == pytest.approx(100.0 * (exceeded - 1.0) / 0.01, rel=0.01)
    assert most["pressure_kPa"] == 2.0
    (warning,) = (part.text for part in parts if isinstance(part, Warn) and "tear" in part.text)
    assert most["part"] in warning
    assert not would_tear({**most, "percent": most["percent"] / 160.0}, 1.6)
