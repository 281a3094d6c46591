"""What `simulate` and `place` make of options that choose the model of the unit."""

import pytest

from mu_addon.cli.main import parser
from mu_addon.cli.study import job_of
from mu_addon.errors import InputError
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress


def job(*words):
    """The study of a command line, or the error that it ends with."""
    options = parser().parse_args([*words, "--preset", "mu-1.0x", "--out", "out"])
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        return job_of(options, context)
    raise InputError(messages[-1]["what"], messages[-1]["where"])


@pytest.mark.parametrize("command", ["simulate", "place"])
def test_walls_that_may_touch_are_the_default(command):
    found = job(command)
    assert found.self_contact
    assert not job(command, "--no-self-contact").self_contact
