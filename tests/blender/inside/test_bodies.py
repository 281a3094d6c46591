"""A body of the user's own: examined, with its flaws marked; made the lattice's envelope; taken out again."""

import math

import bpy
import numpy as np

from mu_addon.blender.body import state as bodies
from mu_addon.blender.jobs import start_child
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import drawing, envelope
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.parameters import load_preset
from mu_addon.design.surface import volume
from mu_addon.studies.unit_ranking import UnitStudy

from .acting import add, points_of, refused


def barrel(width=18.75, tall=25.0, low=-2.0, high=80.0, around=32, hole=False, beside=6.25):
    mesh = bpy.data.meshes.new("barrel")
    angles = np.arange(around) * 2 * math.pi / around
    ring = [(width * math.cos(a), beside + tall * math.sin(a)) for a in angles]
    vertices = [(x, y, z) for z in (low, high) for x, y in ring]
    faces = [(k, (k + 1) % around, around + (k + 1) % around, around + k) for k in range(around)]
    faces.append(tuple(reversed(range(around))))
    if not hole:
        faces.append(tuple(range(around, 2 * around)))
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new("Barrel", mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def choose(obj, root):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.hide_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = root
    bpy.context.view_layer.update()


def points(obj):
    found = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", found)
    return found.reshape(-1, 3).astype(float)


def test_a_body_becomes_the_envelope_wherever_it_and_the_unit_stand():
    root = add()
    root.location, root.rotation_euler = (100.0, -40.0, 7.0), (0.3, 0.2, 1.0)
    bpy.context.view_layer.update()
    obj = barrel()
    obj.matrix_world = root.matrix_world @ obj.matrix_world
    choose(obj, root)
    assert bpy.ops.mu.body_check() == {"FINISHED"}
    assert drawing.beside(root, bodies.FLAWS) is None
    before = len(points_of(root, "lattice"))
    assert bpy.ops.mu.body() == {"FINISHED"}
    assert root.mu_unit.trouble == "", root.mu_unit.trouble
    kept = root.mu_unit.envelope
    assert np.allclose(motion_parts.vertices_of(kept).min(0), [-18.75, -18.75, -2.0], atol=1e-4)
    struts = points_of(root, "lattice")
    assert ((struts[:, 0] / 18.75) ** 2 + ((struts[:, 1] - 6.25) / 25) ** 2).max() < 1.001
    assert len(struts) < before
    assert obj.hide_get()
    # Shape the unit on: the body stays, and where it no longer fits, that is said.
    root.mu_unit.chambers.wall_mm = 1.0
    assert root.mu_unit.trouble == ""
    assert root.mu_unit.envelope == kept
    root.mu_unit.chambers.count = 7
    assert "from z = -2 to 80 mm, the unit from 0 to 87.5" in root.mu_unit.trouble
    root.mu_unit.chambers.count = 6
    assert root.mu_unit.trouble == ""
    assert bpy.ops.mu.body_remove() == {"FINISHED"}
    assert root.mu_unit.envelope is None
    assert len(points_of(root, "lattice")) == before


def test_the_solid_is_cut_to_the_body_and_grows_old_with_it():
    root = add()
    root.mu_unit.chambers.count = 3
    choose(barrel(high=40.0), root)
    bpy.ops.mu.body()
    assert bpy.ops.mu.solid() == {"FINISHED"}
    at = motion_parts.vertices_of(root.mu_unit.solid)
    reach = (at[:, 0] / 18.75) ** 2 + ((at[:, 1] - 6.25) / 25) ** 2
    assert reach[at[:, 2] > 0.01].max() < 1.001
    assert at[:, 2].max() == 37.5
    assert unit_object.solid_is_current(root)
    bpy.ops.mu.body_remove()
    assert not unit_object.solid_is_current(root)


def test_flaws_are_marked_in_their_places():
    root = add()
    choose(barrel(hole=True), root)
    assert bpy.ops.mu.body_check() == {"FINISHED"}
    marks = drawing.beside(root, bodies.FLAWS)
    at = points(marks)
    assert len(at) == 32
    assert np.allclose(at[:, 2], 80.0)
    assert "32 edges are open" in refused(bpy.ops.mu.body)
    assert root.mu_unit.envelope is None
    root.mu_unit.chambers.wall_mm = 1.0
    assert drawing.beside(root, bodies.FLAWS) == marks

    choose(barrel(width=12.0), root)
    bpy.ops.mu.body_check()
    at = points(drawing.beside(root, bodies.FLAWS))
    # Six bladders come out of it on either side.
    assert len(at) == 12, at
    assert (np.hypot(at[:, 0] / 12, (at[:, 1] - 6.25) / 25) > 0.99).all(), at
    assert np.hypot(at[:, 0], at[:, 1]).max() < 12.51
    assert (at[:, 0] > 0).sum() == 6
    choose(barrel(), root)
    bpy.ops.mu.body_check()
    assert drawing.beside(root, bodies.FLAWS) is None

    choose(barrel(width=0.01875, tall=0.025, low=0.0, high=0.08, beside=0.00625), root)
    assert "seems to be in metres" in refused(bpy.ops.mu.body)
    for other in bpy.context.selected_objects:
        other.select_set(False)
    assert "no mesh is selected" in refused(bpy.ops.mu.body)


def test_an_inside_out_or_mirrored_body_is_turned():
    root = add()
    obj = barrel()
    obj.data.flip_normals()
    choose(obj, root)
    assert bpy.ops.mu.body() == {"FINISHED"}
    assert root.mu_unit.trouble == ""
    obj.scale.x = -1.0
    choose(obj, root)
    assert bpy.ops.mu.body() == {"FINISHED"}
    assert root.mu_unit.trouble == ""
    body = envelope.envelope_in(root, load_preset("mu-1.0x"))
    assert volume(body.vertices, body.triangles) > 0


def test_a_simulation_is_given_the_body(monkeypatch):
    root = add()
    choose(barrel(), root)
    bpy.ops.mu.body()
    monkeypatch.setattr(start_child, "start", lambda *arguments, **more: None)
    monkeypatch.setattr(start_child, "watch", lambda *arguments: None)
    assert bpy.ops.mu.simulate() == {"FINISHED"}
    job = UnitStudy.read(studies.results_folder(root))
    assert job.unit == to_unit(root.mu_unit)
    assert job.body.hash == envelope.envelope_in(root, job.unit).hash


def test_a_copy_of_a_body_is_repaired_where_there_is_one_way_to():
    root = add()
    root.location = (30.0, 0.0, 5.0)
    bpy.context.view_layer.update()
    obj = barrel()
    obj.matrix_world = root.matrix_world @ obj.matrix_world
    obj.data.polygons[3].flip()
    obj.data.update()
    choose(obj, root)
    assert "inconsistently oriented" in refused(bpy.ops.mu.body)
    assert bpy.ops.mu.body_repair() == {"FINISHED"}
    assert obj.hide_get()
    (copy,) = [o for o in bpy.context.selected_objects if o.type == "MESH" and o != obj and o.parent is None]
    assert copy.name.startswith("Barrel repaired")
    assert bpy.ops.mu.body() == {"FINISHED"}
    assert root.mu_unit.trouble == "", root.mu_unit.trouble
    choose(barrel(hole=True), root)
    assert "open edges" in refused(bpy.ops.mu.body_repair)
