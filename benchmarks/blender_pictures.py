"""The pictures that the pages on Blender show, taken of the extension as it is.

    python -m benchmarks.blender_pictures            what takes minutes, without a window: FOLDER/*.blend
    MU_BLENDER_UI... benchmarks/blender_pictures.py last.png SECONDS        FOLDER/blender-*.png

with FOLDER as MU_PICTURES (MU_BLENDER_UI as of tests/blender/test_installed.py, MU_TEST_FOLDER=FOLDER; it
needs ImageMagick). The first needs bpy, the second the built extension. MU_ONLY names some of the pictures,
with blanks between them. Each is made in a Blender as new, whose window is as large as the picture.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "blender")]

FOLDER = Path(os.environ["MU_PICTURES"])
ONLY = os.environ.get("MU_ONLY", "").split()
SIZE = 1100, 830
TITLE = 20
"""Height of the bar with the file's name, which is left out."""
COLOURS = 128
CLIP = "clip"
BASE, TIP = ("base a", "base b"), ("tip a", "tip b")


# What takes minutes, in a Python with bpy.


def prepare():
    """A grasp, units that are simulated, a diagnosis, two rankings and a filmed bench, as .blend files."""
    import mu_addon
    from mu_addon.blender.evidence.state import DIAGNOSIS
    from mu_addon.blender.gripper.state import GRASP
    from mu_addon.blender.simulate.job import SIMULATION
    from tests.blender.filming import ANGLES, film, pressures
    from tests.studies.diagnosis_data import weighed_blocks

    weighed_blocks(FOLDER / "blocks", 0.09)
    truth = film(FOLDER / CLIP, ANGLES)[:, 0].tolist()
    (FOLDER / "markers.json").write_text(json.dumps(dict(zip(BASE + TIP, truth, strict=True))))
    pressures(FOLDER, ANGLES)
    jobs = {
        "obstacle": ("obstacle", SIMULATION, bpy.ops.mu.simulate),
        "evidence": ("measured", DIAGNOSIS, bpy.ops.mu.evidence_diagnose),
        "gripper": ("gripper", GRASP, bpy.ops.mu.grasp),
        "printed": ("", SIMULATION, bpy.ops.mu.simulate),
    }
    for name, (scene, kind, start) in jobs.items():
        if ONLY and name not in ONLY:
            continue
        bpy.ops.wm.read_factory_settings(use_empty=True)
        mu_addon.register()
        bpy.ops.mu.millimetres()
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"{name}.blend"))
        if scene:
            bpy.ops.mu.sample(scene=scene)
        else:
            bpy.ops.mu.add(preset="mu-1.0x")
        root = bpy.context.view_layer.objects.active
        if name == "printed":
            root.mu_unit.study.command = "simulate"
        if name == "evidence":
            root.mu_evidence.folder = "//blocks"
        assert start() == {"FINISHED"}
        _wait(kind.child(root))
        bpy.ops.wm.save_mainfile()
        mu_addon.unregister()
        print(name, flush=True)
    if not ONLY or "runs" in ONLY:
        _two_runs()


def _two_runs():
    """A unit that was simulated with two walls, and ranked with one."""
    import mu_addon
    from mu_addon.blender.simulate.job import SIMULATION

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mu_addon.register()
    bpy.ops.mu.millimetres()
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "runs.blend"))
    assert bpy.ops.mu.add(preset="mu-1.0x") == {"FINISHED"}
    unit = bpy.context.view_layer.objects.active
    unit.mu_unit.study.refine = 0.5
    for wall, command in ((1.0, "simulate"), (0.9, "place")):
        unit.mu_unit.chambers.wall_mm, unit.mu_unit.study.command = wall, command
        assert bpy.ops.mu.simulate() == {"FINISHED"}
        _wait(SIMULATION.child(unit))
    bpy.ops.wm.save_mainfile()
    mu_addon.unregister()
    print("runs", flush=True)


def _wait(child):
    from mu_addon.blender.jobs import start_child

    while child.state in ("running", "waiting"):
        start_child.poll()
        time.sleep(0.2)
    assert child.state == "done", child.error


# The pictures, in a Blender with a window.


def shot(name):
    """The window as a picture of few colours."""
    file = FOLDER / f"blender-{name}.png"
    crop = f"{SIZE[0]}x{SIZE[1] - TITLE}+0+{TITLE}"
    command = ["import", "-window", "root", "-crop", crop, "+repage", "+dither", "-colors", str(COLOURS)]
    subprocess.run([*command, "-strip", f"PNG8:{file}"], check=True)
    print("picture", name, flush=True)


def new(*panels, file="", sidebar=True):
    """A Blender as new: one 3D view, the tab MU beside it, and of our panels those open that are named."""
    import addon_utils

    addon_utils.disable(package)
    for kind in panel_kinds:
        if panels and kind.bl_idname == "MU_PT_design":
            kind.bl_options = {"DEFAULT_CLOSED"}
        elif "DEFAULT_CLOSED" in usual[kind]:
            kind.bl_options = usual[kind] - ({"DEFAULT_CLOSED"} if kind.bl_idname in panels else set())
    bpy.ops.wm.read_homefile(load_ui=True, use_empty=False, use_factory_startup=False)
    yield 2.0
    if file:
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / file), load_ui=False)
        yield 2.0
    addon_utils.enable(package)
    yield 2.0
    for other in list(bpy.data.objects):
        if not file:
            bpy.data.objects.remove(other)
    window, area, _ = parts()
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield 2.0
    # What was done last would stand over the sensor's plot.
    parts()[1].spaces.active.show_region_hud = False
    if sidebar:
        parts()[1].spaces.active.show_region_ui = True
        yield 3.0
        parts()[2].active_panel_category = "MU"
        yield 1.0
    if not file:
        bpy.ops.mu.millimetres()


def added(cut=True, preset="mu-1.0x", path="alpha4"):
    """A unit, cut open, with a path."""
    assert called(bpy.ops.mu.add, preset=preset) == {"FINISHED"}
    yield 2.0
    root().mu_unit.cut = cut
    if path:
        assert called(bpy.ops.mu.path, name=path) == {"FINISHED"}
    yield 3.0


def root():
    return unit_object.roots()[0]


def scrolled(times):
    """The sidebar turned down."""
    region = parts()[2]
    move(region.x + region.width * 0.5, region.y + region.height * 0.4)
    yield 1.0
    for _ in range(times):
        event("WHEELDOWNMOUSE", "PRESS")
        yield 0.3
    yield 2.0


def seen_from(turn_deg, objects=None, wider=1.0):
    """Turn the view about the vertical axis, from the right view, and frame what is given or the unit."""
    from mathutils import Euler

    view = parts()[1].spaces.active.region_3d
    view.view_rotation = Euler((math.radians(78), 0.0, math.radians(90 + turn_deg))).to_quaternion()
    view.view_perspective = "PERSP"
    viewports.frame(objects or [root()])
    view.view_distance *= wider


def add():
    yield from new(sidebar=True)
    over_view(0.3, 0.75)
    yield 1.0
    key("A", shift=True)
    yield 2.0
    for letter in "mono":
        key(letter.upper(), unicode=letter)
        yield 1.0
    yield 1.0
    shot("add")
    key("ESC")
    key("ESC")
    yield 1.0


def steps():
    yield from new("MU_PT_stack")
    yield from added()
    seen_from(20)
    yield 2.0
    shot("steps")
    over_view(0.1, 0.6)
    yield 1.0
    assert called(bpy.ops.mu.chambers, "INVOKE_DEFAULT") == {"FINISHED"}
    yield 2.0
    key("F9")
    yield 3.0
    shot("redo")
    key("ESC")
    yield 1.0
    assert called(bpy.ops.mu.mute, step="trim") == {"FINISHED"}
    yield 3.0
    shot("muted")


def live():
    yield from new()
    yield from added(cut=False, path="")
    seen_from(20)
    root().mu_live.colour, root().mu_live.on = "largest_stretch", True
    while bending.of(root()).shape is None or not bending.of(root()).shape.fields:
        yield 0.5
    yield 5.0
    seen_from(20)
    yield 1.0
    shot("live")
    root().mu_live.on = False


def rule():
    yield from new()
    yield from added(preset="mu-1.5x")
    root().mu_unit.chambers.wall_mm = 3.0
    root().mu_unit.lattice.cells_x = 4
    seen_from(20)
    yield 3.0
    shot("rule")


def paths():
    yield from new("MU_PT_path", file="runs.blend")
    root().mu_unit.candidates = True
    seen_from(20)
    yield 3.0
    shot("paths")


def results_panel():
    yield from new("MU_PT_results", file="runs.blend")
    other = next(run.key for run in studies.runs_of(root()) if run.unit.chambers.wall_mm == 1.0)
    assert called(bpy.ops.mu.run_compare, key=other) == {"FINISHED"}
    assert called(bpy.ops.mu.field_show, field="run_difference_mm") == {"FINISHED"}
    yield 3.0
    yield from scrolled(4)
    shot("results-panel")


def paint():
    yield from new("MU_PT_lattice")
    yield from added(path="")
    assert called(bpy.ops.mu.paint_struts) == {"FINISHED"}
    seen_from(20)
    yield 2.0
    over_view(0.45, 0.75)
    yield 1.0
    event("LEFTMOUSE", "PRESS")
    for k in range(12):
        over_view(0.45, 0.75 - 0.04 * k)
        yield 0.2
    event("LEFTMOUSE", "RELEASE")
    yield 3.0
    shot("paint")


def deviation():
    yield from new("MU_PT_results", file="runs.blend")
    assert called(bpy.ops.mu.field_show, field="deviation_mm") == {"FINISHED"}
    yield 3.0
    shot("deviation")


def stress():
    yield from new("MU_PT_results", "MU_PT_field", file="printed.blend")
    assert called(bpy.ops.mu.field_show, field="von_mises_kPa") == {"FINISHED"}
    handles.to_pressure(root(), bpy.context.scene, 40.0)
    yield 3.0
    over_view(0.53, 0.5)
    yield 1.0
    assert called(bpy.ops.mu.probe, "INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    for k in range(4):
        yield 1.5
        over_view(0.53 + 0.003 * k, 0.5)
    yield 3.0
    shot("stress")
    key("ESC")
    yield 1.0


def print_layers():
    yield from new("MU_PT_print", "MU_PT_print_layers")
    yield from added(cut=False, path="")
    assert called(bpy.ops.mu.solid) == {"FINISHED"}
    while not unit_object.solid_is_current(root()):
        yield 1.0
    assert called(bpy.ops.mu.print_layer) == {"FINISHED"}
    root().mu_print.layer = 0.42
    seen_from(20, wider=0.6)
    yield from scrolled(9)
    shot("print-layers")


def print_part():
    yield from new("MU_PT_print", "MU_PT_print_files")
    yield from added(preset="mu-0.75x")
    assert called(bpy.ops.mu.solid) == {"FINISHED"}
    yield 3.0
    seen_from(20)
    yield 2.0
    shot("print")


def print_check():
    yield from new("MU_PT_print", "MU_PT_print_check")
    yield from added(cut=False, preset="mu-0.75x")
    assert called(bpy.ops.mu.print_check) == {"FINISHED"}
    child = printing.PRINTING.child(root())
    while child.state in ("running", "waiting"):
        yield 1.0
    assert child.state == "done", child.error
    yield 2.0
    assert called(bpy.ops.mu.print_show, finding=0) == {"FINISHED"}
    yield 2.0
    seen_from(20)
    yield from scrolled(11)
    shot("print-check")


def simulate():
    yield from new("MU_PT_simulate")
    yield from added(preset="mu-0.75x")
    seen_from(20)
    assert called(bpy.ops.mu.simulate) == {"FINISHED"}
    child = SIMULATION.child(root())
    while child.state == "running" and child.progress.get("stage") != "Model A":
        yield 1.0
    yield 4.0
    shot("simulate")
    assert called(bpy.ops.mu.cancel) == {"FINISHED"}
    while child.state == "running":
        yield 1.0


def obstacle():
    yield from new("MU_PT_simulate", "MU_PT_obstacles", file="obstacle.blend")
    assert called(bpy.ops.mu.field_show, field="displacement_mm") == {"FINISHED"}
    handles.to_pressure(root(), bpy.context.scene, 40.0)
    yield 3.0
    seen_from(0, [root(), *root().children], 1.4)
    yield 2.0
    shot("obstacle")


def gripper():
    yield from new("MU_PT_gripper", "MU_PT_grasp", file="gripper.blend")
    seen_from(14, [gripper_object.active(bpy.context), *gripper_object.active(bpy.context).children], 1.2)
    yield 2.0
    shot("gripper")
    gripper_object.active(bpy.context).mu_gripper.cut = True
    assert called(bpy.ops.mu.grasp_show) == {"FINISHED"}
    scene = bpy.context.scene
    scene.frame_set(round(0.55 * scene.frame_end))
    yield 3.0
    shot("grasp")


def apply():
    yield from new("MU_PT_evidence", file="evidence.blend")
    assert called(bpy.ops.mu.evidence_apply) == {"FINISHED"}
    yield 2.0
    seen_from(20)
    yield from scrolled(9)
    shot("apply")


def assets():
    yield from new(sidebar=False)
    assert called(bpy.ops.mu.assets) == {"FINISHED"}
    yield 3.0
    area = parts()[1]
    area.ui_type = "ASSETS"
    yield 3.0
    area.spaces.active.params.asset_library_reference = "Monolithic Units"
    # Its pictures are read one by one, behind the window.
    yield 15.0
    shot("assets")


def optimize():
    yield from new("MU_PT_optimize")
    yield from added(path="")
    props = root().mu_optimize
    for number, wanted in enumerate(
        ({"kind": "angle", "ask": "maximise"}, {"kind": "mass", "ask": "minimise"}, {"kind": "printable"})
    ):
        assert called(bpy.ops.mu.optimize_list, what="targets") == {"FINISHED"}
        for name, value in wanted.items():
            setattr(props.targets[number], name, value)
    for _ in range(2):
        assert called(bpy.ops.mu.optimize_list, what="freedoms") == {"FINISHED"}
    props.freedoms[1].how, props.freedoms[1].values = "values", "11.5, 12.5, 13.5"
    props.evaluations, props.refine, props.check_refine = 8, 0.35, 0.4
    seen_from(20)
    yield from scrolled(6)
    shot("optimize")
    assert called(bpy.ops.mu.optimize) == {"FINISHED"}
    child = OPTIMIZATION.child(root())
    while child.state in ("running", "waiting"):
        yield 1.0
    assert child.state == "done", child.error
    assert called(bpy.ops.mu.optimize_dismiss) == {"FINISHED"}
    assert called(bpy.ops.mu.job_dismiss) == {"FINISHED"}
    assert called(bpy.ops.mu.optimize_add, number=1) == {"FINISHED"}
    both = unit_object.roots()
    for one in both:
        one.mu_unit.cut = True
    unit_object.make_active(bpy.context, next(one for one in both if one.mu_optimize.targets))
    yield 3.0
    seen_from(50, both, 1.1)
    yield from scrolled(24)
    shot("optimize-found")


def sensor_live():
    import numpy as np

    calibration = module("sensing.calibration")
    yield from new("MU_PT_sensor", file="printed.blend")
    assert called(bpy.ops.mu.path, name="alpha4") == {"FINISHED"}
    root().mu_unit.cut = True
    # Three sweeps of the simulated sensor: its own law, with its noise.
    angle, random = 22.5 * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, 200))), np.random.default_rng(0)
    volts = 2.4 * np.exp(-0.006 * angle) - 0.02 + 0.004 * random.normal(size=(3, 200))
    sweeps = [
        calibration.CalibrationSweep(np.linspace(0.0, 8.0, 200) + 10 * k, angle, v)
        for k, v in enumerate(volts)
    ]
    file = sensor.calibration_file(root())
    file.parent.mkdir(parents=True, exist_ok=True)
    calibration.write_calibration(file, calibration.calibrate(sweeps, "light_V", "dark_V"))
    root().mu_sensor.source = "simulated"
    assert called(bpy.ops.mu.sensor_connect) == {"FINISHED"}
    assert called(bpy.ops.mu.sensor_twin) == {"FINISHED"}
    seen_from(10, [root(), *root().children], 1.9)
    parts()[1].spaces.active.region_3d.view_location.z -= 18.0
    yield 12.0
    while twin.status(root())[0] != "live" or sensor.of(root()).reading.angle_deg < 2.0:
        yield 0.05
    shot("sensor-live")
    assert called(bpy.ops.mu.sensor_disconnect) == {"FINISHED"}
    yield 3.0


def editor(tree, split=0.0):
    """A tree in the node editor, in place of the view or beside it, which keeps a share of the width."""
    window, area, _ = parts()
    if split:
        with bpy.context.temp_override(window=window, area=area):
            bpy.ops.screen.screen_full_area(use_hide_panels=False)
        yield 2.0
        while len(window.screen.areas) > 1:
            other = next(one for one in window.screen.areas if one.type != "VIEW_3D")
            with bpy.context.temp_override(window=window, area=other):
                assert bpy.ops.screen.area_close() == {"FINISHED"}
            yield 1.0
        area = parts()[1]
        with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=split)
        yield 2.0
        area = max((one for one in window.screen.areas if one.type == "VIEW_3D"), key=lambda one: one.x)
    area.ui_type = tree.bl_idname
    yield 2.0
    area.spaces.active.node_tree = tree
    area.spaces.active.show_region_ui = False
    yield 2.0


def framed(tree, labels=()):
    """All nodes of a tree in its editor, or those of some labels."""
    for node in tree.nodes:
        node.select = not labels or node.bl_label in labels
    yield 1.0
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "NODE_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.node.view_selected()
    for node in tree.nodes:
        node.select = False
    yield 3.0


def nodes_walls():
    yield from new(sidebar=False)
    assert called(bpy.ops.mu.tree_new, template="three-walls") == {"FINISHED"}
    (tree,) = trees.trees()
    yield from editor(tree)
    yield from framed(tree)
    motion = next(node for node in tree.nodes if node.bl_label == "Simulate")
    child = trees.start(tree, (motion.name,))
    while child.state == "running":
        yield 1.0
    assert child.state == "done", child.error
    compare = next(node for node in tree.nodes if node.bl_label == "Compare")
    child = trees.start(tree, (compare.name,))
    while child.state == "running" and not child.progress.get("fraction"):
        yield 1.0
    yield 20.0
    shot("nodes-walls")
    child.cancel()
    while child.state == "running":
        yield 1.0


def nodes_unit():
    yield from new(sidebar=False)
    yield from added(path="alpha4")
    assert called(bpy.ops.mu.tree_of_unit, steps=True) == {"FINISHED"}
    (tree,) = trees.trees()
    yield from editor(tree, 0.3)
    parts()[1].spaces.active.show_region_toolbar = False
    seen_from(0, wider=1.3)
    yield from framed(tree, ("Profile", "Chambers", "Membranes", "Cells"))
    shot("nodes-unit")
    chambers = next(node for node in tree.nodes if node.bl_label == "Chambers")
    wall = next(s.identifier for s in chambers.inputs if s.name.startswith("Wall"))
    setattr(chambers, chambers.field_of(wall), 3.0)
    yield from framed(tree, ("Chambers", "Membranes"))
    shot("nodes-error")


def leave():
    """A ranking that this session of Blender starts and leaves behind, for the picture goes-on."""
    yield from new()
    yield from added(preset="mu-0.75x")
    assert called(bpy.ops.wm.save_as_mainfile, filepath=str(FOLDER / "left.blend")) == {"FINISHED"}
    assert called(bpy.ops.mu.simulate) == {"FINISHED"}
    yield 2.0
    assert called(bpy.ops.wm.save_mainfile) == {"FINISHED"}


def goes_on():
    yield from new("MU_PT_simulate", file="left.blend")
    seen_from(20)
    yield 6.0
    shot("goes-on")
    child = SIMULATION.child(root())
    assert child.state == "running", child.state
    assert called(bpy.ops.mu.cancel) == {"FINISHED"}
    while child.state == "running":
        yield 1.0


def track():
    yield from new(sidebar=False)
    window, area, _ = parts()
    clip = bpy.data.movieclips.load(str(FOLDER / CLIP / "shot0001.png"))
    area.ui_type = "CLIP_EDITOR"
    space = area.spaces.active
    space.clip, space.show_region_ui = clip, True
    yield 2.0
    region = next(r for r in area.regions if r.type == "WINDOW")
    side = next(r for r in area.regions if r.type == "UI")
    places = json.loads((FOLDER / "markers.json").read_text())
    with bpy.context.temp_override(window=window, area=area, region=region):
        for name, pixel in places.items():
            tracking._place(clip, name, pixel, MarkerSettings({}), "")
        assert bpy.ops.mu.track() == {"FINISHED"}
        bpy.ops.clip.view_all()
    bench = clip.mu_bench
    (bench.base_1, bench.base_2), (bench.tip_1, bench.tip_2) = BASE, TIP
    bench.base_1_mm, bench.base_2_mm, bench.fps = (-15, 0), (15, 0), 10
    bench.pressure, bench.folder = "//pressure.csv", "//measured"
    bpy.context.scene.frame_set(30)
    side.active_panel_category = "MU"
    yield 2.0
    shot("track")


PICTURES = {
    "add": add, "steps": steps, "live": live, "rule": rule, "paths": paths, "results-panel": results_panel,
    "paint": paint, "print": print_part, "print-check": print_check, "simulate": simulate,
    "obstacle": obstacle, "gripper": gripper, "apply": apply, "assets": assets, "optimize": optimize,
    "sensor-live": sensor_live, "track": track, "deviation": deviation, "stress": stress,
    "print-layers": print_layers, "nodes-walls": nodes_walls, "nodes-unit": nodes_unit,
}  # fmt: skip
AFTER_ONE_ANOTHER = {"leave": leave, "goes-on": goes_on}
"""Each in a Blender of its own, and asked for by name."""


def session():
    ids = subprocess.run(
        ["xdotool", "search", "--class", "blender"], capture_output=True, text=True, check=True
    )
    for number in ids.stdout.split():
        subprocess.run(["xdotool", "windowsize", number, *map(str, SIZE)], check=False)
        subprocess.run(["xdotool", "windowmove", number, "0", "0"], check=False)
    bpy.context.preferences.view.smooth_view = 0
    yield 3.0
    for name, picture in PICTURES.items():
        if not ONLY or name in ONLY:
            yield from picture()
    for name, picture in AFTER_ONE_ANOTHER.items():
        if name in ONLY:
            yield from picture()


if bpy.app.background:
    FOLDER.mkdir(parents=True, exist_ok=True)
    prepare()
else:
    import math

    from simulated import called, event, key, module, move, over_view, package, parts, run

    unit_object, printing = module("blender.unit.object"), module("blender.printing.state")
    handles = module("blender.scene.handles")
    gripper_object, viewports = module("blender.gripper.object"), module("blender.shared.viewports")
    SIMULATION = module("blender.simulate.job").SIMULATION
    trees = module("blender.node_tree.state")
    studies, bending = module("blender.simulate.study_folder"), module("blender.live_bending.state")
    OPTIMIZATION = module("blender.optimize.state").OPTIMIZATION
    sensor, twin = module("blender.sensor.state"), module("blender.sensor.twin")
    tracking, MarkerSettings = (
        module("blender.track.state"),
        module("measured.bench").MarkerSettings,
    )
    panel_kinds = [
        kind for kind in bpy.types.Panel.__subclasses__() if str(kind.__module__).startswith(package)
    ]
    usual = {kind: getattr(kind, "bl_options", set()) for kind in panel_kinds}
    run(session)
