"""Jobs in the header: one runs, the others wait; Cancel, and a notice at the end."""

import re
import sys
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import pytest

import mu_addon
from mu_addon.blender.evidence import panel as evidence_panel
from mu_addon.blender.evidence import state as evidence
from mu_addon.blender.gripper import object as gripper_object
from mu_addon.blender.gripper import panel as gripper_panel
from mu_addon.blender.gripper import state as grasps
from mu_addon.blender.jobs import header, preferences, start_child
from mu_addon.blender.jobs.panel import rounded
from mu_addon.blender.optimize import panel as optimize_panel
from mu_addon.blender.optimize import state as optimization
from mu_addon.blender.printing import panel as print_panel
from mu_addon.blender.printing import state as printing
from mu_addon.blender.sensor import panel as sensor_panel
from mu_addon.blender.sensor import state as sensor
from mu_addon.blender.simulate import panel as simulate_panel
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate import timings
from mu_addon.blender.simulate.job import SIMULATION, announced, job_of, plan_of
from mu_addon.blender.simulate.panel import start_words
from mu_addon.blender.unit import object as unit_object
from mu_addon.errors import InputError
from mu_addon.run.child import Child

from .acting import add, refused
from .drawing import drawn
from .jobs import FAKE, ended, fake, watch


def started(root, how, monkeypatch):
    """A fake simulation, started as its operator does."""

    def fake(arguments, folder, **settings):
        folder = folder / start_child.OWN_FOLDER
        return Child([sys.executable, FAKE, how], folder, start_child.environment(), **settings)

    monkeypatch.setattr(start_child, "start", fake)
    return SIMULATION.start(root, SIMULATION.folder_of(root), lambda folder: None)


def said():
    """Words of the status bar; the header of a view says nothing beside it."""
    shown = _said(header.draw, status_bar=True)
    assert _said(header.draw_in_view, status_bar=True) == ""
    # The time left counts down between the two.
    assert bool(_said(header.draw_in_view, status_bar=False)) == bool(shown)
    return shown


def _said(draw, status_bar):
    texts, layout = [], MagicMock()
    layout.row.return_value = layout
    layout.label.side_effect = lambda text="", **_: texts.append(text)
    layout.progress.side_effect = lambda factor, text: texts.append(text)
    layout.menu.side_effect = lambda name, text="", **_: texts.append(text)
    context = SimpleNamespace(screen=SimpleNamespace(show_statusbar=status_bar))
    draw(MagicMock(layout=layout), context)
    return " ".join(texts)


def told(operator, **settings):
    """The tooltip of a button of the header."""
    return getattr(bpy.types, f"MU_OT_{operator}").description(bpy.context, SimpleNamespace(**settings))


def test_one_runs_the_others_wait_and_each_ends_with_a_notice(monkeypatch):
    first, second = add(), add()
    assert said() == ""
    one = started(first, "hang", monkeypatch)
    two = started(second, "good", monkeypatch)
    watch(lambda: one.progress)
    assert (one.state, two.state) == ("running", "waiting")
    assert SIMULATION.is_running(second)
    assert "motion (3 of 10)" in said()
    assert "mu-1.0x: simulation: " in told("job_cancel", key=SIMULATION.key(first))
    assert "+1" in said()
    assert bpy.ops.mu.job_cancel() == {"FINISHED"}
    assert "stopping" in said()
    ended(one)
    watch(lambda: two.state != "waiting")
    ended(two)
    assert (one.state, two.state) == ("cancelled", "done")
    assert "Done in" in said()
    assert "mu-1.0x.001: simulation" in said()
    assert bpy.ops.mu.job_dismiss() == {"FINISHED"}
    assert said() == ""
    assert SIMULATION.child(second) is None, "and its panel says no more of it"
    assert "is not running" in refused(bpy.ops.mu.job_cancel)


def test_a_notice_goes_when_another_file_opens(monkeypatch, tmp_path):
    root = add()
    child = started(root, "good", monkeypatch)
    ended(child)
    assert "Done in" in said()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert said() == ""
    (root,) = unit_object.roots()
    assert SIMULATION.child(root) is child, "the panel of its unit still tells"


@pytest.mark.own_process
def test_the_bar_is_there_in_the_session_that_installs_the_extension():
    """The installer sets a status text before it registers; Blender then restores what it drew before."""
    bar, workspace = bpy.types.STATUSBAR_HT_header, bpy.context.workspace
    workspace.status_text_set("Install: mu_addon")
    before = bar.draw
    mu_addon.register()
    workspace.status_text_set(None)
    assert header.draw in bar.draw._draw_funcs
    assert before in (bar.draw, *bar.draw._draw_funcs), "and what Blender draws stays"
    mu_addon.unregister()
    workspace.status_text_set(None)
    assert header.draw not in bar.draw._draw_funcs


def test_what_waits_can_be_taken_out_of_the_queue(monkeypatch):
    first, second = add(), add()
    one = started(first, "hang", monkeypatch)
    two = started(second, "good", monkeypatch)
    assert bpy.ops.mu.job_cancel(key=SIMULATION.key(second)) == {"FINISHED"}
    assert two.state == "cancelled"
    one.cancel()
    ended(one)
    start_child.poll()
    assert two.state == "cancelled"
    assert not start_child.running()


def test_a_failed_one_says_what_in_the_header(monkeypatch):
    child = started(add(), "reported_error", monkeypatch)
    ended(child)
    assert "Failed: mu-1.0x: simulation" in said()
    assert len(said()) <= header.NOTICE_LETTERS
    assert child.error["what"] in told("job_dismiss")


def test_a_bar_is_short_whatever_a_stage_is_called(monkeypatch):
    root = add()
    root.name = "a name of a unit that nobody can read at a glance"
    child = started(root, "hang", monkeypatch)
    watch(lambda: child.progress)
    child.progress["stage"] = "candidates behind the third limit point"
    assert "stage 3 of 10" in said()
    assert "limit point" not in said()
    everything = told("job_cancel", key=SIMULATION.key(root))
    assert "limit point" in everything
    assert root.name in everything
    assert everything.endswith("finished stages are kept")
    assert bpy.ops.mu.job_cancel() == {"FINISHED"}
    ended(child)


def test_a_plan_has_the_stages_of_the_job_and_the_seconds_of_the_last_run(study, tmp_path, monkeypatch):
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    root = add(preset="mu-0.75x")
    root.mu_unit.study.command = "simulate"
    assert [name for name, _ in plan_of(root)] == ["solid", "mesh", "Model A", "report"]
    detail, seconds = timings.of_run(study)
    timings.note(detail, seconds)
    assert dict(plan_of(root))["Model A"] != seconds["Model A"], (
        "a run on a coarser mesh tells nothing of this one"
    )


def test_the_button_says_what_it_will_take_by_what_was_measured_here(tmp_path, monkeypatch):
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    root = add(preset="mu-0.75x")
    root.mu_unit.study.command = "simulate"
    assert not announced(root)[1]
    assert start_words(root).startswith("Simulate, perhaps ")
    # It follows what is changed: a coarser mesh, and suction whose walls pass through each other.
    whole, _ = announced(root)
    root.mu_unit.study.refine = 0.35
    assert announced(root)[0] < 0.9 * whole
    root.mu_unit.study.refine = 0.5
    root.mu_unit.study.self_contact = False
    assert announced(root)[0] > whole
    root.mu_unit.study.self_contact = True
    detail = job_of(root).detail()
    timings.note(detail, {"solid": 2.0, "mesh": 8.0, "Model A": 500.0, "report": 30.0})
    assert announced(root) == (540.0, True)
    assert start_words(root) == "Simulate, about 9 min"
    assert dict(plan_of(root))["Model A"] == 500.0, "and the bar counts by the same figure"
    # Found in the cache: that is no time that a new one takes.
    timings.note(detail, {"Model A": 1.0})
    assert announced(root) == (540.0, True)
    assert [rounded(s) for s in (3, 41, 95, 1500, 7200, 12600)] == [
        "10 s", "40 s", "2 min", "25 min", "2 h", "3 h 30 min",
    ]  # fmt: skip


def test_a_quick_ranking_is_started_by_its_own_button(tmp_path, monkeypatch):
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    root = add(preset="mu-0.75x")
    assert announced(root, quick=True)[0] < 0.5 * announced(root)[0]
    assert "Quick Ranking, perhaps " in drawn(simulate_panel)
    given = {}
    monkeypatch.setattr(start_child, "start", lambda *_, **more: given.update(more))
    monkeypatch.setattr(start_child, "watch", lambda *_: None)
    assert bpy.ops.mu.simulate(quick=True) == {"FINISHED"}
    assert given["plan"] == plan_of(root, quick=True)
    (run,) = studies.runs_of(root)
    assert run.title == "Quick ranking"
    # The main button is the full one again, in a folder of its own.
    assert bpy.ops.mu.simulate() == {"FINISHED"}
    assert given["plan"] == plan_of(root)
    assert sorted(run.title for run in studies.runs_of(root)) == ["Quick ranking", "Ranking"]


def test_progress_redraws_sidebars_and_an_end_the_scene(monkeypatch):
    drawn = []
    for name in ("redraw", "redraw_regions", "redraw_status"):
        monkeypatch.setattr(start_child.viewports, name, lambda *_, name=name: drawn.append(name))
    child = started(add(), "hang", monkeypatch)
    drawn.clear()
    watch(lambda: start_child._poll() and "redraw_regions" in drawn)
    assert set(drawn) == {"redraw_regions", "redraw_status"}
    # Not with each look at the job: without a graphics card a frame takes the solver's time.
    monkeypatch.setattr(start_child, "REDRAW_S", 1e6)
    count = len(drawn)
    for _ in range(20):
        start_child._poll()
    assert len(drawn) == count
    child.cancel()
    watch(lambda: start_child._poll() is None)
    assert drawn[-1] == "redraw"
    assert drawn.count("redraw") == 1


def test_preferences_say_what_uninstalling_deletes(tmp_path, monkeypatch):
    """Runs of files that were never saved lie in a folder that goes with the extension."""
    monkeypatch.setattr(preferences, "user_folder", lambda *parts: tmp_path)
    told = preferences.MU_AP_preferences
    assert "Uninstalling" not in drawn([told])
    (tmp_path / "mu-1.0x-1").mkdir()
    assert "deletes the results of one unit or gripper in files that were never saved" in drawn([told])
    (tmp_path / "hand-2").mkdir()
    assert "of 2 units or grippers" in drawn([told])


SEATS = {
    "simulate": (SIMULATION, simulate_panel),
    "print_check": (printing.PRINTING, print_panel),
    "evidence_diagnose": (evidence.DIAGNOSIS, evidence_panel),
    "optimize": (optimization.OPTIMIZATION, optimize_panel),
    "sensor_calibrate": (sensor.CALIBRATION, sensor_panel),
    "grasp": (grasps.GRASP, gripper_panel),
}
"""By the operator that starts it: kind of job, its panels."""


@pytest.mark.parametrize(
    "start", ["simulate", "print_check", "evidence_diagnose", "optimize", "sensor_calibrate", "grasp"]
)
def test_a_panel_tells_how_its_job_ends_and_stops_it(start, blocks):
    kind, panels = SEATS[start]
    root = gripper() if start == "grasp" else add()
    root.mu_evidence.folder = str(blocks)
    for what in ("targets", "freedoms") if start == "optimize" else ():
        bpy.ops.mu.optimize_list(what=what)
    assert getattr(bpy.ops.mu, start).poll()
    folder = kind.folder_of(root)

    def operator(name):
        return getattr(bpy.ops.mu, f"{kind.prefix}{name}")

    endings = {"good": "Done in", "garbage": "Done in", "reported_error": "thicker wall"}
    for how, expected in {**endings, "crash": "SIGSEGV", "wordless": "without a message"}.items():
        ended(fake(kind, root, how, folder))
        assert expected in drawn(panels), (how, drawn(panels))
        assert operator("dismiss")() == {"FINISHED"}
        assert expected not in drawn(panels)
    child = fake(kind, root, "hang", folder)
    watch(lambda: child.progress)
    # Three seconds, counted down since the child said so.
    assert re.search(r"0\.50 50%, motion, [0-3](\.\d)? s left", drawn(panels)), drawn(panels)
    assert f"mu.{kind.prefix}cancel" in drawn(panels)
    with pytest.raises(InputError, match="already"):
        kind.start(root, folder, lambda folder: None)
    if start != "sensor_calibrate":
        assert not getattr(bpy.ops.mu, start).poll()
    # The unit's own simulation is another one.
    assert bpy.ops.mu.cancel.poll() == (start == "simulate")
    assert operator("cancel")() == {"FINISHED"}
    assert "stopping" in drawn(panels)
    ended(child)
    assert "Cancelled" in drawn(panels)
    assert not operator("cancel").poll()
    assert getattr(bpy.ops.mu, start).poll()


def gripper():
    bpy.ops.mu.gripper_add()
    return gripper_object.active(bpy.context)
