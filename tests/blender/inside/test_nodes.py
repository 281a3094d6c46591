"""Node groups: built in code, usable on anyone's geometry, renewed in place when they are old."""

import attrs
import bmesh
import bpy
import numpy as np
import pytest

from mu_addon.blender.assets import dropped, library
from mu_addon.blender.assets.group_pictures import group_pixels
from mu_addon.blender.assets.surface_picture import surface_pixels
from mu_addon.blender.evidence import state as evidence
from mu_addon.blender.gripper import object as gripper_object
from mu_addon.blender.node_tree import state as trees
from mu_addon.blender.obstacles import state as obstacles
from mu_addon.blender.preview import nodes
from mu_addon.blender.shared.compat import modifier_input, set_modifier_input
from mu_addon.blender.sidebar.unit_panel import MU_PT_unit
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import resins
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.assets import asset_names
from mu_addon.design.parameters import load_preset, preset_names
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.section_picture import section_pixels
from mu_addon.materials import load_material, material_names

from .acting import add, refused
from .drawing import drawn as drawn_by


def edge(length, radius=None):
    mesh = bpy.data.meshes.new("edge")
    mesh.from_pydata([(0, 0, 0), (0, 0, length)], [(0, 1)], [])
    if radius is not None:
        mesh.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radius)
    obj = bpy.data.objects.new("edge", mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def skinned(obj):
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    return np.array([v.co[:] for v in mesh.vertices])


def test_tubes_take_their_radius_from_the_attribute_or_the_input():
    tapered = edge(10.0, [1.0, 3.0])
    nodes.skin(tapered, "MU Tubes")
    points = skinned(tapered)
    wide = np.hypot(points[:, 0], points[:, 1])
    assert np.allclose(wide[points[:, 2] < 1], 1.0, atol=1e-5)
    assert np.allclose(wide[points[:, 2] > 9], 3.0, atol=1e-5)

    plain = edge(10.0)
    modifier = nodes.skin(plain, "MU Tubes")
    assert nodes.skin(plain, "MU Tubes") == modifier
    assert len(plain.modifiers) == 1
    set_modifier_input(modifier, "Radius", 2.0)
    set_modifier_input(modifier, "Sides", 12)
    assert modifier_input(modifier, "Sides") == 12
    points = skinned(plain)
    assert len(points) == 24
    assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 2.0, atol=1e-5)
    try:
        set_modifier_input(modifier, "no such input", 1)
    except KeyError:
        pass
    else:
        raise AssertionError


def test_a_colour_field_scales_a_value():
    obj = edge(10.0)
    obj.data.attributes.new("stress_kPa", "FLOAT", "POINT").data.foreach_set("value", [5.0, 30.0])
    modifier = nodes.skin(obj, "MU Colour Field")
    for name, value in {"Attribute": "stress_kPa", "Low": 0.0, "High": 20.0}.items():
        set_modifier_input(modifier, name, value)
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    colour = [a.value for a in mesh.attributes["mu_colour"].data]
    assert np.allclose(colour, [0.25, 1.0])
    assert [a.value for a in mesh.attributes["stress_kPa"].data] == [5.0, 30.0]


def test_a_group_that_is_there_is_not_built_again():
    first = nodes.group("MU Tubes")
    first.nodes["Group Output"].location.x = 1234.0
    assert nodes.group("MU Tubes").nodes["Group Output"].location.x == 1234.0


def drawn(points, kind="POLY"):
    curve = bpy.data.curves.new("own", "CURVE")
    curve.dimensions = "3D"
    spline = curve.splines.new(kind)
    spline.points.add(len(points) - 1)
    for point, at in zip(spline.points, points, strict=True):
        point.co = (*at, 1.0)
    obj = bpy.data.objects.new("own", curve)
    bpy.context.collection.objects.link(obj)
    return obj


def closed_volume(obj):
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    solid = bmesh.new()
    solid.from_mesh(mesh)
    assert all(edge.is_manifold for edge in solid.edges)
    return solid.calc_volume()


def test_a_users_own_curve_gets_tubes():
    obj = drawn([(0, 0, 0), (0, 0, 10), (0, 0, 40)])
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.mu.skin(group="MU Tubes") == {"FINISHED"}
    points = skinned(obj)
    assert len(points) == 24
    assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 1.0, atol=1e-5)
    obj.data.splines[0].points[2].radius = 0.5  # alt S, in edit mode
    set_modifier_input(obj.modifiers[0], "Radius", 3.0)
    points = skinned(obj)
    wide = np.hypot(points[:, 0], points[:, 1])
    assert np.allclose(wide[points[:, 2] < 1], 3.0, atol=1e-5)
    assert np.allclose(wide[points[:, 2] > 39], 1.5, atol=1e-5)


def test_a_waveguide_on_a_curve_has_whole_wells_at_a_constant_pitch():
    obj = drawn([(0, 0, 0), (0, 0, 40)])
    modifier = nodes.skin(obj, "MU Waveguide")
    bar = 1.5 * 1.5 * 40

    def wells():
        return (bar - closed_volume(obj)) / (1.5 * 0.65 * 1.0)

    assert abs(wells() - 12) < 1e-3  # 11 pitches of 3.125 mm, and half a pitch or more at either end
    set_modifier_input(modifier, "Pitch", 8.0)
    assert abs(wells() - 5) < 1e-3
    set_modifier_input(modifier, "Pitch", 50.0)
    assert abs(wells() - 1) < 1e-3
    set_modifier_input(modifier, "Pitch", 8.0)
    set_modifier_input(modifier, "Cut", False)
    points = skinned(obj)
    assert len(points) == 8 + 5 * 8
    boxes = points[(points[:, 2] > 0.01) & (points[:, 2] < 39.99)]  # the bar has its vertices at its ends
    middles = boxes.reshape(5, 8, 3).mean(axis=1)
    assert np.allclose(np.diff(middles[:, 2]), 8.0, atol=1e-4)
    assert np.allclose(middles[:, 2].mean(), 20.0, atol=1e-4)
    # In one face: all on one side of the axis, by half the section less half a well.
    side = np.abs(middles[:, :2]).max(axis=1)
    assert np.allclose(side, 0.75 - 0.325 + 0.03, atol=1e-4)
    assert np.allclose(middles[:, :2], middles[0, :2], atol=1e-5)


def test_a_group_of_an_older_version_in_a_file_is_upgraded(tmp_path):
    # As version 1 was: a radius that replaced the attribute's, and edges only.
    tree = bpy.data.node_groups.new("MU Tubes", "GeometryNodeTree")
    tree.is_modifier = True
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Sides", in_out="INPUT", socket_type="NodeSocketInt")
    tree["mu_version"] = 1
    tree.asset_mark()
    obj = drawn([(0, 0, 0), (0, 0, 40)])
    modifier = obj.modifiers.new("MU Tubes", "NODES")
    modifier.node_group = tree
    set_modifier_input(modifier, "Sides", 5)
    path = str(tmp_path / "older.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    obj = bpy.data.objects["own"]
    assert bpy.data.node_groups["MU Tubes"]["mu_version"] == 1
    add()  # whatever needs the group brings it up to date
    tree = obj.modifiers[0].node_group
    assert tree["mu_version"] == nodes.GROUPS["MU Tubes"].version > 1
    assert tree.asset_data.catalog_id == nodes.CATALOGUE
    assert modifier_input(obj.modifiers[0], "Sides") == 5
    assert len(skinned(obj)) == 10


@pytest.mark.parametrize(
    "group", ["MU Tubes", "MU Balls", "MU Labelled Tube", "MU Waveguide", "MU Colour Field"]
)
def test_every_group_has_a_picture_of_what_it_makes(group):
    assert group in nodes.GROUPS
    assert len(nodes.GROUPS) == 5
    before = len(bpy.data.objects), len(bpy.data.meshes)
    pixels = group_pixels(group, 64)
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == before
    there = pixels[..., 3] > 0.0
    assert 0.03 < there.mean() < 0.8
    # It fills the picture one way, and keeps off its border.
    assert max(np.ptp(rows) for rows in np.nonzero(there)) > 50
    border = np.concatenate([there[0], there[-1], there[:, 0], there[:, -1]])
    assert not border.any()
    assert len(np.unique(pixels[there], axis=0)) > 3, "it is shaded or coloured"


def test_a_surface_is_lit_and_the_nearer_triangle_hides_the_other():
    # Seen from the front (+x): a red triangle before a larger green one, which it hides in part.
    near, far = (
        np.array([[5, -2, -2], [5, 2, -2], [5, 0, 2]]),
        np.array([[-5, -9, -9], [-5, 9, -9], [-5, 0, 9]]),
    )
    points, triangles = np.vstack([far, near]).astype(float), np.array([[3, 4, 5], [0, 1, 2]])
    red_and_green = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    pixels = surface_pixels(points, triangles, red_and_green, 96)
    behind = surface_pixels(points, triangles[1:], red_and_green[1:], 96)
    red, green = (pixels[..., k] > 0.0 for k in (0, 1))
    assert red.any()
    assert not (red & green).any()
    assert np.array_equal(red | green, behind[..., 1] > 0.0), "red lies wholly before green"
    # Turned round, triangles look the same.
    turned = surface_pixels(points, triangles[:, ::-1], red_and_green, 96)
    assert np.array_equal(turned, pixels)


def test_a_resin_is_chosen_by_its_name_and_a_changed_one_is_said_to_be():
    root = add()
    assert resins.name_of(root) == "Choose a Resin"
    assert bpy.ops.mu.resin(name="flexible-80a") == {"FINISHED"}
    got, want = to_unit(root.mu_unit), load_material("flexible-80a").in_unit(to_unit(root.mu_unit))
    assert got.wall == want.wall
    assert attrs.asdict(got.material) == pytest.approx(attrs.asdict(want.material))
    assert got.material.elongation_at_break == 1.2
    assert resins.name_of(root) == "Flexible 80A"
    root.mu_unit.material.membrane_modulus_kPa *= 1.1
    assert resins.name_of(root) == "Flexible 80A, changed"
    assert bpy.ops.mu.resin(name="elastic-50a-v1") == {"FINISHED"}
    assert resins.name_of(root) == "Elastic 50A V1"


def test_a_resin_and_a_printer_dropped_on_a_unit_become_its_parameters():
    assert bpy.ops.mu.assets() == {"FINISHED"}
    file = str(library.user_folder("assets") / library.MADE_FILE)
    with bpy.data.libraries.load(file, assets_only=True) as (there, here):
        # Blender lists them in an order of its own.
        assert (sorted(there.materials), sorted(there.objects)) == (
            sorted(load_material(name).name for name in material_names()),
            sorted(load_printer(name).title for name in asset_names("printers")),
        )
        here.materials = [load_material(material_names()[0]).name]
        here.objects = there.objects[:1]
    [resin], [box] = here.materials, here.objects
    for made in (resin, box):
        pixels = np.array(made.preview.image_pixels_float[:]).reshape(128, 128, 4)
        assert 0.1 < (pixels[..., 3] > 0.5).mean() < 0.9
    far, near = add(), add()
    far.location, near.location = (0.0, 300.0, 0.0), (0.0, 0.0, 0.0)
    for root in (far, near):
        root.mu_print.printer = "own"
    before = to_unit(near.mu_unit)
    # As Blender's drop does: a material into the slot that is under the mouse.
    near.material_slots[1].material = resin
    dropped.take()
    want = load_material(material_names()[0]).in_unit(before)
    assert to_unit(near.mu_unit).material == want.material != before.material
    assert to_unit(near.mu_unit).wall == want.wall
    assert to_unit(far.mu_unit).material == before.material
    assert near.material_slots[1].material.name == "MU Section"
    assert dropped.waiting() is None
    # What undo brings back from between a drop and its taking is taken away, not taken again.
    near.data.materials.append(resin)
    assert dropped.waiting() == (near.mu_unit.uuid, resin.name)
    now = to_unit(near.mu_unit)
    near.mu_unit.material.membrane_modulus_kPa = 2000.0
    for function in bpy.app.handlers.undo_post:
        function(bpy.context.scene)
    assert dropped.waiting() is None
    assert len(near.data.materials) == 5
    assert to_unit(near.mu_unit).material.membrane_modulus_kPa == 2000.0
    near.mu_unit.material.membrane_modulus_kPa = now.material.membrane_modulus_kPa
    box.asset_clear()  # as it is after a drop
    box.location = (10.0, 20.0, 0.0)
    bpy.context.collection.objects.link(box)
    bpy.context.view_layer.update()
    dropped.take()
    assert (near.mu_print.printer, far.mu_print.printer) == (asset_names("printers")[0], "own")
    assert not [o for o in bpy.data.objects if o.get(dropped.PRINTER)]
    assert bpy.context.object == near
    assert dropped.waiting() is None
    assert "neither a resin nor a printer" in refused(
        bpy.ops.mu.take_asset, unit=near.mu_unit.uuid, asset="Cube"
    )


def test_presets_and_groups_become_an_asset_library_of_the_users():

    def names():
        return {entry.name for entry in bpy.context.preferences.filepaths.asset_libraries}

    assert bpy.ops.mu.assets() == {"FINISHED"}
    assert bpy.ops.mu.assets() == {"FINISHED"}  # a second time adds no second entry
    libraries = bpy.context.preferences.filepaths.asset_libraries
    assert [entry.name for entry in libraries].count("Monolithic Units") == 1
    assert len(bpy.data.node_groups) == 0, "groups that this file does not use were left in it"
    assert not [m.name for m in bpy.data.materials if m.name.startswith("MU ")], "nor their materials"
    assert not [o for o in bpy.data.objects if o.mu_unit.uuid], "nor are the presets' units"
    folder = library.user_folder("assets")
    assert nodes.CATALOGUE in (folder / "blender_assets.cats.txt").read_text()
    assert sorted(p.name for p in folder.iterdir()) == [
        "blender_assets.cats.txt",
        "mu-nodes.blend",
        "mu-resins-and-printers.blend",
        "mu-units.blend",
    ]
    with bpy.data.libraries.load(str(folder / "mu-units.blend"), assets_only=True) as (there, here):
        assert set(there.objects) == set(preset_names())
        assert not there.node_groups, "those that units use are assets of the other file alone"
        here.objects = ["mu-0.75x"]
    dropped = bpy.data.objects["mu-0.75x"]
    pixels = np.array(dropped.preview.image_pixels_float[:])
    assert np.allclose(pixels, section_pixels(load_preset("mu-0.75x"), 128).ravel(), atol=0.01)
    assert dropped.asset_data.catalog_id == library.UNITS_CATALOGUE
    bpy.context.collection.objects.link(dropped)
    bpy.context.view_layer.objects.active = dropped
    assert unit_object.active_root(bpy.context) == dropped
    assert to_unit(dropped.mu_unit) == load_preset("mu-0.75x")
    bpy.data.objects.remove(dropped)
    with bpy.data.libraries.load(str(folder / "mu-nodes.blend"), assets_only=True) as (there, here):
        assert set(there.node_groups) == set(nodes.GROUPS)
        here.node_groups = ["MU Tubes"]
    [tree] = here.node_groups
    assert tree.asset_data.catalog_id == nodes.CATALOGUE
    pixels = np.array(tree.preview.image_pixels_float[:]).reshape(128, 128, 4)
    assert set(np.unique(pixels[..., 3])) == {0.0, 1.0}, "a tube, and nothing beside it"
    seen = pixels[pixels[..., 3] > 0.0]
    assert 0.05 < len(seen) / 128**2 < 0.5
    assert np.ptp(seen[:, 0]) > 0.2, "it is shaded"
    obj = drawn([(0, 0, 0), (0, 0, 40)])
    assert nodes.skin(obj, "MU Tubes").node_group.name == "MU Tubes"
    assert len(skinned(obj)) == 16
    assert bpy.ops.mu.assets_remove() == {"FINISHED"}
    assert "Monolithic Units" not in names()
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("scene", ["overview", "paths", "obstacle", "gripper", "measured", "tree"])
def test_a_sample_scene_for_each_task_has_what_it_begins_with_in_view(scene):
    assert bpy.ops.mu.sample(scene=scene) == {"FINISHED"}
    bpy.context.view_layer.update()
    there = bpy.data.objects.get
    made = {
        "overview": lambda: (
            there("In a Body of Its Own").mu_unit.envelope and closed_volume(there("Waveguide on a Curve"))
        ),
        "paths": lambda: unit_object.roots()[0].mu_unit.candidates,
        "obstacle": lambda: obstacles.of_unit(unit_object.roots()[0]),
        "gripper": gripper_object.roots,
        "measured": lambda: evidence.measured_data(unit_object.roots()[0]).measured,
        "tree": lambda: [n for t in trees.trees() for n in t.nodes],
    }[scene]
    assert made()
    first = {"measured": "Diagnose", "gripper": ""}.get(scene, "Simulate, perhaps")
    assert first in drawn_by([MU_PT_unit]), "the step at the top is what the scene is about"
    area = next(a for w in bpy.context.window_manager.windows for a in w.screen.areas if a.type == "VIEW_3D")
    view = area.spaces.active.region_3d
    bodies = [o for o in bpy.data.objects if o.type == "MESH" and len(o.data.vertices) and not o.hide_get()]
    assert bodies
    for obj in bodies:
        assert (obj.matrix_world.translation - view.view_location).length < view.view_distance


def test_an_asset_is_called_as_its_preset_beside_a_unit_of_that_name():
    root = add(preset="mu-1.0x")
    root.data.name = "mu-1.0x"
    assert bpy.ops.mu.preset_save(name="mu-1.0x") == {"FINISHED"}
    before = {o.name: o.data.name for o in bpy.data.objects if o.type == "MESH"}
    assert root.name in before
    try:
        assert bpy.ops.mu.assets() == {"FINISHED"}
        file = library.user_folder("assets") / library.UNITS_FILE
        with bpy.data.libraries.load(str(file), assets_only=True) as (there, _):
            assert set(there.objects) == {*preset_names(), "mu-1.0x, your own"}
        assert {o.name: o.data.name for o in bpy.data.objects if o.type == "MESH"} == before
    finally:
        bpy.ops.mu.assets_remove()
        bpy.ops.mu.preset_remove(name="user:mu-1.0x")
