"""Measured data in Blender: checked, diagnosed, shown on the timeline, put into the unit."""

import json

import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.evidence import unit_fem
from mu_addon.measured import read_folder
from tests.evidence import analytic
from tests.usecases.diagnosis_data import bent_unit, weighed_blocks
from tests.usecases.test_diagnose import run as diagnosed

from .session import DRAWN, FAKE, PRELUDE, WATCHING, blender, needs_bpy

pytestmark = needs_bpy

SEEN = """
from mu_addon.blender.evidence import state as evidence, motion as evidence_motion, panel as evidence_panel

PANELS = [evidence_panel.MU_PT_evidence]

def diagnose(root):
    assert bpy.ops.mu.evidence_diagnose() == {"FINISHED"}
    child = evidence.DIAGNOSIS.child(root)
    watch(lambda: child.state != "running")
    assert child.state == "done", child.error

def parts(root):
    return {part["mu_evidence_part"]: part for part in evidence_motion.parts(root)}

"""


def session(code, tmp_path, *arguments):
    return blender(code, tmp_path, FAKE, *arguments, prelude=PRELUDE + WATCHING + DRAWN + SEEN)


def test_a_folder_is_checked_as_it_is_chosen(tmp_path):
    weighed_blocks(tmp_path / "data", 0.09)
    session(
        """
        import pathlib
        root, data = add(), pathlib.Path(sys.argv[2])
        assert "Choose a folder with experiments.toml" in drawn()
        assert not bpy.ops.mu.evidence_diagnose.poll()
        root.mu_evidence.folder = str(data / "none")
        assert "cannot read experiments.toml" in drawn() and not bpy.ops.mu.evidence_diagnose.poll()
        root.mu_evidence.folder = str(data)
        assert "0.75x: 4 rows" in drawn() and "1.5x: 4 rows" in drawn() and "Not diagnosed yet" in drawn()
        assert bpy.ops.mu.evidence_diagnose.poll() and not bpy.ops.mu.evidence_apply.poll()
        table = data / "block_1.csv"
        good = table.read_text()
        table.write_text(good.replace("0.1,", "0.1,much"))
        # Where a line is broken depends on how long the folder's name is.
        assert "isnotanumber" in "".join(drawn().split()) and "block_1.csv,row" in "".join(drawn().split())
        table.write_text(good)
        assert "1.5x: 4 rows" in drawn()
        """,
        tmp_path,
        tmp_path / "data",
    )


def test_from_data_to_a_unit_that_has_what_was_found(tmp_path):
    """The whole way with a real diagnosis; undone, saved, found again, and stale once the data change."""
    weighed_blocks(tmp_path / "data", 0.09)
    session(
        """
        import json, pathlib
        from mu_addon.blender.unit.properties import to_unit
        folder = pathlib.Path(sys.argv[2])
        bpy.context.preferences.edit.use_global_undo = True
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "seat.blend"))
        root = add()
        root.mu_evidence.folder = "//data"
        diagnose(root)
        assert evidence.folder_of(root).parent == studies.folder_of(root)
        said = drawn()
        assert "Named: overcure" in said and "95 %" in said and "Stale" not in said, said
        assert "p = " in said or "p < " in said
        assert bpy.ops.mu.evidence_open(what="errors") == {"FINISHED"}
        assert "No unit under pressure" in refused(bpy.ops.mu.evidence_motion, experiment="1x")

        found = json.loads((evidence.folder_of(root) / "verdict.json").read_text())
        offset = found["causes"][0]["parameters"]["offset_mm"]["value"]
        bpy.ops.ed.undo_push(message="diagnosed")
        assert bpy.ops.mu.evidence_apply() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="applied")
        printed = to_unit(root.mu_unit).print
        assert abs(printed.offset_xy_mm - offset) < 1e-6 and not unit_object.behind(root)
        assert "Applied to the unit: every printed surface moves outward" in drawn().replace("  ", " ")
        assert not bpy.ops.mu.evidence_apply.poll(), "given twice it would count twice"
        bpy.ops.ed.undo()
        root = unit_object.active_root(bpy.context)
        assert to_unit(root.mu_unit).print.offset_xy_mm == 0.0 and bpy.ops.mu.evidence_apply.poll()
        bpy.ops.ed.redo()
        root = unit_object.active_root(bpy.context)
        assert abs(to_unit(root.mu_unit).print.offset_xy_mm - offset) < 1e-6

        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
        (root,) = unit_object.roots()
        assert "Named: overcure" in drawn() and not bpy.ops.mu.evidence_apply.poll()
        table = folder / "data" / "block_1.csv"
        table.write_text(table.read_text().replace("0.1,", "0.11,"))
        assert "Stale: it belongs to other measured data" in drawn()
        told = refused(bpy.ops.mu.evidence_apply)
        assert "The diagnosis is stale: it belongs to other measured data" in told
        """,
        tmp_path,
        tmp_path,
    )


def test_a_diagnosis_that_fails_and_one_that_is_stopped(tmp_path):
    weighed_blocks(tmp_path / "data", 0.09)
    session(
        """
        root = add()
        root.mu_evidence.folder = sys.argv[2]

        def fake(how):
            command = [sys.executable, sys.argv[1], how]
            return launch_as(evidence.DIAGNOSIS, root, command)

        for how, expected in {"told_error": "thicker wall", "crash": "SIGSEGV", "good": "see below"}.items():
            child = fake(how)
            watch(lambda: child.state != "running")
            assert expected in drawn(), (how, drawn())
            assert bpy.ops.mu.evidence_dismiss() == {"FINISHED"}
            assert expected not in drawn()
        child = fake("hang")
        watch(lambda: child.progress)
        assert "0.50 Model A" in drawn() and "mu.evidence_cancel" in drawn()
        assert not bpy.ops.mu.evidence_diagnose.poll()
        # The unit's own simulation is another one.
        assert SIMULATION.child(root) is None and not bpy.ops.mu.cancel.poll()
        assert bpy.ops.mu.evidence_cancel() == {"FINISHED"}
        watch(lambda: child.state != "running")
        assert "Cancelled" in drawn() and not bpy.ops.mu.evidence_cancel.poll()
        assert "there is no such file" in refused(bpy.ops.mu.evidence_open, what="report")
        """,
        tmp_path,
        tmp_path / "data",
    )


@pytest.fixture(scope="module")
def clogged(tmp_path_factory):
    """A unit with a clogged chamber and the verdict on it; a written response stands for its simulation."""
    root = tmp_path_factory.mktemp("clogged")
    folder = bent_unit(root / "data", {"clogged_chamber.share_lost": 0.5})

    def responses(unit, experiments, settings, cache, progress):
        return tuple(
            analytic.response(*k) for k in sorted({(e.scale, e.orientation_deg) for e in experiments})
        )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(unit_fem, "unit_responses", responses)
        ending, messages = diagnosed(folder, root / "study" / "evidence", load_preset("mu-1.0x"))
    assert ending.status == 0, messages[-1]
    assert ending.summary["verdict"] == "named"
    return root


def test_what_has_no_parameter_goes_into_the_simulation(tmp_path, clogged):
    """Applied, undone, saved, simulated, changed and removed; found again as what the results are of."""
    session(
        """
        import json, pathlib, shutil
        import mu_addon.blender.simulate.panel as panels
        from mu_addon.blender.simulate import effects
        from mu_addon.blender.unit.properties import to_unit
        from mu_addon.evidence.extended import ExtendedModel, Fitted

        clogged, folder = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
        PANELS.append(panels.MU_PT_simulate)
        shutil.copytree(clogged / "study", folder / "study")
        bpy.context.preferences.edit.use_global_undo = True
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "seat.blend"))
        root = add()
        root.mu_evidence.folder, root.mu_unit.study.folder = str(clogged / "data"), "//study"
        study = root.mu_unit.study
        study.command, study.detail = "simulate", "quick"
        unit = to_unit(root.mu_unit)
        assert effects.arguments(root, folder) == [] and "With named effects" not in drawn()
        assert "no effects beside" in refused(bpy.ops.mu.evidence_remove)
        bpy.ops.ed.undo_push(message="diagnosed")
        assert bpy.ops.mu.evidence_apply() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="applied")
        assert to_unit(root.mu_unit).chambers == unit.chambers
        share = json.loads((folder / "study/evidence/verdict.json").read_text())
        share = share["causes"][0]["parameters"]["share_lost"]["value"]
        (line,) = effects.lines(root)
        assert line.startswith(f"clogged chamber, share lost: {share:.4g} (") and " to " in line
        said = drawn()
        assert "With named effects" in said and "clogged chamber, share lost: 0.5" in said, said
        assert "Applied to the unit: all moduli" in said and "the last chamber lacks" in said, said
        assert not bpy.ops.mu.evidence_apply.poll()
        # Pressure alone knows no direction.
        assert not effects.has_gravity(root) and "--orientation" not in effects.arguments(root, folder)

        bpy.ops.ed.undo()
        root = unit_object.active_root(bpy.context)
        assert effects.inputs(root) == {} and bpy.ops.mu.evidence_apply.poll()
        bpy.ops.ed.redo()
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
        (root,) = unit_object.roots()
        asked = {"effects": {"clogged_chamber": {"share_lost": share}}}
        assert effects.inputs(root) == asked and "Applied to the unit" in drawn()

        def simulated():
            assert bpy.ops.mu.simulate() == {"FINISHED"}
            child = SIMULATION.child(root)
            watch(lambda: child.state != "running")
            assert child.state == "done", child.error
            return studies.findings(root)

        found = simulated()
        assert not found.stale
        assert found.summary["study"]["effects"] == asked["effects"]
        root.mu_unit.study.orientation_deg = 90.0
        assert not studies.findings(root).stale

        # Weight has a direction, and results of another one are stale.
        known = Fitted(1300.0, 50.0, 1200.0, 1400.0, "kg/m3")
        effects.keep(root, ExtendedModel("named", {"gravity": {"density_kg_m3": known}}, {}).text())
        assert studies.findings(root).stale
        assert "gravity, density: 1300 kg/m3 (1200 to 1400)" in drawn().replace("  ", " ")
        level = simulated()
        assert not level.stale and level.summary["study"]["orientation_deg"] == 90.0
        assert dict(level.angles)[0.0] < -0.5
        root.mu_unit.study.orientation_deg = -90.0
        assert studies.findings(root).stale
        assert bpy.ops.mu.evidence_remove() == {"FINISHED"}
        assert studies.findings(root).stale and "With named effects" not in drawn()
        assert effects.arguments(root, folder) == []
        """,
        tmp_path,
        clogged,
        tmp_path,
    )


MOTION = """
import csv, math
import numpy as np
from mu_addon.measured import read_folder
import pathlib

bpy.context.preferences.edit.use_global_undo = True
clogged = pathlib.Path(sys.argv[2])
root = add()
root.mu_evidence.folder, root.mu_unit.study.folder = str(clogged / "data"), str(clogged / "study")
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = 30, 1.001
measured = read_folder(clogged / "data").experiments
first = measured[0]
"""


def test_measured_and_simulated_motion_on_the_timeline(tmp_path, clogged):
    session(
        MOTION
        + """
assert "Named: clogged chamber" in drawn() and not evidence.diagnosis(root).stale
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
    time, said = evidence_motion.reading(root, scene)
    assert abs(time - first["time_s"][i]) < 1e-3
    row = angle[str(first.rows[i])]
    # Single precision of a frame, at some tens of degrees a second.
    for series, column in (("measured", "measured"), ("model", "base_model"), ("extended", "extended_model")):
        assert abs(said[series] - float(row[column])) < 0.02, (series, said, row)
    assert np.abs(np.array(found["measured|marker 1"].location) - first.markers[1][i]).max() < 1e-2
    (y,) = (r for r in table if r["channel"] == "marker1_y_mm" and r["row"] == str(first.rows[i]))
    assert abs(found["extended|marker 1"].location[1] - float(y["extended_model"])) < 1e-2
    # To the side with more lattice for a positive angle: the needle's point.
    needle = found["measured|angle"]
    bpy.context.view_layer.update()
    point = needle.matrix_world @ needle.data.vertices[2].co
    tilt = math.degrees(math.atan2(*(point - needle.matrix_world.translation).yz))
    assert abs(tilt - said["measured"]) < 1e-3
assert scene.frame_end >= frame - 1
from mu_addon.fem.protocol import read_protocol
assert bpy.ops.mu.evidence_protocol(experiment=first.name) == {"FINISHED"}
played = read_protocol(pathlib.Path(root.mu_unit.study.protocol))
assert np.allclose(played.pressure_kPa[1:], first["pressure_kPa"][1:])
assert played.time_s[-1] == first["time_s"][-1] - first["time_s"][0]
assert "measured " in drawn() and "extended model " in drawn()
""",
        tmp_path,
        clogged,
    )


def test_motion_is_kept_undone_replaced_and_leaves_nothing_behind(tmp_path, clogged):
    session(
        MOTION
        + """
bpy.ops.ed.undo_push(message="start")
assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
count = len(evidence_motion.parts(root))
assert bpy.ops.mu.evidence_motion(experiment=measured[1].name) == {"FINISHED"}
assert evidence_motion.shown(root) == measured[1].name
assert bpy.ops.mu.rebuild() == {"FINISHED"} and len(evidence_motion.parts(root)) == count
meshes, actions = len(bpy.data.meshes), len(bpy.data.actions)
assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
assert (len(bpy.data.meshes), len(bpy.data.actions)) == (meshes, actions)
bpy.ops.ed.undo_push(message="shown")
bpy.ops.ed.undo()
root = unit_object.active_root(bpy.context)
assert evidence_motion.parts(root) == []
bpy.ops.ed.redo()
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[3] + "/seat.blend")
bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
(root,) = unit_object.roots()
assert evidence_motion.shown(root) == first.name
bpy.context.scene.frame_set(20)
assert "measured" in evidence_motion.reading(root, bpy.context.scene)[1]
# Other parameters: what was predicted for the unit as it was is not shown any more.
root.mu_unit.chambers.wall_mm = 1.0
assert "Stale: it belongs to other parameters" in drawn()
assert bpy.ops.mu.evidence_motion(experiment=first.name) == {"FINISHED"}
assert {mark.partition("|")[0] for mark in parts(root)} == {"", "measured"}
assert bpy.ops.mu.evidence_motion(experiment="") == {"FINISHED"}
assert evidence_motion.parts(root) == [] and not bpy.data.actions
assert "was measured as 'none'" in refused(bpy.ops.mu.evidence_motion, experiment="none")
bpy.ops.mu.evidence_motion(experiment=first.name)
bpy.ops.mu.delete()
assert not [o for o in bpy.data.objects if o.get("mu_evidence_part")]
""",
        tmp_path,
        clogged,
        tmp_path,
    )


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
    session(
        """
        root = add()
        root.mu_evidence.folder = sys.argv[2]
        scene = bpy.context.scene
        scene.render.fps = 10
        assert bpy.ops.mu.evidence_motion(experiment="gap") == {"FINISHED"}
        found = parts(root)
        assert set(name.partition("|")[0] for name in found) == {"", "measured"}
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
        """,
        tmp_path,
        folder,
    )


def test_without_the_solver_measured_motion_is_shown_and_the_panel_says_why(tmp_path):
    weighed_blocks(tmp_path / "data", 0.09)
    session(
        """
        import importlib.util

        find = importlib.util.find_spec
        importlib.util.find_spec = lambda name, *a: None if name == "warp" else find(name, *a)
        root = add()
        root.mu_evidence.folder = sys.argv[2]
        assert "1x: 4 rows" in drawn()
        assert "Not in this Blender: warp" in refused(bpy.ops.mu.evidence_diagnose)
        """,
        tmp_path,
        tmp_path / "data",
    )


def test_the_verdict_files_are_read_as_diagnose_writes_them(clogged):
    """What the panel shows stands in the files under these names."""
    found = json.loads((clogged / "study" / "evidence" / "verdict.json").read_text())
    summary = json.loads((clogged / "study" / "evidence" / "summary.json").read_text())
    assert {"verdict", "causes", "gain", "residual_table"} <= found.keys()
    assert {"headline", "sentence", "next", "status"} <= summary.keys()
    assert {"against", "p_value", "where"} <= found["residual_table"][0].keys()


def test_a_diagnosis_that_was_broken_off_shows_no_verdict(tmp_path, clogged):
    """Its files are there in part: verdict.json is written before the run ends."""
    session(
        MOTION
        + """
import json, shutil
shutil.copytree(clogged / "study", sys.argv[3] + "/study")
root.mu_unit.study.folder = sys.argv[3] + "/study"
assert "Named: clogged chamber" in drawn()
path = pathlib.Path(sys.argv[3], "study/evidence/summary.json")
path.write_text(json.dumps({"status": "running"}))
assert "The diagnosis is not finished" in drawn() and "clogged" not in drawn()
assert "Diagnose the measured data first" in refused(bpy.ops.mu.evidence_apply)
assert list(evidence.course(root, first.name).series) == ["measured"]
path.write_text("{")
assert "The diagnosis is not finished" in drawn()
""",
        tmp_path,
        clogged,
        tmp_path,
    )
