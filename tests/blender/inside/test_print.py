"""Print check, markers and files from Blender: real children, and children that misbehave."""

import json
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from mathutils import Vector

from mu_addon.blender.jobs import start_child as jobs
from mu_addon.blender.printing import layer, marks
from mu_addon.blender.printing import panel as print_panel
from mu_addon.blender.printing import state as printing
from mu_addon.blender.sidebar import figures, unit_panel
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate import timings
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.properties import to_unit
from mu_addon.design.printing.slices import signed_area
from mu_addon.design.profile import cavity_polygon
from mu_addon.design.surface import bad_edges, stl_bytes, stl_surface
from mu_addon.studies.export import FORMATS, MANIFEST

from .acting import add, refused, with_runs
from .drawing import drawn as drawn_by
from .jobs import ended, fake

PANELS = print_panel


def done(root, *, state="done"):
    child = printing.PRINTING.child(root)
    ended(child)
    assert child.state == state, (child.state, child.error)
    return child


def short():
    # Three chambers at 0.75x are checked in a fifth of the time.
    root = add(preset="mu-0.75x")
    root.mu_unit.chambers.count = 3
    return root


def drawn():
    return drawn_by(PANELS)


def finding(check, severity, places=(), value=None, limit=None, unit="", **more):
    return {
        "check": check,
        "severity": severity,
        "what": f"{check} was measured",
        "value": value,
        "limit": limit,
        "unit": unit,
        "places": list(places),
        "count": len(places),
        "source": "",
        "assumed": False,
        "remedy": "",
        **more,
    }


def write_check(root, findings, builds=()):
    folder = printing.CHECK.folder_of(root)
    printing.CHECK.write(root, folder)
    check = {"findings": findings, "orientation": list(builds), "direction": list(root.mu_print.up)}
    (folder / "check.json").write_text(json.dumps(check))


def test_a_check_from_start_to_markers(tmp_path):
    """A real check in its child: what the panel says is what check.json holds, and is found again."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    root = short()
    assert "Not checked yet" in drawn()
    assert not bpy.ops.mu.print_show.poll()
    assert "Check the print first" in refused(bpy.ops.mu.print_marks)
    assert bpy.ops.mu.print_check() == {"FINISHED"}
    assert "The job for the printer is running" in refused(bpy.ops.mu.print_export)
    assert "mu.print_cancel" in drawn()
    done(root)
    found = printing.CHECK.found(root)
    assert found.stale == ""
    assert found.folder.parent == studies.folder_of(root)
    faults = [f for f in found.content["findings"] if f["severity"] in ("error", "warning")]
    assert faults
    assert not printing.errors(root)
    texts = drawn()
    for fault in faults:
        assert fault["check"].capitalize() in texts
    assert "checks passed" in texts
    assert "Checked: no errors" in texts
    assert f"Checked: no errors, {len(faults)} warning" in figures.lines(root, 36)[0][-1]
    assert "Stale" not in texts
    best = found.content["orientation"][0]
    assert f"{best['islands']} islands" in texts

    assert bpy.ops.mu.print_show(finding=0) == {"FINISHED"}
    balls = [m for m in marks.mark_objects(root) if m.data is not None]
    assert len(balls) == sum(len(f["places"]) > 0 for f in faults)
    (chosen,) = bpy.context.selected_objects
    first = found.content["findings"][0]
    assert len(chosen.data.vertices) == len(first["places"])
    assert np.allclose(chosen.data.vertices[0].co, first["places"][0], atol=1e-4)
    assert first["what"].split()[0] in drawn()
    assert "place 1 of" in drawn()
    assert bpy.ops.mu.print_open(what="errors") == {"FINISHED"}

    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    (root,) = unit_object.roots()
    assert printing.CHECK.found(root).stale == ""
    assert len(marks.mark_objects(root)) == len(balls) + 1
    assert "place 1 of" in drawn()
    (folder,) = (tmp_path / "seat.mu").glob("*/check")
    assert (folder / "report.html").is_file()
    assert json.loads((folder / "summary.json").read_text())["verdict"] == "warning"


def test_markers_lead_to_every_place_and_undo_takes_them_back(tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    root = add()
    root.location = (100, 0, 0)
    bpy.context.view_layer.update()
    places = [[1, 2, 3], [4, 5, 6]]
    build = {
        "direction": [0.6, 0, 0.8],
        "cup_ml": 0.25,
        "islands": 7,
        "support_mm2": 12.0,
        "inner_mm2": 3.0,
        "height_mm": 80,
        "fits": True,
        "best_among": True,
    }
    write_check(
        root,
        [
            finding("gap", "pass", value=1.0, limit=0.5, unit="mm"),
            finding("bridge", "warning", [[0, 0, 70]], 21.4, 21.0, "mm", assumed=True),
            finding("thinnest solid", "error", places, 0.2, 0.4, "mm", remedy="thicken it"),
            finding("not examined", "info", value=float("nan")),
        ],
        builds=[build, {**build, "islands": 3, "cup_ml": 0.0004}],
    )
    texts = drawn()
    assert "3 islands, cups below 0.01 ml" in texts
    assert texts.index("Thinnest solid  (2):  0.2 / 0.4 mm") < texts.index("Bridge:  21.4 / 21 mm")
    assert "The check found 1 error" in texts
    assert ": export asks first" in texts
    assert "7 islands, cups of 0.25 ml" in texts
    assert texts.index("Not examined") < texts.index("1 checks passed")
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.mu.print_show(finding=0) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="shown")
    view = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    view = view.spaces.active.region_3d
    assert (view.view_location - Vector((101, 2, 3))).length < 1e-4
    assert "Thicken it" in drawn()
    assert "place 1 of 2" in drawn()
    bpy.ops.mu.print_show(finding=0)
    assert (view.view_location - Vector((104, 5, 6))).length < 1e-4
    assert "place 2 of 2" in drawn()
    bpy.ops.mu.print_show(finding=0)
    assert "place 1 of 2" in drawn()
    bpy.ops.mu.print_show(finding=1)
    assert "This limit is assumed" in drawn().replace("  ", " ")
    assert "There are 4 findings" in refused(bpy.ops.mu.print_show, finding=9)
    assert "has 2 places" in refused(bpy.ops.mu.print_show, finding=0, place=2)

    by_finding = {m.get("mu_check"): m for m in marks.mark_objects(root)}
    assert set(by_finding) == {"0", "1", "up"}
    colours = [by_finding[k].data.materials[0].name for k in "01"]
    assert colours == ["MU Flaws", "MU Doubt"]
    graph = bpy.context.evaluated_depsgraph_get()

    def width():
        return by_finding["0"].evaluated_get(graph).dimensions.x - 3.0

    bpy.context.view_layer.update()
    assert abs(width() - 2 * 0.8) < 0.05
    bpy.ops.mu.print_show(finding=0)
    bpy.context.view_layer.update()
    assert abs(width() - 0.8 * (1 + marks.LARGER)) < 0.1  # the place that is looked at is larger
    bpy.ops.mu.print_show(finding=1)
    root.mu_print.marker = 2.0
    bpy.context.view_layer.update()
    assert abs(width() - 2 * 2.0) < 0.1
    up = by_finding["up"].rotation_quaternion @ Vector((0, 0, 1))
    assert (up - Vector((0, 0, 1))).length < 1e-5

    while marks.mark_objects(root):
        bpy.ops.ed.undo()
        (root,) = unit_object.roots()
    assert "No place is marked" in refused(bpy.ops.mu.print_clear)
    bpy.ops.mu.print_marks()
    root.mu_unit.chambers.wall_mm = 1.0  # a rebuild leaves them, and the panel says that they are old
    assert len(marks.mark_objects(root)) == 3
    assert "Stale: made with other parameters" in drawn()
    assert "The check is stale" in refused(bpy.ops.mu.print_marks)
    root.mu_unit.chambers.wall_mm = 0.9
    write_check(root, [finding("cup", "warning", [[0, 0, 0]])])
    assert "marks are from an earlier check" in drawn().replace("  ", " ")
    assert bpy.ops.mu.print_clear() == {"FINISHED"}
    assert not marks.mark_objects(root)

    assert bpy.ops.mu.print_up(direction=(0.6, 0, 0.8)) == {"FINISHED"}
    assert "Stale: made with another direction" in drawn()
    bpy.ops.mu.print_up()
    assert "Stale" not in drawn()
    bpy.ops.mu.path(name="alpha4")
    assert "Stale: made with other parameters" in drawn()
    bpy.ops.mu.path(name="none")
    own = tmp_path / "mine.toml"
    text = (printing.folder_of(root, "check") / "printer.toml").read_text()
    own.write_text(text.replace("value = 0.6", "value = 0.8"))
    root.mu_print.printer, root.mu_print.printer_file = "own", str(own)
    assert "Stale: made with another printer" in drawn()
    assert bpy.ops.mu.print_check.poll()
    own.write_text(text.replace("value = 0.6", "value = -1"))
    assert "value = -1 is out of bounds" in refused(bpy.ops.mu.print_check)
    root.mu_print.printer = "form-4-elastic-50a"
    sheet = tmp_path / "limits.csv"
    sheet.write_text("limit,sizes,measured\nwall_mm,0.2 0.9,0.5\n")
    root.mu_print.limits_file = str(sheet)
    assert printing.printer_of(root)["wall_mm"] == 0.5
    assert "Stale: made with another printer" in drawn()
    sheet.write_text("limit,sizes,measured\nwall_mm,0.2 0.9,5.0\n")
    assert "the part has 0.2 to 0.9" in refused(bpy.ops.mu.print_check)

    unit_object.delete(root)
    assert not [o for o in bpy.data.objects if "mu_check" in o]


def test_the_next_step_goes_from_the_ranking_to_the_files(home, tmp_path, monkeypatch):
    """The button at the top, each step once the one before it is done; with what was measured here."""
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    root = with_runs(home)

    def step():
        return drawn_by([unit_panel.MU_PT_unit])

    assert "Use Path α4" in step()
    bpy.ops.mu.path(name="alpha1")
    assert "Use Path α4" in step(), "the chosen path is a worse one"
    summary = studies.findings(root).run.folder / "summary.json"
    summary.write_text(json.dumps({**json.loads(summary.read_text()), "tied_with_chosen": ["alpha1"]}))
    assert "Use Path" not in step(), "a tied path is as good"
    assert "Build Solid" in step()
    assert bpy.ops.mu.solid() == {"FINISHED"}
    assert "Check Print" in step()
    assert "perhaps" in step().partition("Check Print")[2], "nothing was measured yet"
    timings.note("check interactive", {"part": 3.0, "check": 6.0, "report": 11.0})
    assert "Check Print, about 20 s" in step()
    assert "Check Print" not in drawn(), "one button of each: the panel points to the top"
    assert "The button is at the top" in drawn()

    write_check(root, [finding("drain", "warning")])
    assert "Export" in step()
    seconds = {"solid": 21.0, "stl": 2.0, "3mf": 7.0, "step": 100.0, "report": 1.0}
    timings.note(f"export {root.mu_print.quality}", seconds)
    assert "Export, about 30 s" in step(), "of the chosen formats alone"
    root.mu_print.formats = {"stl", "txt"}
    assert "Export, perhaps" in step(), "a format was never written here"

    folder = printing.EXPORT.folder_of(root)
    printing.EXPORT.write(root, folder)
    written = {"resin": {"ml": 1.0, "g": 1.0}, "files": [], "refused": []}
    (folder / MANIFEST).write_text(json.dumps({**written, "vents": None}))
    assert "Open the Files" in step()
    root.mu_unit.chambers.wall_mm = 1.05
    assert "Open the Files" not in step()
    assert "Simulate, " in step(), "another unit begins anew"


def test_an_export_as_chosen(tmp_path, monkeypatch):
    """Files of a real export, with the path and less what the printer adds; asked first where in error."""
    monkeypatch.setattr(timings, "_file", lambda: tmp_path / "timings.json")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    root = add()
    assert [name for name, *_ in printing.FORMATS] == list(FORMATS)
    bpy.ops.mu.path(name="alpha4")
    settings = root.mu_print
    settings.formats = set()
    assert "Choose at least one kind of file" in refused(bpy.ops.mu.print_export)
    settings.formats, settings.quality = {"stl", "txt"}, "interactive"
    settings.compensate = "gauge"
    assert "Choose the gauge's sheet" in refused(bpy.ops.mu.print_export)
    settings.compensate = "unit"
    assert "set them under Print Offsets" in refused(bpy.ops.mu.print_export)
    root.mu_unit.print.offset_xy_mm = 0.1
    bpy.ops.mu.mute(step="trim")
    assert "is not the unit" in refused(bpy.ops.mu.print_export)
    bpy.ops.mu.mute(step="trim", muted=False)
    assert "Waveguide along α4" in drawn().replace("  ", " ")
    assert "Not checked" in drawn()

    write_check(root, [finding("chamber wall", "error", [[0, 0, 0]], 0.2, 0.6, "mm")])
    asked = {}

    class Manager:
        def invoke_confirm(self, *_, **words):
            asked.update(words)
            return {"RUNNING_MODAL"}

        fileselect_add = invoke_confirm

    context, pressed = MagicMock(wraps=bpy.context, window_manager=Manager(), object=root), MagicMock()
    assert bpy.types.MU_OT_export_stl.invoke(pressed, context, None) == {"RUNNING_MODAL"}
    pressed.report.assert_called_once_with({"WARNING"}, "The check found: chamber wall. Do not print this")
    assert bpy.types.MU_OT_print_export.invoke(MagicMock(), context, None) == {"RUNNING_MODAL"}
    assert "chamber wall" in asked["message"]
    assert not jobs.running()

    assert bpy.ops.mu.print_export() == {"FINISHED"}
    done(root)
    texts = drawn()
    assert "unit.stl" in texts
    assert "nodes.txt" in texts
    assert "unit.3mf" not in texts
    assert "Done in" in texts
    assert "Export, about" not in texts
    timings.note(*timings.of_run(printing.folder_of(root, "export")))
    assert "Export, about" in drawn(), "by what it took"
    assert "Stale: they belong" not in texts
    root.mu_unit.chambers.wall_mm = 1.0
    assert "Stale: made with other parameters" in drawn()
    manifest = printing.EXPORT.found(root).folder / "manifest.json"
    whole = manifest.read_text()
    manifest.write_text("{}")
    assert printing.EXPORT.found(root) is None
    assert "unit.stl" not in drawn()
    manifest.write_text(whole)
    (folder,) = (tmp_path / "seat.mu").glob("*/export")
    manifest = json.loads((folder / MANIFEST).read_text())
    assert manifest["path"]["name"] == "alpha4"
    assert manifest["taken_off_mm"]["xy"] == pytest.approx(0.1)
    vertices, triangles = stl_surface((folder / "unit.stl").read_bytes())
    assert bad_edges(triangles) == 0
    assert np.ptp(vertices[:, 2]) == pytest.approx(81.0, abs=0.5)


def test_vents_for_the_direction_of_the_build():
    """As `export --vent-along`: upside down the chamber is a cup, which gets a hole and a plug."""
    root = short()
    settings = root.mu_print
    settings.formats, settings.quality = {"stl"}, "interactive"
    assert "Build direction:" not in drawn()
    settings.vents = True
    settings.up = (0.0, 0.0, 0.0)
    assert "Build direction: none is set" in drawn().replace("  ", " ")
    assert "(0.0, 0.0, 0.0) is not a direction" in refused(bpy.ops.mu.print_export)
    settings.up = (0.0, 0.0, -1.0)
    assert "Build direction: upside down" in drawn().replace("  ", " ")
    assert "have no vents" not in drawn()
    settings.formats = {"stl", "step"}
    assert "STEP have no vents" in drawn()
    assert printing.EXPORT.inputs(root).vent_along == (0.0, 0.0, -1.0)
    folder = printing.EXPORT.folder_of(root)
    printing.EXPORT.write(root, folder)
    plug = {"files": [{"file": "plug-1.stl", "bytes": 9}], "refused": [], "resin": {"ml": 1.0, "g": 1.0}}
    vents = {"vents": [{}], "trapped_before_ml": 6.0, "trapped_after_ml": 0.0}
    (folder / MANIFEST).write_text(json.dumps({**plug, "vents": vents}))
    assert "1 vent" in drawn()
    assert "plug-1.stl" in drawn()


@pytest.mark.nightly(
    "tests/studies/test_check_print.py::test_a_file_is_repaired_where_there_is_one_way_to_and_the_report_says_how"
)
def test_a_file_is_checked_and_repaired_before(tmp_path):
    """As `check --stl FILE --repair`: a cube with one face turned over."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "seat.blend"))
    root = add(preset="mu-0.75x")
    settings = root.mu_print
    assert "Choose the STL file" in refused(bpy.ops.mu.print_check_file)
    vertices = 12.0 * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces = np.array([*faces, [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])
    faces[0] = faces[0, ::-1]
    (tmp_path / "part.stl").write_bytes(stl_bytes(vertices, faces))
    settings.stl_file = str(tmp_path / "part.stl")
    assert bpy.ops.mu.print_check_file() == {"FINISHED"}
    child = done(root, state="failed")
    assert child.error["status"] == print_panel.NOT_PRINTABLE
    assert "1 triangle is flipped" in drawn()

    settings.repair = True
    assert "1 triangle is flipped" not in drawn().replace(child.error["what"], ""), "asked otherwise"
    assert bpy.ops.mu.print_check_file() == {"FINISHED"}
    done(root)
    texts = drawn()
    assert "Repaired: 1 " in texts
    folder = printing.FILE_CHECK.folder_of(root)
    assert np.linalg.det(_corners(folder / "part.stl")).sum() / 6.0 == pytest.approx(12.0**3)
    assert printing.CHECK.found(root) is None, "the unit itself was not checked"

    settings.against_unit = True
    assert bpy.ops.mu.print_check_file() == {"FINISHED"}
    done(root, state="failed")
    assert "times its nominal size" in drawn()


def _corners(path):
    vertices, triangles = stl_surface(path.read_bytes())
    return vertices[triangles]


def test_what_must_not_be_printed_is_an_answer_and_a_torn_file_is_none():
    root = add()
    child = fake(printing.PRINTING, root, "reported_error", printing.folder_of(root, "check"))
    ended(child)
    child.error["status"] = print_panel.NOT_PRINTABLE
    assert "Checked: not printable" in drawn()
    assert "thicker wall" not in drawn()
    # A torn file is no check.
    folder = printing.folder_of(root, "check")
    (folder / "check.json").write_text('{"findings": [')
    assert "Not checked yet" in drawn()


@pytest.mark.nightly(
    "tests/design/printing/test_faults.py::test_a_unit_in_a_user_defined_body_has_its_size_and_inches_are_still_found"
)
def test_a_body_of_ones_own_is_checked_by_its_solid():
    root = short()
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=20, depth=30, location=(0, 0, 14))
    root.select_set(True)
    assert bpy.ops.mu.body() == {"FINISHED"}
    bpy.context.view_layer.objects.active = root
    assert "only STL is written" in refused(bpy.ops.mu.print_export)
    assert bpy.ops.mu.print_check() == {"FINISHED"}
    child = printing.PRINTING.child(root)
    ended(child)
    found = printing.CHECK.found(root)
    assert found is not None, child.error
    assert not found.stale, child.error
    assert abs(found.content["figures"]["x_mm"] - 40.0) < 0.1
    bpy.ops.mu.body_remove()
    assert "Stale: made with other parameters" in drawn()


def test_the_words_of_a_direction_fit_beside_their_button():
    angles = np.radians(np.arange(0, 360, 5))
    tilts = np.radians([0, 20, 70, 90, 120, 180])
    every = [(np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)) for t in tilts for a in angles]
    assert max(len(print_panel.direction_words(direction)) for direction in every) <= 20


def test_layers_follow_the_slider_the_direction_and_the_solid():
    root = short()
    assert "Build the solid first" in refused(bpy.ops.mu.print_layer)
    assert bpy.ops.mu.solid() == {"FINISHED"}
    assert bpy.ops.mu.print_layer() == {"FINISHED"}
    shown = layer.layer_object(root)
    d = to_unit(root.mu_unit).dimensions

    def heights(axis):
        at = np.empty(3 * len(shown.data.vertices), np.float32)
        shown.data.vertices.foreach_get("co", at)
        return at.reshape(-1, 3)[:, axis]

    # At a bladder's apex, z = 1.5 U, what is enclosed is a disc of its inner radius.
    whole = d.height + d.inlet_length
    root.mu_print.layer = (1.5 * d.cell + d.inlet_length) / whole
    assert heights(2) == pytest.approx(1.5 * d.cell, abs=0.01)
    found = layer.facts(shown)
    assert found["whole_mm"] == pytest.approx(whole, abs=0.01)
    assert found["enclosed_mm2"] == pytest.approx(np.pi * (d.R - d.wall) ** 2, rel=0.02)
    faces = np.array([p.material_index for p in shown.data.polygons])
    areas = np.array([p.area for p in shown.data.polygons])
    assert areas[faces == 1].sum() == pytest.approx(found["enclosed_mm2"], rel=1e-3)
    assert areas[faces == 0].sum() == pytest.approx(found["area_mm2"], rel=1e-3)
    assert f"Enclosed (blue): {found['enclosed_mm2']:.0f} mm²" in drawn()
    # Along another direction the layer stands square to that.
    root.mu_print.up = (1.0, 0.0, 0.0)
    assert np.ptp(heights(0)) < 0.01
    # Across the axis the inlet opens the chamber: it is blue all the same.
    root.mu_print.layer = 0.5
    assert layer.facts(shown)["enclosed_mm2"] == pytest.approx(
        2 * signed_area(cavity_polygon(d, 64)), rel=0.02
    )
    root.mu_print.layer = 1.0
    assert len(shown.data.polygons) > 0
    root.mu_unit.chambers.wall_mm = 1.2
    assert "Of an earlier solid" in drawn()
    assert bpy.ops.mu.solid() == {"FINISHED"}
    assert "Of an earlier solid" not in drawn()
    assert bpy.ops.mu.print_layer_clear() == {"FINISHED"}
    assert layer.layer_object(root) is None
    assert "No layer is shown" in refused(bpy.ops.mu.print_layer_clear)
