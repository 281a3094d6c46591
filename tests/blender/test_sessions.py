"""What outlives a session of Blender, and what ends with it: each session is a process of its own."""

import json
import time
from pathlib import Path

import pytest

from mu_addon.design.parameters import read_unit
from mu_addon.run.lock import holder

from .session import PATIENCE_S, Blender, needs_bpy

pytestmark = needs_bpy


def session(python, folder, function, **arguments):
    """One session from its beginning to its end; returns what its part in `inside/sessions.py` returns."""
    blender = Blender(python, folder)
    try:
        return blender.call(
            "tests.blender.inside.sessions", function, registered=None, folder=folder, **arguments
        )
    finally:
        blender.close()


def wait_for_the_end_of(pid):
    """Until a process has ended, or only waits to be asked for its status."""
    status = Path("/proc") / str(pid) / "status"
    end = time.monotonic() + PATIENCE_S
    while status.exists() and "State:\tZ" not in status.read_text():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.nightly(
    "tests/blender/inside/test_nodes.py::test_presets_and_groups_become_an_asset_library_of_the_users"
)
def test_presets_of_the_users_own(each_bpy, tmp_path):
    kept = session(each_bpy, tmp_path, "save_presets")
    assert tmp_path in kept.parents
    assert read_unit(kept).chambers.wall_mm == 1.1
    session(each_bpy, tmp_path, "find_presets")


def test_a_simulation_survives_loading_a_file_and_dies_with_the_session(each_bpy, tmp_path):
    wait_for_the_end_of(session(each_bpy, tmp_path, "leave_a_simulation"))


def test_a_sensor_outlives_undo_load_and_render_and_dies_with_blender(each_bpy, tmp_path):
    pid, folder = session(each_bpy, tmp_path, "leave_a_sensor", tmp_path=tmp_path)
    wait_for_the_end_of(pid)
    assert json.loads((folder / "status.json").read_text())["state"] == "ended", "and it ended well"


def test_a_run_outlives_blender_and_the_next_session_shows_and_stops_it(each_bpy, tmp_path):
    pid, folder = session(each_bpy, tmp_path, "leave_a_lasting_run")
    assert holder(folder) == pid, "it goes on"
    assert session(each_bpy, tmp_path, "find_a_lasting_run") == "cancelled"
    wait_for_the_end_of(pid)
    assert session(each_bpy, tmp_path, "find_nothing") == ([], [])
