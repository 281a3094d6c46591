"""Runs inside an installed Blender, without a window: from an empty scene to a print and a ranked path."""

import importlib
import sys
import time
from pathlib import Path

import bpy

folder = Path(sys.argv[sys.argv.index("--") + 1])
(package,) = (name for name, _ in bpy.context.preferences.addons.items() if name.endswith(".mu_addon"))
assert package.startswith("bl_ext."), package


def module(name):
    return importlib.import_module(f"{package}.{name}")


unit_object, jobs = module("blender.unit.object"), module("blender.jobs.start_child")
studies, child_module = module("blender.simulate.study_folder"), module("run.child")
SIMULATION = module("blender.simulate.job").SIMULATION

assert "mu_addon" not in sys.modules, "the core was imported under a second name"
assert bpy.ops.mu.add(preset="mu-0.75x") == {"FINISHED"}
root = unit_object.active_root(bpy.context)
taken = []
for step in range(10):
    before = time.process_time()
    root.mu_unit.chambers.wall_mm = 0.85 + 0.01 * step
    bpy.context.view_layer.update()
    taken.append(time.process_time() - before)
assert min(taken) < 0.1, taken
print("preview", round(1000 * min(taken)), "ms")
root.mu_unit.chambers.wall_mm = 0.9
assert bpy.ops.mu.path(name="alpha4") == {"FINISHED"}
assert bpy.ops.mu.solid() == {"FINISHED"}
assert bpy.ops.mu.export_stl(filepath=str(folder / "unit.stl"), quality="interactive") == {"FINISHED"}
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "day.blend"))


def watch(child):
    # Timers never fire in background.
    end = time.monotonic() + 3600
    while child.state == child_module.RUNNING:
        assert time.monotonic() < end
        jobs.poll()
        time.sleep(0.1)


printing = module("blender.printing.state")
assert bpy.ops.mu.print_check() == {"FINISHED"}
child = printing.PRINTING.child(root)
watch(child)
assert child.state == child_module.DONE, child.error
assert printing.CHECK.found(root).stale == ""
assert bpy.ops.mu.print_show(finding=0) == {"FINISHED"}
root.mu_print.formats, root.mu_print.quality = {name for name, *_ in printing.FORMATS}, "interactive"
assert bpy.ops.mu.print_export() == {"FINISHED"}
child = printing.PRINTING.child(root)
watch(child)
assert child.state == child_module.DONE, child.error
names = {entry["file"] for entry in printing.EXPORT.found(root).content["files"]}
assert {"unit.stl", "unit.3mf", "unit-beams.3mf", "waveguide.step", "nodes.txt"} <= names, names

assert jobs.missing() == []
SHORT = folder / "short.csv"
SHORT.write_text("time_s,pressure_kPa\n0,0\n8,10\n")
root.mu_unit.study.refine, root.mu_unit.study.protocol = 0.3, str(SHORT)
assert bpy.ops.mu.simulate() == {"FINISHED"}
child = SIMULATION.child(root)
while not child.progress:
    jobs.poll()
    time.sleep(0.1)
assert bpy.ops.mu.cancel() == {"FINISHED"}
watch(child)
assert child.state == child_module.CANCELLED, child.error

assert bpy.ops.mu.simulate() == {"FINISHED"}
child = SIMULATION.child(root)
watch(child)
assert child.state == child_module.DONE, child.error
found = studies.findings(root)
assert (found.summary["status"], found.stale) == ("complete", False)
assert len(found.ranking) + len(found.run.at_least_mm) == 10
for whose, what in (("model_a", "mesh"), ("alpha4", "mesh"), ("model_a", "print")):
    assert bpy.ops.mu.motion(name=whose, what=what) == {"FINISHED"}
bpy.context.scene.frame_set(193)
assert len(module("blender.results.motion").parts(root)) == 5
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
(root,) = unit_object.roots()
assert studies.findings(root).ranking == found.ranking

# Something in the way, and the gripper to print; the active object says which is worked on.
assert bpy.ops.mu.add(preset="mu-0.75x") == {"FINISHED"}
stopped = unit_object.active_root(bpy.context)
stopped.mu_unit.study.command, stopped.mu_unit.study.protocol = "simulate", str(SHORT)
stopped.mu_unit.study.refine = 0.3
assert bpy.ops.mu.obstacle_box(size=(20, 12, 12), gap=0.6) == {"FINISHED"}
bpy.context.view_layer.update()
assert bpy.ops.mu.simulate() == {"FINISHED"}
child = SIMULATION.child(stopped)
watch(child)
assert child.state == child_module.DONE, child.error
(touch,) = studies.contact_forces(stopped)
assert touch.force_N.max() > 0
assert not studies.findings(stopped).stale
grasps = module("blender.gripper.state")
assert bpy.ops.mu.gripper_add() == {"FINISHED"}
gripper = module("blender.gripper.object").active(bpy.context)
gripper.mu_gripper.detail = "part"
assert bpy.ops.mu.grasp() == {"FINISHED"}
child = grasps.GRASP.child(gripper)
watch(child)
assert child.state == child_module.DONE, child.error
assert (grasps.folder_of(gripper) / "gripper.3mf").is_file()
assert bpy.ops.mu.gripper_delete() == {"FINISHED"}
bpy.context.view_layer.objects.active = stopped
assert bpy.ops.mu.delete() == {"FINISHED"}

uuid = root.mu_unit.uuid
bpy.ops.preferences.addon_disable(module=package)
assert not [name for name in dir(bpy.types) if name.startswith("MU_")]
assert not hasattr(bpy.types.Object, "mu_unit")
bpy.ops.preferences.addon_enable(module=package)
(root,) = (obj for obj in bpy.data.objects if obj.mu_unit.uuid)
assert root.mu_unit.uuid == uuid
assert bpy.ops.mu.rebuild() == {"FINISHED"}
print("the day is over")
