"""What `simulate` and `place` make of options that choose the model of the unit."""

import pytest

from mu_addon.cli.main import parser
from mu_addon.cli.study_job import job_of
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
def test_the_printed_body_whose_walls_may_touch_is_the_default(command):
    found = job(command)
    assert found.mesh.fidelity == "resolved"
    assert found.self_contact
    assert not job(command, "--no-self-contact").self_contact


def test_a_homogenised_unit_has_no_walls_that_touch():
    found = job("place", "--fidelity", "homogenised")
    assert found.mesh.fidelity == "homogenised"
    assert not found.self_contact
    with pytest.raises(InputError, match="self-contact"):
        job("place", "--fidelity", "homogenised", "--self-contact")


def test_what_only_a_homogenised_unit_has_chooses_it():
    for words in (("--order", "1"), ("--mesher", "gmsh")):
        assert job("simulate", *words).mesh.fidelity == "homogenised"


def test_what_only_a_homogenised_unit_has_is_refused_beside_the_other():
    with pytest.raises(InputError, match="linear elements"):
        job("simulate", "--order", "1", "--fidelity", "resolved")
