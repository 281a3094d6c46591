"""Blender's own gestures on a unit: what must hold after each, whatever the unit is made of inside."""

import bpy
import numpy as np
import pytest

from mu_addon.blender.gripper import object as gripper_object
from mu_addon.blender.jobs import start_child
from mu_addon.blender.live_bending import state as live
from mu_addon.blender.obstacles import state as obstacles
from mu_addon.blender.path import candidates
from mu_addon.blender.scene import gestures
from mu_addon.blender.shared import displays, scene_units
from mu_addon.blender.sidebar import unit_panel
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate.job import SIMULATION
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.fields import field
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.parameters import Chambers
from mu_addon.design.quantity import describe

from .acting import add, refused
from .drawing import drawn
from .jobs import ended, launch, watch
from .test_motion import show

TALL = 81.0
"""Height in mm of a unit of scale 1: 75 and the inlet's 6."""


def belonging(root):
    """Everything of the scene that is the unit or belongs to it."""
    return [o for o in bpy.context.scene.objects if unit_object.root_of(o) == root]


def corners(root):
    """What is seen of the unit itself, struts as their axes, in the world: corners low and high (3,)."""
    points = np.empty(3 * len(root.data.vertices), np.float32)
    root.data.vertices.foreach_get("co", points)
    matrix = np.array(root.matrix_world)
    points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    return points.min(axis=0), points.max(axis=0)


def size(root):
    low, high = corners(root)
    return high - low


def select(*objects):
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[-1]
    bpy.context.view_layer.update()


def other_than(*roots):
    """The unit that is none of these."""
    (found,) = [root for root in unit_object.roots() if root not in roots]
    return found


def stranger(at=(500.0, 0.0, 0.0)):
    bpy.ops.mesh.primitive_cube_add(size=20.0, location=at)
    return bpy.context.object


def test_a_click_anywhere_on_a_unit_is_on_the_unit():
    root = add()
    # A click selects one object: of all that is drawn for the unit, there is only the unit itself.
    assert belonging(root) == [root]
    assert root.type == "MESH"
    assert np.allclose(size(root)[2], TALL, atol=1e-3)
    assert bpy.context.selected_objects == [root]
    bpy.ops.object.select_all(action="SELECT")
    assert bpy.context.selected_objects == [root]
    # Its size is a parameter of the design: S would show another unit than the one that is simulated.
    assert list(root.lock_scale) == [True] * 3


@pytest.mark.parametrize("linked", [False, True])
def test_a_duplicate_is_complete_and_independent(linked, tmp_path):
    root = add(preset="mu-0.75x")
    root.name = "first"
    root.mu_unit.study.folder = str(tmp_path / "kept")
    bpy.ops.mu.path(name="alpha4")
    select(root)
    assert bpy.ops.object.duplicate(linked=linked) == {"FINISHED"}
    bpy.context.view_layer.update()
    copy = other_than(root)
    assert bpy.context.object == copy
    assert copy.mu_unit.uuid != root.mu_unit.uuid
    assert root.mu_unit.study.folder == str(tmp_path / "kept")
    assert studies.folder_of(copy) != studies.folder_of(root)
    assert np.allclose(size(copy), size(root))
    before = size(root).copy()
    copy.mu_unit.chambers.count = 4
    bpy.context.view_layer.update()
    assert root.mu_unit.chambers.count == 6
    assert np.allclose(size(root), before)
    assert np.allclose(size(copy)[2], 0.75 * (50.0 + 6.0), atol=1e-3)
    root.mu_unit.chambers.count = 5
    bpy.context.view_layer.update()
    assert np.allclose(size(root)[2], 0.75 * (62.5 + 6.0), atol=1e-3)
    assert np.allclose(size(copy)[2], 0.75 * (50.0 + 6.0), atol=1e-3)
    select(root)
    assert bpy.ops.object.delete() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert unit_object.roots() == [copy]
    copy.mu_unit.chambers.wall_mm = 0.95
    assert copy.mu_unit.trouble == ""
    assert np.allclose(size(copy)[2], 0.75 * (50.0 + 6.0), atol=1e-3)


@pytest.mark.parametrize("shown", ["a motion", "candidates"])
def test_a_duplicate_of_everything_selected_has_no_results_of_the_other(study, shown):
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(study)
    show(name="alpha4")
    # They stand on the unit at rest: the motion goes.
    root.mu_unit.candidates = shown == "candidates"
    bpy.ops.object.select_all(action="SELECT")
    count = len(belonging(root))
    assert bpy.ops.object.duplicate() == {"FINISHED"}
    bpy.context.view_layer.update()
    copy = other_than(root)
    assert len(belonging(root)) == count
    assert [o for o in belonging(copy) if o.get(displays.MOTION)] == []
    candidates = [o for o in belonging(copy) if o.get("mu_part", "").startswith("candidate:")]
    assert len(candidates) == (10 if shown == "candidates" else 0)
    assert studies.findings(root) is not None
    assert studies.findings(copy) is None


def test_a_duplicate_that_shows_its_solid_builds_its_own():
    root = add(preset="mu-0.75x")
    bpy.ops.mu.solid()
    select(root)
    bpy.ops.object.duplicate(linked=True)
    bpy.context.view_layer.update()
    copy = other_than(root)
    assert unit_object.solid_is_current(copy)
    copy.mu_unit.show = "preview"
    assert root.mu_unit.show == "solid"
    copy.mu_unit.chambers.count = 4
    assert not unit_object.solid_is_current(copy)
    assert unit_object.solid_is_current(root)
    assert np.allclose(size(root)[2], 0.75 * TALL, atol=1e-2)
    assert np.allclose(size(copy)[2], 0.75 * 56.0, atol=1e-2)


def test_x_deletes_all_of_it_and_nothing_else(study):
    other = stranger()
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(study)
    root.mu_unit.candidates = True
    root.mu_motion.on_unit = False  # beside the unit at rest, so that candidates stay
    show(name="alpha4")
    bpy.ops.mu.motion_legend()
    second = add(preset="mu-0.75x")
    own = bpy.data.objects.new("of the user's own", None)
    bpy.context.collection.objects.link(own)
    own.parent = root
    assert len(belonging(root)) > 13
    select(root)
    assert bpy.ops.object.delete() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert {o.name for o in bpy.data.objects} == {other.name, second.name, own.name}
    assert len([m for m in bpy.data.meshes if m.users]) == 2
    assert np.allclose(size(second)[2], 0.75 * TALL, atol=1e-2)
    assert study.is_dir(), "results are files of the user's"


def test_deleted_while_it_is_simulated():
    root = add()
    child = launch(root, "hang")
    watch(lambda: child.progress)
    key = SIMULATION.key(root)
    select(root)
    assert bpy.ops.object.delete() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert list(bpy.data.objects) == []
    assert [job.key for job in start_child.running()] == [key], "undo may bring the unit back"
    child.cancel()
    ended(child)


def test_a_new_name_shows_in_the_panel_and_keeps_the_results(study):
    root = add(preset="mu-0.75x")
    assert root.name == "mu-0.75x"
    root.mu_unit.study.folder = str(study)
    assert not studies.findings(root).stale
    bpy.ops.mu.solid()
    root.name = "Thumb"
    bpy.context.view_layer.update()
    assert "Thumb" in drawn(unit_panel)
    assert to_unit(root.mu_unit).name == "Thumb"
    assert not studies.findings(root).stale
    assert unit_object.solid_is_current(root)
    root.mu_unit.title = "Index"
    assert root.name == "Index"


def test_hidden_and_moved_to_a_collection_as_a_whole():
    root = add()
    root.mu_unit.candidates = True
    root.hide_set(True)  # as H does
    bpy.context.view_layer.update()
    assert not any(o.visible_get() for o in belonging(root))
    root.hide_set(False)
    bpy.context.view_layer.update()
    assert all(o.visible_get() for o in belonging(root))
    shelf = bpy.data.collections.new("shelf")
    bpy.context.scene.collection.children.link(shelf)
    for collection in root.users_collection:
        collection.objects.unlink(root)
    shelf.objects.link(root)
    bpy.context.view_layer.update()
    assert all(list(o.users_collection) == [shelf] for o in belonging(root))
    root.mu_unit.candidates = False
    root.mu_unit.candidates = True
    assert all(list(o.users_collection) == [shelf] for o in belonging(root))


def test_a_part_deleted_by_force_comes_back():
    root = add()
    root.mu_unit.candidates = True
    select(candidates.candidate(root, "alpha3"))
    bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert candidates.candidate(root, "alpha3") is not None
    root.data.clear_geometry()
    bpy.context.view_layer.update()
    assert bpy.ops.mu.rebuild() == {"FINISHED"}
    assert np.allclose(size(root)[2], TALL, atol=1e-3)
    root.modifiers.clear()
    bpy.context.view_layer.update()
    assert len(root.modifiers) == 1, "it came back by itself"
    assert np.allclose(size(root)[2], TALL, atol=1e-3)
    bpy.data.node_groups.remove(root.modifiers[0].node_group)
    bpy.context.view_layer.update()
    assert len([m for m in root.modifiers if m.node_group is not None]) == 1
    assert np.allclose(size(root)[2], TALL, atol=1e-3)


def library(folder, **settings):
    """A saved file with a unit in a collection, and an empty one in its place."""
    folder.mkdir(exist_ok=True)
    root = add(preset="mu-0.75x", **settings)
    shelf = bpy.data.collections.new("shelf")
    bpy.context.scene.collection.children.link(shelf)
    for collection in root.users_collection:
        collection.objects.unlink(root)
    shelf.objects.link(root)
    root.name = "stored"
    root.mu_unit.path = "alpha4"
    root.mu_unit.study.folder = "//stored.mu/one"
    file = folder / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    tall, uuid = size(root)[2], root.mu_unit.uuid
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mu.millimetres()
    return file, tall, uuid


def fetched(file, name, link):
    bpy.ops.wm.append(
        filepath=str(file / "Object" / name), directory=f"{file}/Object/", filename=name, link=link
    )
    bpy.context.view_layer.update()
    return next(o for o in bpy.context.scene.objects if o.name.startswith(name))


def test_appended_it_is_a_unit_of_its_own(tmp_path):
    file, tall, uuid = library(tmp_path / "there")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here.blend"))
    first = fetched(file, "stored", link=False)
    # Its results are those of the file that it comes from: found there, and never written to by this one.
    assert first.mu_unit.uuid != uuid
    assert studies.folder_of(first) != tmp_path / "there" / "stored.mu" / "one"
    assert tmp_path / "there" not in studies.folder_of(first).parents
    assert np.isclose(size(first)[2], tall)
    first.mu_unit.chambers.count = 4
    assert np.isclose(size(first)[2], 0.75 * 56.0, atol=1e-3)
    assert unit_object.root_of(first).mu_unit.path == "alpha4"
    fetched(file, "stored", link=False)
    assert len({root.mu_unit.uuid for root in unit_object.roots()}) == 2


@pytest.mark.parametrize("way", ["appended", "linked", "made local", "overridden"])
def test_taken_from_a_file_where_it_shows_its_result_it_is_seen_at_rest_and_says_so(way, study, tmp_path):
    root = add(preset="mu-0.75x")
    root.name, root.mu_unit.study.folder = "stored", str(study)
    show()
    assert root.mu_unit.show == "result"
    file = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    root = fetched(file, "stored", link=way != "appended")
    if way == "overridden":
        root = root.override_create(remap_local_usages=True)
    elif way == "made local":
        select(root)
        bpy.ops.object.make_local(type="ALL")
    for _ in range(2):
        bpy.context.view_layer.update()
        gestures.look()
    root = next(o for o in bpy.context.scene.objects if o.name == "stored")
    seen = root.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert len(seen.data.vertices) > 500
    select(root)
    assert ("No result of its own to show" in drawn(unit_panel)) == (way == "appended")
    if way == "appended":
        assert root.mu_unit.show == "preview"
        assert len(seen.data.vertices) > 20_000, "the skinned struts"


def test_appended_bent_and_with_its_solid_it_bends_and_brings_no_other_object(tmp_path):
    root = add(preset="mu-0.75x")
    root.name = "stored"
    assert bpy.ops.mu.solid() == {"FINISHED"}
    solid = root.mu_unit.solid.name
    root.mu_live.on = True
    file = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    fetched(file, "stored", link=True)
    assert bpy.context.scene.objects.keys() == ["stored"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    root = fetched(file, "stored", link=False)
    assert bpy.context.scene.objects.keys() == ["stored"]
    assert root.mu_unit.solid.name == solid
    assert unit_object.solid_is_current(root)
    assert live.of(root) is not None
    root.mu_live.on = False


def test_appended_beside_another_it_has_one_skin(tmp_path):
    file, *_ = library(tmp_path / "there")
    first = add(preset="mu-0.75x")
    for _ in range(2):
        fetched(file, "stored", link=False)
    first.mu_unit.path = "alpha4"
    graph = bpy.context.evaluated_depsgraph_get()
    skinned = {len(root.evaluated_get(graph).data.vertices) for root in unit_object.roots()}
    assert len(unit_object.roots()) == 3
    assert len(skinned) == 1, skinned
    group = bpy.data.node_groups["MU Unit"]
    assert [[m.node_group for m in root.modifiers] for root in unit_object.roots()] == [[group]] * 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "here.blend"))
    assert not [tree.name for tree in bpy.data.node_groups if "." in tree.name]


def test_a_unit_of_another_scene_keeps_the_size_of_its_own(tmp_path):
    root = add(preset="mu-0.75x")
    scale = root.scale.x
    other = bpy.data.scenes.new("metres")
    other.unit_settings.scale_length = 1.0 if scale == 1.0 else 0.001
    bpy.context.window.scene = other
    bpy.context.view_layer.update()
    gestures.look()
    assert root.scale.x == scale


def test_from_a_scene_of_millimetres_it_comes_into_one_of_metres_true_in_size_and_place(tmp_path):
    file, tall, _ = library(tmp_path / "there")
    bpy.ops.wm.open_mainfile(filepath=str(file))
    bpy.data.objects["stored"].location = (1049.0, 0.0, 0.0)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    root = fetched(file, "stored", link=False)
    assert np.isclose(size(root)[2], tall / 1000.0)
    assert np.isclose(root.location.x, 1.049)
    linked = fetched(file, "stored", link=True)
    linked = next(o for o in bpy.data.objects if o.library is not None)
    select(linked)
    assert "Appears at 1e+03 times its true size. Object > Library Override" in drawn(unit_panel)
    override = linked.override_create(remap_local_usages=True)
    bpy.context.view_layer.update()
    gestures.look()
    bpy.context.view_layer.update()
    assert np.isclose(size(override)[2], tall / 1000.0)


def test_a_linked_collection_has_its_true_size(tmp_path):
    file, _, _ = library(tmp_path / "there")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.link(directory=f"{file}/Collection/", filename="shelf", instance_collections=True)
    (instance,) = (o for o in bpy.context.scene.objects if o.instance_type == "COLLECTION")
    assert np.allclose(instance.scale, 0.001)


def test_below_a_scaled_parent_a_unit_keeps_its_true_size():
    root = add()
    parent = bpy.data.objects.new("parent", None)
    bpy.context.collection.objects.link(parent)
    root.parent = parent
    for scale in ((2.0,) * 3, (0.5,) * 3):
        parent.scale = scale
        for _ in range(2):
            bpy.context.view_layer.update()
            gestures.look()
        assert np.isclose(scene_units.shown_factor(root, bpy.context.scene), 1.0, rtol=1e-5)
    parent.scale = (1.0, 1.0, 2.0)
    bpy.context.view_layer.update()
    gestures.look()
    select(root)
    assert "times its true size. A parent is scaled" in drawn(unit_panel)


def test_an_asset_that_is_dropped_again_has_a_mesh_of_its_own(tmp_path):
    """Blender reuses what it brought in before; a mesh that ten units share is slower to bring in, too."""
    file, tall, _ = library(tmp_path / "there")
    for _ in range(3):
        bpy.ops.wm.append(directory=f"{file}/Object/", filename="stored", do_reuse_local_id=True)
    units = unit_object.roots()
    assert len({root.mu_unit.uuid for root in units}) == len({root.data.name for root in units}) == 3
    assert all(root.mu_unit.preview == root.data for root in units)
    units[1].mu_unit.chambers.count = 4
    heights = sorted(round(size(root)[2], 3) for root in units)
    assert heights == [round(0.75 * 56.0, 3), round(tall, 3), round(tall, 3)]


def test_linked_it_shows_and_says_why_it_does_not_change(tmp_path):
    file, tall, _ = library(tmp_path / "there")
    root = fetched(file, "stored", link=True)
    assert root.library is not None
    assert np.isclose(size(root)[2], tall)
    select(root)
    assert unit_object.active_root(bpy.context) == root
    assert "linked from library.blend" in drawn(unit_panel)
    for operator in (bpy.ops.mu.solid, bpy.ops.mu.simulate, bpy.ops.mu.rebuild, bpy.ops.mu.delete):
        assert "linked from library.blend" in refused(operator)
    assert bpy.ops.object.make_local(type="ALL") == {"FINISHED"}
    bpy.context.view_layer.update()
    (root,) = unit_object.roots()
    root.mu_unit.chambers.count = 4
    assert np.isclose(size(root)[2], 0.75 * 56.0, atol=1e-3)


def test_a_library_override_is_moved_and_keeps_its_shape(tmp_path):
    file, tall, _ = library(tmp_path / "there")
    linked = fetched(file, "stored", link=True)
    root = linked.override_create(remap_local_usages=True)
    root.location = (40.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    assert np.isclose(size(root)[2], tall)
    assert corners(root)[0][0] > 20.0
    select(root)
    assert "linked from library.blend" in drawn(unit_panel)
    assert "linked from library.blend" in refused(bpy.ops.mu.rebuild)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "user.blend"))
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = [o for o in bpy.context.scene.objects if o.mu_unit.uuid]
    assert np.isclose(size(root)[2], tall)
    assert root.location.x == 40.0


@pytest.mark.parametrize(
    ("system", "scale_length"), [("METRIC", 1.0), ("METRIC", 0.001), ("IMPERIAL", 1.0), ("NONE", 1.0)]
)
def test_a_unit_has_its_true_size_in_any_scene(system, scale_length):
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = system, scale_length
    units.length_unit = {"METRIC": "METERS", "IMPERIAL": "INCHES"}.get(system, units.length_unit)
    before = units.system, units.scale_length, units.length_unit
    root = add(millimetres=False)
    assert (units.system, units.scale_length, units.length_unit) == before
    # Without a unit system lengths are numbers: there they are mm.
    metres = size(root)[2] * (0.001 if system == "NONE" else units.scale_length)
    assert np.isclose(metres, TALL / 1000.0, rtol=1e-4), metres
    chambers = root.mu_unit.chambers
    wall = next(d for d in describe(Chambers) if d.name == "wall_mm")
    assert np.isclose(getattr(chambers, field(chambers, wall)), 0.9, rtol=1e-5), "in mm, in any scene"
    chambers.wall_mm_true = 1.0
    assert np.isclose(to_unit(root.mu_unit).chambers.wall_mm, 1.0, rtol=1e-6)
    units.system, units.scale_length = "METRIC", 0.01
    bpy.context.view_layer.update()
    assert np.isclose(size(root)[2] * units.scale_length, TALL / 1000.0, rtol=1e-4)


def test_a_new_unit_lands_beside_what_is_there():
    cube = stranger((0.0, 0.0, 0.0))
    roots = [add(), add(preset="mu-0.75x"), add()]
    bpy.ops.mu.gripper_add()
    gripper = bpy.context.object
    bpy.context.view_layer.update()
    boxes = [np.array([cube.matrix_world @ v.co for v in cube.data.vertices])]
    boxes = [(b.min(axis=0), b.max(axis=0)) for b in boxes] + [corners(root) for root in roots]
    boxes.append(corners(gripper))
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[:i]:
            assert ((low > other_high) | (other_low > high)).any()


def test_a_preset_keeps_a_name_of_the_users():
    root = add()
    bpy.ops.mu.preset_load(name="mu-0.75x")
    assert root.name == "mu-0.75x"
    root.name = "Thumb"
    bpy.ops.mu.preset_load(name="mu-1.5x")
    assert root.name == "Thumb"
    assert root.mu_unit.scale == 1.5


def test_a_gripper_is_one_thing_too(tmp_path):
    bpy.ops.mu.millimetres()
    bpy.ops.mu.gripper_add()
    root = bpy.context.object
    root.mu_gripper.folder = str(tmp_path)
    assert root.type == "MESH"
    assert [child.get("mu_grip") for child in root.children] == ["cube"]
    select(root)
    bpy.ops.object.duplicate(linked=True)
    bpy.context.view_layer.update()
    (copy,) = (other for other in gripper_object.roots() if other != root)
    assert copy.mu_gripper.uuid != root.mu_gripper.uuid
    assert copy.mu_gripper.folder == ""
    assert [child.get("mu_grip") for child in copy.children] == ["cube"]
    wide = size(root)[1]
    copy.mu_gripper.fingers.gap_mm += 10.0
    assert np.isclose(size(root)[1], wide)
    assert size(copy)[1] > wide + 5.0
    bpy.data.objects.remove(copy.children[0])
    bpy.context.view_layer.update()
    assert len(copy.children) == 1, "the cube comes back"
    select(root)
    bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert {o.name for o in bpy.data.objects} == {copy.name, copy.children[0].name}


def test_millimetres_keep_true_sizes_and_places_of_what_belongs_to_a_study():
    """In a scene of metres everything stands in metres; in millimetres the same numbers are 1000 times."""
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = "METRIC", 1.0
    bpy.context.scene.cursor.location = (0.05, 0.02, 0.0)
    first, second = add(millimetres=False), add(millimetres=False)
    bpy.context.view_layer.objects.active = first
    assert bpy.ops.mu.obstacle_box(gap=5.0) == {"FINISHED"}
    box = bpy.data.objects["Obstacle"]
    tied = bpy.data.objects.new("Tied", box.data.copy())
    bpy.context.collection.objects.link(tied)
    tied.parent, tied.location.y = first, 60.0
    tied.mu_obstacle.unit = first.mu_unit.uuid
    bpy.ops.mu.gripper_add()
    gripper = bpy.context.object
    cube = next(child for child in gripper.children if child.get("mu_grip") == "cube")
    bpy.context.view_layer.update()
    every = [first, second, box, tied, gripper, cube]
    before = [np.array(corners(obj)) for obj in every]
    frames = [np.array(first.matrix_world.inverted() @ obj.matrix_world) for obj in every]
    met = obstacles.placed(first, box).body.vertices
    bpy.context.view_layer.objects.active = first
    assert bpy.ops.mu.millimetres() == {"FINISHED"}
    bpy.context.view_layer.update()
    for obj, old, frame in zip(every, before, frames, strict=True):
        assert np.allclose(np.array(corners(obj)), 1000.0 * old, rtol=1e-5, atol=1e-3), obj.name
        now = np.array(first.matrix_world.inverted() @ obj.matrix_world)
        assert np.allclose(now, frame, rtol=1e-5, atol=1e-3), obj.name
    assert np.allclose(bpy.context.scene.cursor.location, (50.0, 20.0, 0.0), rtol=1e-5)
    assert np.allclose(obstacles.placed(first, box).body.vertices, met, atol=1e-4)
    # By Blender's own field, too, and again and again: each look mends once.
    units.scale_length = 1.0
    for _ in range(3):
        bpy.context.view_layer.update()
    for obj, old in zip(every, before, strict=True):
        assert np.allclose(np.array(corners(obj)), old, rtol=1e-5, atol=1e-6), obj.name
