"""Targets and freedoms in Blender: written as design.toml, searched, proposed units put into the scene."""

import json

import attrs
import bpy
import numpy as np
import pytest

from mu_addon.blender.jobs.panel import rounded
from mu_addon.blender.optimize import panel as panels
from mu_addon.blender.optimize import state as optimization
from mu_addon.blender.optimize.properties import FREE
from mu_addon.blender.simulate import effects
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import shape_hash, to_unit
from mu_addon.design.parameters import write_unit
from mu_addon.evidence.extended import ExtendedModel, Fitted
from mu_addon.report.design_charts import picture
from mu_addon.studies.optimize import Optimize, mechanics_of

from .acting import add, refused
from .drawing import drawn as drawn_by
from .jobs import ended


def drawn():
    return drawn_by([panels.MU_PT_optimize])


def target(root, kind, **values):
    assert bpy.ops.mu.optimize_list(what="targets") == {"FINISHED"}
    made = root.mu_optimize.targets[-1]
    made.kind = kind
    for name, value in values.items():
        setattr(made, name, value)
    return made


def free(root, parameter, **values):
    assert bpy.ops.mu.optimize_list(what="freedoms") == {"FINISHED"}
    made = root.mu_optimize.freedoms[-1]
    made.parameter = parameter
    for name, value in values.items():
        setattr(made, name, value)
    return made


def finished(root, **changed):
    """A run's folder with one proposed unit, as a run leaves it."""
    folder = optimization.folder_of(root)
    optimization.OPTIMIZE.write(root, folder)
    unit = to_unit(root.mu_unit)
    chambers = attrs.evolve(unit.chambers, wall_mm=0.712345678)
    proposed = attrs.evolve(unit, name="proposed-1", chambers=chambers)
    write_unit(proposed, folder / "proposed-1.toml")
    (folder / "proposed-1.png").write_bytes(picture(proposed))
    common = {"standard_error": 0.5, "objective": False}
    targets = [
        {"name": "angle at 30 kPa", "asked": "at least 20 deg", "unit": "deg", "value": 18.25,
         "met": False, "robust": False, **common},
        {"name": "printable", "asked": "yes", "unit": "", "value": None,
         "met": True, "robust": True, **common},
    ]  # fmt: skip
    row = {"file": "proposed-1.toml", "printable": "pass", "targets": targets}
    row |= {
        "changes": ["chambers.wall_mm: 0.9 to 0.7123 mm"],
        "reasons": ["angle at 30 kPa: chambers.wall_mm by +1.2 deg"],
    }
    summary = {"status": "complete", "outcome": "No unit of 3 meets every target.", "proposed": [row]}
    (folder / "summary.json").write_text(json.dumps({**summary, "in_the_way": ["mass"], **changed}))
    return proposed


def test_every_parameter_has_a_range():
    root = add()
    for name, d in FREE.items():
        table = optimization.freedom_table(free(root, name))
        assert d.low <= table["low"] < table["high"] <= d.high, name


def test_properties_are_written_as_the_file_that_the_core_reads(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    assert "add a target first" in refused(bpy.ops.mu.optimize).casefold()
    target(root, "angle", pressure_kPa=30.0, ask="value", value=19.2, tolerance=0.3)
    target(root, "angle", pressure_kPa=-10.0, ask="high", high=-8.0)
    target(root, "safety", ask="low", low=4.0)
    target(root, "air_volume", ask="range", low=10.0, high=60.0)
    target(root, "stiffness", direction="z", ask="maximise")
    target(root, "mass", ask="minimise")
    target(root, "deviation", path="alpha2", pressures_kPa=(-15.0, 30.0), ask="minimise")
    root.mu_optimize.targets[-1].paths = "free"
    assert root.mu_optimize.targets[-1].path == ""
    root.mu_optimize.targets[-1].paths = "alpha2"
    target(root, "tip_force", gap_mm=1.5, ask="low", low=0.2)
    target(root, "tip_position", toward="z", ask="high", high=2.0)
    target(root, "workspace", pressures_kPa=(-10.0, 20.0), ask="maximise")
    target(root, "stretch", ask="curve", points="10: 1.2, 20.5: 1.4", tolerance=0.1)
    target(root, "angle", pressure_kPa=0.0, ask="value", value=0.0, tolerance=0.5)
    target(root, "printable")
    assert "may change first" in refused(bpy.ops.mu.optimize)
    free(root, "chambers.wall_mm", low=0.65, high=1.4)
    free(root, "lattice.cells_x", low=3.0, high=5.0)
    free(root, "chambers.cell_mm", low=12.0, high=13.0)
    free(root, "chambers.neck_diameter_mm", how="values", values="11, 12.5, 13")
    free(root, "chambers.bladder_share", how="fixed", value=0.55)
    root.mu_optimize.evaluations = 7
    root.mu_optimize.robust = root.mu_optimize.has_gravity = True

    expected = sum(seconds for _, seconds in optimization.plan_of(root))
    assert f"Optimize, perhaps {rounded(expected)}" in drawn()
    assert optimization.unchecked_texts(root) == optimization.OPTIMIZE.inputs(root).texts()
    optimization.OPTIMIZE.write(root, tmp_path / "run")
    design = Optimize.read(tmp_path / "run").design
    unit = to_unit(root.mu_unit)
    assert shape_hash(design.unit) == shape_hash(
        attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, bladder_share=0.55))
    )
    angle, vacuum, safety, air, stiffness, mass, deviation, *added, printable, thinnest = design.targets
    force, place, path, *curve, rest = added
    assert (force.quantity.gap_mm, force.quantity.pressure_kPa, force.low) == (1.5, 30.0, 0.2)
    assert (place.quantity.direction, path.quantity.pressures_kPa) == ("z", (-10.0, 20.0))
    assert [(t.quantity.pressure_kPa, t.value, t.tolerance) for t in curve] == [
        (10, 1.2, 0.1),
        (20.5, 1.4, 0.1),
    ]
    assert (rest.quantity.pressure_kPa, design.orientation_deg, design.robust) == (0.0, 90.0, True)
    assert (angle.quantity.pressure_kPa, angle.value, angle.tolerance) == (30.0, 19.2, 0.3)
    assert (vacuum.name, vacuum.high) == ("angle at -10 kPa", -8.0)
    assert safety.low == 4.0
    assert (air.low, air.high) == (10.0, 60.0)
    assert (stiffness.goal, stiffness.quantity.direction) == ("maximise", "z")
    assert mass.goal == "minimise"
    assert deviation.quantity.path == "alpha2"
    assert printable.kind == "printable"
    assert thinnest.kind == "wall_thickness", "the printer's limit, so that the search keeps it"
    wall, cells, cell, neck = design.freedoms
    assert neck.values == (11, 12.5, 13)
    assert design.unit.chambers.bladder_share == 0.55
    assert (wall.low, wall.high) == (0.65, 1.4)
    assert cells.values == (3, 4, 5)
    assert cell.also == {"chambers.bladder_diameter_mm": 2.0}, "the bladder is two cells wide"
    assert (design.search.evaluations, design.settings.refine, design.check_refine) == (7, 0.5, 0.75)
    # What the core reads is what it writes again.
    assert Optimize.read(tmp_path / "run").texts() == Optimize(design=design).texts()


def test_path_resin_kind_and_struts_as_printed_are_asked_for_by_name(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    target(root, "deviation", path="", pressures_kPa=(-10.0, 20.0), ask="minimise")
    path = free(root, "path")
    assert path.values.startswith("alpha1, alpha2, ")
    path.values = "alpha2, alpha4"
    resin = free(root, "resin")
    assert set(resin.values.split(", ")) == {"elastic-50a-v1", "flexible-80a"}
    free(root, "waveguide.row", low=1.0, high=2.0)
    kind = free(root, "lattice.kind", values="body-centred, body-centred-straight")
    assert drawn(), "the panel shows names"
    target(root, "angle", ask="low", low=5.0)
    root.mu_optimize.self_contact = True
    optimization.OPTIMIZE.write(root, tmp_path / "run")
    design = Optimize.read(tmp_path / "run").design
    assert design.self_contact
    assert [f.values for f in design.freedoms] == [
        ("alpha2", "alpha4"), ("elastic-50a-v1", "flexible-80a"), (1, 2),
        ("body-centred", "body-centred-straight"),
    ]  # fmt: skip
    kind.values = ""
    assert "the list of values is empty" in refused(bpy.ops.mu.optimize)


def test_the_users_own_body_goes_along(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    target(root, "angle")
    free(root, "chambers.wall_mm")
    half = np.array([17.0, 22.5, 37.5])
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube = bpy.context.object
    for vertex in cube.data.vertices:
        vertex.co = np.array(vertex.co) * half + [0.0, 5.5, 37.5]
    root.mu_unit.envelope = cube.data
    assert optimization.unchecked_texts(root) == optimization.OPTIMIZE.inputs(root).texts()
    optimization.OPTIMIZE.write(root, tmp_path / "run")
    job = Optimize.read(tmp_path / "run")
    np.testing.assert_allclose(np.ptp(job.design.body.bounds, axis=0), 2 * half, atol=1e-4)
    assert mechanics_of(job.design, None)[0].body is job.design.body


def test_what_the_core_refuses_is_said_and_nothing_is_written(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    target(root, "angle", ask="range", low=30.0, high=20.0)
    free(root, "chambers.wall_mm")
    assert "low is not below high" in refused(bpy.ops.mu.optimize)
    root.mu_optimize.targets[0].ask = "low"
    root.mu_optimize.freedoms[0].low = 0.01
    assert "are not a range within its bounds" in refused(bpy.ops.mu.optimize)
    assert not (optimization.folder_of(root) / "design.toml").exists()
    assert bpy.ops.mu.optimize_unlist(what="targets", index=0) == {"FINISHED"}
    assert "has 0 rows" in refused(bpy.ops.mu.optimize_unlist, what="targets", index=0)
    assert not bpy.ops.mu.optimize.poll()


def test_in_a_window_the_job_refuses_what_the_core_does(tmp_path, monkeypatch):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    target(root, "angle", ask="range", low=30.0, high=20.0)
    free(root, "chambers.wall_mm")
    monkeypatch.setattr(optimization.prepared, "at_once", lambda: False)
    assert bpy.ops.mu.optimize() == {"FINISHED"}
    child = optimization.OPTIMIZATION.child(root)
    assert ended(child).state == "failed"
    assert "low is not below high" in child.error["what"]
    assert "low is not below high" in drawn()


def test_named_effects_of_the_unit_are_optimised_with_it(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    target(root, "angle")
    free(root, "chambers.wall_mm")
    known = {"sd": 0.1, "low95": 0.3, "high95": 1.2}
    found = {name: {} for name in ("clogged_chamber", "gravity")}
    found["clogged_chamber"]["share_lost"] = Fitted(0.5, **known)
    found["gravity"]["density_kg_m3"] = Fitted(1100.0, **known)
    effects.keep(root, ExtendedModel("named", found, {}).text())
    assert "With the named effects" in drawn()
    optimization.OPTIMIZE.write(root, tmp_path / "run")
    job = Optimize.read(tmp_path / "run")
    assert mechanics_of(job.design, job.model)[1] == [], "nothing of it is left out"
    assert job.model.of_effects == {
        "clogged_chamber.share_lost": 0.5, "gravity.density_kg_m3": 1100.0,
    }  # fmt: skip
    root.mu_unit.study.orientation_deg = 90.0
    assert "turned by 90 degrees in Simulate" in refused(bpy.ops.mu.optimize)
    root.mu_optimize.has_gravity = True
    root.mu_optimize.orientation_deg = 90.0
    optimization.OPTIMIZE.write(root, tmp_path / "level")
    assert Optimize.read(tmp_path / "level").design.orientation_deg == 90.0


def test_a_file_is_searched_from_this_unit_or_from_its_own(tmp_path):
    root = add()
    root.mu_unit.chambers.wall_mm = 1.05
    root.mu_optimize.source = "file"
    assert "Choose a design.toml first" in refused(bpy.ops.mu.optimize)
    file = tmp_path / "design.toml"
    file.write_text(
        'format = 1\npreset = "mu-0.75x"\n[[target]]\nkind = "mass"\nobjective = "minimise"\n'
        '[[freedom]]\nparameter = "chambers.wall_mm"\nlow = 0.8\nhigh = 1.3\n'
    )
    root.mu_optimize.file = str(file)
    assert optimization.OPTIMIZE.inputs(root).design.unit.chambers.wall_mm == 1.05
    root.mu_optimize.own_unit = False
    assert optimization.OPTIMIZE.inputs(root).design.unit.scale == 0.75
    file.write_text(file.read_text().replace("low = 0.8", "low = true"))
    assert "line 8" in refused(bpy.ops.mu.optimize)


def test_values_to_choose_from_are_lengths_at_the_units_scale():
    root = add(preset="mu-0.75x")
    neck = free(root, "chambers.neck_diameter_mm", how="values")
    neck.true_values = "9, 9.4,10.5"
    assert optimization.freedom_table(neck)["values"] == pytest.approx([12.0, 9.4 / 0.75, 14.0])
    assert neck.true_values == "9, 9.4, 10.5"
    neck.true_values = "9, wide"
    assert optimization.freedom_table(neck)["values"] == [12, "wide"], "for the core to refuse"
    cells = free(root, "lattice.cells_x", how="values")
    cells.true_values = "3, 5"
    assert optimization.freedom_table(cells)["values"] == [3, 5]


def test_a_proposed_unit_is_applied_undone_and_added_beside(tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    assert "Stands in the way" not in drawn()
    assert not bpy.ops.mu.optimize_apply.poll()
    target(root, "angle")
    free(root, "chambers.wall_mm")
    finished(root)
    texts = drawn()
    for expected in (
        "No unit of 3 meets every target", "Stands in the way: mass", "Unit 1",
        "angle at 30 kPa: 18.25 ± 0.5 deg, asked:", "printable: yes", "Wall: 0.9 to 0.7123 mm",
        "Largest influence on each target: angle at 30 kPa: Wall by",
    ):  # fmt: skip
        assert expected in texts, (expected, texts)
    assert "other parameters" not in texts
    finished(root, seconds={"search": 60.0}, designs=3)
    expected = 20.0 * root.mu_optimize.evaluations
    assert dict(optimization.plan_of(root))["search"] == expected, "it takes as long again"
    name = root.name
    bpy.ops.ed.undo_push(message="found")
    assert bpy.ops.mu.optimize_apply(number=1) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="applied")
    assert abs(to_unit(root.mu_unit).chambers.wall_mm - 0.712345678) < 1e-7
    assert root.name == name
    assert not unit_object.behind(root)
    assert "The unit has its parameters" in drawn()
    assert "other parameters" not in drawn()
    assert "a picture" in drawn()
    bpy.ops.ed.undo()
    root = unit_object.active_root(bpy.context)
    assert to_unit(root.mu_unit).chambers.wall_mm == 0.9
    assert "The unit has its parameters" not in drawn()
    assert "no unit 2 is proposed" in refused(bpy.ops.mu.optimize_apply, number=2)
    root.mu_unit.chambers.wall_mm = 1.0
    assert "started from other parameters" in drawn()

    summary = optimization.folder_of(root) / "summary.json"
    good = summary.read_text()
    for bad in ("{", '{"proposed": ["a text"]}', '{"proposed": 3}', "[]"):
        summary.write_text(bad)
        assert not bpy.ops.mu.optimize_apply.poll()
        assert "Stands in the way" not in drawn()
    summary.write_text(good)

    uuid = root.mu_unit.uuid
    assert bpy.ops.mu.optimize_add(number=1) == {"FINISHED"}
    beside = unit_object.active_root(bpy.context)
    assert beside.mu_unit.uuid != uuid
    assert abs(to_unit(beside.mu_unit).chambers.wall_mm - 0.712345678) < 1e-7
    old = unit_object.by_uuid(uuid)
    assert to_unit(old.mu_unit).chambers.wall_mm == 1.0
    assert beside.location.x - old.location.x >= old.dimensions.x, "none stands in the other"


def test_the_panel_says_how_to_begin_what_is_entered_and_what_a_sign_means(tmp_path):
    root = add()
    root.mu_unit.study.folder = str(tmp_path)
    assert "Press + to add a target" in drawn()
    first = target(root, "angle", ask="curve")
    assert "Press + for each parameter" in drawn()
    free(root, "chambers.wall_mm")
    assert "Press +" not in drawn()
    assert panels.asked_title(first, "points") == "kPa: deg"
    assert panels.asked_title(first, "tolerance") == "Within (deg)"
    first.kind = "stretch"
    assert panels.asked_title(first, "points") == "kPa: value"
    finished(root)
    assert "Question mark: met" not in drawn()
    summary = optimization.folder_of(root) / "summary.json"
    said = json.loads(summary.read_text())
    said["proposed"][0]["targets"][0]["met"] = True
    summary.write_text(json.dumps(said))
    assert "Question mark: met" in drawn()
    pictures = drawn().count("a picture")
    (optimization.folder_of(root) / panels.FRONT).write_bytes(picture(to_unit(root.mu_unit)))
    assert drawn().count("a picture") == pictures + 1


def test_a_coarser_mesh_and_fewer_units_are_expected_to_take_less():
    props = add().mu_optimize
    props.evaluations, props.refine, props.check_refine = 24, 0.5, 0.75
    usual = dict(optimization.plan_of(bpy.context.object))
    props.evaluations, props.refine, props.check_refine = 3, 0.25, 0.375
    quick = dict(optimization.plan_of(bpy.context.object))
    by_refinement = usual["search"] / quick["search"] / 8
    assert by_refinement > 2.0
    check = "check of what is proposed"
    assert usual[check] / quick[check] == pytest.approx(2 * by_refinement)
