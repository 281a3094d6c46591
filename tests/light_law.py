"""The law of light in mu-1.0x's waveguide, fitted once for tests that compare other things.

Fitting takes half of the time of a coarse run without report. It stands for the law of mu-0.75x, too.
"""

import shutil

import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.run.cache import Cache
from mu_addon.sensing.light_law import fit_law
from mu_addon.sensing.optics import Optics
from mu_addon.simulate_and_place import light

from .made_once import made_once


@pytest.fixture(scope="session")
def with_light(tmp_path_factory):
    """Puts the law into the cache of a study's folder, and returns the folder."""

    def make(folder):
        # Of a third of the guides: a rougher law, but a law.
        law = fit_law(load_preset("mu-1.0x").printed, Optics(), traces=40)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(light, "fit_law", lambda *_, **__: law)
            for preset in ("mu-0.75x", "mu-1.0x"):
                light.cached_law(load_preset(preset).printed, Optics(), Cache(folder))

    made = Cache(made_once(tmp_path_factory, "light", make))

    def put(folder):
        shutil.copytree(made.folder, folder / "cache", dirs_exist_ok=True)
        return folder

    return put
