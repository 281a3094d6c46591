"""A unit that bends while it is designed: its process, its shape in the unit's own place, and its end.

Timers never fire in background: the tests call what they call.
"""

import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from mu_addon.blender.jobs import start_child
from mu_addon.blender.live_bending import state as live
from mu_addon.blender.live_bending import words
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.scene import gestures, handles
from mu_addon.blender.shared import displays, viewports
from mu_addon.blender.unit import object as unit_object

from .acting import add
from .jobs import PATIENCE_S


def bent(root, states):
    """Wait as a window does, until the unit is bent and so many states are there."""
    end = time.monotonic() + PATIENCE_S
    while live.of(root).current is None or len(live.of(root).current.pressure_kPa) < states:
        assert time.monotonic() < end, words.words(root)
        live._tick()
        assert not live.of(root).trouble, live.of(root).trouble
        time.sleep(0.05)


def coloured(root):
    """Wait as a window does, until stretch and stress are there."""
    end = time.monotonic() + PATIENCE_S
    while not live.of(root).shape.fields:
        assert time.monotonic() < end, words.words(root)
        live._tick()
        time.sleep(0.05)


def painted(root, field):
    """Values of a field at the vertices of the struts."""
    part = next(part for part in live.parts(root) if part[displays.LIVE] == "lattice")
    found = np.empty(len(part.data.vertices), np.float32)
    part.data.attributes[field].data.foreach_get("value", found)
    return found


def lattice(root):
    """Vertices (v, 3) in mm of the struts as they are shown."""
    part = next(part for part in live.parts(root) if part[displays.LIVE] == "lattice")
    return motion_parts.vertices_of(part.data)


def test_a_unit_bends_at_the_sliders_pressure_and_anew_after_a_change(tmp_path):
    root = add(preset="mu-1.0x")
    root.mu_unit.chambers.count = 3
    root.mu_unit.study.folder = str(tmp_path / "unit")
    root.mu_live.on = True
    assert words.words(root) == "Bending..."
    assert not live.is_seen(root)
    bent(root, 5)
    assert live.is_seen(root)
    angle = live.angle_at(live.of(root).shape, 40.0)
    assert words.words(root).startswith(f"{angle:.1f} ± ")
    assert words.words(root).endswith("at 40 kPa, refining")
    at_40 = lattice(root)
    root.mu_live.pressure_kPa = 20.0
    at_20 = lattice(root)
    assert 0.0 < live.angle_at(live.of(root).shape, 20.0) < angle
    root.mu_live.pressure_kPa = 0.0
    rest = lattice(root)
    assert abs(live.angle_at(live.of(root).shape, 0.0)) < 1e-6
    assert np.abs(at_40 - rest).max() > np.abs(at_20 - rest).max() > 0.5
    assert np.ptp(rest[:, 1]) == pytest.approx(50.0), "as drawn, in millimetres"
    # Its arrow drags the slider, and no frame.
    assert handles.usable(root, handles.PRESSURE)
    handles.to_pressure(root, bpy.context.scene, 25.0)
    assert handles.pressure_of(root, bpy.context.scene) == root.mu_live.pressure_kPa == 25.0
    # What is bent is cut open, too, at once and whatever else runs.
    root.mu_live.pressure_kPa = 40.0
    root.mu_unit.cut = True
    assert np.ptp(lattice(root)[:, 0]) < 0.6 * np.ptp(at_40[:, 0])
    root.mu_unit.cut = False
    assert np.allclose(lattice(root), at_40, atol=1e-4)
    # Dimmed at once, then bent anew, by the same process; broken rules and running jobs leave it as it is.
    pid = live.of(root).child.pid
    root.mu_unit.chambers.wall_mm = 1.2
    assert live.is_seen(root)
    assert np.allclose(lattice(root), at_40, atol=1e-4), "the last bend stays"
    assert {part.data.materials[0].name for part in live.parts(root)} == {"MU Before"}
    assert words.words(root) == "Bending... (dim: the shape before)"
    root.mu_live.pressure_kPa = 20.0
    assert np.allclose(lattice(root), at_20, atol=1e-4)
    root.mu_live.pressure_kPa = 40.0
    bent(root, 5)
    assert {part.data.materials[0].name for part in live.parts(root)} == {"MU Membrane", "MU Lattice"}
    assert live.of(root).child.pid == pid
    assert live.angle_at(live.of(root).shape, 40.0) < angle
    # Another view of it is no other design.
    root.mu_unit.show = "solid"
    root.mu_unit.show = "preview"
    assert live.is_seen(root)
    root.mu_unit.candidates = True
    root.mu_unit.candidates = False
    assert live.is_seen(root)
    # The same shape's stretch, asked for once it is there; its largest pressure stretches it most.
    assert not live.of(root).shape.fields
    root.mu_live.colour = "largest_stretch"
    bent(root, 5)
    coloured(root)
    low, high = live.of(root).shape.ends("largest_stretch")
    assert 1.0 <= low < 1.01 < high < 2.0
    most = painted(root, "largest_stretch").max()
    assert most > 1.01
    slots = {part.data.materials[0].name for part in live.parts(root)}
    assert len(slots) == 1
    assert slots.pop().startswith("MU Live")
    root.mu_live.pressure_kPa = 20.0
    assert 1.0 < painted(root, "largest_stretch").max() < most
    root.mu_live.colour = "von_mises_kPa"
    assert painted(root, "von_mises_kPa").max() > 1.0
    root.mu_live.colour = "plain"
    assert {part.data.materials[0].name for part in live.parts(root)} == {"MU Membrane", "MU Lattice"}
    folder, child = live.of(root).folder, live.of(root).child
    root.mu_live.on = False
    assert live.of(root) is None
    assert not live.parts(root)
    assert not folder.exists()
    assert child.state == "failed" or child.state == "cancelled"
    root.mu_unit.show = "solid"
    root.mu_unit.chambers.wall_mm = 0.9
    root.mu_live.on = True
    assert root.mu_unit.show == "preview", "the bend that was asked for is shown"
    root.mu_live.pressure_kPa = 40.0
    live._tick()
    assert live.is_seen(root), "found before, in whatever session: at once"
    assert live.of(root).child is None
    assert np.allclose(lattice(root), at_40, atol=5e-3), "lengths to 0.002 mm"
    assert words.words(root).startswith(f"{angle:.1f} ± ")
    root.mu_unit.chambers.neck_diameter_mm = 13.5
    live._tick()
    assert words.words(root) == "Bending... (dim: the shape before)"
    root.mu_live.on = False
    root.mu_live.on = True
    live._tick()
    assert words.words(root) == "Bending... (dim: a unit like it)"
    # Colours that are asked for while it bends come with the shape.
    time.sleep(live.RESTS_S)
    live._tick()
    assert live.of(root).number == 1
    root.mu_live.colour = "largest_stretch"
    coloured(root)
    assert live.of(root).current is not None
    root.mu_live.on = False


def test_an_opened_file_shows_what_was_saved_and_bend_waits_grey_behind_it(tmp_path):
    root = add(preset="mu-0.75x")
    assert bpy.ops.mu.solid() == {"FINISHED"}
    root.mu_live.on = True
    assert words.behind(root) == ""
    root.mu_unit.show = "solid"
    assert words.behind(root) == ": in Preview"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    (root,) = unit_object.roots()
    assert root.mu_unit.show == "solid"
    assert live.of(root) is not None
    root.mu_unit.show = "preview"
    root.mu_unit.candidates = True
    assert words.behind(root) == ": candidates are at rest"
    root.mu_live.on = False
    root.mu_live.on = True
    assert not root.mu_unit.candidates
    root.mu_live.on = False


@pytest.mark.parametrize(
    ("error", "reaches_kPa", "finished", "better"),
    [
        (0.09, 20.0, False, False),  # the same mesh computed anew, its first pressure
        (0.09, 40.0, False, True),
        (0.03, 10.0, False, False),  # finer, and not there yet
        (0.03, 50.0, False, True),
        (0.03, 30.0, True, True),  # finer, and no equilibrium beyond
        (0.20, 80.0, False, False),  # coarser, beyond what is asked for
    ],
)
def test_a_shape_is_never_followed_by_one_that_bends_less_far(error, reaches_kPa, finished, better):
    kept = SimpleNamespace(error=0.09, pressure_kPa=np.array([0.0, 40.0]))
    answer = {"error": error, "states": [[0.0, 0.0], [reaches_kPa, 9.6]], "finished": finished}
    assert live._is_better(answer, kept, 40.0) is better


def test_a_real_job_comes_first(monkeypatch, tmp_path):
    root = add(preset="mu-1.0x")
    root.mu_unit.chambers.count = 3
    root.mu_unit.study.folder = str(tmp_path / "unit")
    root.mu_live.on = True
    live.of(root).due_s = 0.0
    # A kept shape of a unit like it is shown first.
    live._tick()
    live._tick()
    child = live.of(root).child
    assert child.state == "running"
    with monkeypatch.context() as given:
        given.setattr(start_child, "is_busy", lambda: True)
        live._tick()
        assert child.state != "running"
        assert live.of(root).child is None
        assert words.words(root) == "After the running job (dim: a unit like it)"
    live._tick()
    assert live.of(root).child.state == "running", "after it, the unit is bent"
    # A duplicate is bent by a process of its own.
    bpy.ops.object.duplicate()
    gestures.look()
    (copy,) = [one for one in unit_object.roots() if one != root]
    unit_object.rebuild(copy)
    live.of(copy).due_s = 0.0
    live._tick()
    assert live.of(copy).folder != live.of(root).folder
    copy.mu_live.on = False
    unit_object.make_active(bpy.context, root)
    # A deleted unit leaves no process.
    child = live.of(root).child
    bpy.ops.mu.delete()
    live._tick()
    assert child.state != "running"


def test_what_cannot_be_bent_live_is_told(tmp_path):
    root = add(preset="mu-1.0x")
    root.mu_unit.study.folder = str(tmp_path / "unit")
    root.mu_unit.wall.law = "prony"
    root.mu_live.on = True
    live.of(root).due_s = 0.0
    live._tick()
    assert words.words(root) == "A wall with memory is bent by Simulate only"
    root.mu_unit.wall.law = "neo-hooke"
    assert words.words(root) == "Bending..."
    root.mu_unit.chambers.wall_mm = 6.0
    assert words.words(root) == "A design rule is broken"
    assert live.of(root).due_s is None
    root.mu_live.on = False
    assert unit_object.roots() == [root]


def test_a_view_that_holds_the_unit_at_rest_holds_it_bent(monkeypatch):
    """A view of 2 by 2: framed for what leaves it, left alone where the unit at rest is out of it already."""
    framed = []
    eye = SimpleNamespace(perspective_matrix=np.eye(4))
    window = SimpleNamespace(type="WINDOW", width=800, height=600)
    space = SimpleNamespace(active=SimpleNamespace(region_3d=eye))
    area = SimpleNamespace(spaces=space, regions=[window], width=800, height=600)
    monkeypatch.setattr(viewports, "areas", lambda: [area])
    monkeypatch.setattr(viewports, "frame_points", lambda area, points: framed.append(points))
    box = np.array([[-0.8, -0.8, 0.0], [0.8, 0.8, 0.0]])
    viewports.keep_in_view(box, 1.2 * box)
    viewports.keep_in_view(1.3 * box, 1.4 * box)
    assert len(framed) == 0
    viewports.keep_in_view(box, 1.3 * box)
    assert len(framed) == 1
    # What the sidebar covers is not seen.
    area.regions = [window, SimpleNamespace(type="UI", width=160)]
    viewports.keep_in_view(0.7 * box, 0.75 * box)
    assert len(framed) == 2
    # Nor what headers cover.
    area.regions = [window, *(SimpleNamespace(type=kind, height=30) for kind in ("HEADER", "TOOL_HEADER"))]
    viewports.keep_in_view(box, 1.05 * box)
    assert len(framed) == 3
