"""Simulations from Blender: commands, folders, what survives a file load, and what the panels say."""

import importlib.util
import json

import bpy
import pytest

import mu_addon
from mu_addon.blender.jobs import start_child as jobs
from mu_addon.blender.obstacles import panel as obstacle_panel
from mu_addon.blender.path import panel as path_panel
from mu_addon.blender.printing import panel as print_panel
from mu_addon.blender.results import panel as results_panel
from mu_addon.blender.shared.wording import in_panel
from mu_addon.blender.sidebar import unit_panel
from mu_addon.blender.simulate import panel as simulate_panel
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate.job import SIMULATION, job_of
from mu_addon.blender.unit import object as unit_object
from mu_addon.meshing.settings import MeshSettings

from .acting import add, refused
from .drawing import drawn as drawn_by
from .drawing import panels_of
from .jobs import ended, launch, watch

PANELS = panels_of(unit_panel, path_panel, simulate_panel, print_panel)
PANELS += [results_panel.MU_PT_results, obstacle_panel.MU_PT_obstacles]


def drawn():
    return drawn_by([*PANELS, bpy.types.MU_MT_presets, bpy.types.MU_MT_presets_remove])


def test_panels_tell_what_a_child_says():
    assert "Add > Mesh > Monolithic Unit" in drawn()
    root = add()
    assert "Nothing simulated yet" in drawn()
    assert "No solid built yet" in drawn()
    launch(root, "reported_error")
    watch(lambda: not jobs.running())
    assert "thicker wall" in drawn()
    assert "at 12 kPa" in drawn()
    assert bpy.ops.mu.open(what="errors") == {"FINISHED"}
    assert "there is no such file" in refused(bpy.ops.mu.open, what="report")

    root.mu_unit.chambers.wall_mm = 3.0
    assert "too thick" in drawn()
    # A scene of metres is as good as any.
    bpy.context.scene.unit_settings.scale_length = 1.0
    assert "too thick" in drawn()


def test_without_the_solver_geometry_works_and_the_panel_says_why(monkeypatch, blocks):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "warp" else find(name, *a)
    )
    add().mu_evidence.folder = str(blocks)
    assert jobs.missing() == ["warp"]
    assert "Not in this Blender: warp" in refused(bpy.ops.mu.evidence_diagnose)
    assert "Cannot simulate: warp not found" in drawn()
    assert "Not in this Blender: warp" in refused(bpy.ops.mu.simulate)
    assert bpy.ops.mu.solid() == {"FINISHED"}


def test_errors_speak_of_fields_and_not_of_files_or_options():
    words = in_panel("where: [chambers] wall_mm, or give --port and --known-deg; see study_folder")
    assert words == "where: Wall, or give Port and Known Deg; see study_folder"


def test_a_worker_whose_solver_does_not_load_says_so(tmp_path, monkeypatch):
    broken = tmp_path / "broken" / "warp"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("raise ImportError('libwarp.so: not for this machine')")
    found = jobs.environment()
    found["PYTHONPATH"] = f"{broken.parent.resolve()}:{found['PYTHONPATH']}"
    monkeypatch.setattr(jobs, "environment", lambda: found)
    root = add()
    assert bpy.ops.mu.simulate() == {"FINISHED"}
    child = SIMULATION.child(root)
    ended(child)
    assert child.state == "failed"
    assert "libwarp.so: not for this machine" in child.error["what"]
    assert "design and export work without" in drawn()


def test_unregister_ends_what_runs():
    child = launch(add(), "deaf")
    watch(lambda: child.progress)
    mu_addon.unregister()
    assert child._process.returncode is not None
    assert jobs.running() == []
    mu_addon.register()


def test_folders_of_studies(tmp_path):
    root = add()
    root.mu_unit.title = "Grip / no. 1"
    short = root.mu_unit.uuid[:8]
    assert studies.folder_of(root).parts[-2:] == ("studies", f"Grip-no.-1-{short}")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    here = tmp_path
    assert studies.folder_of(root) == here / "seat.mu" / f"Grip-no.-1-{short}"
    assert studies.assign_folder(root) == studies.folder_of(root)
    assert root.mu_unit.study.folder.startswith("//seat.mu")
    root.mu_unit.title = "renamed"  # the results stay where they are
    assert studies.folder_of(root) == here / "seat.mu" / f"Grip-no.-1-{short}"


@pytest.mark.slow
def test_a_motion_from_start_to_stale(tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    root = add(preset="mu-0.75x")
    root.mu_unit.chambers.count = 2
    # Of its thirteen instants few have a pressure of their own.
    protocol = tmp_path / "both.csv"
    rows = "0,0\n0.25,5\n3,5\n"
    protocol.write_text(f"time_s,pressure_kPa\n{rows}")
    study = root.mu_unit.study
    study.command, study.refine, study.protocol = "simulate", 0.35, str(protocol)
    assert bpy.ops.mu.simulate() == {"FINISHED"}
    child = SIMULATION.child(root)
    fractions = []
    watch(lambda: fractions.append(child.progress.get("fraction")) or child.state != "running")
    assert child.state == "done", child.error
    assert len(set(fractions)) > 3
    found = studies.findings(root)
    assert found.summary["status"] == "complete"
    assert not found.stale
    assert found.angles[-1][0] == 5.0
    assert found.angles[-1][1] > 0
    assert "kPa" in drawn()
    assert "Coarse mesh (0.35): angles up to 12 % too small" in drawn()
    assert "Stale" not in drawn()
    root.mu_unit.chambers.wall_mm = 1.0
    assert studies.findings(root).stale
    assert "Stale" in drawn()
    root.mu_unit.chambers.wall_mm = 0.9
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = unit_object.roots()
    assert not studies.findings(root).stale, "found again on reopen"
    (summary,) = tmp_path.glob("seat.mu/*/runs/*/summary.json")
    assert json.loads(summary.read_text())["status"] == "complete"


def test_the_printed_body_is_simulated_on_the_mesh_that_is_asked_for():
    root = add()
    study = root.mu_unit.study
    study.command = "simulate"
    assert job_of(root).mesh == MeshSettings(refine=0.5)
    assert job_of(root).self_contact
    study.refine = 0.7
    assert job_of(root).mesh.refine == 0.7
    study.self_contact = False
    assert not job_of(root).self_contact
