"""Files dropped into a view: what Blender's handlers call, with files as users have them."""

import bpy
import trimesh

from mu_addon.blender.node_tree import state as trees
from mu_addon.blender.obstacles import state as obstacles
from mu_addon.blender.scene import dropping
from mu_addon.blender.unit import envelope
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.assets import asset_root
from mu_addon.design.parameters import load_preset, write_unit

from .acting import add, refused


def test_each_handler_names_an_operator_that_takes_a_file():
    for handler in (dropping.MU_FH_toml, dropping.MU_FH_envelope, dropping.MU_FH_obstacle):
        _, name = handler.bl_import_operator.split(".")
        assert "filepath" in getattr(bpy.ops.mu, name).get_rna_type().properties
        assert bpy.types.FileHandler.bl_rna_get_subclass_py(handler.bl_idname) is handler


def test_a_units_file_is_a_unit_where_it_is_dropped_and_a_trees_file_a_tree(tmp_path):
    write_unit(load_preset("mu-0.75x"), tmp_path / "unit.toml")
    assert bpy.ops.mu.drop_toml(filepath=str(tmp_path / "unit.toml"), place=(0.5, 0.0, 0.0)) == {"FINISHED"}
    (root,) = unit_object.roots()
    assert root.mu_unit.scale == 0.75
    assert abs(root.location.x - 0.5) < 1e-6
    assert bpy.ops.mu.drop_toml(filepath=str(asset_root() / "graphs" / "unit.toml")) == {"FINISHED"}
    (tree,) = trees.trees()
    assert tree.name == "unit"


def test_a_surface_is_an_obstacle_or_an_envelope_in_the_units_frame(tmp_path):
    root = add(preset="mu-0.75x")
    root.location.x = 0.3
    box = trimesh.creation.box((10.0, 10.0, 10.0))
    box.apply_translation([0.0, 60.0, 30.0])
    box.export(tmp_path / "block.stl")
    assert bpy.ops.mu.drop_obstacle(filepath=str(tmp_path / "block.stl")) == {"FINISHED"}
    (found,) = obstacles.of_unit(root)
    body = obstacles.placed(root, found).body
    assert abs(body.vertices[:, 1].min() - 55.0) < 1e-3, "in mm, in the unit's frame"
    around = trimesh.creation.cylinder(30.0, 160.0)
    around.export(tmp_path / "around.obj")
    assert bpy.ops.mu.drop_envelope(filepath=str(tmp_path / "around.obj")) == {"FINISHED"}
    assert envelope.envelope_in(root, to_unit(root.mu_unit)) is not None


def test_files_that_are_none_are_said(tmp_path):
    (tmp_path / "a.toml").write_text("[[[")
    (tmp_path / "b.toml").write_text("x = 1")
    (tmp_path / "c.stl").write_text("no surface")
    assert "TOML" in refused(bpy.ops.mu.drop_toml, filepath=str(tmp_path / "a.toml"))
    assert "x" in refused(bpy.ops.mu.drop_toml, filepath=str(tmp_path / "b.toml"))
    assert "cannot read" in refused(bpy.ops.mu.drop_toml, filepath=str(tmp_path / "none.toml"))
    assert "no file is named" in refused(bpy.ops.mu.drop_toml)
    assert not bpy.ops.mu.drop_obstacle.poll()
    add(preset="mu-0.75x")
    refused(bpy.ops.mu.drop_obstacle, filepath=str(tmp_path / "c.stl"))
    assert unit_object.roots()
