"""Every command gives what it gave when it was recorded: words, files, and numbers at their digits.

`python tests/golden/record.py [NAME ...]` records a change that is meant; its reason goes into the commit.
"""

import pytest

from tests.blender.session import needs_bpy
from tests.golden import kept
from tests.golden.record import NAMES, RECORDED, changes
from tests.golden.running import Workspace


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    return Workspace(tmp_path_factory.mktemp("golden") / "work")


@pytest.mark.nightly("test_a_change_is_told_and_digits_within_the_error_are_none")
@pytest.mark.parametrize("name", [*NAMES[:-1], pytest.param(NAMES[-1], marks=needs_bpy)])
def test_a_command_gives_what_was_recorded(workspace, name):
    changed = changes(name, workspace.run(name))
    assert not changed, "\n".join(changed)


def test_a_change_is_told_and_digits_within_the_error_are_none():
    recorded = {"summary.json: angle_deg.16": "4.84528740", "stdout 00": "angle: 4.8 deg at 16 kPa"}
    assert kept.read(kept.written(recorded)) == recorded
    nearly = recorded | {"summary.json: angle_deg.16": "4.84528741"}
    assert list(kept.differences(recorded, nearly, 1e-6)) == []
    for key, value in (("summary.json: angle_deg.16", "4.8454"), ("stdout 00", "angle: 4.8 deg at 17 kPa")):
        (told,) = kept.differences(recorded, recorded | {key: value}, 1e-6)
        assert key in told
        assert value in told
    (gone,) = kept.differences(recorded, {"stdout 00": recorded["stdout 00"]}, 1e-6)
    assert "(not there)" in gone


def test_every_command_is_recorded():
    assert {path.stem for path in RECORDED.glob("*.txt")} == set(NAMES)
