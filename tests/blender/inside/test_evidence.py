"""Measured data in Blender: checked, diagnosed, shown on the timeline, put into the unit."""

import csv
import json
import math
import re
import shutil
from pathlib import Path

import attrs
import bpy
import numpy as np
import pytest

from mu_addon.blender.evidence import panel as evidence_panel
from mu_addon.blender.evidence import state as evidence
from mu_addon.blender.evidence import timeline as evidence_motion
from mu_addon.blender.simulate import effects, timings
from mu_addon.blender.simulate import panel as panels
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit
from mu_addon.evidence.extended import ExtendedModel, Fitted
from mu_addon.fem.protocol import read_protocol
from mu_addon.measured import read_folder

from ...lab_files import exports
from .acting import add, refused
from .drawing import drawn as drawn_by
from .jobs import ended


def diagnose(root):
    assert bpy.ops.mu.evidence_diagnose() == {"FINISHED"}
    child = evidence.DIAGNOSIS.child(root)
    ended(child)
    assert child.state == "done", child.error


def parts(root):
    return {part["mu_evidence_part"]: part for part in evidence_motion.parts(root)}


def drawn(*more):
    return drawn_by([evidence_panel.MU_PT_evidence, *more])


def test_a_folder_is_checked_as_it_is_chosen(blocks):
    root, data = add(), blocks
    assert "Choose a folder with experiments.toml" in drawn()
    assert not bpy.ops.mu.evidence_diagnose.poll()
    root.mu_evidence.folder = str(data / "none")
    assert "cannot read the experiments" in drawn()
    assert not bpy.ops.mu.evidence_diagnose.poll()
    root.mu_evidence.folder = str(data)
    assert "0.75x: 4 rows" in drawn()
    assert "1.5x: 4 rows" in drawn()
    assert "Not diagnosed yet" in drawn()
    assert bpy.ops.mu.evidence_diagnose.poll()
    assert not bpy.ops.mu.evidence_apply.poll()
    table = data / "block_1.csv"
    good = table.read_text()
    table.write_text(good.replace("0.1,", "0.1,much"))
    # Where a line is broken depends on how long the folder's name is.
    assert "isnotanumber" in "".join(drawn().split())
    assert "block_1.csv,row" in "".join(drawn().split())
    table.write_text(good)
    assert "1.5x: 4 rows" in drawn()


def test_from_data_to_a_unit_that_has_what_was_found(blocks, tmp_path, monkeypatch):
    """The whole way with a real diagnosis; undone, saved, found again, and stale once the data change."""
    folder = tmp_path
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "seat.blend"))
    root = add()
    root.mu_evidence.folder = "//data"
    monkeypatch.setattr(timings, "_file", lambda: folder / "timings.json")
    diagnose(root)
    assert "Diagnose, about" not in drawn()
    timings.note(*timings.READERS["evidence"](evidence.folder_of(root)))
    assert "Diagnose, about" in drawn(), "by what such data took here"
    assert evidence.folder_of(root).parent == studies.folder_of(root)
    texts = drawn()
    assert "Named: overcure" in texts, texts
    assert "95 %" in texts, texts
    assert "Stale" not in texts, texts
    assert "p = " in texts or "p < " in texts
    assert bpy.ops.mu.evidence_open(what="errors") == {"FINISHED"}
    assert "No unit under pressure" in refused(bpy.ops.mu.evidence_motion, experiment="1x")

    found = json.loads((evidence.folder_of(root) / "verdict.json").read_text())
    offset = found["causes"][0]["parameters"]["offset_mm"]["value"]
    bpy.ops.ed.undo_push(message="diagnosed")
    assert bpy.ops.mu.evidence_apply() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="applied")
    printed = to_unit(root.mu_unit).print
    assert abs(printed.offset_xy_mm - offset) < 1e-6
    assert not unit_object.behind(root)
    assert "Applied to the unit: every printed surface moves outward" in drawn().replace("  ", " ")
    assert "evidence_apply" in drawn()
    # The same verdict, had it been ambiguous: nothing to apply before what separates the rivals is measured.
    with monkeypatch.context() as given:
        doubtful = attrs.evolve(evidence.diagnosis(root), verdict={**found, "verdict": "ambiguous"})
        assert doubtful.name == "ambiguous"
        given.setattr(evidence, "diagnosis", lambda root: doubtful)
        given.setattr(evidence, "applied", lambda root: "")
        assert "evidence_apply" not in drawn()
        assert "Several effects explain the data equally well" in refused(bpy.ops.mu.evidence_apply)
    assert not bpy.ops.mu.evidence_apply.poll(), "given twice it would count twice"
    bpy.ops.ed.undo()
    root = unit_object.active_root(bpy.context)
    assert to_unit(root.mu_unit).print.offset_xy_mm == 0.0
    assert bpy.ops.mu.evidence_apply.poll()
    bpy.ops.ed.redo()
    root = unit_object.active_root(bpy.context)
    assert abs(to_unit(root.mu_unit).print.offset_xy_mm - offset) < 1e-6

    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = unit_object.roots()
    assert "Named: overcure" in drawn()
    assert not bpy.ops.mu.evidence_apply.poll()
    table = blocks / "block_1.csv"
    table.write_text(table.read_text().replace("0.1,", "0.11,"))
    assert "Stale: made with other measured data" in drawn()
    stale = "The diagnosis is stale: made with other measured data"
    assert stale in refused(bpy.ops.mu.evidence_apply)


def test_what_has_no_parameter_is_applied_undone_saved_and_removed(tmp_path, clogged):
    folder = tmp_path
    shutil.copytree(clogged / "study", folder / "study")
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "seat.blend"))
    root = add()
    root.mu_evidence.folder, root.mu_unit.study.folder = str(clogged / "data"), "//study"
    study = root.mu_unit.study
    (folder / "inflate.csv").write_text("time_s,pressure_kPa\n0,0\n2,5\n")
    study.command, study.refine, study.protocol = "simulate", 0.3, "//inflate.csv"
    unit = to_unit(root.mu_unit)
    assert not effects.named_effects(root)
    assert "With named effects" not in drawn(panels.MU_PT_simulate)
    assert "no effects in addition" in refused(bpy.ops.mu.evidence_remove)
    bpy.ops.ed.undo_push(message="diagnosed")
    assert bpy.ops.mu.evidence_apply() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="applied")
    assert to_unit(root.mu_unit).chambers == unit.chambers
    share = json.loads((folder / "study/evidence/verdict.json").read_text())
    share = share["causes"][0]["parameters"]["share_lost"]["value"]
    (line,) = effects.lines(root)
    assert line.startswith(f"clogged chamber, share lost: {share:.4g} (")
    assert " to " in line
    texts = drawn(panels.MU_PT_simulate)
    assert "With named effects" in texts, texts
    assert "clogged chamber, share lost: 0.5" in texts, texts
    assert "Applied to the unit: all moduli" in texts, texts
    assert "the last chamber receives less pressure" in texts, texts
    assert not bpy.ops.mu.evidence_apply.poll()
    # Pressure alone knows no direction.
    assert not effects.has_gravity(root)
    assert "orientation_deg" not in effects.named_effects(root).tables

    bpy.ops.ed.undo()
    root = unit_object.active_root(bpy.context)
    assert effects.inputs(root) == {}
    assert bpy.ops.mu.evidence_apply.poll()
    bpy.ops.ed.redo()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = unit_object.roots()
    assert effects.inputs(root) == {"effects": {"clogged_chamber": {"share_lost": share}}}
    assert "Applied to the unit" in drawn(panels.MU_PT_simulate)
    before = studies.design_of(root)
    # Weight has a direction: results of another one are of another design.
    known = Fitted(1300.0, 50.0, 1200.0, 1400.0, "kg/m3")
    effects.keep(root, ExtendedModel("named", {"gravity": {"density_kg_m3": known}}, {}).text())
    assert "gravity, density: 1300 kg/m3 (1200 to 1400)" in drawn(panels.MU_PT_simulate).replace("  ", " ")
    weighed = studies.design_of(root)
    root.mu_unit.study.orientation_deg = 90.0
    assert len({before, weighed, studies.design_of(root)}) == 3
    assert bpy.ops.mu.evidence_remove() == {"FINISHED"}
    assert "With named effects" not in drawn(panels.MU_PT_simulate)
    assert not effects.named_effects(root)


def opened(clogged):
    """A unit with the diagnosed data; returns it, the scene and the experiments."""
    bpy.context.preferences.edit.use_global_undo = True
    root = add()
    root.mu_evidence.folder, root.mu_unit.study.folder = str(clogged / "data"), str(clogged / "study")
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 30, 1.001
    return root, scene, read_folder(clogged / "data").experiments


def test_measured_and_simulated_motion_on_the_timeline(clogged):

    root, scene, measured = opened(clogged)
    first = measured[0]

    assert "Named: clogged chamber" in drawn()
    assert not evidence.diagnosis(root).stale
    assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
    found = parts(root)
    assert {"measured|angle", "model|angle", "extended|angle", "|dial", "measured|marker 1"} <= set(found)
    assert all(part.type == "MESH" for mark, part in found.items() if mark != "|frame")
    table = list(csv.DictReader((clogged / "study/evidence/residuals.csv").open()))
    table = [r for r in table if r["experiment"] == first.name]
    angle = {r["row"]: r for r in table if r["channel"] == "angle_deg"}
    for i in (0, 7, len(first) - 1):
        frame = scene.frame_start + (first["time_s"][i] - first["time_s"][0]) * 30 / 1.001
        scene.frame_set(int(frame), subframe=frame % 1)
        time, values = evidence_motion.reading(root, scene)
        assert abs(time - first["time_s"][i]) < 1e-3
        row = angle[str(first.rows[i])]
        # Single precision of a frame, at some tens of degrees a second.
        for series, column in (
            ("measured", "measured"),
            ("model", "base_model"),
            ("extended", "extended_model"),
        ):
            assert abs(values[series] - float(row[column])) < 0.02, (series, values, row)
        assert np.abs(np.array(found["measured|marker 1"].location) - first.markers[1][i]).max() < 1e-2
        (y,) = (r for r in table if r["channel"] == "marker1_y_mm" and r["row"] == str(first.rows[i]))
        assert abs(found["extended|marker 1"].location[1] - float(y["extended_model"])) < 1e-2
        # To the side with more lattice for a positive angle: the needle's point.
        needle = found["measured|angle"]
        bpy.context.view_layer.update()
        point = needle.matrix_world @ needle.data.vertices[2].co
        tilt = math.degrees(math.atan2(*(point - needle.matrix_world.translation).yz))
        assert abs(tilt - values["measured"]) < 1e-3
    assert scene.frame_end >= frame - 1
    assert bpy.ops.mu.evidence_protocol(experiment=first.name) == {"FINISHED"}
    played = read_protocol(Path(root.mu_unit.study.protocol))
    assert np.allclose(played.pressure_kPa[1:], first["pressure_kPa"][1:])
    assert played.time_s[-1] == first["time_s"][-1] - first["time_s"][0]
    assert "measured " in drawn()
    assert "extended model " in drawn()


def test_motion_is_kept_undone_replaced_and_leaves_nothing_behind(tmp_path, clogged):

    root, _, measured = opened(clogged)
    first = measured[0]

    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
    count = len(evidence_motion.parts(root))
    assert bpy.ops.mu.evidence_motion(experiment=measured[1].name) == {"FINISHED"}
    assert evidence_motion.shown(root) == measured[1].name
    assert bpy.ops.mu.rebuild() == {"FINISHED"}
    assert len(evidence_motion.parts(root)) == count
    meshes, actions = len(bpy.data.meshes), len(bpy.data.actions)
    assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
    assert (len(bpy.data.meshes), len(bpy.data.actions)) == (meshes, actions)
    bpy.ops.ed.undo_push(message="shown")
    bpy.ops.ed.undo()
    root = unit_object.active_root(bpy.context)
    assert evidence_motion.parts(root) == []
    bpy.ops.ed.redo()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = unit_object.roots()
    assert evidence_motion.shown(root) == first.name
    bpy.context.scene.frame_set(20)
    assert "measured" in evidence_motion.reading(root, bpy.context.scene)[1]
    # Other parameters: what was predicted for the unit as it was is not shown any more.
    root.mu_unit.chambers.wall_mm = 1.0
    assert "Stale: made with other parameters" in drawn()
    assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
    assert {mark.partition("|")[0] for mark in parts(root)} == {"", "measured"}
    assert bpy.ops.mu.evidence_motion(experiment="") == {"FINISHED"}
    assert evidence_motion.parts(root) == []
    assert not bpy.data.actions
    assert "was measured as 'none'" in refused(bpy.ops.mu.evidence_motion, experiment="none")
    bpy.ops.mu.evidence_motion(experiment=first.name)
    bpy.ops.mu.delete()
    assert not [o for o in bpy.data.objects if o.get("mu_evidence_part")]


def test_what_was_not_seen_is_not_there(tmp_path):
    """A marker and an angle lost for a while: their objects vanish for as long, and come back."""
    folder = tmp_path / "data"
    folder.mkdir()
    time = np.arange(30) / 10
    lost = (time > 0.95) & (time < 1.55)
    rows = []
    for t, gone in zip(time, lost, strict=True):
        values = ["", "", ""] if gone else [f"{10 * t:g}", f"{5 * t:g}", "75"]
        rows.append(",".join([f"{t:g}", f"{4 * t:g}", *values]))
    head = "time_s,pressure_kPa,angle_deg,marker2_y_mm,marker2_z_mm"
    (folder / "a.csv").write_text("\n".join([head, *rows]) + "\n")
    (folder / "experiments.toml").write_text(
        '[[experiment]]\nname = "gap"\nkind = "unit_pressure"\nfile = "a.csv"\nrole = "fit"\n'
    )
    assert len(read_folder(folder).experiments[0]) == 30
    root = add()
    root.mu_evidence.folder = str(folder)
    scene = bpy.context.scene
    scene.render.fps = 10
    assert bpy.ops.mu.evidence_motion(experiment="gap") == {"FINISHED"}
    found = parts(root)
    assert {name.partition("|")[0] for name in found} == {"", "measured"}
    for frame in range(1, 31):
        scene.frame_set(frame)
        gone = 10 <= frame - 1 <= 15
        assert found["measured|angle"].hide_viewport == gone, frame
        assert found["measured|marker 2"].hide_render == gone
        assert evidence_motion.reading(root, scene)[1].keys() == (set() if gone else {"measured"})
        if not gone:
            assert abs(found["measured|marker 2"].location[1] - 0.5 * (frame - 1)) < 1e-4
            assert found["measured|marker 2"].location[0] == 0.0
    assert "6 of 30 values of angle_deg are missing" in drawn()


def test_a_diagnosis_that_was_broken_off_shows_no_verdict(tmp_path, clogged):
    """Its files are there in part: verdict.json is written before the run ends."""

    root, _, measured = opened(clogged)
    first = measured[0]

    shutil.copytree(clogged / "study", tmp_path / "study")
    root.mu_unit.study.folder = str(tmp_path / "study")
    assert "Named: clogged chamber" in drawn()
    path = tmp_path / "study/evidence/summary.json"
    path.write_text(json.dumps({"status": "running"}))
    assert "The diagnosis is not finished" in drawn()
    assert "clogged" not in drawn()
    assert "Diagnose the measured data first" in refused(bpy.ops.mu.evidence_apply)
    assert list(evidence.course(root, first.name).series) == ["measured"]
    path.write_text("{")
    assert "The diagnosis is not finished" in drawn()


def test_files_of_a_machine_are_imported_and_asked_about_in_the_panel(tmp_path):
    (tmp_path / "pull.txt").write_text(exports.PLAIN)
    root = add()
    refused(bpy.ops.mu.import_files, files=[], directory=str(tmp_path))
    assert bpy.ops.mu.import_files(directory=str(tmp_path), files=[{"name": "pull.txt"}]) == {"FINISHED"}
    texts = drawn()
    assert re.search(r"the unit of 'Kraft'[^\n]* is not given", texts), texts
    assert "was it a coupon" in texts
    answers = {one.key: one for one in root.mu_import.answers}
    assert answers["unit.Kraft"].value == "N"
    refused(bpy.ops.mu.import_answers)
    answers["kind"].value = "coupon"
    assert bpy.ops.mu.import_answers() == {"FINISHED"}
    # What a coupon needs is asked next.
    left = {one.key: one for one in root.mu_import.answers if not one.answered}
    assert set(left) == {"mode", "section_mm", "length_mm"}
    left["section_mm"].value, left["length_mm"].value = "12.5", "40"
    refused(bpy.ops.mu.import_answers)
    left = {one.key: one for one in root.mu_import.answers if not one.answered}
    left["section_mm"].value = "12.5x3"
    assert bpy.ops.mu.import_answers() == {"FINISHED"}
    assert not root.mu_import.files
    assert "pull: 24 rows" in drawn()
    (found,) = read_folder(Path(bpy.path.abspath(root.mu_evidence.folder))).experiments
    assert np.polyfit(found["strain"], found["stress_kPa"], 1)[0] == pytest.approx(2500.0, rel=1e-4)


def test_an_import_can_be_left(tmp_path):
    (tmp_path / "pull.txt").write_text(exports.PLAIN)
    root = add()
    bpy.ops.mu.import_files(directory=str(tmp_path), files=[{"name": "pull.txt"}])
    assert bpy.ops.mu.import_cancel() == {"FINISHED"}
    assert not root.mu_import.files
    assert not root.mu_evidence.folder
    assert "Import Files" in drawn() or "mu.import_files" in drawn()
