"""A ranking of three chambers, which have one path, on a coarse mesh: run once for all who read it."""

import pytest

from .coarse_pictures import coarsely
from .headless.processes import coarse, here
from .made_once import made_once


@pytest.fixture(scope="session")
def finished(tmp_path_factory, with_light):
    """Its folder; whoever writes into it takes a copy."""

    def make(folder):
        with coarsely():
            done = here(*coarse(with_light(folder)), "--workers", "1")
        assert done.returncode == 0, done.stderr

    return made_once(tmp_path_factory, "finished", make)
