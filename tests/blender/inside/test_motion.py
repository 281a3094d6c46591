"""Results on the model: objects, attributes, timeline and panels, from a study that was run by the core."""

import json
from types import SimpleNamespace

import attrs
import bpy
import numpy as np
import pytest
from PIL import Image

from mu_addon.blender.path import candidates, hover, picking, ranking
from mu_addon.blender.path import legend as path_legend
from mu_addon.blender.path import panel as path_panel
from mu_addon.blender.results import field_colours as fields
from mu_addon.blender.results import legend, legend_object, run_motions, runs
from mu_addon.blender.results import motion as motion_parts
from mu_addon.blender.results import operators as result_operators
from mu_addon.blender.results import panel as results_panel
from mu_addon.blender.shared import viewports
from mu_addon.blender.shared.compat import modifier_input
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.unit import drawing
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit import preview_update as live
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.anchors import anchor_points
from mu_addon.simulate_and_place.charts import ANGLE, angle_picture, delta_name, delta_picture

from ...studies.bent_motion import write_bent_part, write_bent_run
from .acting import add, refused
from .drawing import drawn, panels_of
from .jobs import launch, watch


def started(study):
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(study)
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


def test_colours_are_those_of_reports():
    import matplotlib

    from mu_addon.report.heatmaps import MAP

    table = matplotlib.colormaps[MAP](np.linspace(0.0, 1.0, len(fields.STOPS)))
    assert np.abs(table[:, :3] - fields.STOPS).max() < 1e-3


def test_motion_plays_in_its_own_time_and_carries_its_fields(study):
    root = started(study)
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
    stress = [values(mesh, "von_mises_kPa") for mesh in (other.data, part.data)]
    assert not np.allclose(*stress, rtol=0.02)
    assert values(other.data, "deviation_mm").max() > 1e-3
    assert not values(part.data, "deviation_mm").any()
    # The first is seen in the unit's own place, of which it is the mesh; the other one beside it.
    assert other.location.y < part.location.y == 0.0
    assert part.hide_viewport
    assert not other.hide_viewport
    scene.frame_set(193)
    own = [motion_parts.vertices_of(evaluated(p)) for p in motion_parts.parts(root) if p.hide_viewport]
    assert np.allclose(
        sorted(motion_parts.vertices_of(evaluated(root)).tolist()), sorted(np.concatenate(own).tolist())
    )
    root.mu_unit.show = "preview"
    assert len(evaluated(root).vertices) != sum(map(len, own))
    root.mu_unit.show = "result"
    root.mu_motion.on_unit = False
    assert root.mu_unit.show == "preview"
    assert other.location.y < part.location.y < 0.0
    assert not part.hide_viewport
    root.mu_motion.on_unit = True
    assert root.mu_unit.show == "result"
    root.mu_motion.apart = 0.0
    assert other.location.y == part.location.y == 0.0
    assert bpy.ops.mu.motion(name="model_a", on=False) == {"FINISHED"}
    assert motion_parts.shown(root) == [("alpha4", "mesh")]
    assert bpy.ops.mu.motion_clear() == {"FINISHED"}
    assert motion_parts.parts(root) == []
    assert root.mu_unit.show == "preview"


def test_colours_follow_the_range_and_grey_is_what_is_not_known(study):
    root = started(study)
    show(name="model_a")
    show(name="alpha4")
    bpy.context.scene.frame_set(193)
    settings = root.mu_motion
    known, unknown = (motion_parts.one(root, name, "mesh") for name in ("model_a", "alpha4"))
    # What no part knows is grey on all of them: without self-contact, without a run to compare with.
    nowhere = ("contact_pressure_kPa", "run_difference_mm")
    for field in nowhere:
        settings.field = field
        assert all(field not in part.data.attributes for part in (known, unknown))
    assert "Compare with another run" in run_motions.difference_words(root)
    for field in fields.FIELDS:
        if field.name in nowhere:
            continue
        settings.field = field.name
        material = fields.material_of(root)
        assert material.node_tree.nodes["Field"].attribute_name == field.name
        assert settings.low < settings.high
        assert known.data.materials[0] == material
        there = field.name in unknown.data.attributes
        assert there == (field.name != "dJ_by_modulus_mm_per_MPa")
        assert (unknown.data.materials[0] == material) == there, field.name
    settings.field = "largest_principal_stress_kPa"
    low, high = settings.low, settings.high
    ramp = fields.material_of(root).node_tree.nodes["Range"].inputs
    assert (ramp["From Min"].default_value, ramp["From Max"].default_value) == (low, high)
    assert low < 0 < high
    settings.symmetric = True
    assert settings.low == -settings.high
    assert abs(settings.high - max(-low, high)) < 1e-3 * high
    settings.symmetric = False
    settings.low, settings.high = 0.0, 100.0
    settings.lock = True
    settings.field = "displacement_mm"
    assert settings.high == 100.0  # locked
    colours = np.empty(4 * len(known.data.vertices), np.float32)
    known.data.color_attributes[fields.COLOUR].data.foreach_get("color", colours)
    u = values(known.data, "displacement_mm")
    expected = fields.colours(root, u)
    assert np.allclose(colours.reshape(-1, 4), expected)
    assert len(np.unique(expected, axis=0)) > 10
    assert bpy.ops.mu.motion_range() == {"FINISHED"}
    assert settings.high < 100.0


def test_colours_and_their_legend_go_together_when_another_unit_is_active(study):
    root = started(study)
    assert legend.subject(bpy.context) is None
    assert bpy.ops.mu.field_show(field="displacement_mm") == {"FINISHED"}
    root.name = "the first"
    motion = motion_parts.motion_of(root)
    assert legend.subject(bpy.context) == root
    assert "the first" not in legend.lines(root, motion, bpy.context.scene)
    other = add(preset="mu-0.75x")
    assert unit_object.active_root(bpy.context) == other
    assert legend.subject(bpy.context) == root
    assert legend.lines(root, motion, bpy.context.scene)[0] == "the first"
    root.hide_set(True)
    assert legend.subject(bpy.context) is None


def test_every_way_into_a_result_shows_its_colours_or_says_that_this_view_cannot(study, tmp_path):
    root = started(study)
    (window,) = bpy.context.window_manager.windows
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    shading = area.spaces.active.shading

    def offered():
        """Whether the view's header has the button."""
        header = type(
            "Header", (), {"draw": lambda self, context: result_operators.draw_colours(self, context)}
        )
        with bpy.context.temp_override(window=window, area=area):
            assert viewports.shows_colours(bpy.context) == (shading.color_type == "VERTEX")
            return "mu.colours" in drawn([header])

    shading.color_type = "MATERIAL"
    assert not offered(), "nothing is coloured"
    peak = bpy.context.scene.frame_end
    root.mu_unit.show = "result"
    assert shading.color_type == "VERTEX"
    assert bpy.context.scene.frame_current not in (1, peak), "where the field is largest, not at rest"
    for gesture in (
        lambda: setattr(root.mu_motion, "field", "largest_stretch"),
        lambda: runs.show(root, studies.shown_run(root).key),
        lambda: setattr(root.mu_unit, "show", "preview") or setattr(root.mu_unit, "show", "result"),
    ):
        shading.color_type = "MATERIAL"
        assert offered()
        gesture()
        assert shading.color_type == "VERTEX"
        assert not offered()
    root.mu_live.colour = "largest_stretch"
    root.mu_live.colour = "plain"
    assert shading.color_type == "VERTEX", "the colours of live bending are not the only ones"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    shading.color_type = "MATERIAL"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"), load_ui=False)
    (window,) = bpy.context.window_manager.windows
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    shading = area.spaces.active.shading
    for shading.type, shading.color_type in (("SOLID", "MATERIAL"), ("WIREFRAME", "MATERIAL")):
        assert offered()
        with bpy.context.temp_override(window=window, area=area):
            assert bpy.ops.mu.colours() == {"FINISHED"}
        assert (shading.type, shading.color_type) == ("SOLID", "VERTEX")
        assert not offered()


def test_a_result_appears_state_by_state_while_its_job_runs(tmp_path):
    root, scene = add(preset="mu-0.75x"), bpy.context.scene
    root.mu_unit.study.folder = str(tmp_path / "home")
    folder = write_bent_run(tmp_path / "home", 1000, ranked=False).folder

    def solved(*pressures):
        write_bent_part(folder, pressures)
        angles = {f"{p:g}": 1.0 for p in (0.0, *pressures)}
        (folder / "summary.json").write_text(json.dumps({"status": "running", "angle_deg": angles}))

    def told():
        child = launch(root, "good")
        watch(lambda: child.state != "running")

    def seen():
        """Words of the legend, and whether every colour is that of what is not known."""
        motion = motion_parts.motion_of(root)
        mesh = motion_parts.one(root, "model_a", "mesh").data
        colours = np.empty(4 * len(mesh.vertices), np.float32)
        mesh.color_attributes[fields.COLOUR].data.foreach_get("color", colours)
        unknown = np.isnan(values(mesh, root.mu_motion.field)).all()
        assert unknown == (len(np.unique(colours.reshape(-1, 4), axis=0)) == 1)
        _, *words = legend.lines(root, motion, scene)
        return " | ".join(words[:2]), unknown

    solved(10.0)
    root.mu_unit.show = "result"
    frames = {p: 1 + 24 * n for n, p in enumerate((-20, -10, 0, 10, 20, 30, 40))}
    assert (scene.frame_current, scene.frame_end) == (frames[10], frames[40])
    assert seen() == ("3.00 s, 10.0 kPa | 2 of 7 pressures so far", False)
    assert "motion up to 10 kPa: 2 of 7 pressures so far" in drawn([results_panel.MU_PT_results])
    for later in (frames[10] + 1, frames[20], frames[40], frames[-20]):
        scene.frame_set(later)
        words, unknown = seen()
        assert "not solved yet" in words
        assert unknown, "nothing that is not solved has a colour"

    scene.frame_set(frames[10])
    before = np.concatenate([moved(part) for part in motion_parts.parts(root)])
    solved(10.0, 20.0, 30.0)
    told()
    assert scene.frame_current == frames[30], "it follows the largest one"
    assert seen() == ("5.00 s, 30.0 kPa | 4 of 7 pressures so far", False)
    further = np.concatenate([moved(part) for part in motion_parts.parts(root)])
    assert further.max() > 2.5 * before.max()
    scene.frame_set(frames[10])
    again = np.concatenate([moved(part) for part in motion_parts.parts(root)])
    np.testing.assert_allclose(again, before, atol=1e-5)

    write_bent_run(tmp_path / "home", 2000, ranked=False)
    told()
    assert scene.frame_current == frames[10], "a view that was moved stays"
    assert seen() == ("3.00 s, 10.0 kPa | coarse mesh (0.5)", False)
    scene.frame_set(frames[-20])
    assert seen() == ("0.00 s, -20.0 kPa | coarse mesh (0.5)", False)


def test_a_field_of_few_spots_has_a_range_of_what_it_is_there():
    touched = np.zeros((4, 1000))
    touched[2, :20] = np.linspace(10.0, 30.0, 20)
    touched[3, 0] = 336.0
    low, high = fields.BY_NAME["contact_pressure_kPa"].ends(touched)
    assert low == 0.0
    assert 28.0 < high < 50.0, "one corner stretches no range"
    assert fields.BY_NAME["contact_pressure_kPa"].ends(np.full((2, 3), np.nan)) == (0.0, 0.0)
    stress = np.linspace(5.0, 105.0, 1001)
    assert fields.BY_NAME["von_mises_kPa"].ends(stress)[0] == 0.0, "an amount's colours begin at 0"
    assert fields.BY_NAME["largest_stretch"].ends(stress)[0] > 5.0


def test_the_legend_stands_in_the_scene(study):
    root = started(study)
    show(name="model_a")
    root.mu_motion.field = "displacement_mm"
    assert bpy.ops.mu.motion_legend() == {"FINISHED"}
    bar = legend_object.bar_of(root)

    def texts(what):
        return [text.data.body for text in bar.children if text["mu_legend"] == what]

    assert not bar.hide_render
    for frame, state in ((1, "0.00 s, 0.0 kPa"), (193, "8.00 s, 40.0 kPa")):
        bpy.context.scene.frame_set(frame)
        expected = f"Displacement [mm]\n{state}\ncoarse mesh (0.2)"
        assert texts("head") == [expected], texts("head")
    root.mu_motion.lock = True
    root.mu_motion.low, root.mu_motion.high = 0.0, 4.0
    assert texts("tick") == ["0", "1", "2", "3", "4"]
    # At a tick's height the bar has the colour that the model has there.
    ramp = next(n for n in bar.data.materials[0].node_tree.nodes if n.type == "VALTORGB").color_ramp
    field = fields.material_of(root).node_tree.nodes["Ramp"].color_ramp
    assert np.allclose(ramp.evaluate(0.3), field.evaluate(0.3))
    bar.location.y = 99.0  # moved by the user, it stays there
    root.mu_motion.field = "von_mises_kPa"
    assert texts("head")[0].startswith("Von Mises Stress [kPa]")
    assert bar.location.y == 99.0
    count = len(bpy.data.objects)
    assert bpy.ops.mu.motion_legend(on=False) == {"FINISHED"}
    assert legend_object.bar_of(root) is None
    assert bpy.ops.mu.motion_legend() == {"FINISHED"}
    assert len(bpy.data.objects) == count
    bpy.ops.mu.delete()
    assert not bpy.data.objects
    assert not bpy.data.curves


def test_a_painted_field_takes_the_candidates_off_the_unit(study):
    root = started(study)
    root.mu_unit.candidates = True
    assert candidates.candidate(root, "alpha1") is not None
    assert bpy.ops.mu.field_show(field="displacement_mm") == {"FINISHED"}
    assert not root.mu_unit.candidates
    assert candidates.candidate(root, "alpha1") is None
    assert not unit_object.behind(root)


def test_a_path_of_the_whole_lattice_moves_and_is_shown_where_it_lies(study):
    root = started(study)
    name, j, points = ranking.free(root)
    assert name in motion_parts.motion_of(root).paths
    assert 0 < j < 1
    root.mu_unit.candidates = True
    tube = drawing.beside(root, "free")
    assert tube.data.materials[0].name.startswith("MU J"), "in the colours of the candidates"
    assert np.allclose(motion_parts.vertices_of(tube.data), points, atol=1e-4)
    show(name=name)
    show(name=name, what="print")
    bpy.context.scene.frame_set(193)
    for part in motion_parts.parts(root):
        assert np.allclose(moved(part), values(part.data, "displacement_mm"), atol=1e-4)
        assert values(part.data, "deviation_mm").max() > 1e-3
    root.mu_unit.chambers.wall_mm = 1.0
    assert ranking.free(root) is None
    assert drawing.beside(root, "free") is None


def test_the_print_is_carried_by_the_mesh(study):
    root = started(study)
    show(name="model_a", what="print")
    (part,) = motion_parts.parts(root)
    solid = root.mu_unit.solid
    assert len(part.data.vertices) == len(solid.vertices)
    assert part.data != solid
    assert root.mu_unit.show == "result"
    assert "outside the mesh" in part["mu_outside"]
    bpy.context.scene.frame_set(193)
    rest, now = motion_parts.vertices_of(part.data), motion_parts.vertices_of(evaluated(part))
    assert np.allclose(moved(part), values(part.data, "displacement_mm"), atol=1e-4)
    tip = rest[:, 2] > 0.99 * rest[:, 2].max()
    assert (now - rest)[tip, 1].mean() > 1.0  # it bends toward +y under pressure
    inlet = rest[:, 2] < 0.0
    assert inlet.any()
    assert values(part.data, "displacement_mm")[inlet].max() < 1e-12
    # Neighbours stay neighbours: no vertex is torn away. The made-up motion shears edges by up to 42 %.
    edges = np.empty(2 * len(part.data.edges), np.int32)
    part.data.edges.foreach_get("vertices", edges)
    a, b = edges.reshape(-1, 2).T
    before, after = (np.linalg.norm(p[a] - p[b], axis=1) for p in (rest, now))
    assert (np.abs(after - before) < 0.45 * before).all()
    root.mu_unit.chambers.wall_mm = 1.0
    assert "other parameters" in refused(bpy.ops.mu.motion, name="alpha4", what="print")


def test_undo_save_and_reload(study):
    bpy.ops.ed.undo_push(message="before") if bpy.ops.ed.undo_push.poll() else None
    root = started(study)
    show(name="model_a")
    show(name="model_a", what="print")
    root.mu_motion.field, root.mu_motion.cut = "von_mises_kPa", False
    counts = {part.name: len(part.data.vertices) for part in motion_parts.parts(root)}
    bpy.ops.wm.save_as_mainfile(filepath=str(study / "../seat.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(study / "../seat.blend"))
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
    assert not [o for o in bpy.data.objects if o.get(motion_parts.MOTION)]


def test_what_is_missing_is_said(study):
    root = add(preset="mu-0.75x")
    assert "simulate this unit first" in refused(bpy.ops.mu.motion)
    assert "no such picture" in refused(bpy.ops.mu.picture, name="angle.png")
    root.mu_unit.study.folder = str(study)
    assert "no motion of 'alpha77'" in refused(bpy.ops.mu.motion, name="alpha77")
    Image.new("RGB", (2, 2)).save(study / "motion" / "angle.png")
    assert bpy.ops.mu.picture(name="angle.png") == {"FINISHED"}
    assert "angle.png" in bpy.data.images
    show(name="model_a")
    # The study's files go: frames still come, and the operators say what is missing.
    (study / "motion" / "model_a.npz").unlink()
    bpy.context.scene.frame_set(50)
    assert "simulate this unit first" in refused(bpy.ops.mu.motion)
    root.mu_motion.cut = False
    assert "no motion to show" in root.mu_motion.trouble


def test_the_bar_under_the_mouse_is_known_and_where_its_path_truly_runs():
    root = add(preset="mu-1.0x")
    bars = {"alpha1": [(10.0, 0.0), (10.0, 50.0)], "alpha2": [(20.0, 25.0), (20.0, 90.0)]}
    assert hover.nearest((16.0, 30.0), bars, 7.0) == "alpha2"
    assert hover.nearest((12.0, 80.0), bars, 7.0) == "", "beyond the end of the nearer one"
    assert hover.nearest((12.0, 55.0), bars, 7.0) == "alpha1"
    assert hover.nearest((0.0, 0.0), {}, 7.0) == ""
    root.location.x = 100.0
    bpy.context.view_layer.update()
    points = np.array(hover.true_place(root, "alpha4"))
    expected = anchor_points(to_unit(root.mu_unit))[3:] + np.array([100.0, 0.0, 0.0])
    assert np.allclose(points, expected, atol=1e-4)


def test_candidates_say_their_rank(study):
    root = add(preset="mu-0.75x")
    root.mu_unit.candidates = True
    assert modifier_input(candidates.candidate(root, "alpha1").modifiers[0], "Label") == "α1"
    root.mu_unit.study.folder = str(study)
    live.catch_up()  # as when a simulation has ended
    known = {name: (j, n) for n, (name, j) in enumerate(ranking.known(root).j.items(), 1)}
    assert sorted(rank for _, rank in known.values()) == list(range(1, 11))
    bpy.ops.mu.path(name="alpha4")
    tubes = {name: candidates.candidate(root, name) for name in known}
    for name, tube in tubes.items():
        label = modifier_input(tube.modifiers[0], "Label")
        assert label.startswith("α"), label
        assert label.endswith(f"#{known[name][1]}"), label
    # The chosen one is thicker; its colour is that of its J, as of every other.
    width = {name: values(tube.data, "radius").max() for name, tube in tubes.items()}
    assert width["alpha4"] == pytest.approx(candidates.THICKER * width["alpha1"])
    # The list of the panel is sorted either way, and says what its numbers are.
    by_rank = sorted(known, key=lambda name: known[name][1])
    assert [w.name for w in path_panel.in_order(root, ranking.known(root), "deviation")] == by_rank
    assert [w.name for w in path_panel.in_order(root, ranking.known(root), "name")] == [
        f"alpha{k}" for k in range(1, 11)
    ]
    words = drawn([path_panel.MU_PT_path])
    assert "Mean deviation [mm], smaller is better" in words.replace("  ", " ")
    assert f"{known['alpha4'][0]:.3f}  #{known['alpha4'][1]}" in words
    assert len({tuple(t.data.materials[0].diffuse_color) for t in tubes.values()}) == 10
    # The tooltip of a row in the list shows its path in the lattice; of the chosen one's, too.
    for asked, shown in (("alpha2", "alpha2"), ("none", "alpha4")):
        bpy.types.MU_OT_path.description(bpy.context, SimpleNamespace(name=asked))
        assert hover._listed == shown
    hover._let_go()
    assert hover._listed == ""
    assert not unit_object.behind(root)
    # They stand beside the lattice in the order of their names, whatever the ranking; each at its own height.
    order = [name for name, _ in sorted(known.items(), key=lambda item: item[1][1])]
    ends = {name: motion_parts.vertices_of(tube.data) for name, tube in tubes.items()}
    places = [ends[f"alpha{number}"][0, 1] for number in range(1, 11)]
    assert places == sorted(places)
    assert places[0] > to_unit(root.mu_unit).dimensions.bounds[1][1], "and cover nothing of it"
    anchors = anchor_points(to_unit(root.mu_unit))
    assert np.allclose(ends["alpha4"][:, 2], anchors[3:, 2], atol=1e-4)
    # What the mesh cannot decide says so, in the view, in the list and above the colours.
    summary = study / "summary.json"
    found = json.loads(summary.read_text())
    summary.write_text(json.dumps({**found, "tied_with_chosen": [order[1]]}))
    known_now = ranking.known(root)
    assert [known_now.rank(name) for name in order[:3]] == ["≈#1", "≈#1", "#3"]
    assert path_legend.label(root, known_now, order[1])[-1] == "≈#1"
    assert path_legend.UNDECIDED in path_legend.lines(known_now)
    assert path_legend.UNDECIDED in drawn([path_panel.MU_PT_path])
    # A path that cannot win has a bound in place of its number, and leaves open the rank of those beyond it.
    last, worst = order[-2:]
    solved = {name: j for name, j in found["J_hat_mm"].items() if name != last}
    bound = 0.5 * (solved[order[2]] + solved[order[3]])
    summary.write_text(json.dumps({**found, "J_hat_mm": solved, "J_hat_at_least_mm": {last: bound}}))
    some = ranking.known(root)
    assert [some.rank(name) for name in (order[2], order[3], last, worst)] == ["#3", "", "", ""]
    words = drawn([path_panel.MU_PT_path])
    assert f"≥ {bound:.3f}" in words
    assert path_legend.BOUND in words
    assert path_legend.BOUND in path_legend.lines(some)
    assert len(path_legend.marks(some)) >= 2
    assert path_legend.marks(attrs.evolve(some, j={order[0]: 0.3})) == [], "a ramp of one value says nothing"
    assert path_legend.label(root, some, last)[-1] == f"≥ {bound:.3f}"
    # Before any path is solved there are estimates.
    estimated = {name: value for name, value in found.items() if name not in ("J_hat_mm", "chosen")}
    summary.write_text(json.dumps({**estimated, "J_hat_estimated_mm": {order[0]: 0.3, last: 0.8}}))
    words = drawn([path_panel.MU_PT_path])
    assert path_legend.ESTIMATED in words
    assert "~ 0.80" in words
    summary.write_text(json.dumps(found))
    shown = ranking.known(root)
    assert [shown.share_of(shown.numbers[name]) for name in (order[0], order[-1])] == [0.0, 1.0]
    marks = dict(path_legend.marks(ranking.known(root)))
    assert {0.0, 1.0} < set(marks)
    root.mu_unit.chambers.wall_mm = 1.0  # stale: they say so, in grey
    assert ranking.known(root).stale
    label = modifier_input(candidates.candidate(root, "alpha1").modifiers[0], "Label")
    assert label == f"α1\n#{known['alpha1'][1]}?"
    assert candidates.candidate(root, "alpha1").data.materials[0].name == "MU Candidate"
    assert "stale" in path_legend.lines(ranking.known(root))[-1]
    # A click makes one the active object, which chooses it.
    bpy.context.view_layer.objects.active = candidates.candidate(root, "alpha7")
    picking.choose_active()
    assert root.mu_unit.path == "alpha7"


def test_panels_show_the_motion(study):
    # As a study's report writes them: that of the fixture has none.
    delta = np.linspace(0.0, 0.1, 12).reshape(3, 4)
    for name, picture in (
        (ANGLE, angle_picture(np.array([-20.0, 0.0, 40.0]), np.array([-3.3, 0.0, 6.3]))),
        (delta_name("alpha4"), delta_picture("alpha4", delta, np.arange(3.0), 0.1)),
    ):
        (study / "motion" / name).write_bytes(picture.png)
    root = add(preset="mu-0.75x")
    panels = [kind for kind in panels_of(results_panel) if issubclass(kind, bpy.types.Panel)]
    assert drawn(panels).count("imulated") == 1, "once is enough"
    root.mu_unit.study.folder = str(study)
    texts = drawn(results_panel)
    assert "Analysis mesh Without a sensor path0 Path α1 Path α2" in texts
    assert "Play" not in texts
    assert texts.count("a picture") == 1
    assert "Choose a sensor path" in texts
    bpy.ops.mu.path(name="alpha4")
    assert drawn(results_panel).count("a picture") == 2
    show(name="alpha4")
    root.mu_motion.field = "dJ_by_modulus_mm_per_MPa"
    texts = drawn(results_panel)
    assert "Play" in texts
    assert "Path α4, analysis mesh" in texts
    assert "without this field: alpha4" in texts
