"""Exports and specimens: written, read back by us and by others, and refused where they are broken."""

import hashlib
import io
import json
import tomllib
import zipfile
from types import SimpleNamespace

import attrs
import lib3mf
import numpy as np
import pytest
import trimesh

from mu_addon.design import surface
from mu_addon.design.anchors import window
from mu_addon.design.beams import lattice_beams
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Chambers, Unit, to_toml
from mu_addon.design.printing.printer import load_printer, printer_text, read_printer
from mu_addon.design.printing.sheets import compensation_offsets, gauge_sheet, measured_limits, read_sheet
from mu_addon.design.solid import build_solid
from mu_addon.design.surface import stl_surface
from mu_addon.design.threemf import Beams, Part, read_3mf, write_3mf
from mu_addon.design.waveguide import waveguide
from mu_addon.errors import InputError
from mu_addon.materials.library import load_material
from mu_addon.measured.folder import read_folder
from mu_addon.meshing import gmsh_model
from mu_addon.studies.export import Export, deformed_in
from mu_addon.studies.inputs import NodePath, path_of
from mu_addon.studies.specimens import Specimens

from .bent_motion import ANGLES, PRESSURES, bent, write_bent_motion
from .unit_runs import ended

SMALL = Unit(name="three", chambers=Chambers(count=3))
RESIN = load_material("elastic-50a-v1")


def coarse(**inputs):
    return Export(unit=SMALL, quality="interactive", **inputs)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    context, _ = ended(coarse(path=window(SMALL, "alpha1")), folder, False)
    assert context.status == 0
    return folder, json.loads((folder / "manifest.json").read_text())


def test_the_unit_is_written_as_a_run_bent_it(tmp_path):
    """Each section of the motion turns by its share of the tip's angle, and so does the printed surface."""
    run_of = tmp_path / "run"
    mesh = write_bent_motion(run_of, unit=SMALL)
    (run_of / "unit.toml").write_text(to_toml(SMALL))
    job = coarse(formats=(), deformed=deformed_in(run_of, SMALL, 20.0))
    context, _ = ended(job, tmp_path / "out", False)
    assert context.status == 0
    assert Export.read(tmp_path / "out").texts() == job.texts()
    vertices, triangles = stl_surface((tmp_path / "out" / "unit_at_20_kPa.stl").read_bytes())
    drawn = build_solid(SMALL, quality="interactive")
    corners = drawn.vertices[drawn.triangles].reshape(-1, 3)
    above = corners[:, 2] > 0.0
    points = np.vstack([corners, [0.0, 0.0, SMALL.dimensions.height]])
    nodes = SimpleNamespace(nodes=points, beams=mesh.beams[:0])
    angle = ANGLES[list(PRESSURES).index(20.0)]
    expected = corners + bent(nodes, angle)[:-1]
    # Linear elements miss the turn's curvature by at most 3/8 of their squared length times it; curved less.
    edges = mesh.nodes[mesh.tets[:, [0, 0, 0, 1, 1, 2]]] - mesh.nodes[mesh.tets[:, [1, 2, 3, 2, 3, 3]]]
    turn = np.radians(angle) / SMALL.dimensions.height
    curvature = 2.0 * turn + np.abs(mesh.nodes).max() * turn**2
    bound = 0.375 * (edges**2).sum(axis=2).max() * curvature
    off = np.linalg.norm(vertices[triangles].reshape(-1, 3) - expected, axis=1)[above]
    assert off.max() < bound < 0.2 * np.linalg.norm(expected - corners, axis=1).max()
    with pytest.raises(InputError, match="no state at 21 kPa"):
        deformed_in(run_of, SMALL, 21.0)
    with pytest.raises(InputError, match="another unit"):
        deformed_in(run_of, Unit(), 20.0)


def test_everything_is_there_and_as_the_manifest_says(exported):
    folder, manifest = exported
    assert [f["file"] for f in manifest["files"]] == [
        "unit.stl",
        "unit.3mf",
        "unit-beams.3mf",
        "cavity.step",
        "membrane.step",
        "envelope.step",
        "waveguide.step",
        "nodes.txt",
    ]
    for entry in manifest["files"]:
        content = (folder / entry["file"]).read_bytes()
        assert entry["bytes"] == len(content)
        assert entry["sha256"] == hashlib.sha256(content).hexdigest()
    assert manifest["refused"] == []
    assert [a["file"] for a in manifest["assembly"]] == [
        "envelope.step",
        "membrane.step",
        "waveguide.step",
        "cavity.step",
    ]
    assert manifest["resin"]["g"] == pytest.approx(manifest["solid"]["volume_mm3"] / 1e3 * 1.01)
    errors = {f["file"]: f["read_back"].get("volume_error") for f in manifest["files"]}
    assert abs(errors["unit.stl"]) < 1e-4
    assert abs(errors["unit.3mf"]) < 1e-4
    assert all(abs(errors[f"{name}.step"]) < 5e-4 for name in ("cavity", "membrane", "envelope", "waveguide"))


def test_parabolas_stay_parabolas_in_step(exported):
    """Each outer arc sweeps a surface of revolution over a curve of degree 2, in millimetres."""
    text = (exported[0] / "membrane.step").read_text()
    assert text.count("B_SPLINE_CURVE_WITH_KNOTS('',2") >= 3 * 4
    assert text.count("SURFACE_OF_REVOLUTION") >= 3 * 4 + 3 * 4
    assert "SI_UNIT(.MILLI.,.METRE.)" in text


def test_both_packages_are_read_by_the_consortiums_own_library(exported):
    wrapper = lib3mf.get_wrapper()
    for name, meshes in (("unit.3mf", 1), ("unit-beams.3mf", 4)):
        model = wrapper.CreateModel()
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(True)
        reader.ReadFromFile(str(exported[0] / name))
        assert reader.GetWarningCount() == 0
        found = model.GetMeshObjects()
        count = 0
        while found.MoveNext():
            count += 1
            mesh = found.GetCurrentMeshObject()
            assert mesh.IsManifoldAndOriented() or mesh.BeamLattice().GetBeamCount()
        assert count == meshes


def test_beams_fill_what_the_lattice_fills():
    """Frusta with round ends, united and cut to the box, against the bare lattice's volume."""
    from manifold3d import Manifold, OpType

    from mu_addon.design import shapes
    from mu_addon.design.solid import QUALITY, lattice_solid

    d = SMALL.dimensions
    lattice = lattice_of(d)
    wide = attrs.evolve(d, R=1e-3, r=5e-4)  # no actuator, so that no strut is left out
    beams = lattice_beams(wide)
    assert len(beams.pairs) == 8 * len(lattice.struts)
    n = QUALITY["interactive"].around_strut
    parts = []
    for (a, b), (r, q) in zip(beams.nodes[beams.pairs], beams.radii, strict=True):
        parts.append(shapes.spindle(b - a, np.array([r, q]), n).translate(a.tolist()))
    parts += [shapes.ball(d.junction_diameter / 2, n).translate(node.tolist()) for node in lattice.nodes]
    united = Manifold.batch_boolean(parts, OpType.Add) ^ shapes.box(*np.array(d.bounds).T)
    fine = lattice_solid(d, lattice, attrs.evolve(QUALITY["interactive"], along_strut=8))
    assert united.volume() == pytest.approx(fine.volume(), rel=0.003)


def test_beams_leave_out_the_path_and_raise_its_neighbours():
    unit = attrs.evolve(SMALL, scale=0.75)
    bar = waveguide(unit, window(unit, "alpha1"))
    plain, sensed = lattice_beams(unit.dimensions), lattice_beams(unit.dimensions, bar)
    assert len(sensed.pairs) == len(plain.pairs)
    assert sensed.volume > plain.volume
    assert sensed.radii.max() == pytest.approx(0.75)


def box():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Part("box & <co>", corners, np.array([t for q in quads for t in (q[:3], [q[0], q[2], q[3]])]))


def test_a_package_comes_back_as_it_was_written():
    beams = Beams(np.array([[0, 0, 2], [0, 0, 3.5]]), np.array([[0, 1]]), np.array([[0.3, 0.4]]))
    written = write_3mf([box(), Part("one", beams=beams, clipped_to=1)], [1, 2], 'a "title"')
    assert written == write_3mf([box(), Part("one", beams=beams, clipped_to=1)], [1, 2], 'a "title"')
    objects, printed = read_3mf(written)
    assert printed == [1, 2]
    assert objects[1].name == "box & <co>"
    assert np.array_equal(objects[1].vertices, box().vertices)
    assert np.array_equal(objects[1].triangles, box().triangles)
    assert objects[2].clipped_to == 1
    assert objects[2].beams.volume == pytest.approx(np.pi * 1.5 / 3 * (0.09 + 0.12 + 0.16))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit="millimeter"', 'unit="inch"', "its unit is inch"),
        ('v3="2"', 'v3="99"', "vertex is missing"),
        ('v1="0" v2="1" v3="3"', 'v1="1" v2="1" v3="3"', "a repeated vertex"),
        ("/core/2015/02", "/core/1999/02", "another namespace"),
        ('<item objectid="1"/>', "", "the build list is empty"),
        ("</model>", "", "not a 3MF package"),
    ],
)
def test_a_package_that_breaks_a_rule_is_refused(old, new, words):
    spoilt = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(write_3mf([box()], [1], "t"))) as sound,
        zipfile.ZipFile(spoilt, "w") as package,
    ):
        for name in sound.namelist():
            text = sound.read(name).decode()
            if name.endswith(".model"):
                assert old in text
                text = text.replace(old, new)
            package.writestr(name, text)
    with pytest.raises(InputError, match=words):
        read_3mf(spoilt.getvalue())


def test_without_gmsh_the_rest_is_written(tmp_path, monkeypatch):
    def missing(*_):
        raise gmsh_model.GmshUnavailable("gmsh cannot load libGLU.so.1", remedy="install libglu1-mesa")

    monkeypatch.setattr("mu_addon.meshing.step_file.load_gmsh", missing)
    context, messages = ended(coarse(formats=("stl", "step", "txt")), tmp_path, False)
    assert context.status == 0
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert [f["file"] for f in manifest["files"]] == ["unit.stl", "nodes.txt"]
    assert manifest["refused"][0]["why"] == "gmsh cannot load libGLU.so.1"
    assert any(
        m["type"] == "warning" and "libglu1-mesa" in m["text"] for m in messages if "text" in m
    ) or any("libglu1-mesa" in str(m) for m in messages)
    assert not list(tmp_path.glob("*.step"))


def test_a_file_that_is_not_what_was_built_is_an_error(tmp_path, monkeypatch):
    real = surface.stl_bytes
    monkeypatch.setattr(surface, "stl_bytes", lambda v, t: real(v * 1.001, t))
    context, _ = ended(coarse(formats=("stl",)), tmp_path, False)
    assert context.status == 5
    assert not (tmp_path / "unit.stl").exists()
    assert "read back, encloses" in json.loads((tmp_path / "summary.json").read_text())["reason"]["what"]


def test_a_path_is_a_window_or_a_row_of_the_search(tmp_path):
    assert path_of(SMALL, "") is None
    assert path_of(SMALL, "alpha1").name == "alpha1"
    table = tmp_path / "paths.csv"
    table.write_text("path,points_mm\npath7,0 25 6.25; 0 25 18.75\npath9,0 25 6.25; 6.25 18.75 12.5\n")
    assert path_of(SMALL, str(table)) == NodePath("path7", ((0, 25, 6.25), (0, 25, 18.75)))
    assert path_of(SMALL, str(table), "path9").name == "path9"
    for text, words in (("path,points_mm\n", "there is no path"), ("path\npath7\n", "points_mm")):
        table.write_text(text)
        with pytest.raises(InputError, match=words):
            path_of(SMALL, str(table))
    with pytest.raises(InputError, match="cannot read the paths"):
        path_of(SMALL, str(tmp_path / "none.csv"))


def test_calliper_sheets_become_offsets(tmp_path):
    path = tmp_path / "gauge.csv"
    rows = [line.split(",") for line in gauge_sheet().splitlines()]
    for row in rows[1:]:
        offset = 0.08 if row[2] == "z" else 0.15
        row[4] = f"{float(row[3]) + (2 if row[1] == 'solid' else -2) * offset:.3f}"
    path.write_text("\n".join(",".join(row) for row in rows))
    found, source = compensation_offsets(SMALL, str(path))
    assert found == pytest.approx((0.15, 0.08), abs=1e-3)
    assert source.startswith("gauge.csv: 0.150 +- 0.00")
    path.write_text(gauge_sheet())
    with pytest.raises(InputError, match="0 sizes were measured"):
        read_sheet(path)
    path.write_text(gauge_sheet().replace("0.9,\n", "0.9,9.0\n"))
    with pytest.raises(InputError, match="x1 measured as"):
        read_sheet(path)
    with pytest.raises(InputError, match="no print offset"):
        compensation_offsets(SMALL, "unit")
    assert compensation_offsets(SMALL, None) == ((0.0, 0.0), "")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("specimens")
    context, _ = ended(Specimens(unit=Unit(), resin=RESIN, printer=load_printer()), folder)
    assert context.status == 0
    return folder, json.loads((folder / "manifest.json").read_text())


def test_specimens_weigh_what_they_should(printed):
    folder, manifest = printed
    rows = {row["name"]: row for row in manifest["specimens"]}
    own = [name for name in rows if not name.startswith("limit-")]
    assert own == ["gauge", "cube-0.75x", "cube-1x", "cube-1.5x", "strut", "wall", "beam", "waveguide"]
    assert len(rows) - len(own) == 13
    for scale in (0.75, 1.0, 1.5):
        row = rows[f"cube-{scale:g}x"]
        assert row["size_mm"] == pytest.approx([37.5 * scale] * 3)
        # The relative density of the paper's cell, 9.90 %, at every scale.
        assert row["mass_g"] == pytest.approx(0.0990 * (3.75 * scale) ** 3 * 1.01, rel=0.005)
    import trimesh

    for row in manifest["specimens"]:
        mesh = trimesh.load(folder / row["file"])
        assert mesh.is_watertight
        assert mesh.volume / 1e3 * 1.01 == pytest.approx(row["mass_g"], rel=1e-4)


def filled(folder, path, **measured):
    """The sheet of limits with some of its rows filled in."""
    lines = (folder / "limits.csv").read_text().splitlines()
    path.write_text("\n".join(f"{line}{measured.get(line.partition(',')[0], '')}" for line in lines) + "\n")
    return path


def test_limits_that_were_measured_take_the_place_of_those_that_were_not(printed, tmp_path):
    printer = load_printer()
    sheet = filled(
        printed[0], tmp_path / "limits.csv", wall_mm="0.42", bridge_mm="15", density_g_per_ml="1.03"
    )
    found = printer.with_limits(measured_limits(sheet))
    changed = {name for name in printer.limits if found.limits[name] != printer.limits[name]}
    assert changed == {"wall_mm", "bridge_mm", "density_g_per_ml"}
    assert found["wall_mm"] == 0.42
    assert found["density_g_per_ml"] == 1.03
    assert found.limits["wall_mm"].standing == "measured"
    assert not found.limits["wall_mm"].assumed
    assert found.limits["gap_mm"].standing == "assumed"
    # It is kept with what is checked, and read again.
    (tmp_path / "printer.toml").write_text(printer_text(found))
    assert read_printer(tmp_path / "printer.toml") == found


@pytest.mark.parametrize(
    ("measured", "message"),
    [
        ({}, "no limit was measured"),
        ({"wall_mm": "thin"}, "wall_mm measured as 'thin'; the part has 0.24 to 0.9"),
        ({"wall_mm": "0.1"}, "wall_mm measured as '0.1'"),
        ({"wall_mm": "nan"}, "wall_mm measured as 'nan'"),
        ({"density_g_per_ml": "8.24"}, "density_g_per_ml measured as '8.24'"),
    ],
)
def test_a_sheet_of_limits_that_says_nothing_sensible_is_refused(printed, tmp_path, measured, message):
    with pytest.raises(InputError, match=message):
        measured_limits(filled(printed[0], tmp_path / "limits.csv", **measured))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("limit,sizes,measured\nwall,1 2,1\n", "there is no limit 'wall'"),
        ("limit,sizes,measured\nwall_mm,1 2,1\nwall_mm,1 2,2\n", "given twice"),
        ("limit,sizes,measured\nwall_mm,,1\n", "has no sizes"),
        ("limit,sizes,measured\nwall_mm,1 x,1\n", "has no sizes"),
    ],
)
def test_a_sheet_of_limits_that_was_edited_too_much_is_refused(tmp_path, text, message):
    (tmp_path / "limits.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        measured_limits(tmp_path / "limits.csv")


def test_the_template_is_a_folder_of_measured_data_but_for_its_rows(printed):
    folder = printed[0] / "measured"
    entries = tomllib.loads((folder / "experiments.toml").read_text())["experiment"]
    assert {e["kind"] for e in entries} == {
        "lattice_compression",
        "coupon",
        "beam_deadweight",
        "waveguide_bending",
    }
    for number, entry in enumerate(entries, 1):
        columns = (folder / entry["file"]).read_text().strip().split(",")
        rows = [[str(0.01 * number * (k + 1)) for _ in columns] for k in range(5)]
        (folder / entry["file"]).write_text("\n".join(",".join(r) for r in [columns, *rows]) + "\n")
    found = read_folder(folder)
    assert len(found.experiments) == len(entries) == 3 * 3 + 3 + 3 + 2
    assert (printed[0] / "report.html").read_text().count("<tr") > 20
    # What is filled in stays when the specimens are written again.
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    ended(Specimens(unit=Unit(), resin=RESIN, printer=load_printer()), printed[0], False)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    for scale in (0.75, 1.5):
        unit = attrs.evolve(Unit(), scale=scale)
        ended(Specimens(unit=unit, resin=None, printer=load_printer()), printed[0], False)
    now = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert {name: now[name] for name in before} == before
    # The resin of the first run is not that of the last.
    assert Specimens.read(printed[0]).resin is None


def test_vents_for_a_build_direction_are_cut_and_their_plugs_written(tmp_path):
    context, messages = ended(coarse(formats=("stl", "step"), vent_along=(0.0, 0.0, -1.0)), tmp_path, False)
    assert context.status == 0
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert "plug-1.stl" in [f["file"] for f in manifest["files"]]
    vents = manifest["vents"]
    assert vents["trapped_before_ml"] > 5.0
    assert vents["trapped_after_ml"] < 0.1
    assert len(vents["vents"]) == 1
    part = trimesh.load(tmp_path / "unit.stl")
    plug = trimesh.load(tmp_path / "plug-1.stl")
    for read in (part, plug):
        assert read.is_watertight
        assert read.body_count == 1
    # One tunnel more than without the vent, and the file is the one that the manifest measured.
    plain = build_solid(SMALL)
    assert (plain.gates.genus + 1, manifest["solid"]["gates"]["genus"]) == (
        manifest["solid"]["gates"]["genus"],
        1 - part.euler_number // 2,
    )
    assert any("step has no vents" in m.get("what", "") for m in messages)
    assert Export.read(tmp_path).vent_along == (0.0, 0.0, -1.0)


def test_no_vent_where_nothing_is_trapped_and_a_reason_where_none_can_be(tmp_path):
    job = coarse(formats=("stl",), vent_along=(0.0, 0.0, 1.0))
    context, messages = ended(job, tmp_path / "up", False)
    assert context.status == 0
    assert any("no vent is needed" in m.get("what", "") for m in messages)
    assert not list((tmp_path / "up").glob("plug*"))
    context, messages = ended(attrs.evolve(job, vent_along=(1.0, 0.0, 0.0)), tmp_path / "side", False)
    assert context.status == 6
    assert "can have no vent" in messages[-1]["what"]
    assert not (tmp_path / "side" / "unit.stl").exists()
    with pytest.raises(InputError, match="not a direction"):
        coarse(vent_along=(1e-9, 0.0, 0.0))
    with pytest.raises(InputError, match="no format 'stp'; did you mean 'step'"):
        coarse(formats=("stp",))
