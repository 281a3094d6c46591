"""Simulations from Blender: commands, folders, what survives a file load, and what the panels say."""

import json
from pathlib import Path

import pytest

from .session import DRAWN, FAKE, PRELUDE, WATCHING, blender, needs_bpy

pytestmark = needs_bpy

SEEN = """
from mu_addon.blender.obstacles import panel as obstacle_panel
from mu_addon.blender.unit import panel as unit_panel
from mu_addon.blender.path import panel as path_panel
from mu_addon.blender.simulate import panel as simulate_panel
from mu_addon.blender.results import panel as results_panel
from mu_addon.blender.printing import panel as print_panel
PANELS = [*unit_panel.CLASSES, *path_panel.CLASSES, *simulate_panel.CLASSES]
PANELS += [results_panel.MU_PT_results, obstacle_panel.MU_PT_obstacles, *print_panel.CLASSES]
PANELS += [bpy.types.MU_MT_presets, bpy.types.MU_MT_presets_remove]

"""


def session(code, tmp_path, *arguments):
    return blender(code, tmp_path, FAKE, *arguments, prelude=PRELUDE + WATCHING + DRAWN + SEEN)


def test_panels_tell_what_a_child_says(tmp_path):
    session(
        """
        assert "Add > Mesh > Monolithic Unit" in drawn()
        root = add()
        assert "Nothing simulated yet" in drawn() and "No solid built yet" in drawn()
        child = launch(root, "hang")
        watch(lambda: child.progress)
        assert "0.50 Model A, 3.0 s left" in drawn() and "mu.cancel" in drawn()
        assert not bpy.ops.mu.simulate.poll()
        assert bpy.ops.mu.cancel() == {"FINISHED"}
        assert "stopping" in drawn()
        watch(lambda: child.state != "running")
        assert "Cancelled" in drawn() and bpy.ops.mu.simulate.poll() and not bpy.ops.mu.cancel.poll()
        assert bpy.ops.mu.dismiss() == {"FINISHED"}
        assert "Cancelled" not in drawn()

        for how, expected in {
            "good": "Done in",
            "told_error": "no equilibrium",
            "crash": "SIGSEGV",
            "wordless": "without a word",
            "garbage": "Done in",
        }.items():
            child = launch(root, how)
            watch(lambda: child.state != "running")
            assert expected in drawn(), (how, drawn())
        launch(root, "told_error")
        watch(lambda: not jobs.running())
        assert "thicker wall" in drawn() and "at 12 kPa" in drawn()
        assert bpy.ops.mu.open(what="errors") == {"FINISHED"}
        assert "there is no such file" in refused(bpy.ops.mu.open, what="report")

        root.mu_unit.chambers.wall_mm = 3.0
        assert "too thick" in drawn() and "last valid design" in drawn()
        bpy.context.scene.unit_settings.scale_length = 1.0
        assert "not in millimetres" in drawn()
        """,
        tmp_path,
    )


def test_without_the_solver_geometry_works_and_the_panel_says_why(tmp_path):
    session(
        """
        import importlib.util

        find = importlib.util.find_spec
        importlib.util.find_spec = lambda name, *a: None if name == "warp" else find(name, *a)
        root = add()
        assert jobs.missing() == ["warp"]
        assert "Cannot simulate: warp not found" in drawn()
        assert "Not in this Blender: warp" in refused(bpy.ops.mu.simulate)
        assert bpy.ops.mu.solid() == {"FINISHED"}
        """,
        tmp_path,
    )


def test_a_worker_whose_solver_does_not_load_says_so(tmp_path):
    session(
        """
        import pathlib
        broken = pathlib.Path("broken/warp")
        broken.mkdir(parents=True)
        (broken / "__init__.py").write_text("raise ImportError('libwarp.so: not for this machine')")
        real = jobs.environment
        def environment():
            found = real()
            return {**found, "PYTHONPATH": str(broken.parent.resolve()) + ":" + found["PYTHONPATH"]}
        jobs.environment = environment
        root = add()
        assert bpy.ops.mu.simulate() == {"FINISHED"}
        child = SIMULATION.child(root)
        watch(lambda: child.state != "running")
        assert child.state == "failed" and "libwarp.so: not for this machine" in child.error["what"]
        assert "design and export work without" in drawn()
        """,
        tmp_path,
    )


def test_a_simulation_survives_loading_a_file_and_dies_with_the_session(tmp_path):
    said = session(
        """
        root = add()
        uuid = root.mu_unit.uuid
        child = launch(root, "hang")
        watch(lambda: child.progress)
        assert bpy.app.timers.is_registered(jobs._poll)
        bpy.ops.wm.read_homefile(use_empty=True)
        assert jobs.running() == [f"{uuid}:simulate"] and bpy.app.timers.is_registered(jobs._poll)
        root = add()
        assert "other job" in drawn()
        print("child", child._process.pid)
        """,
        tmp_path,
    )
    number = said.split("child ")[1].split()[0]
    status = Path("/proc") / number / "status"
    assert not status.exists() or "State:\tZ" in status.read_text()


def test_unregister_ends_what_runs(tmp_path):
    session(
        """
        child = launch(add(), "deaf")
        watch(lambda: child.progress)
        mu_addon.unregister()
        assert child._process.returncode is not None and jobs.running() == []
        mu_addon.register()
        """,
        tmp_path,
    )


def test_folders_of_studies(tmp_path):
    session(
        """
        import pathlib
        root = add()
        root.mu_unit.title = "Grip / no. 1"
        short = root.mu_unit.uuid[:8]
        assert studies.folder_of(root).parts[-2:] == ("studies", f"Grip-no.-1-{short}")
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2] + "/seat.blend")
        here = pathlib.Path(sys.argv[2])
        assert studies.folder_of(root) == here / "seat.mu" / f"Grip-no.-1-{short}"
        assert studies.assign_folder(root) == studies.folder_of(root)
        assert root.mu_unit.study.folder.startswith("//seat.mu")
        root.mu_unit.title = "renamed"  # the results stay where they are
        assert studies.folder_of(root) == here / "seat.mu" / f"Grip-no.-1-{short}"
        """,
        tmp_path,
        tmp_path,
    )


def test_two_simulations_of_one_unit_are_refused(tmp_path):
    session(
        """
        from mu_addon.errors import InputError
        root = add()
        launch(root, "hang")
        try:
            SIMULATION.start(root, ["simulate"], studies.folder_of(root))
        except InputError as error:
            assert "already" in str(error)
        else:
            raise AssertionError
        """,
        tmp_path,
    )


@pytest.mark.slow
def test_a_quick_look_from_start_to_stale(tmp_path):
    session(
        """
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2] + "/seat.blend")
        root = add(preset="mu-0.75x")
        root.mu_unit.study.command, root.mu_unit.study.detail = "simulate", "quick"
        assert bpy.ops.mu.simulate() == {"FINISHED"}
        child = SIMULATION.child(root)
        fractions = []
        watch(lambda: fractions.append(child.progress.get("fraction")) or child.state != "running")
        assert child.state == "done", child.error
        assert len(set(fractions)) > 3
        found = studies.findings(root)
        assert found.status == "complete" and not found.stale
        assert found.angles[0][0] < 0 < found.angles[-1][0] and found.angles[0][1] < 0 < found.angles[-1][1]
        assert "kPa" in drawn() and "Stale" not in drawn()
        root.mu_unit.chambers.wall_mm = 1.0
        assert studies.findings(root).stale and "Stale" in drawn()
        root.mu_unit.chambers.wall_mm = 0.9
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
        (root,) = unit_object.roots()
        assert not studies.findings(root).stale, "found again on reopen"
        print("folder", studies.folder_of(root))
        """,
        tmp_path,
        tmp_path,
    )
    (summary,) = tmp_path.glob("seat.mu/*/summary.json")
    assert json.loads(summary.read_text())["status"] == "complete"
