"""Results on the model: objects, attributes, timeline and panels, from a study that was run by the core."""

import shutil
import subprocess
import sys

import pytest

from .session import PRELUDE, ROOT, blender, needs_bpy

pytestmark = needs_bpy

COARSE = ["--order", "1", "--refine", "0.5", "--rule", "volume_fraction", "--no-mesh-check", "--workers", "1"]

SEEN = """
import numpy as np
from mu_addon.blender import fields, motion_parts, studies

def started():
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = sys.argv[1]
    return root

def show(**settings):
    assert bpy.ops.mu.motion(**settings) == {"FINISHED"}

def values(mesh, name):
    found = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes[name].data.foreach_get("value", found)
    return found

def evaluated(part):
    bpy.context.view_layer.update()
    return part.evaluated_get(bpy.context.evaluated_depsgraph_get()).data

def moved(part):
    return np.linalg.norm(
        motion_parts.vertices_of(evaluated(part)) - motion_parts.vertices_of(part.data), axis=1
    )

"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "out"
    line = [sys.executable, ROOT / "headless" / "run.py", "place", "--preset", "mu-0.75x", "--out", folder]
    done = subprocess.run([*map(str, line), *COARSE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def session(code, tmp_path, study):
    own = tmp_path / "study"
    shutil.copytree(study, own, ignore=shutil.ignore_patterns("cache", "played"))
    return blender(code, tmp_path, own, prelude=PRELUDE + SEEN)


def test_motion_plays_in_its_own_time_and_carries_its_fields(tmp_path, study):
    session(
        """
        root = started()
        show(name="model_a")
        show(name="alpha4")
        scene, motion = bpy.context.scene, motion_parts.motion_of(root)
        assert motion_parts.shown(root) == [("model_a", "mesh"), ("alpha4", "mesh")]
        assert scene.frame_end == 289  # 12 s at 24 frames a second, from frame 1
        part = motion_parts.one(root, "model_a", "mesh")
        for rate, frame in ((24, 1), (24, 193), (24, 205), (12, 97), (25, 201)):
            scene.render.fps = rate
            scene.frame_set(frame)
            time = (frame - 1) / rate
            first, second, share = motion.at(time)
            own = {"Model A membrane": "membrane", "Model A lattice": "lattice"}[part.name]
            skin = motion.skin(own, True)
            u = (1 - share) * motion.model_a[first] + share * motion.model_a[second]
            expected = skin.of_nodes(motion.mesh.nodes + u)
            assert np.abs(motion_parts.vertices_of(evaluated(part)) - expected).max() < 1e-4, (rate, frame)
            # At a sample, what the attribute says is how far the point is from where it was.
            if share == 0.0:
                assert np.allclose(moved(part), values(evaluated(part), "displacement_mm"), atol=1e-4)
            mises = motion.fields[own]["von_mises_kPa"]
            between = (1 - share) * mises[first] + share * mises[second]
            assert np.allclose(values(part.data, "von_mises_kPa"), between, atol=1e-3)
        other = motion_parts.one(root, "alpha4", "mesh")
        assert "von_mises_kPa" not in other.data.attributes
        assert values(other.data, "deviation_mm").max() > 1e-3 and not values(part.data, "deviation_mm").any()
        assert other.location.y < part.location.y < 0.0
        root.mu_motion.apart = 0.0
        assert other.location.y == part.location.y == 0.0
        assert bpy.ops.mu.motion(name="model_a", on=False) == {"FINISHED"}
        assert motion_parts.shown(root) == [("alpha4", "mesh")]
        assert bpy.ops.mu.motion_clear() == {"FINISHED"} and motion_parts.parts(root) == []
        """,
        tmp_path,
        study,
    )


def test_colours_follow_the_range_and_grey_is_what_is_not_known(tmp_path, study):
    session(
        """
        root = started()
        show(name="model_a")
        show(name="alpha4")
        bpy.context.scene.frame_set(193)
        settings = root.mu_motion
        known, unknown = (motion_parts.one(root, name, "mesh") for name in ("model_a", "alpha4"))
        for field in fields.FIELDS:
            settings.field = field.name
            material = fields.material_of(root)
            assert material.node_tree.nodes["Field"].attribute_name == field.name
            assert settings.low < settings.high
            assert known.data.materials[0] == material
            there = field.name in unknown.data.attributes
            assert (unknown.data.materials[0] == material) == there, field.name
        settings.field = "largest_principal_stress_kPa"
        low, high = settings.low, settings.high
        ramp = fields.material_of(root).node_tree.nodes["Range"].inputs
        assert (ramp["From Min"].default_value, ramp["From Max"].default_value) == (low, high)
        assert low < 0 < high
        settings.symmetric = True
        assert settings.low == -settings.high and abs(settings.high - max(-low, high)) < 1e-3 * high
        settings.symmetric = False
        settings.high = 10.0
        settings.lock = True
        settings.field = "displacement_mm"
        assert settings.high == 10.0  # locked
        colours = np.empty(4 * len(known.data.vertices), np.float32)
        known.data.color_attributes[fields.COLOUR].data.foreach_get("color", colours)
        u = values(known.data, "displacement_mm")
        expected = fields.colours(root, u)
        assert np.allclose(colours.reshape(-1, 4), expected) and len(np.unique(expected, axis=0)) > 10
        assert bpy.ops.mu.motion_range() == {"FINISHED"} and settings.high < 10.0
        """,
        tmp_path,
        study,
    )


def test_the_print_is_carried_by_the_mesh(tmp_path, study):
    session(
        """
        root = started()
        show(name="model_a", what="print")
        (part,) = motion_parts.parts(root)
        solid = unit_object.part(root, "solid")
        assert len(part.data.vertices) == len(solid.data.vertices) and part.data != solid.data
        assert root.mu_unit.show == "preview" and "outside the mesh" in part["mu_outside"]
        bpy.context.scene.frame_set(193)
        rest, now = motion_parts.vertices_of(part.data), motion_parts.vertices_of(evaluated(part))
        assert np.allclose(moved(part), values(part.data, "displacement_mm"), atol=1e-4)
        tip = rest[:, 2] > 0.99 * rest[:, 2].max()
        assert (now - rest)[tip, 1].mean() > 1.0  # it bends toward +y under pressure
        inlet = rest[:, 2] < 0.0
        assert inlet.any() and not values(part.data, "displacement_mm")[inlet].any()
        # Neighbours stay neighbours: no vertex is torn away.
        edges = np.empty(2 * len(part.data.edges), np.int32)
        part.data.edges.foreach_get("vertices", edges)
        a, b = edges.reshape(-1, 2).T
        before, after = (np.linalg.norm(p[a] - p[b], axis=1) for p in (rest, now))
        assert np.abs(after - before).max() < 1.0
        root.mu_unit.chambers.wall_mm = 1.0
        assert "other parameters" in refused(bpy.ops.mu.motion, name="alpha4", what="print")
        """,
        tmp_path,
        study,
    )


def test_undo_save_and_reload(tmp_path, study):
    session(
        """
        bpy.ops.ed.undo_push(message="before") if bpy.ops.ed.undo_push.poll() else None
        root = started()
        show(name="model_a")
        show(name="model_a", what="print")
        root.mu_motion.field, root.mu_motion.cut = "von_mises_kPa", False
        counts = {part.name: len(part.data.vertices) for part in motion_parts.parts(root)}
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/../seat.blend")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=sys.argv[1] + "/../seat.blend")
        (root,) = unit_object.roots()
        assert {part.name: len(part.data.vertices) for part in motion_parts.parts(root)} == counts
        bpy.context.scene.frame_set(193)
        for part in motion_parts.parts(root):
            assert np.allclose(moved(part), values(part.data, "displacement_mm"), atol=1e-4)
            assert part.modifiers["Motion"].filepath.startswith("//")
        # Nothing is drawn twice, and what belongs to the unit goes with it.
        show(name="model_a")
        assert len(motion_parts.parts(root)) == 3
        assert bpy.ops.mu.delete() == {"FINISHED"}
        assert not [o for o in bpy.data.objects if o.get(unit_object.MOTION)]
        """,
        tmp_path,
        study,
    )


def test_what_is_missing_is_said(tmp_path, study):
    session(
        """
        import pathlib
        root = add(preset="mu-0.75x")
        assert "simulate this unit first" in refused(bpy.ops.mu.motion)
        assert "no such picture" in refused(bpy.ops.mu.picture, name="angle.png")
        root.mu_unit.study.folder = sys.argv[1]
        assert "no motion of 'alpha77'" in refused(bpy.ops.mu.motion, name="alpha77")
        assert bpy.ops.mu.picture(name="angle.png") == {"FINISHED"} and "angle.png" in bpy.data.images
        show(name="model_a")
        # The study's files go: frames still come, and the operators say what is missing.
        (pathlib.Path(sys.argv[1]) / "motion" / "model_a.npz").unlink()
        bpy.context.scene.frame_set(50)
        assert "simulate this unit first" in refused(bpy.ops.mu.motion)
        root.mu_motion.cut = False
        assert "no motion to show" in root.mu_motion.trouble
        """,
        tmp_path,
        study,
    )


def test_candidates_say_their_rank(tmp_path, study):
    session(
        """
        from mu_addon.blender import ranking
        from mu_addon.blender.compat import modifier_input
        from mu_addon.blender import live
        root = add(preset="mu-0.75x")
        root.mu_unit.candidates = True
        assert modifier_input(unit_object.part(root, "candidate:alpha1").modifiers[0], "Label") == "α1"
        root.mu_unit.study.folder = sys.argv[1]
        live.catch_up()  # as when a simulation has ended
        known = ranking.ranked(root)
        assert sorted(rank for _, rank in known.values()) == list(range(1, 11))
        bpy.ops.mu.path(name="alpha4")
        tubes = {name: unit_object.part(root, f"candidate:{name}") for name in known}
        for name, tube in tubes.items():
            label = modifier_input(tube.modifiers[0], "Label")
            assert label.startswith("α") and label.endswith(f"#{known[name][1]}"), label
        assert tubes["alpha4"].data.materials[0].name == "MU Waveguide"
        colours = {tuple(t.data.materials[0].diffuse_color) for n, t in tubes.items() if n != "alpha4"}
        assert len(colours) == 9
        assert not unit_object.behind(root)
        root.mu_unit.chambers.wall_mm = 1.0  # stale: they say nothing any more
        assert ranking.ranked(root) == {}
        assert modifier_input(unit_object.part(root, "candidate:alpha1").modifiers[0], "Label") == "α1"
        """,
        tmp_path,
        study,
    )


def test_panels_show_the_motion(tmp_path, study):
    session(
        """
        from unittest.mock import MagicMock
        from mu_addon.blender import results_panel, thumbnails

        def drawn():
            said, layout = [], MagicMock()
            for name in ("row", "column", "box", "grid_flow"):
                getattr(layout, name).return_value = layout
            layout.label.side_effect = lambda text="", **_: said.append(text)
            layout.operator.side_effect = lambda name, text="", **_: said.append(text or name) or MagicMock()
            layout.template_icon.side_effect = lambda icon, scale: said.append("a picture")
            for cls in results_panel.CLASSES:
                if cls.poll(bpy.context):
                    cls.show(None, layout, bpy.context, unit_object.active_root(bpy.context))
            return " ".join(said)

        root = add(preset="mu-0.75x")
        assert "simulate this unit first" in drawn() and "No pictures yet" in drawn()
        root.mu_unit.study.folder = sys.argv[1]
        said = drawn()
        assert "A α1 α2" in said and "Play" not in said and said.count("a picture") == 1
        assert "Choose a sensor path" in said
        bpy.ops.mu.path(name="alpha4")
        assert drawn().count("a picture") == 2
        show(name="alpha4")
        root.mu_motion.field = "von_mises_kPa"
        said = drawn()
        assert "Play" in said and "Not known of alpha4" in said
        """,
        tmp_path,
        study,
    )
