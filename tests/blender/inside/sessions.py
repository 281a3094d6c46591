"""Parts of `test_sessions`: what one session of Blender does before it ends, and what another one finds."""

import bpy

import mu_addon
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import presets

from .acting import add, refused


def begin():
    """As Blender begins, with the user's files where they are."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mu_addon.register()


def save_presets():
    """Save a preset of the user's own, load it, be refused; returns its file."""
    begin()
    assert presets.names() == ["mu-0.75x", "mu-1.0x", "mu-1.5x"]
    root = add()
    root.mu_unit.chambers.wall_mm = 1.1
    assert bpy.ops.mu.preset_save(name="thick one") == {"FINISHED"}
    assert presets.names()[-1] == "user:thick one"
    assert bpy.ops.mu.preset_load(name="mu-1.5x") == {"FINISHED"}
    assert root.mu_unit.scale == 1.5
    assert not unit_object.behind(root)
    assert bpy.ops.mu.preset_load(name="user:thick one") == {"FINISHED"}
    assert round(root.mu_unit.chambers.wall_mm, 4) == 1.1
    assert root.mu_unit.scale == 1.0
    fresh = add(preset="user:thick one")
    assert round(fresh.mu_unit.chambers.wall_mm, 4) == 1.1
    for name in ("", "../escape", "a/b", ".hidden", "x" * 61):
        assert "cannot be the name" in refused(bpy.ops.mu.preset_save, name=name)
    assert "no preset" in refused(bpy.ops.mu.preset_load, name="mu-9x")
    assert "cannot read" in refused(bpy.ops.mu.preset_load, name="user:never")
    assert "comes with the extension" in refused(bpy.ops.mu.preset_remove, name="mu-1.0x")
    return presets._file("user:thick one")


def find_presets():
    """Another session finds the preset and removes it."""
    begin()
    assert presets.names()[-1] == "user:thick one"
    assert bpy.ops.mu.preset_remove(name="user:thick one") == {"FINISHED"}
    assert presets.names() == ["mu-0.75x", "mu-1.0x", "mu-1.5x"]
