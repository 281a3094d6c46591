"""The real sensor in Blender: sessions in their own process, the panel's words, calibration and the twin.

Timers never fire in background: the tests call what they call.
"""

import importlib.util
import math
import os
import shutil
import signal
import time
import tty
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np

import mu_addon
from mu_addon.blender.jobs import start_child as jobs
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.sensor import panel as sensor_panel
from mu_addon.blender.sensor import plot as sensor_plot
from mu_addon.blender.sensor import session as sensor_session
from mu_addon.blender.sensor import state as sensor
from mu_addon.blender.sensor import twin
from mu_addon.blender.sensor.session import RUNNING, Guide, Session
from mu_addon.blender.unit import object as unit_object
from mu_addon.sensing.calibration import CalibrationSweep, calibrate, write_calibration
from mu_addon.sensing.recording import read_recording
from tests.studies.bent_motion import write_bent_motion

from .acting import add, refused
from .drawing import drawn as drawn_by
from .drawing import lines
from .jobs import PATIENCE_S

SENDER = Path(__file__).parents[2] / "sensing" / "sender.py"


def watch(until):
    end = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < end, drawn()
        sensor.poll()
        jobs.poll()
        time.sleep(0.02)


def started(source="simulated", **settings):
    """A unit whose study is in `study`, beside a test's other files."""
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(Path("study").resolve())
    root.mu_sensor.source = source
    for name, value in settings.items():
        setattr(root.mu_sensor, name, value)
    return root


def connected(root, rows=20):
    assert bpy.ops.mu.sensor_connect() == {"FINISHED"}
    session = sensor.of(root)
    watch(lambda: session.watched.status.get("rows", 0) > rows and session.traces is not None)
    return session


def ended(session):
    watch(lambda: not session.running)
    return session.child.state


def drawn():
    return drawn_by([sensor_panel.MU_PT_sensor])


def calibrated(path, channel="light_V", dark="dark_V", top=45.0):
    """The simulated sensor's own law, with its noise."""
    random = np.random.default_rng(0)
    sweeps = []
    for k in range(3):
        angle = top / 2 * (1 - np.cos(np.linspace(0, 2 * np.pi, 200)))
        volts = 2.4 * np.exp(-0.006 * angle) - 0.02 + 0.004 * random.normal(size=200)
        sweeps.append(CalibrationSweep(np.linspace(0, 8, 200) + 10 * k, angle, volts))
    write_calibration(path, calibrate(sweeps, channel, dark))


def test_connect_pause_mark_and_disconnect(tmp_path):
    root = started()
    assert "mu.sensor_connect" in drawn()
    assert not bpy.ops.mu.sensor_mark.poll()
    assert bpy.ops.mu.sensor_connect() == {"FINISHED"}
    s, first = sensor.of(root), lines([sensor_panel.MU_PT_sensor])
    assert s.watched.status == {}
    watch(lambda: s.watched.status.get("rows", 0) > 20 and s.traces is not None)
    for button in ("mu.sensor_disconnect", "mu.sensor_mark", "mu.sensor_sweep", "Show Twin"):
        now = lines([sensor_panel.MU_PT_sensor])
        assert now.index(button) == first.index(button), "a button moves while the sensor connects"
    texts = drawn()
    assert "Connected: simulated sensor" in texts, texts
    assert "Nothing lost" in texts, texts
    assert "light_V" in texts, texts
    assert "Format frames, " in texts
    assert "samples on disk" in texts
    assert "Not calibrated" in texts
    assert not bpy.ops.mu.sensor_connect.poll()
    assert bpy.ops.mu.sensor_mark.poll()
    assert bpy.ops.mu.sensor_mark(words="valve\nopen") == {"FINISHED"}
    assert bpy.ops.mu.sensor_pause() == {"FINISHED"}
    watch(lambda: s.state == "paused")
    assert "Port released" in drawn()
    assert "Open Port" in drawn()
    rows = s.watched.status["rows"]
    assert bpy.ops.mu.sensor_pause() == {"FINISHED"}
    watch(lambda: s.state == "connected" and s.watched.status["rows"] > rows + 10)
    assert bpy.ops.mu.sensor_disconnect() == {"FINISHED"}
    assert ended(s) == "done"
    assert "Disconnected" in drawn()
    assert bpy.ops.mu.sensor_connect.poll(), "again, into another folder"
    again = connected(root)
    assert again.watched.folder != s.watched.folder
    assert again.watched.folder.parent.name == "recordings"
    bpy.ops.mu.sensor_disconnect()
    ended(again)
    first = min((tmp_path / "study" / "recordings").iterdir())
    marks = [m["text"] for m in read_recording(first)[0].messages if m.get("event") == "mark"]
    assert marks == ["valve open"], "one line, whatever was typed"


def test_unregister_ends_the_session():
    s = connected(started())
    mu_addon.unregister()
    s.child._process.wait(PATIENCE_S)
    assert not hasattr(bpy.types.Object, "mu_sensor")
    assert not bpy.app.timers.is_registered(sensor._poll.function)
    mu_addon.register()
    assert sensor.of(add()) is None


def test_panels_are_drawn_anew_when_samples_begin_and_when_they_end():
    child = SimpleNamespace(state=RUNNING, poll=lambda: None)
    watched = SimpleNamespace(starved_s=0.2, look=lambda: False, columns=(), fresh=lambda: ())
    session = Session(child, watched)
    assert [session.update(None, 10.0) for _ in range(2)] == [True, False]
    watched.starved_s = 1.5
    assert [session.update(None, 10.0) for _ in range(2)] == [True, False]


def test_a_killed_reader_and_a_folder_that_is_gone(tmp_path, monkeypatch):
    root = started()
    s = connected(root)
    os.kill(s.child.pid, signal.SIGKILL)
    assert ended(s) == "failed"
    texts = drawn()
    assert "SIGKILL" in texts
    assert "Connect again" in texts
    assert bpy.ops.mu.sensor_connect.poll()
    s = connected(root)
    shutil.rmtree(s.watched.folder)
    monkeypatch.setattr(sensor, "SILENT_S", 0.5)
    watch(lambda: s.watched.silent_s > 1.0 or not s.running)
    assert "No status for" in drawn() or s.child.state == "failed", drawn()
    bpy.ops.mu.sensor_disconnect()
    watch(lambda: not s.running)
    drawn()
    root.mu_sensor.source = "replay"
    assert "Choose the folder of a recording" in refused(bpy.ops.mu.sensor_connect)
    root.mu_sensor.replay = str(tmp_path / "study" / "none")
    assert bpy.ops.mu.sensor_connect() == {"FINISHED"}
    assert ended(sensor.of(root)) == "failed"
    assert "the recording is invalid" in drawn(), drawn()


def test_garbage_on_the_line_is_counted_and_shown():
    master, slave = os.openpty()
    tty.setraw(slave)
    root = started("port", port=os.ttyname(slave))
    assert bpy.ops.mu.sensor_connect() == {"FINISHED"}
    s = sensor.of(root)
    watch(lambda: s.state == "connected")
    os.write(master, b"\x00\xff{{{:::\n" * 50)
    for k in range(60):
        os.write(master, f"light:{2 + 0.001 * k:.3f}\n".encode() + b"light:much\n" * (k % 10 == 0))
        watch(lambda: True)
        time.sleep(0.01)
    watch(lambda: s.watched.status.get("rows", 0) >= 30)
    texts = drawn()
    assert "unreadable" in texts, texts
    assert "light" in texts, texts
    os.close(master)
    os.close(slave)
    watch(lambda: s.state in ("disconnected", "waiting"))
    bpy.ops.mu.sensor_disconnect()
    assert ended(s) == "done"


def test_the_odd_angle_of_a_sweep_is_the_one_that_contradicts_the_others():
    angles = [0.0, 15.0, 30.0, 45.0, 30.0, 15.0, 0.0]
    light = [2.0, 1.7, 1.5, 1.3, 1.52, 1.74, 2.01]
    assert Guide(angles, light_V=light).odd is None, "hysteresis is no fault"
    assert Guide(angles, light_V=[-v for v in light]).odd is None, "nor is light that rises"
    for k in range(7):
        wrong = [*light]
        wrong[k] = 1.3 if light[k] > 1.6 else 2.0
        assert Guide(angles, light_V=wrong).odd == k
    assert Guide(angles, light_V=[2.0, 1.7, 1.9]).odd == 2, "of two that contradict each other the latest"
    assert Guide(angles, light_V=[2.0, 1.9]).odd is None
    assert Guide(angles, light_V=[1.0, 1.0, 1.0]).odd is None


def test_a_guided_sweep_calibrates_and_a_zero_mends_weaker_light(tmp_path, monkeypatch):
    """A bench that bends as it is told: the light follows the angle of the last press of the button."""
    master, slave = os.openpty()
    tty.setraw(slave)
    bench = {"angle": 0.0, "light": 2.0, "k": 0}

    def bend():
        # A few lines each look: the device's line.
        for _ in range(3):
            bench["k"] += 1
            noise = 0.002 * math.sin(12.9898 * bench["k"])
            volts = bench["light"] * math.exp(-0.01 * bench["angle"]) + 0.1 + noise
            os.write(master, f"light:{volts:.5f} dark:0.1\n".encode())

    def watching(until):
        watch(lambda: bend() or until())

    def arrived():
        """Until the recorder, a process of its own, has what the bench sends now."""
        level = bench["light"] * math.exp(-0.01 * bench["angle"])
        watching(lambda: s.reading is not None and abs(s.reading.light_V - level) < 0.01)

    monkeypatch.setattr(sensor, "HOLD_S", 1.05)  # what calibration reads is 1 s
    root = started("port", port=os.ttyname(slave), sweep_to=45.0, sweep_step=15.0)
    assert bpy.ops.mu.sensor_connect() == {"FINISHED"}
    s = sensor.of(root)
    watching(lambda: s.watched.status.get("rows", 0) > 20)
    assert sensor.chosen(root) == ("light", "dark"), sensor.chosen(root)
    assert "Connect and calibrate first" not in drawn()
    assert "calibrate first" in refused(bpy.ops.mu.sensor_zero)
    assert bpy.ops.mu.sensor_sweep() == {"FINISHED"}
    angles = list(s.guide.angles)
    assert angles == [0, 15, 30, 45, 30, 15, 0, 15, 30, 45, 30, 15, 0]
    assert not bpy.ops.mu.sensor_back.poll(), "nothing to take back"

    def held():
        assert bpy.ops.mu.sensor_hold() == {"FINISHED"}
        watching(lambda: not s.guide.holding and len(s.guide.light_V) == s.guide.held)

    # A wrong step is seen at once and undone: pressed at 30 before the unit was bent that far.
    for bent in (0, 15, 5):
        bench["angle"] = bent
        arrived()
        assert "breaks the order" not in drawn()
        held()
    assert "Number 3, 30°, breaks the order of the light: go back to it and repeat it" in drawn()
    for left in (2, 1, 0):
        assert bpy.ops.mu.sensor_back() == {"FINISHED"}
        assert s.guide.held == left
        assert "breaks the order" not in drawn()
    for angle in angles:
        assert f"Bend to {angle:g}" in drawn()
        bench["angle"] = angle
        arrived()
        assert bpy.ops.mu.sensor_hold() == {"FINISHED"}
        assert not bpy.ops.mu.sensor_hold.poll()
        assert "Hold still" in drawn()
        watching(lambda: s.guide is None or not s.guide.holding)
    watching(lambda: s.guide is None)
    child = sensor.CALIBRATION.child(root)
    watching(lambda: child.state == "failed" or sensor.calibration(root)[0] is not None)
    assert child.state == "done", child.error
    found, _ = sensor.calibration(root)
    assert found.range_deg == (0.0, 45.0)
    assert found.sweeps == 2
    assert found.dark == "dark"
    assert s.guide is None
    assert "0 to 45" in drawn()
    assert child.result, child.error

    bench["angle"] = 30.0
    arrived()
    watching(lambda: abs(s.reading.angle_deg - 30.0) < 0.5)
    assert s.reading.possible, s.reading
    bench["light"] = 1.8
    arrived()
    assert s.reading.angle_deg > 37, "a tenth of the light is gone: it looks like bending"
    root.mu_sensor.known_deg = 30.0
    assert bpy.ops.mu.sensor_zero() == {"FINISHED"}
    watching(lambda: abs(s.reading.angle_deg - 30.0) < 0.5)
    assert "light -10" in drawn(), s.reading
    _, low, high = s.traces.extremes()
    assert abs(low[2, -1] - 30.0) < 1.5
    assert low[3, -1] < 30.0 < high[4, -1]
    bpy.ops.mu.sensor_disconnect()
    assert ended(s) == "done"

    # The same from the recording that it left; and from a folder that holds none.
    (sensor.calibration_file(root)).unlink()
    assert bpy.ops.mu.sensor_calibrate(data=str(s.watched.folder)) == {"FINISHED"}
    watch(lambda: sensor.calibration(root)[0] is not None)
    assert sensor.calibration(root)[0].gain == 1.0
    assert bpy.ops.mu.sensor_calibrate(data=str(tmp_path / "study")) == {"FINISHED"}
    watch(lambda: sensor.CALIBRATION.child(root).state != "running")
    assert sensor.CALIBRATION.child(root).state == "failed"
    assert "experiments.toml" in drawn()
    assert sensor.calibration(root)[0] is not None, "the one that was there stays"


def test_the_twin_follows_the_simulated_sensor_and_never_beyond(tmp_path):
    write_bent_motion(tmp_path / "study")
    calibrated(tmp_path / "study" / "sensor" / "calibration.toml")
    bpy.context.preferences.edit.use_global_undo = True
    root = started()
    assert "Show Twin" in drawn()
    assert bpy.ops.mu.sensor_twin() == {"FINISHED"}
    (membrane,) = (part for part in twin.parts(root) if part["mu_twin"] == "membrane")
    rest = motion_parts.vertices_of(membrane.data)
    assert twin.status(root) == ("waiting", "no signal")
    assert membrane.data.materials[0].name == "MU Twin Waiting"
    s = connected(root)
    seen = []

    def look():
        r, tip = s.reading, motion_parts.vertices_of(membrane.data)
        if r is not None and twin.status(root)[0] == "live":
            top = tip[rest[:, 2] > rest[:, 2].max() - 1e-6]
            about = top - top.mean(axis=0)
            widest = about[np.abs(about[:, 1]).argmax()]
            seen.append((r.angle_deg, np.degrees(np.arctan2(*widest[[2, 1]]))))
        return len(seen) > 40 and max(a for a, _ in seen) > 40

    watch(look)
    asked, shown = np.array(seen).T
    # The end plane's own slope, negative toward +y or its supplement.
    slope = np.minimum(np.abs(shown), 180.0 - np.abs(shown))
    assert np.abs(slope - asked).max() < 0.5, np.abs(slope - asked).max()
    assert membrane.data.materials[0].name == "MU Twin"
    assert "simulated at" in twin.status(root)[1]

    class Reading:
        light_V, angle_deg, low_deg, high_deg, possible = 2.0, 30.0, 29.0, 31.0, True

    def follow(fresh=True, **values):
        reading = Reading()
        for name, value in values.items():
            setattr(reading, name, value)
        twin.set_pose(root, reading, fresh)
        return motion_parts.vertices_of(membrane.data)

    at_30 = follow()
    for beyond in ({"angle_deg": 51.0}, {"angle_deg": -17.0}, {"possible": False}):
        assert np.array_equal(follow(**beyond), at_30), "it stays where it was"
        state, words = twin.status(root)
        assert state == "outside"
        assert membrane.data.materials[0].name == "MU Out of Range"
        assert ("calibration" in words) == ("possible" in beyond), words
        assert words in drawn().replace("  ", " ") or state == "outside"
    assert np.array_equal(follow(fresh=False), at_30)
    assert twin.status(root)[0] == "waiting"
    assert not np.array_equal(follow(angle_deg=10.0), at_30)
    assert twin.status(root)[0] == "live"
    assert follow(angle_deg=float("nan")).shape == at_30.shape
    assert twin.status(root) == ("waiting", "not calibrated")

    # Another motion than the one it was made from: cut open or not, for one.
    root.mu_motion.cut = not root.mu_motion.cut
    follow(angle_deg=10.0)
    assert twin.status(root)[0] == "waiting"
    assert "show the twin again" in drawn(), drawn()
    root.mu_motion.cut = not root.mu_motion.cut

    # Undo takes the objects away and brings them back; the twin is found again.
    bpy.ops.ed.undo_push(message="with twin")
    assert bpy.ops.mu.sensor_twin(on=False) == {"FINISHED"}
    assert not twin.parts(root)
    bpy.ops.ed.undo_push(message="without")
    watch(lambda: True)
    bpy.ops.ed.undo()
    (root,) = unit_object.roots()
    watch(lambda: twin.parts(root) and twin.status(root)[0] != "waiting")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "study" / "seat.blend"))
    bpy.ops.mu.sensor_disconnect()
    ended(s)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "study" / "seat.blend"))
    (root,) = unit_object.roots()
    assert {p.data.materials[0].name for p in twin.parts(root)} == {"MU Twin Waiting"}
    unit_object.delete(root)
    assert not [o for o in bpy.data.objects if o.get("mu_twin")]


def test_a_calibration_of_other_channels_or_a_broken_one_is_told_of(tmp_path):
    calibrated(tmp_path / "other.toml", channel="lamp_V", dark=0.0)
    root = started(calibration=str(tmp_path / "other.toml"))
    s = connected(root)
    watch(lambda: s.trouble)
    assert "the stream has no channel lamp_V" in drawn().replace("  ", " ")
    watch(lambda: s.reading is not None)
    assert 1.5 < s.reading.light_V < 2.5
    assert s.reading.angle_deg != s.reading.angle_deg
    path = tmp_path / "other.toml"
    path.write_text("version = 1\n")
    watch(lambda: not s.trouble)
    assert "the calibration is invalid" in drawn()
    assert s.running
    path.unlink()
    assert "There is no" in drawn()
    root.mu_sensor.calibration = ""
    assert "Not calibrated: voltages only" in drawn()


def test_the_plot_stands_still_while_recording_goes_on_and_ends_with_its_connection(monkeypatch):
    root = started()
    s = connected(root)
    assert bpy.ops.mu.sensor_freeze() == {"FINISHED"}
    still = s.frozen.end_s
    watch(lambda: s.traces.end_s > still + 0.5)
    assert s.frozen.end_s == still
    assert bpy.ops.mu.sensor_freeze() == {"FINISHED"}
    assert s.frozen is None
    root.mu_sensor.seconds = 3.0
    watch(lambda: s.traces is not None and s.traces.step_s * s.traces.bins == 3.0)
    age, *_ = s.traces.extremes()
    assert age[0] < -0.5, "what is still in the ring is drawn again"
    plots = []
    monkeypatch.setattr(sensor_plot, "_plot", lambda *given: plots.append(given))
    sensor_plot._draw()
    assert bpy.ops.mu.sensor_freeze() == {"FINISHED"}
    assert bpy.ops.mu.sensor_disconnect() == {"FINISHED"}
    assert ended(s) == "done"
    sensor_plot._draw()
    assert len(plots) == 1, "not even one that stood still"


def test_what_is_drawn_does_not_grow_with_the_rate_and_stays_in_its_axes(tmp_path, monkeypatch):
    """There is no graphics card in background: what would be drawn is kept instead."""
    calibrated(tmp_path / "study" / "sensor" / "calibration.toml")
    root = started()
    s = connected(root)
    rows = np.random.default_rng(0).normal(2.0, 0.1, (50_000, 5))
    s.traces.add(s.traces.end_s + np.arange(50_000) / 5000, rows)
    shapes, texts = [], []
    monkeypatch.setattr(
        sensor_plot, "_shape", lambda kind, points, colour: shapes.append((kind, np.array(points), colour))
    )
    monkeypatch.setattr(sensor_plot, "write", lambda text, *_, **__: texts.append(text))
    monkeypatch.setattr(sensor_plot, "blf", MagicMock(**{"dimensions.return_value": (40.0, 10.0)}))
    monkeypatch.setattr(sensor_plot, "room", lambda context, scale: (100.0, 900.0, 24.0))

    def plotted():
        shapes.clear()
        texts.clear()
        sensor_plot._plot(bpy.context, root.mu_sensor, s, s.traces, 1.0)
        return [points for kind, points, _ in shapes if kind == "LINE_STRIP"]

    curves = plotted()
    assert len(curves) == 3, "light, dark and angle"
    for points in curves:
        assert len(points) <= 2 * sensor_session.BINS
        assert np.isfinite(points).all()
        assert points[:, 0].min() >= 99.0
        assert points[:, 0].max() <= 900.0
    heights = [np.ptp(points[:, 1]) for points in curves]
    assert max(heights[:2]) <= sensor_plot.HEIGHT
    assert 20 < heights[2] <= sensor_plot.HEIGHT
    assert any(kind == "TRI_STRIP" and colour == sensor_plot.BAND for kind, _, colour in shapes)
    words = " ".join(texts)
    assert "light_V" in words, words
    assert "angle in" in words, words
    assert "-10 s" in words, words
    bpy.ops.mu.sensor_channel(name="dark_V")
    assert len(plotted()) == 2
    assert "dark_V" not in " ".join(texts)
    bpy.ops.mu.sensor_freeze()
    plotted()
    assert "plot frozen" in " ".join(texts)


def test_without_pyserial_the_panel_says_so(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "serial" else find(name, *a)
    )
    started()
    assert sensor.missing() == ["serial"]
    assert "Not in this Blender: serial" in drawn()
    assert "Not in this Blender: serial" in refused(bpy.ops.mu.sensor_connect)


def test_the_angles_of_a_sweep():
    settings = started().mu_sensor
    for low, high, step, expected in (
        (0.0, 45.0, 15.0, [0, 15, 30, 45, 30, 15] * 2 + [0]),
        (0.0, 20.0, 15.0, [0, 15, 20, 15] * 2 + [0]),
        (10.0, -10.0, 10.0, [10, 0, -10, 0] * 2 + [10]),
    ):
        settings.sweep_from, settings.sweep_to, settings.sweep_step = low, high, step
        assert sensor.sweep_angles(settings) == expected, sensor.sweep_angles(settings)
    connected(unit_object.roots()[0])
    settings.sweep_to, settings.sweep_step = 10.0, 0.5
    settings.sweep_to = 10.0
    assert "a sweep over 1 angle" in refused(bpy.ops.mu.sensor_sweep)
