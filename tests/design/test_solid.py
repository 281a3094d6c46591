import hashlib
import subprocess
import sys
from functools import cache

import attrs
import numpy as np
import pytest

from mu_addon.design import gates, shapes, solid, surface
from mu_addon.design.anchors import window
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Chambers, Envelope, Unit, Waveguide, load_preset
from mu_addon.design.stl_and_nodes import write_nodes, write_stl
from mu_addon.errors import InputError

PRESETS = ("mu-0.75x", "mu-1.0x", "mu-1.5x")
OTHER_SIZE = pytest.mark.nightly("test_presets_pass_every_gate")


@cache
def built(name, path=None, quality="interactive"):
    unit = load_preset(name)
    return solid.build_solid(unit, window(unit, path) if path else None, quality)


def digest(s):
    return hashlib.sha256(surface.stl_bytes(s.vertices, s.triangles)).hexdigest()


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("mu-0.75x", marks=OTHER_SIZE),
        "mu-1.0x",
        pytest.param("mu-1.5x", marks=OTHER_SIZE),
    ],
)
def test_presets_pass_every_gate(name):
    g = built(name).gates
    assert g.lattice_genus == g.lattice_genus_expected == 365
    assert (g.lattice_components, g.components, g.inner_shells) == (1, 1, 1)
    assert (g.bad_edges, g.bad_edges_after_stl) == (0, 0)
    assert abs(g.inner_volume_error) < 0.01
    assert g.genus == 394


def test_written_stl_is_watertight_for_another_reader(tmp_path):
    import trimesh

    s = built("mu-1.0x", "alpha4")
    write_stl(s, tmp_path / "unit.stl")
    mesh = trimesh.load(tmp_path / "unit.stl")
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert len(mesh.split(only_watertight=False)) == 1
    assert mesh.volume == pytest.approx(s.gates.volume_mm3, rel=1e-5)
    low, high = np.array(load_preset("mu-1.0x").dimensions.bounds).T
    assert mesh.bounds[0] == pytest.approx([low[0], low[1], -6.0], abs=1e-4)
    assert mesh.bounds[1] == pytest.approx(high, abs=1e-4)


def test_solid_is_the_same_in_another_process():
    code = (
        "import hashlib\n"
        "from mu_addon.design import solid, surface\n"
        "from mu_addon.design.anchors import window\n"
        "from mu_addon.design.parameters import load_preset\n"
        "u = load_preset('mu-1.0x')\n"
        "s = solid.build_solid(u, window(u, 'alpha4'))\n"
        "print(hashlib.sha256(surface.stl_bytes(s.vertices, s.triangles)).hexdigest())\n"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == digest(built("mu-1.0x", "alpha4"))


def test_bodies_of_revolution_keep_their_volume():
    """Actuator and cavity, cut into facets, keep their analytic volumes, the better the finer."""
    from mu_addon.design.profile import cavity_polygon, cavity_volume, outer_polygon, outer_volume

    d = load_preset("mu-1.0x").dimensions
    for polygon, volume in ((outer_polygon, outer_volume), (cavity_polygon, cavity_volume)):
        coarse = shapes.revolved(polygon(d, 6), 64).volume()
        fine = shapes.revolved(polygon(d, 24), 64).volume()
        assert fine == pytest.approx(volume(d), rel=2e-4)
        assert abs(fine / volume(d) - 1) < 0.2 * abs(coarse / volume(d) - 1)


def test_facets_keep_area_and_volume():
    assert shapes.cylinder(2.0, -1.0, 3.0, 12).volume() == pytest.approx(16 * np.pi)
    assert shapes.ball(1.5, 12).volume() == pytest.approx(4.5 * np.pi)
    straight = shapes.spindle(np.array([1.0, 2.0, 2.0]), np.full(5, 0.5), 12)
    assert straight.volume() == pytest.approx(0.75 * np.pi)
    tapered = shapes.spindle(np.array([0.0, 3.0, 0.0]), np.array([1.0, 2.0]), 12)
    assert tapered.volume() == pytest.approx(np.pi * (1 + 2 + 4))


def test_waveguide_adds_its_bar_and_takes_its_wells():
    """Wells a whole cell apart all fall on junctions and are left out; six of 1.5 x 1 x 0.65 mm come back."""
    unit = load_preset("mu-1.0x")
    plain = solid.build_solid(
        attrs.evolve(unit, waveguide=attrs.evolve(unit.waveguide, well_pitch_mm=12.5)), window(unit, "alpha4")
    )
    wells = built("mu-1.0x", "alpha4")
    assert plain.gates.volume_mm3 - wells.gates.volume_mm3 == pytest.approx(6 * 1.5 * 1.0 * 0.65, rel=0.01)


def test_mass_is_volume_times_density():
    made = built("mu-0.75x")
    enclosed = gates.volume(made.vertices, made.triangles)
    assert made.volume_mm3 == pytest.approx(enclosed, rel=1e-6)
    assert made.mass_g(1.1) == pytest.approx(1.1e-3 * enclosed, rel=1e-6)


def test_unknown_quality_is_refused():
    with pytest.raises(InputError, match="no quality 'fine'"):
        solid.build_solid(Unit(), quality="fine")


def rebuilt(monkeypatch, **changes):
    """Build the small unit with parts of the assembly sabotaged."""
    for name, value in changes.items():
        monkeypatch.setattr(solid, name, value)
    return solid.build_solid(Unit(chambers=Chambers(count=3)))


def test_a_closed_inlet_is_caught(monkeypatch):
    """A bore that stops short leaves a sealed void: two shells."""
    full = shapes.cylinder
    monkeypatch.setattr(
        shapes, "cylinder", lambda r, low, high, n: full(r, low, 0.5 if r == 2.0 else high, n)
    )
    with pytest.raises(gates.GateError, match="gate: one component"):
        rebuilt(monkeypatch)


def test_a_leak_is_caught(monkeypatch):
    """A cavity that breaks through the wall joins inside and outside once more."""
    from mu_addon.design.profile import cavity_polygon

    def swollen(d, per_arc, offset=None):
        polygon = cavity_polygon(d, per_arc, offset)
        return polygon * np.where(np.abs(polygon[:, 1:] - d.cell / 2) < 1.0, [1.1, 1.0], [1.0, 1.0])

    with pytest.raises(gates.GateError, match="gate: one cavity"):
        rebuilt(monkeypatch, cavity_polygon=swollen)


def test_a_wrong_cavity_is_caught(monkeypatch):
    from mu_addon.design.profile import cavity_polygon

    with pytest.raises(gates.GateError, match="gate: cavity volume"):
        rebuilt(monkeypatch, cavity_polygon=lambda d, *rest: cavity_polygon(attrs.evolve(d, wall=0.6), *rest))


def test_a_missing_strut_is_caught(monkeypatch):
    def cut(*taken):
        hole = shapes.box([-11, 26.6, 1.6], [-8, 29.6, 4.6])
        return original(*taken) - hole

    original = solid.lattice_solid
    with pytest.raises(gates.GateError, match="gate: lattice genus"):
        rebuilt(monkeypatch, lattice_solid=cut)


def test_a_loose_body_is_caught(monkeypatch):
    original = solid.lattice_solid
    with pytest.raises(gates.GateError, match="gate: lattice in one piece"):
        rebuilt(monkeypatch, lattice_solid=lambda *a: original(*a) + shapes.box([30, 30, 0], [31, 31, 1]))


@pytest.mark.parametrize(
    ("change", "gate"),
    [
        ({"bad_edges": 2}, "closed surface"),
        ({"bad_edges_after_stl": 2}, "watertight STL"),
        ({"inner_shells": 2}, "one cavity"),
    ],
)
def test_each_number_is_a_gate(change, gate):
    gates.require_solid(built("mu-1.0x").gates)
    with pytest.raises(gates.GateError, match=f"gate: {gate}"):
        gates.require_solid(attrs.evolve(built("mu-1.0x").gates, **change))


def test_an_open_surface_is_caught():
    s = built("mu-1.0x")
    with pytest.raises(gates.GateError, match="gate: closed surface"):
        gates.check_solid(s.vertices, s.triangles[1:], None, 1.0, (0, 1), 0)


VARIED = {
    # Its facets touch along edges of four triangles unless slivers are collapsed before welding.
    "touching facets": Unit(
        scale=0.75,
        chambers=Chambers(
            count=4,
            cell_mm=19.851030585646917,
            bladder_diameter_mm=39.702061171293835,
            neck_diameter_mm=23.464654220516834,
            bladder_share=0.5654780901870173,
            wall_mm=0.7313064383821848,
            base_cap_mm=0.5123173473396794,
            tip_cap_mm=1.862069245634315,
            inlet_diameter_mm=3.1293473605183006,
            inlet_wall_mm=1.5131301793457976,
        ),
        lattice=Envelope(
            cells_x=5,
            cells_y_minus=2,
            cells_y_plus=4,
            junction_diameter_mm=2.4489724596415576,
            midspan_diameter_mm=3.647766869817609,
        ),
    ),
    "thickest wall": Unit(chambers=Chambers(count=3, wall_mm=1.874)),
    "bar on the apices": Unit(chambers=Chambers(count=3), waveguide=Waveguide(row=1)),
    "bar on the other side": Unit(chambers=Chambers(count=4), waveguide=Waveguide(row=-1)),
    "wide": Unit(
        scale=0.6, chambers=Chambers(count=3), lattice=Envelope(cells_x=5, cells_y_minus=2, cells_y_plus=4)
    ),
    "thick struts": Unit(scale=2.0, chambers=Chambers(count=3), lattice=Envelope(midspan_diameter_mm=7.0)),
}


@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(unit, marks=[pytest.mark.nightly("test_other_units_pass_the_gates")] * (name == "wide"))
        for name, unit in VARIED.items()
    ],
    ids=VARIED,
)
def test_other_units_pass_the_gates(unit):
    s = solid.build_solid(unit, window(unit, "alpha1"))
    assert s.gates.lattice_genus == lattice_of(unit.dimensions).cycles


@pytest.mark.nightly("test_presets_pass_every_gate")
def test_export_quality_has_the_same_topology():
    coarse, fine = built("mu-1.0x", "alpha4").gates, built("mu-1.0x", "alpha4", "export").gates
    assert fine.genus == coarse.genus
    assert fine.lattice_genus == coarse.lattice_genus
    assert fine.volume_mm3 == pytest.approx(coarse.volume_mm3, rel=0.01)
    assert abs(fine.inner_volume_error) < 0.3 * abs(coarse.inner_volume_error)


def test_node_file_lists_every_node_and_marks_the_anchors(tmp_path):
    unit = load_preset("mu-1.5x")
    write_nodes(unit, tmp_path / "anchors.txt")
    lines = (tmp_path / "anchors.txt").read_text().splitlines()
    header = [line for line in lines if line.startswith("#")]
    rows = [line.split() for line in lines if not line.startswith("#")]
    assert header[-1] == "# id kind x_mm y_mm z_mm"
    lattice = lattice_of(unit.dimensions)
    assert [int(row[0]) for row in rows] == list(range(len(lattice.nodes)))
    assert np.array([row[2:] for row in rows], float) == pytest.approx(lattice.nodes, abs=1e-6)
    from mu_addon.design.anchors import anchor_points

    marked = {row[1]: [float(x) for x in row[2:]] for row in rows if row[1].startswith("P")}
    assert list(marked) == ["P1", "P2", "P3", "P4", "P5", "P6"]
    assert np.array(list(marked.values())) == pytest.approx(anchor_points(unit))
    assert sum(row[1] == "corner" for row in rows) == 4 * 5 * 7
