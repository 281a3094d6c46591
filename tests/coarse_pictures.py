"""Pictures of reports as large as ever, of fewer rays: tests of runs read words and tables, not shades."""

from contextlib import contextmanager

import pytest

from mu_addon.report import render


@contextmanager
def coarsely():
    """One value a pixel for four, a sky of 8 directions for 160; tests/report draws as a user's run does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render, "SKY_DIRECTIONS", 8)
        patch.setitem(render.render.__kwdefaults__, "samples", 1)
        yield


@pytest.fixture(scope="module", autouse=True)
def coarse_pictures():
    with coarsely():
        yield
