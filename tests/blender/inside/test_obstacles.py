"""Obstacles: meshes of the scene that a unit meets, examined, handed to the simulation, stale when moved."""

from unittest.mock import patch

import bpy
import numpy as np
from mathutils import Vector

from mu_addon.blender.body.state import FLAWS
from mu_addon.blender.jobs import start_child
from mu_addon.blender.obstacles import state as obstacles
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import drawing
from mu_addon.blender.unit import object as unit_object
from mu_addon.design.surface import volume
from mu_addon.studies.unit_ranking import UnitStudy

from .acting import add, refused


def ball(at, name="Ball", radius=8.0):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=radius, location=at)
    obj = bpy.context.object
    obj.name = name
    return obj


def choose(root, *objects):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = root
    bpy.context.view_layer.update()


def asked():
    with patch.object(start_child, "start"), patch.object(start_child, "watch"):
        assert bpy.ops.mu.simulate() == {"FINISHED"}
    return UnitStudy.read(studies.results_folder(unit_object.active_root(bpy.context)))


def test_what_a_simulation_is_given():
    root = add()
    root.location, root.rotation_euler = (100.0, -40.0, 7.0), (0.3, 0.2, 1.0)
    bpy.context.view_layer.update()
    one = ball(root.matrix_world @ Vector((0, 60, 60)))
    two = ball((300, 0, 0), "Far")
    choose(root, one, two)
    assert bpy.ops.mu.obstacle(friction=0.3) == {"FINISHED"}
    two.mu_obstacle.friction = 0.0
    two.scale = (1.0, 1.0, -2.0)  # mirrored: turned, so that it still looks outward
    bpy.context.view_layer.update()
    met = asked().obstacles
    assert [(rigid.name, rigid.friction) for rigid in met] == [("Ball.obj", 0.3), ("Far.obj", 0.0)]
    near, far = (rigid.body for rigid in met)
    assert np.allclose(near.bounds.mean(axis=0), [0, 60, 60], atol=0.5)
    assert far.bounds.mean(axis=0).max() > 100
    assert volume(far.vertices, far.triangles) > 0
    assert obstacles.inputs(root) == sorted([(near.hash, 0.3), (far.hash, 0.0)])

    assert bpy.ops.mu.obstacle_remove(name="Far") == {"FINISHED"}
    assert len(asked().obstacles) == 1
    assert "Far" in bpy.data.objects
    assert "is not an obstacle" in refused(bpy.ops.mu.obstacle_remove, name="Far")
    bpy.ops.mu.obstacle_remove()
    assert asked().obstacles == ()
    assert not bpy.ops.mu.obstacle_check.poll()


def test_what_moves_or_is_edited_is_another_obstacle():
    root = add()
    one = ball((0, 60, 60))
    choose(root, one)
    bpy.ops.mu.obstacle()
    seen = [obstacles.inputs(root)]
    assert obstacles.inputs(root) == seen[0]

    def changed():
        bpy.context.view_layer.update()
        seen.append(obstacles.inputs(root))
        return seen[-1] not in seen[:-1]

    one.location.y = 70.0
    assert changed()
    one.data.vertices[0].co.z += 1.0
    one.data.update()
    assert changed()
    one.modifiers.new("Wide", "DISPLACE").strength = 1.0
    assert changed()
    one.mu_obstacle.friction = 0.2
    assert changed()
    root.location.x = 5.0
    assert changed()
    root.location.x = 0.0
    assert not changed()
    # A copy is an obstacle, too; a copy of the unit has none.
    choose(root, one)
    bpy.context.view_layer.objects.active = one
    bpy.ops.object.duplicate()
    assert len(obstacles.of_unit(root)) == 2
    bpy.data.objects.remove(bpy.context.object)
    assert obstacles.of_unit(root) == [one]


def test_flaws_are_told_and_marked():

    root = add()
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 80, 30))
    plane = bpy.context.object
    choose(root, plane)
    assert "cannot be an obstacle: 4 edges are open" in refused(bpy.ops.mu.obstacle)
    assert obstacles.of_unit(root) == []
    dust = ball((0, 80, 0), radius=0.001)
    choose(root, dust)
    assert "another unit of length" in refused(bpy.ops.mu.obstacle)

    # In the unit's way already: an obstacle to move, told and marked, and no simulation with it.
    one = ball((0, 33, 60))
    choose(root, one)
    assert bpy.ops.mu.obstacle() == {"FINISHED"}
    assert obstacles.placed(root, one).flaws[0].what.startswith("it overlaps the unit by up to 6.")
    assert bpy.ops.mu.obstacle_check() == {"FINISHED"}
    at = np.array([v.co for v in drawing.beside(root, FLAWS).data.vertices])
    assert len(at) == 1, at
    assert abs(at[0] - [0, 28.1, 60]).max() < 1.0, at
    assert "overlaps the unit" in refused(bpy.ops.mu.simulate)
    one.location.y = 45.0
    bpy.context.view_layer.update()
    assert obstacles.placed(root, one).flaws is None, "looked at where it stands now"
    assert bpy.ops.mu.obstacle_check() == {"FINISHED"}
    assert drawing.beside(root, FLAWS) is None
    assert len(asked().obstacles) == 1


def test_a_box_stands_before_the_tip():
    root = add()
    root.location = (10.0, 20.0, 30.0)
    bpy.context.view_layer.update()
    assert bpy.ops.mu.obstacle_box(size=(10, 20, 30), gap=4.0, friction=0.1) == {"FINISHED"}
    bpy.context.view_layer.update()
    (box,) = obstacles.of_unit(root)
    body = obstacles.placed(root, box).body
    assert np.allclose(body.bounds, [[-5, 35.25, 45], [5, 55.25, 75]], atol=1e-3), body.bounds
    assert volume(body.vertices, body.triangles) > 0
    assert abs(box.mu_obstacle.friction - 0.1) < 1e-6
    assert bpy.ops.mu.obstacle_check() == {"FINISHED"}
    assert not obstacles.placed(root, box).flaws
