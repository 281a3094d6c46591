"""What `simulate` and `place` make of options that choose the model of the unit."""

import pytest

from mu_addon.studies import starting

from .processes import here


@pytest.mark.parametrize("command", ["simulate", "place"])
@pytest.mark.parametrize(("words", "touch"), [((), True), (("--no-self-contact",), False)])
def test_walls_that_may_touch_are_the_default(command, words, touch, monkeypatch):
    jobs = []
    monkeypatch.setattr(starting, "start", lambda job, folder, context: jobs.append(job))
    assert here(command, "--preset", "mu-1.0x", *words, "--out", "out").returncode == 0
    assert [job.self_contact for job in jobs] == [touch]
