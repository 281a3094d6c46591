"""A gripper in Blender: drawn from the core's parameters, sent to grasp, its grasp on the timeline."""

import json
from pathlib import Path

import bpy
import numpy as np

from mu_addon.blender.gripper import object as gripper_object
from mu_addon.blender.gripper import panel as gripper_panel
from mu_addon.blender.gripper import state as grasps
from mu_addon.blender.gripper import timeline as grasp_motion
from mu_addon.blender.gripper.properties import to_gripper
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.simulate import timings
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.drawing import PARTS
from mu_addon.design.gripper import load_gripper
from mu_addon.files import write_npz
from mu_addon.report.pc2 import write_pc2
from mu_addon.studies.grip import Grip

from .acting import add, refused
from .drawing import drawn as drawn_by

PANELS = gripper_panel


def held(**settings):
    bpy.ops.mu.millimetres()
    assert bpy.ops.mu.gripper_add(**settings) == {"FINISHED"}
    bpy.context.view_layer.update()
    return gripper_object.active(bpy.context)


def world(obj):
    at = motion_parts.vertices_of(obj.data)
    matrix = np.array(obj.matrix_world)
    return at @ matrix[:3, :3].T + matrix[:3, 3]


def drawn():
    return drawn_by(PANELS)


def test_the_active_object_says_which_panels_are_seen():
    """With one unit and one gripper in a scene, whichever is active has the sidebar to itself."""
    gripper = held()
    unit = add()
    assert gripper_object.active(bpy.context) is None
    bpy.context.view_layer.objects.active = gripper
    assert gripper_object.active(bpy.context) == gripper
    assert unit_object.active_root(bpy.context) is None
    bpy.context.view_layer.objects.active = gripper_object.part(gripper, "cube")
    assert gripper_object.active(bpy.context) == gripper
    assert unit_object.active_root(bpy.context) is None
    bpy.context.view_layer.objects.active = None
    assert unit_object.active_root(bpy.context) == unit, "the only unit there is"
    assert gripper_object.active(bpy.context) is None


def test_two_fingers_face_each_other_over_the_plate():
    root = held()
    assert root.mu_gripper.trouble == ""
    assert not unit_object.roots()
    assert [o.name for o in bpy.data.objects] == ["Cube", root.name], "one object, and the cube"

    def both(part):
        of = np.array([item.value for item in root.data.attributes["mu_part"].data]) == PARTS.index(part)
        at = world(root)[of]
        return at[: len(at) // 2], at[len(at) // 2 :]

    for gap in (30.0, 40.0):
        root.mu_gripper.fingers.gap_mm = gap
        bpy.context.view_layer.update()
        bars = both("waveguide")
        assert np.allclose(bars[0] * [-1, -1, 1], bars[1], atol=1e-4), "each half a turn from the other"
        inner = [at[:, 1] for at in both("lattice")]
        # Struts end at the envelope's faces: the gap is between those.
        assert abs(inner[1].min() - inner[0].max() - gap) < 1e-3
    plate, cube = np.concatenate(both("plate")), world(gripper_object.part(root, "cube"))
    assert plate[:, 2].max() == 0.0
    assert abs(plate[:, 2].min() + 5.0) < 1e-6
    assert np.allclose(cube.min(axis=0), [-12.5, -12.5, 75 + 3 - 12.5], atol=1e-4)
    root.mu_gripper.cube_mm = 12.5
    assert np.allclose(np.ptp(world(gripper_object.part(root, "cube")), axis=0), 12.5, atol=1e-4)
    # It is the user's to move, along the fingers, and stays there.
    moved = gripper_object.part(root, "cube")
    assert tuple(moved.lock_location) == (True, True, False)
    moved.location.z = 80.3
    assert np.isclose(root.mu_gripper.cube_height, 80.3 * root.scale.x), (
        "as long as it is, in the scene's unit"
    )
    root.mu_gripper.cube_height = 80.3 * root.scale.x
    root.mu_gripper.cube_mm = 20.0
    bpy.context.view_layer.update()
    assert np.allclose(world(moved).mean(axis=0), [0, 0, 80.3], atol=1e-4)
    assert gripper_object.beyond_mm(root) == 5.3

    root.mu_gripper.plate.hole_diameter_mm = 9.0
    assert "leave too little" in root.mu_gripper.trouble
    assert "leave too little" in drawn()
    assert "leave too little" in refused(bpy.ops.mu.grasp)
    root.mu_gripper.plate.hole_diameter_mm = 4.0
    assert root.mu_gripper.trouble == ""
    assert bpy.ops.mu.grasp.poll()
    assert bpy.ops.mu.gripper_delete() == {"FINISHED"}
    assert not bpy.data.objects
    assert "Add > Mesh > Monolithic Gripper" in refused(bpy.ops.mu.gripper_delete)


def test_fingers_of_few_chambers_have_a_path_of_their_own():
    unit = add(preset="mu-1.0x")
    bpy.ops.mu.path(name="alpha4")
    # What was chosen for six chambers is none of three.
    unit.mu_unit.chambers.count = 3
    root = held(of_unit=True)
    assert to_gripper(root.mu_gripper).path == "alpha1"
    assert not root.mu_gripper.trouble


def test_its_fingers_may_be_a_unit_of_ones_own(tmp_path):
    unit = add(preset="mu-0.75x")
    unit.mu_unit.chambers.wall_mm = 1.1
    bpy.ops.mu.path(name="alpha3")
    root = held(of_unit=True)
    core = to_gripper(root.mu_gripper)
    assert (core.unit.scale, core.unit.chambers.wall_mm, core.path) == (0.75, 1.1, "alpha3")
    # The active object decides whether unit or gripper is worked on.
    assert gripper_object.active(bpy.context) == root
    bpy.context.view_layer.objects.active = unit
    assert gripper_object.active(bpy.context) is None
    unit.mu_unit.chambers.wall_mm = 0.9
    assert to_gripper(root.mu_gripper).unit.chambers.wall_mm == 1.1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = gripper_object.roots()
    assert to_gripper(root.mu_gripper) == core


def test_what_a_grasp_is_asked(tmp_path):
    root = held()
    props = root.mu_gripper
    props.folder, props.cube_mm, props.friction = str(tmp_path / "out"), 20.0, 0.3
    props.fingers.gap_mm = 26.5
    grasps.GRASPING.write(root, tmp_path / "asked")
    asked = Grip.read(tmp_path / "asked")
    assert (asked.sides, asked.friction, asked.beyond_mm) == ((20.0,), 0.3, 3.0)
    assert (asked.coarse, asked.refine) == (True, 0.4)
    assert asked.gripper.fingers.gap_mm == 26.5
    assert asked.self_contact
    props.detail = "part"
    assert grasps.GRASPING.inputs(root).sides == ()
    assert "was not grasped yet" in drawn()
    assert "there is no grasp" in refused(bpy.ops.mu.grasp_show)


def test_the_button_says_what_a_grasp_will_take_by_what_was_measured_here(tmp_path, monkeypatch):
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    root = held()
    props = root.mu_gripper
    props.folder, props.cube_mm = str(tmp_path / "out"), 20.0
    assert "Grasp, perhaps " in drawn()
    grasps.GRASPING.write(root, tmp_path / "out")
    seconds = {"solid": 3.0, "mesh": 5.0, "grasp of 20 mm": 582.0, "light": 4.0, "report": 6.0}
    (tmp_path / "out" / "summary.json").write_text(json.dumps({"seconds": seconds}), encoding="utf-8")
    timings.note(*timings.of_run(tmp_path / "out"))
    assert "Grasp, about 10 min" in drawn()
    assert dict(grasps.GRASP.plan_of(root))["grasp of 20 mm"] == 582.0, (
        "and the bar counts by the same figure"
    )
    props.cube_mm = 12.5
    assert "Grasp, about 10 min" in drawn(), "another cube takes about as long"
    props.self_contact = False
    assert "Grasp, perhaps " in drawn(), "another model does not"
    props.detail = "part"
    assert "Make the Part, perhaps 10 s" in drawn()


def write_folder(folder):
    """What `grip` leaves of a grasp of 20 mm in 2 s: a triangle a finger, which goes 5 mm inward and back."""
    (folder / "cube-20").mkdir(parents=True)
    for name, text in Grip(gripper=load_gripper("gripper"), cubes_mm=(20.0,)).texts().items():
        (folder / name).write_text(text, encoding="utf-8")
    figures = {"angle_at_hold_deg": 12.3, "normal_at_hold_N": 0.45, "held": True, "margin": 4.0}
    figures["gap_error_mm"] = 0.02
    (folder / "summary.json").write_text(json.dumps({"grasps": {"20": figures}}), encoding="utf-8")
    rows = ["phase,time_s,normal_N", "i,0,0", "ii,1,0.5", "v,2,0"]
    (folder / "grasp_20.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    triangle = np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]])
    apart = np.array([0.0, 30.0, 0.0])
    rest = np.array([triangle - apart, triangle + apart])
    way = np.array([0.0, 5.0, 0.0])[:, None, None] * [0.0, 1.0, 0.0]
    for side, at, inward in (("left", rest[0], 1.0), ("right", rest[1], -1.0)):
        write_pc2(folder / "cube-20" / f"{side}.pc2", at + inward * way, 0.0, 1.0)
    write_npz(
        folder / "cube-20" / "gripper.npz",
        {
            "rest_mm": rest.astype(np.float32),
            "triangles": np.array([[0, 1, 2]], np.int32),
            "membrane": np.array([True]),
            "time_s": np.array([0.0, 1.0, 2.0]),
            "cube_mm": np.array([[0.0, 0.0, 98.0], [0.0, 0.0, 78.0], [0.0, 0.0, 79.0]]),
            "cube_side_mm": np.array(20.0),
        },
    )


def test_a_grasp_plays_on_the_timeline(tmp_path):
    write_folder(tmp_path / "out")
    root = held()
    props = root.mu_gripper
    props.folder = str(tmp_path / "out")
    assert grasps.of(root) is None, "another cube"
    props.cube_mm = 20.0
    found = grasps.of(root)
    assert not found.stale
    assert "12.3°, 0.45 N" in drawn()
    assert "Held: friction carries 4 times the weight" in drawn()
    scene = bpy.context.scene
    scene.render.fps = 10
    assert bpy.ops.mu.grasp_show() == {"FINISHED"}
    left, right, cube = grasp_motion.parts(root)
    assert scene.frame_end == 21
    for frame, way, height, expected in (
        (1, 0.0, 98.0, "Opening: 0.00 N"),
        (6, 2.5, 88.0, "0.25 N"),
        (11, 5.0, 78.0, "Closing: 0.50 N"),
        (21, 0.0, 79.0, "Rel"),
    ):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        moved = [motion_parts.vertices_of(o.evaluated_get(graph).data) for o in (left, right)]
        assert np.allclose(moved[0][:, 1].min(), -30 + way, atol=1e-3), frame
        assert np.allclose(moved[1][:, 1].min(), 30 - way, atol=1e-3), frame
        assert abs(cube.matrix_world.translation.z - height) < 1e-3, frame
        assert expected in drawn(), drawn()
    assert gripper_object.part(root, "cube").hide_viewport
    assert not cube.hide_viewport
    assert bpy.ops.mu.grasp_show() == {"FINISHED"}
    assert len(grasp_motion.parts(root)) == 3
    bpy.ops.mu.grasp_show(on=False)
    assert not grasp_motion.parts(root)
    assert not gripper_object.part(root, "cube").hide_viewport
    for name, value in (("friction", 0.4), ("density_g_per_ml", 1.0), ("path", "alpha3")):
        before = getattr(props, name)
        setattr(props, name, value)
        assert grasps.of(root).stale, name
        assert "Stale" in drawn(), name
        setattr(props, name, before)
        assert not grasps.of(root).stale
    props.paths = "alpha2"
    assert props.path == "alpha2"
    assert grasps.of(root).stale
    props.paths = "alpha4"
    gripper_object.part(root, "cube").location.z += 2.0
    assert grasps.of(root).stale
    assert "Stale" in drawn()


def test_an_unsaved_files_grasp_goes_where_saving_finds_it(tmp_path):
    root = held()
    unsaved = grasps.folder_of(root)
    root.mu_gripper.folder = str(unsaved)
    root.mu_gripper.cube_mm = 20.0
    write_folder(unsaved)
    assert bpy.ops.mu.grasp_show() == {"FINISHED"}
    place = tmp_path / "project"
    place.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(place / "hand.blend"))
    assert not unsaved.exists()
    assert grasps.folder_of(root) == place / "hand.mu" / unsaved.name
    place.rename(tmp_path / "moved")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "moved" / "hand.blend"))
    (root,) = gripper_object.roots()
    left, right, _ = grasp_motion.parts(root)
    for part in (left, right):
        path = bpy.path.abspath(part.modifiers["Motion"].filepath)
        assert Path(path).is_file(), path
    assert grasps.of(root) is not None


def test_both_fingers_are_cut_open_toward_the_same_side():
    root = held()
    root.mu_gripper.cut = True
    of = np.array([item.value for item in root.data.attributes["mu_part"].data]) == PARTS.index("actuator")
    walls = motion_parts.vertices_of(root.data)[of]
    for side in (walls[walls[:, 1] < 0.0], walls[walls[:, 1] > 0.0]):
        assert side[:, 0].max() < 1e-6 < 10.0 < -side[:, 0].min(), "the half away from +x"
