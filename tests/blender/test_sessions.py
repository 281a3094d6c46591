"""What outlives a session of Blender, and what ends with it: each session is a process of its own."""

from mu_addon.design.parameters import read_unit

from .session import Blender, needs_bpy

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


def test_presets_of_the_users_own(each_bpy, tmp_path):
    kept = session(each_bpy, tmp_path, "save_presets")
    assert tmp_path in kept.parents
    assert read_unit(kept).chambers.wall_mm == 1.1
    session(each_bpy, tmp_path, "find_presets")
