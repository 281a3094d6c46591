"""What a window would stand still for is made in a process of its own, and shown as what is made at once."""

import time

import bpy
import numpy as np
import pytest

from mu_addon.blender.jobs import prepared, start_child
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import object as unit_object

from .acting import add, with_runs
from .jobs import PATIENCE_S


def settled():
    """Wait as a window does: by the timer's function, which says that a job has ended."""
    end = time.monotonic() + PATIENCE_S
    while start_child.running():
        assert time.monotonic() < end, "it never came"
        start_child._poll()
        time.sleep(0.05)


def corners(mesh):
    return motion_parts.vertices_of(mesh)


def test_a_solid_is_made_elsewhere_and_is_the_same(monkeypatch, tmp_path):
    monkeypatch.setattr(prepared, "at_once", lambda: False)
    root = add(preset="mu-0.75x")
    root.mu_unit.chambers.count = 3
    root.mu_unit.study.folder = str(tmp_path / "unit")
    before = time.thread_time()
    assert bpy.ops.mu.solid() == {"CANCELLED"}, "without an undo step of its own"
    assert time.thread_time() - before < 0.5
    assert root.mu_unit.solid is None
    # Changed meanwhile: what is shown in the end is of the unit as it is then.
    root.mu_unit.chambers.wall_mm = 1.1
    settled()
    settled()
    assert unit_object.solid_is_current(root)
    assert start_child.ended() == [], "what is shown needs no notice"
    made = corners(root.mu_unit.solid)
    # One more while the file is written: both are made.
    root.mu_unit.chambers.wall_mm = 1.2
    assert bpy.ops.mu.export_stl(filepath=str(tmp_path / "it.stl"), quality="interactive") == {"CANCELLED"}
    assert bpy.ops.mu.solid() == {"CANCELLED"}
    settled()
    made = corners(root.mu_unit.solid)
    assert unit_object.solid_is_current(root)
    assert (tmp_path / "it.stl").stat().st_size == 84 + 50 * len(root.mu_unit.solid.polygons)
    (job,) = start_child.ended()
    assert "STL" in job.title, "a file is told of when it is there"
    monkeypatch.undo()
    bpy.ops.mu.solid()
    assert np.array_equal(corners(root.mu_unit.solid), made)


def test_what_cannot_be_made_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(prepared, "at_once", lambda: False)
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(tmp_path / "unit")
    bpy.ops.mu.export_stl(filepath=str(tmp_path / "none" / "it.stl"), quality="interactive")
    (tmp_path / "none").write_text("a file where a folder was meant")
    settled()
    (job,) = start_child.ended()
    assert job.child.state == "failed"


@pytest.mark.nightly("test_a_solid_is_made_elsewhere_and_is_the_same")
def test_a_difference_and_a_print_that_moves_are_made_elsewhere(home, monkeypatch):
    root = with_runs(home)
    thick = next(r.key for r in studies.runs_of(root) if r.unit.chambers.wall_mm > 1)
    assert bpy.ops.mu.run_compare(key=thick) == {"FINISHED"}

    def shown():
        bpy.ops.mu.field_show(field=motion_parts.DIFFERENCE)
        settled()
        found = [motion_parts.played(root, part).fields for part in motion_parts.parts(root)]
        return [fields[motion_parts.DIFFERENCE] for fields in found]

    there = shown()
    motion_parts._forget()
    monkeypatch.setattr(prepared, "at_once", lambda: False)
    assert bpy.ops.mu.field_show(field=motion_parts.DIFFERENCE) == {"CANCELLED"}
    elsewhere = shown()
    assert max(values.max() for values in there) > 5.0
    assert all(np.array_equal(one, two) for one, two in zip(there, elsewhere, strict=True))
    assert bpy.ops.mu.motion(what="print") == {"CANCELLED"}
    settled()  # its solid,
    settled()  # then where its points lie in the mesh
    assert ("model_a", "print") in motion_parts.shown(root)
