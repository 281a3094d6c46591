"""A unit with a clogged chamber and the verdict on it, judged once for all who read it.

A written response stands for the unit's simulation.
"""

import json

import attrs
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.evidence import unit_fem
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.measured import read_folder
from mu_addon.studies.diagnose import Diagnose

from .evidence import analytic
from .made_once import made_once
from .studies.diagnosis_data import bent_unit
from .studies.unit_runs import ended


def responses(unit, experiments, settings, cache, progress, held):
    assert unit.name
    progress("base", 1.0)
    kinds = sorted({(e.scale, e.orientation_deg) for e in experiments})
    every = tuple(analytic.response(*k) for k in kinds)
    # What was not asked for is not simulated.
    return every if settings.effects else tuple(attrs.evolve(r, variants={}) for r in every)


def judge(folder):
    """Fill data/ and study/evidence/ of a folder, and said.json with the messages of the run."""
    data = bent_unit(folder / "data", {"clogged_chamber.share_lost": 0.5})
    job = Diagnose(data=read_folder(data), unit=load_preset("mu-1.0x"), settings=UnitSettings(whole=None))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(unit_fem, "unit_responses", responses)
        context, messages = ended(job, folder / "study" / "evidence")
    assert context.status == 0, messages[-1]
    (folder / "said.json").write_text(json.dumps(messages, default=str))


@pytest.fixture(scope="session")
def clogged(tmp_path_factory):
    """The folder, see `judge`; nobody writes into it."""
    return made_once(tmp_path_factory, "clogged", judge)
