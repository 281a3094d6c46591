"""The preview shows the core's geometry, follows its parameters, and keeps the last good one."""

import time

import attrs
import bpy
import numpy as np

from mu_addon.blender.preview import skeletons
from mu_addon.blender.shared import updates
from mu_addon.blender.shared.compat import modifier_input, set_modifier_input
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import preview_update as live
from mu_addon.design.anchors import anchor_points
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import cavity_polygon, outer_polygon, outer_volume
from mu_addon.design.steps import ALONG, Stack, StepInputs
from mu_addon.design.surface import volume
from mu_addon.errors import InputError

from .acting import add, attribute, points_of, refused, shown_parts


def test_parts_show_the_cores_geometry():

    root = add()
    core = load_preset("mu-1.0x")
    d = core.dimensions

    def points(mesh):
        found = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", found)
        return found.reshape(-1, 3).astype(float)

    def surface(mesh):
        mesh.calc_loop_triangles()
        found = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", found)
        return points(mesh), found.reshape(-1, 3).astype(np.int64)

    # A regular polygon of n sides holds sin(2 pi/n)/(2 pi/n) of the circle around it.
    turn = 2 * np.pi / 48
    for entry in root.mu_unit.stack:
        entry.shown = entry.name == "membranes"
    closed, triangles = surface(root.data)
    boss = np.pi * d.inlet_length * ((d.inlet_radius + d.inlet_wall) ** 2)
    bore = np.pi * d.inlet_radius**2 * (d.inlet_length + d.base_cap)
    ring = volume(closed, triangles) / (np.sin(turn) / turn)
    # The surface is open at the bore's inner end, a disc at height base_cap: the cone below it.
    disc = np.pi * d.inlet_radius**2 * d.base_cap / 3
    assert abs(ring + disc - (outer_volume(d) + boss - bore)) < 0.005 * outer_volume(d), ring

    root.mu_unit.stack["membranes"].shown, root.mu_unit.stack["struts"].shown = False, True
    radius = attribute(root, "radius")
    assert abs(radius.min() - d.junction_diameter / 2) < 1e-6
    assert abs(radius.max() - d.midspan_diameter / 2) < 1e-6
    lattice = lattice_of(d)
    at = points_of(root, "lattice")
    assert at.min(0).round(3).tolist() == lattice.nodes.min(0).round(3).tolist()
    assert at.max(0).round(3).tolist() == lattice.nodes.max(0).round(3).tolist()
    assert len(root.data.edges) == 4 * len(lattice.struts)

    skinned = root.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    thick = points(skinned)
    (_, high_x), _, _ = d.bounds
    reach = np.abs(thick).max(0)[0] - high_x
    # Balls close the tubes' ends, as in the print: without them the corner would reach 0.41 as far.
    assert 0.47 * d.junction_diameter < reach < 0.51 * d.junction_diameter, reach
    used = {skinned.materials[face.material_index].name for face in skinned.polygons}
    assert used == {"MU Lattice"}
    root.mu_unit.stack["anchors"].shown = True
    assert np.allclose(points_of(root, "anchors"), anchor_points(core), atol=1e-5)
    assert shown_parts(root) == {"lattice", "anchors"}


def test_cut_open_shows_the_wall():

    given, made = StepInputs(load_preset("mu-1.0x")), Stack()
    d = given.unit.dimensions
    cut = skeletons.actuator(made.value("membranes", given), cut=True)
    assert cut.vertices[:, 0].max() < 1e-9
    section = cut.faces[-1]
    assert (cut.slots == 1).sum() == len(section)
    p, q, r = cut.vertices[section.T]
    normals = np.cross(q - p, r - p) / 2
    assert (normals[:, 0] >= 0).all()
    assert np.abs(normals[:, 1:]).max() < 1e-9

    def area(polygon):
        x, z = polygon.T
        return abs(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1))) / 2

    wall = area(outer_polygon(d, ALONG)) - area(cavity_polygon(d, ALONG))
    wall += d.inlet_wall * d.inlet_length - d.inlet_radius * d.base_cap
    assert abs(normals[:, 0].sum() / (2 * wall) - 1) < 1e-6, (normals[:, 0].sum(), 2 * wall)
    assert skeletons.lattice(made.value("struts", given), cut=True).vertices[:, 0].max() < 1e-6


def test_a_broken_rule_keeps_the_last_good_preview():

    root = add()
    mesh = root.data
    before = len(mesh.vertices), [v.co[:] for v in mesh.vertices][::97]
    root.mu_unit.chambers.wall_mm = 3.0
    core = load_preset("mu-1.0x")
    try:
        attrs.evolve(core, chambers=attrs.evolve(core.chambers, wall_mm=3.0))
    except InputError as error:
        expected = [error.what, error.remedy]
    assert root.mu_unit.trouble.split("\n") == expected
    assert (len(mesh.vertices), [v.co[:] for v in mesh.vertices][::97]) == before
    assert "wall" in refused(bpy.ops.mu.rebuild)
    for operator in (bpy.ops.mu.solid, bpy.ops.mu.export_stl, bpy.ops.mu.simulate):
        assert "rule is broken: a wall of 3 mm is too thick" in refused(operator)
    root.mu_unit.chambers.wall_mm = 0.95
    assert root.mu_unit.trouble == ""
    assert bpy.ops.mu.rebuild() == {"FINISHED"}


def test_every_slider_reaches_the_preview_quickly():
    root = add()
    taken = []
    for step in range(10):
        before = time.process_time()
        root.mu_unit.chambers.wall_mm = 0.8 + 0.01 * step
        bpy.context.view_layer.update()
        taken.append(time.process_time() - before)
        assert not unit_object.behind(root)
    assert min(taken) < 0.1


def test_a_preview_that_fell_behind_is_caught_up():
    root = add()
    with updates.paused():
        root.mu_unit.chambers.count = 4
    assert unit_object.behind(root)
    for handler in bpy.app.handlers.undo_post:
        if handler is live.catch_up:
            handler(bpy.context.scene)
    assert not unit_object.behind(root)
    tall = points_of(root, "actuator")[:, 2].max()
    assert abs(tall - 4 * 12.5) < 1e-4


def test_keyframes_and_drivers_on_a_unit_are_followed():
    root = add()
    root.keyframe_insert("mu_unit.chambers.neck_diameter_mm", frame=1)
    root.mu_unit.chambers.neck_diameter_mm += 2.0
    root.keyframe_insert("mu_unit.chambers.neck_diameter_mm", frame=21)
    root.driver_add("mu_unit.lattice.junction_diameter_mm").driver.expression = "2 - frame / 100"
    shapes, wide = [], []
    for frame in (1, 21):
        bpy.context.scene.frame_set(frame)
        assert not unit_object.behind(root)
        shapes.append(points_of(root, "actuator"))
        wide.append(attribute(root, "radius").mean())
    assert np.abs(shapes[1] - shapes[0]).max() > 0.9, "a neck wider by 2 mm"
    assert wide[1] < wide[0]


def test_strangers_are_left_alone():
    root = add()
    stranger = bpy.data.objects.new("stranger", None)
    bpy.context.collection.objects.link(stranger)
    stranger.parent = root
    root.mu_unit.candidates = True
    assert len([c for c in root.children if c.get("mu_part", "").startswith("candidate:")]) == 10
    root.mu_unit.candidates = False
    assert list(root.children) == [stranger]
    assert bpy.ops.mu.delete() == {"FINISHED"}
    assert [o.name for o in bpy.data.objects] == ["stranger"]
    assert len(bpy.data.meshes) == 0


def test_colours_of_the_users_stay():
    root = add()
    own = bpy.data.materials.new("own")
    root.data.materials[0] = own
    set_modifier_input(root.modifiers[0], "Struts", own)
    root.mu_unit.chambers.wall_mm = 1.0
    assert root.data.materials[0] == own
    assert modifier_input(root.modifiers[0], "Struts") == own
