"""The list of runs: which is shown, what a click and a slider do to it, and where it goes with the file.

The runs are of known bending, written without a solver.
"""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np

from mu_addon.blender.path import candidates
from mu_addon.blender.results import field_operators, legend, panel, places, probe, run_panel, runs
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import object as unit_object

from .acting import add, refused, with_runs
from .drawing import drawn

PANELS = [panel.MU_PT_results, run_panel.MU_PT_comparison, panel.MU_PT_motion, panel.MU_PT_field]


def keys(root):
    """Keys of the runs by what they are: on the default mesh, on a coarse one, that of the thicker wall."""
    found = {("thick" if r.unit.chambers.wall_mm > 1 else r.refine): r.key for r in studies.runs_of(root)}
    return found[1.0], found[0.5], found["thick"]


def caches(root):
    return [Path(bpy.path.abspath(p.modifiers["Motion"].filepath)) for p in motion_parts.parts(root)]


def test_a_small_run_replaces_no_large_one_and_undoing_a_parameter_finds_its_run(home):
    root = with_runs(home)
    full, coarse, thick = keys(root)
    listed = bpy.context.window_manager.mu_runs
    assert [entry.key for entry in listed.entries] == [thick, coarse, full], "the latest first"
    assert studies.shown_run(root).key == full
    assert listed.entries[listed.index].key == full
    assert "Coarse mesh (0.5)" not in drawn(PANELS)
    # Another parameter: its own run is shown at once; then none, and the last one says that it is stale.
    root.mu_unit.chambers.wall_mm = 1.1
    assert (studies.findings(root).run.key, studies.findings(root).stale) == (thick, False)
    root.mu_unit.chambers.wall_mm = 1.2
    assert (studies.findings(root).run.key, studies.findings(root).stale) == (thick, True)
    assert "Stale" in drawn(PANELS)
    root.mu_unit.chambers.wall_mm = 0.9
    assert (studies.findings(root).run.key, studies.findings(root).stale) == (full, False)
    # A click shows another one, until the unit changes.
    listed.index = 1
    assert studies.findings(root).run.key == coarse
    assert "Coarse mesh (0.5)" in drawn(PANELS)
    root.mu_unit.chambers.wall_mm = 1.1
    root.mu_unit.chambers.wall_mm = 0.9
    assert studies.findings(root).run.key == full
    # One of other parameters can be looked at, too, and its parameters taken over.
    assert bpy.ops.mu.run_show(key=thick) == {"FINISHED"}
    assert studies.findings(root).stale
    assert bpy.ops.mu.run_restore() == {"FINISHED"}
    assert round(root.mu_unit.chambers.wall_mm, 5) == 1.1
    assert root.mu_unit.study.command == "simulate"
    assert not studies.findings(root).stale
    assert "no run 'never'" in refused(bpy.ops.mu.run_show, key="never")


def test_a_click_on_a_run_moves_nothing_above_it(home):
    root = with_runs(home)
    above = []
    for key in keys(root):
        assert bpy.ops.mu.run_show(key=key) == {"FINISHED"}
        layout = MagicMock()
        panel.MU_PT_results.show(MagicMock(), layout, bpy.context, root)
        calls = [name for name, _, _ in layout.mock_calls]
        above.append(calls[: calls.index("row().template_list")])
    assert above == [["row"]] * 3


def test_how_near_to_tearing_and_what_is_doubtful_stand_with_the_results(home):
    root = with_runs(home)
    path = studies.findings(root).run.folder / "summary.json"
    assert not panel.MU_PT_warnings.poll(bpy.context)
    summary = json.loads(path.read_text(encoding="utf-8"))
    summary["nearest_to_break"] = {"pressure_kPa": 40.0, "part": "wall", "percent": 17.2}
    summary["warnings"] = ["Paths are not compared at -20 kPa and beyond (alpha5: no equilibrium)."]
    path.write_text(json.dumps(summary), encoding="utf-8")
    runs.refresh()
    shown = drawn([*PANELS, panel.MU_PT_warnings])
    assert "17 % of break in wall, 40 kPa" in shown
    assert "Paths are not compared at -20 kPa" in shown


def test_what_is_shown_on_the_unit_follows_the_run(home):
    root = with_runs(home)
    full, _, thick = keys(root)
    assert bpy.ops.mu.field_show(field="displacement_mm") == {"FINISHED"}
    assert all(path.parents[2].name == full for path in caches(root))
    most = places.largest(root).value
    root.mu_unit.chambers.wall_mm = 1.1
    assert all(path.parents[2].name == thick for path in caches(root))
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)
    assert places.largest(root).value < 0.9 * most, "that one bends less"
    root.mu_unit.chambers.wall_mm = 0.9
    assert abs(places.largest(root).value - most) < 1e-4


def test_a_run_that_was_stopped_says_so_in_the_room_there_is():
    for status in ("cancelled; motion complete", "interrupted; no result yet", "stopped: memory; 2 states"):
        run = SimpleNamespace(ranking=[], angles=[], state=status)
        assert run_panel.found_in(run) == "stopped"


def test_names_and_stars_are_kept_with_the_run(home):
    root = with_runs(home)
    entry = bpy.context.window_manager.mu_runs.entries[2]
    assert entry.title == "Ranking"
    entry.title, entry.starred = "as printed", True
    run = studies.run_by_key(root, entry.key)
    assert (run.title, run.starred) == ("as printed", True)
    assert (run.folder / "label.toml").is_file()
    entry.title = "x" * 200
    assert len(studies.run_by_key(root, entry.key).title) == 80
    entry.title = ""
    assert entry.title == "Ranking"


def test_two_runs_side_by_side_and_as_a_difference_on_the_unit(home):
    root = with_runs(home)
    full, coarse, thick = keys(root)
    assert "is the one that is shown" in refused(bpy.ops.mu.run_compare, key=full)
    assert "Compare with another run" in refused(bpy.ops.mu.field_show, field="run_difference_mm")
    assert bpy.ops.mu.run_compare(key=thick) == {"FINISHED"}
    texts = drawn(PANELS)
    assert "Wall (mm) 0.9 1.1" in texts, texts
    assert "Ranking Motion" in texts, "the columns are named by the runs"
    assert "At 40 kPa (deg) +50.00 +40.00" in texts, texts
    assert bpy.ops.mu.field_show(field="run_difference_mm") == {"FINISHED"}
    scene = bpy.context.scene
    assert scene.frame_current == 1 + 6 * 24, "the last of seven samples, a second apart"
    # Bent by 50 and by 40 degrees: the tips of two arcs of the same length.
    found = places.largest(root)
    rest = found.rest_mm
    turn = np.radians([50.0, 40.0]) * rest[2] / 56.25
    arcs = np.stack(
        [rest[1] * np.cos(turn) + rest[2] * np.sin(turn), rest[2] * np.cos(turn) - rest[1] * np.sin(turn)]
    )
    assert abs(found.value - np.linalg.norm(arcs[:, 0] - arcs[:, 1])) < 0.02 * found.value
    assert bpy.ops.mu.run_compare(key=coarse) == {"FINISHED"}
    bpy.ops.mu.field_show(field="run_difference_mm")
    assert places.largest(root).value == 0.0, "both are written of the same bending"
    assert bpy.ops.mu.run_compare(key=coarse) == {"FINISHED"}
    assert root.mu_unit.study.against == ""


def test_a_run_that_is_compared_with_itself_shows_no_difference(home):
    root = with_runs(home)
    _, _, thick = keys(root)
    assert bpy.ops.mu.run_compare(key=thick) == {"FINISHED"}
    assert bpy.ops.mu.field_show(field="run_difference_mm") == {"FINISHED"}
    assert all("run_difference_mm" in part.data.attributes for part in motion_parts.parts(root))
    assert bpy.ops.mu.run_show(key=thick) == {"FINISHED"}
    assert not any("run_difference_mm" in part.data.attributes for part in motion_parts.parts(root))
    assert "compared with: tick another one" in drawn(PANELS)
    words = legend.lines(root, motion_parts.motion_of(root), bpy.context.scene)
    assert "the run compared with itself" in words
    row = "time_s,obstacle,force_x_N,force_y_N,force_z_N\n0,Box.obj,0,3,4\n"
    (studies.results_folder(root) / studies.CONTACT).write_text(row)
    assert "Box: 5.00 N" in legend.lines(root, motion_parts.motion_of(root), bpy.context.scene)
    assert "compared with: tick" in refused(bpy.ops.mu.field_show, field="run_difference_mm")


def test_a_name_above_a_motion_stays_below_the_headers():
    view = SimpleNamespace(type="WINDOW", x=0, y=100, width=800, height=600)
    upper = SimpleNamespace(type="HEADER", y=674, height=26)
    tools = SimpleNamespace(type="TOOL_HEADER", y=648, height=26)
    lower = SimpleNamespace(type="HEADER", y=100, height=26)
    hidden = SimpleNamespace(type="TOOL_HEADER", y=600, height=1)
    area = SimpleNamespace(regions=[view, upper, tools, hidden])
    assert legend.below_headers(area, view) == 548.0
    area.regions = [view, lower]
    assert legend.below_headers(area, view) == 600.0
    assert legend.name_height(590.0, 50.0, 530.0) == 530.0
    assert legend.name_height(400.0, 50.0, 530.0) == 400.0
    assert legend.name_height(900.0, 700.0, 530.0) == 900.0, "the body is out of sight, and so is its name"


def test_a_legend_keeps_clear_of_what_blender_draws_in_a_view_of_any_size():
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, use_region_overlap=True))
    overlay = SimpleNamespace(show_overlays=True, show_text=True, show_stats=False)

    def room(height, count=2, redo=0, stats=False, tools=0):
        view = SimpleNamespace(type="WINDOW", x=0, y=100, width=800, height=height)
        others = [
            SimpleNamespace(type="HEADER", y=74 + height, height=26),
            SimpleNamespace(type="HUD", y=110, height=redo or 1),
            SimpleNamespace(type="TOOLS", y=100, width=tools or 1, height=height),
        ]
        overlay.show_stats = stats
        active = SimpleNamespace(overlay=overlay)
        area = SimpleNamespace(regions=[view, *others], spaces=SimpleNamespace(active=active))
        context = SimpleNamespace(preferences=preferences, area=area, region=view)
        found = legend.room(context, count)
        texts = found.foot + found.height + 14 + legend.LINE * count
        assert not found.height or texts <= height - 26 - 2 * legend.LINE * (1 + 3 * stats), "below its texts"
        assert found.foot - 30 >= redo, "above the redo panel"
        return found

    assert room(600).height == legend.HEIGHT
    assert room(600, tools=40).left == room(600).left + 40.0
    assert 0 < room(350, count=4).height < legend.HEIGHT
    assert 0 < room(420, redo=120).height < legend.HEIGHT
    assert room(420, stats=True).height < room(420).height
    assert room(200).height == 0.0, "no ramp, for its texts would lie on Blender's own"


def test_candidates_are_seen_on_the_unit_at_rest_alone(home):
    root = with_runs(home)
    root.mu_unit.candidates = True
    assert bpy.ops.mu.motion() == {"FINISHED"}
    assert unit_object.shows_result(root)
    assert not root.mu_unit.candidates
    assert candidates.candidate(root, "alpha1") is None
    # Asked for beside a result they bring back the unit at rest, and Result takes them away again.
    root.mu_unit.candidates = True
    assert not unit_object.shows_result(root)
    assert candidates.candidate(root, "alpha1") is not None
    root.mu_unit.show = unit_object.RESULT
    assert unit_object.shows_result(root)
    assert candidates.candidate(root, "alpha1") is None
    # A run that comes in meanwhile leaves them where they are.
    root.mu_unit.candidates = True
    root.mu_unit.chambers.wall_mm = 1.1
    assert root.mu_unit.show == "preview"
    assert candidates.candidate(root, "alpha1") is not None
    # Motions beside the design bend nothing in its place.
    root.mu_motion.on_unit = False
    assert root.mu_unit.candidates
    root.mu_motion.on_unit = True
    assert not root.mu_unit.candidates


def test_deleting_a_run_frees_its_folder_and_takes_away_what_it_shows(home):
    root = with_runs(home)
    _, coarse, thick = keys(root)
    bpy.ops.mu.field_show(field="von_mises_kPa")
    bpy.ops.mu.run_compare(key=coarse)
    assert bpy.ops.mu.run_remove(key=coarse) == {"FINISHED"}
    assert root.mu_unit.study.against == ""
    assert motion_parts.parts(root), "that of another run stays"
    assert bpy.ops.mu.run_remove() == {"FINISHED"}
    assert motion_parts.parts(root) == []
    assert root.mu_unit.show == "preview"
    assert sorted(path.name for path in (home / "runs").iterdir()) == [thick]
    assert [entry.key for entry in bpy.context.window_manager.mu_runs.entries] == [thick]
    bpy.ops.mu.run_remove(key=thick)
    assert "Nothing simulated yet" in drawn(PANELS)
    assert not bpy.ops.mu.run_remove.poll()


def test_an_unsaved_files_runs_go_where_saving_finds_them(home, tmp_path):
    root = add(preset="mu-0.75x")
    unsaved = studies.assign_folder(root)
    assert not bpy.data.filepath
    shutil.copytree(home, unsaved, dirs_exist_ok=True)
    unit_object.rebuild(root)
    bpy.ops.mu.field_show(field="displacement_mm")
    most = places.largest(root).value
    place = tmp_path / "project"
    place.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(place / "seat.blend"))
    assert not unsaved.exists()
    assert studies.folder_of(root) == place / "seat.mu" / unsaved.name

    def reopened(path):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=str(path))
        (root,) = unit_object.roots()
        assert root.mu_unit.study.folder.startswith("//")
        assert len(studies.runs_of(root)) == 3
        assert not studies.findings(root).stale
        assert all(path.is_file() for path in caches(root))
        bpy.context.scene.frame_set(bpy.context.scene.frame_current)
        assert abs(places.largest(root).value - most) < 1e-4
        return root

    reopened(place / "seat.blend")
    # Saved elsewhere, a file finds the runs where they are; a copy changes nothing of the file that is open.
    (place / "sub").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(place / "sub" / "copy.blend"), copy=True)
    (root,) = unit_object.roots()
    assert root.mu_unit.study.folder.startswith("//seat.mu")
    reopened(place / "sub" / "copy.blend")
    # File and folder moved together find each other.
    shutil.move(place, tmp_path / "moved")
    reopened(tmp_path / "moved" / "seat.blend")


def test_the_probe_says_value_place_and_time(home):
    root = with_runs(home)
    assert "Show a motion first" in refused(bpy.ops.mu.probe)
    bpy.ops.mu.field_show(field="displacement_mm")
    scene, field = bpy.context.scene, "displacement_mm"
    scene.frame_set(1 + 6 * 24)
    surfaces = places.Surfaces(root)
    # From above through the tip: by how much that point was moved, and where it was.
    top = max(places.moved(part)[:, 2].max() for part in places.seen(root))
    found = surfaces.hit((-3.0, 12.0, top + 50.0), (0.0, 0.0, -1.0))
    away = np.linalg.norm(found.now_mm - found.rest_mm)
    assert abs(found.value - away) < 0.02 * away
    assert found.value <= places.largest(root).value + 1e-5
    first, _, _, last = probe.lines(root, found, scene)
    assert first == f"Displacement: {found.value:.4g} mm"
    assert last == "Without a sensor, 6.00 s, 40.0 kPa"
    assert surfaces.hit((500.0, 0.0, 500.0), (0.0, 0.0, 1.0)) is None
    root.mu_motion.field = "contact_pressure_kPa"
    assert places.largest(root) is None
    assert (
        "not known here"
        in probe.lines(root, places.Surfaces(root).hit((-3, 12, top + 50), (0, 0, -1)), scene)[0]
    )
    assert places.values_of(found.part, field) is not None


def test_a_field_that_the_run_has_not_is_refused_with_what_to_do(home):
    with_runs(home)
    assert "without self-contact" in refused(bpy.ops.mu.field_show, field="contact_pressure_kPa")
    # The button of a field that is not there is grey, and its tooltip says why.
    root = unit_object.active_root(bpy.context)
    assert field_operators.lacking(root, "von_mises_kPa") == ""
    for field, words in (("contact_pressure_kPa", "without self-contact"), ("von_mises_kPa", "")):
        kind = bpy.types.MU_OT_field_show
        text = kind.description(bpy.context, SimpleNamespace(field=field))
        assert (f"Not here: this run was simulated {words}" in text) == bool(words)
    assert "no map of the sensitivity" in refused(bpy.ops.mu.field_show, field="dJ_by_modulus_mm_per_MPa")
    assert "no sensor path" in refused(bpy.ops.mu.field_show, field="deviation_mm")
