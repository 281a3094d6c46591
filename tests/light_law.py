"""The law of light in mu-1.0x's waveguide, fitted once for tests that compare other things.

Fitting takes half of the time of a coarse run without report.
"""

import shutil

import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.run.cache import Cache
from mu_addon.sensing.optics import Optics
from mu_addon.usecases.simulate_and_place.light import cached_law


@pytest.fixture(scope="session")
def with_light(tmp_path_factory):
    """Puts the law into the cache of a study's folder, and returns the folder."""
    made = Cache(tmp_path_factory.mktemp("light"))
    cached_law(load_preset("mu-1.0x").printed, Optics(), made)

    def put(folder):
        shutil.copytree(made.folder, folder / "cache", dirs_exist_ok=True)
        return folder

    return put
