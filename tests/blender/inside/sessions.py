"""Parts of `test_sessions`: what one session of Blender does before it ends, and what another one finds."""

import sys
import time
from pathlib import Path

import bpy

import mu_addon
from mu_addon.blender.jobs import start_child as jobs
from mu_addon.blender.sensor import state as sensor
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate.job import SIMULATION
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import presets
from mu_addon.run.child import Child
from mu_addon.run.interpreter import environment

from .acting import add, refused
from .jobs import launch, watch
from .test_sensor import connected, started
from .test_sensor import drawn as sensor_panel_drawn
from .test_sensor import watch as watch_sensor
from .test_simulation import drawn

ROOT = Path(__file__).resolve().parents[3]
LOCKED = str(ROOT / "tests" / "run" / "locked_worker.py")


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


def leave_a_simulation():
    """A simulation that survives loading a file and still runs as the session ends; returns its process."""
    begin()
    root = add()
    uuid = root.mu_unit.uuid
    child = launch(root, "hang")
    watch(lambda: child.progress)
    assert bpy.app.timers.is_registered(jobs._poll.function)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert [job.key for job in jobs.running()] == [f"{uuid}:simulate"]
    assert bpy.app.timers.is_registered(jobs._poll.function)
    add()
    assert "other job" in drawn()
    return child._process.pid


def leave_a_lasting_run():
    """A simulation that goes on as the session ends; returns its process and its folder."""
    begin()
    # As with the extension's preferences, which a process without the extension has not; it ends with this.
    jobs._wanted = lambda: True
    root = add()
    folder = studies.folder_of(root) / "runs" / "one"
    own = folder / jobs.OWN_FOLDER
    child = Child([sys.executable, LOCKED, str(folder)], own, environment([ROOT]))
    key = SIMULATION.key(root)
    jobs.lasting_jobs.keep(
        jobs.lasting_jobs.Record(key, "arm: simulation", folder, time.time(), (("Model A", 9.0),), True)
    )
    jobs.watch(key, child, "arm: simulation", heavy=True, lasts=True)
    watch(lambda: child.progress)
    assert jobs._jobs[key].goes_on
    bpy.ops.wm.save_as_mainfile(filepath="arm.blend")
    return child.pid, folder


def find_a_lasting_run():
    """The next session finds it, with its unit or without, and stops it; returns how it ended."""
    begin()
    jobs._take_up()
    (job,) = jobs.running()
    key = job.key
    assert job.title == "arm: simulation"
    bpy.ops.wm.open_mainfile(filepath="arm.blend")
    (root,) = unit_object.roots()
    child = SIMULATION.child(root)
    watch(lambda: child.progress)
    assert child.estimate.number == 1
    assert "is being simulated" in refused(bpy.ops.mu.simulate) or not bpy.ops.mu.simulate.poll()
    jobs._take_up()
    assert jobs.running() == [jobs._jobs[key]], "found once"
    assert bpy.ops.mu.job_cancel(key=key) == {"FINISHED"}
    watch(lambda: child.state != "running")
    mu_addon.unregister()
    return child.state


def find_nothing():
    """What was seen to its end is not found again."""
    begin()
    jobs._take_up()
    return jobs.running(), jobs.ended()


def leave_a_sensor(tmp_path):
    """A sensor's session that outlives undo, loading and rendering; returns its reader and its folder."""
    begin()
    bpy.context.preferences.edit.use_global_undo = True
    root = started()
    bpy.ops.ed.undo_push(message="added")
    s = connected(root)
    root.mu_sensor.seconds = 5.0
    bpy.ops.ed.undo_push(message="seconds")
    bpy.ops.ed.undo()
    (root,) = unit_object.roots()
    assert sensor.of(root) is s
    assert s.running
    rows = s.watched.status["rows"]
    watch_sensor(lambda: s.watched.status["rows"] > rows and s.traces is not None)

    sensor._render_began()
    watch_sensor(lambda: s.watched.status["rows"] > rows + 20)
    sensor._render_ended()

    assert bpy.app.timers.is_registered(sensor._poll.function)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "study" / "seat.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    assert s.running
    assert bpy.app.timers.is_registered(sensor._poll.function)
    before = s.watched.status["rows"]
    watch_sensor(lambda: s.watched.status["rows"] > before + 10)
    add()
    assert "1 sensor of other units connected" in sensor_panel_drawn()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "study" / "seat.blend"))
    (root,) = unit_object.roots()
    assert sensor.of(root) is s
    assert "Connected" in sensor_panel_drawn()
    return s.child.pid, s.watched.folder
