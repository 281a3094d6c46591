"""Faults put into a real unit at a known place: each is found, within a millimetre of it."""

from functools import cache

import attrs
import numpy as np
import pytest

from mu_addon.design import shapes
from mu_addon.design.body import envelope
from mu_addon.design.lattice import lattice_of
from mu_addon.design.printing.check import check
from mu_addon.design.printing.printer import load_printer, printer_text, read_printer
from mu_addon.design.solid import build_solid, printable
from mu_addon.errors import InputError

from ..bodies import cylinder
from . import parts
from .parts import APEX

FREE = np.array([12.5, 6.25, 18.75])  # the middle of a lattice window, 6 mm from every strut's axis


def faults(surface, *stages, unit=None):
    """Faults by name of a surface checked through the stages."""
    found = check(*surface, load_printer(), unit, stages=stages)
    return {f.check: f for f in found.findings if f.is_fault}


@cache
def clean():
    unit = parts.small_unit()
    solid = parts.small_solid()
    return check(
        solid.vertices, solid.triangles, load_printer(), unit, stages=("thickness", "chambers", "layers")
    )


def off(finding, place):
    return np.linalg.norm(finding.places[0] - place)


def test_a_sound_unit_has_none_of_them():
    found = clean()
    assert [f.check for f in found.findings if f.severity == "error"] == []
    # These are true of it: supports under the lattice's feet and the base, and a wide flat ceiling.
    assert {f.check for f in found.findings if f.is_fault} == {"islands", "overhang", "bridge"}
    by_name = {f.check: f for f in found.findings}
    assert by_name["chamber wall"].value == pytest.approx(0.9, abs=0.02)
    assert by_name["drain"].value == pytest.approx(4.0, abs=0.05)
    # Twenty corner nodes stand on nothing; the inlet's boss is the first layer.
    assert by_name["islands"].count == 20
    assert np.abs(by_name["islands"].places[:, 2]).max() < 0.1


@pytest.mark.parametrize(
    "diameter", [pytest.param(0.8, marks=pytest.mark.nightly("test_a_hole_in_the_wall")), 0.1]
)
def test_a_hole_in_the_wall(diameter):
    """A cell of the grid shows the large one; the small one is found as the shortest curve to cut."""
    found = faults(parts.drilled(diameter), "chambers", unit=parts.small_unit())
    assert set(found) == ({"leaks", "leak test"} if diameter > 0.5 else {"leak test"})
    assert off(found["leak test"], APEX) < 1.0
    if "leaks" in found:
        assert "0.8 mm wide" in found["leaks"].what


@pytest.mark.slow
def test_a_hole_is_a_second_way_out_of_a_part_that_nobody_knows():
    found = faults(parts.drilled(0.8), "chambers")
    assert found["leaks"].severity == "warning"
    assert off(found["leaks"], APEX) < 1.0


@pytest.mark.nightly("test_a_thin_wall")
def test_a_wall_drawn_at_the_limit_is_not_refused_for_its_facets():
    """Drawn as thick as the limit it is thick enough; a little thinner, and as an STL alone, it is not."""
    unit, solid = parts.small_unit(), parts.small_solid()

    def found(limit, unit):
        printer = load_printer()
        printer = printer.with_limits({"wall_mm": attrs.evolve(printer.limits["wall_mm"], value=limit)})
        surface = solid.vertices, solid.triangles
        findings = check(*surface, printer, unit, stages=("thickness", "chambers")).findings
        return next(f for f in findings if f.check == "chamber wall")

    drawn = unit.dimensions.thinnest_wall
    at_limit = found(drawn, unit)
    assert at_limit.severity == "pass"
    assert drawn - 0.002 * unit.dimensions.R < at_limit.value < drawn
    assert "facets" in at_limit.what
    assert found(drawn + 0.01, unit).severity == "error"
    assert found(drawn, None).severity == "error"


def test_a_thin_wall():
    found = faults(parts.thin_walled(0.2), "thickness", "chambers", unit=parts.small_unit())
    assert {"thinnest solid", "chamber wall"} == set(found)
    assert found["thinnest solid"].value == pytest.approx(0.2, abs=0.03)
    assert off(found["chamber wall"], APEX) < 1.0


@pytest.mark.nightly("test_a_narrow_drain")
def test_a_closed_drain():
    found = faults(parts.plugged(), "chambers", unit=parts.small_unit())
    assert {"sealed voids", "leak test", "drain"} == set(found)
    assert off(found["drain"], [0.0, 0.0, -3.0]) < 0.1
    # Of a part that nobody knows, the void itself is shown.
    alone = faults(parts.plugged())
    assert abs(alone["sealed voids"].places[0][:2]).max() < 0.1


@pytest.mark.slow
def test_a_narrow_drain():
    found = faults(parts.narrowed(1.5), "chambers", unit=parts.small_unit())
    assert set(found) == {"drain"}
    assert found["drain"].value == pytest.approx(1.5, abs=0.05)
    assert off(found["drain"], [0.0, 0.0, -3.0]) < 1.0


def test_a_floating_strut():
    found = faults(parts.with_floating_strut(FREE))
    assert set(found) == {"loose pieces"}
    assert off(found["loose pieces"], FREE) < 0.1


def patch():
    solid = parts.small_solid()
    place = solid.vertices[solid.triangles[20_000]].mean(axis=0)
    return solid.vertices, solid.triangles, place, parts.near(solid.vertices, solid.triangles, place, 0.6)


def test_flipped_faces():
    vertices, triangles, place, chosen = patch()
    flipped = np.where(chosen[:, None], triangles[:, ::-1], triangles)
    found = faults((vertices, flipped))
    assert set(found) == {"flipped faces"}
    assert found["flipped faces"].value == np.count_nonzero(chosen) > 1
    assert off(found["flipped faces"], place) < 1.0


def test_a_part_turned_inside_out():
    solid = parts.small_solid()
    assert set(faults((solid.vertices, solid.triangles[:, ::-1]))) == {"inside out"}


def test_doubled_faces():
    vertices, triangles, place, chosen = patch()
    found = faults((vertices, np.concatenate([triangles, triangles[chosen][:, [1, 2, 0]]])))
    assert set(found) == {"doubled faces"}
    assert off(found["doubled faces"], place) < 1.0


def test_missing_faces():
    vertices, triangles, place, chosen = patch()
    found = check(vertices, triangles[~chosen], load_printer())
    assert [f.check for f in found.findings if f.severity == "error"] == ["open edges"]
    assert off(next(f for f in found.findings if f.is_fault), place) < 1.0
    # What cannot be measured is said, not passed.
    assert found.findings[-1].check == "not examined"


def test_self_intersection():
    """A rod laid across a strut and not united with it."""
    middle = np.array([9.4, -9.4, 18.75])
    rod = parts.arrays(shapes.cylinder(0.6, -3, 3, 24).rotate([90, 0, 0]).translate(middle.tolist()))
    solid = parts.small_solid()
    found = faults(parts.joined((solid.vertices, solid.triangles), rod))
    # One place, in the middle of the curve along which the two surfaces cut each other.
    place = found["self-intersection"].places[0]
    assert np.hypot(place[0] - middle[0], place[2] - middle[2]) < 0.6
    assert abs(place[1] - middle[1]) < 3.0


@pytest.mark.parametrize(
    ("factor", "words"),
    [(25.4, "inches for mm"), pytest.param(1 / 25.4, "mm for inches", marks=pytest.mark.slow)],
)
def test_inches_for_millimetres(factor, words):
    solid = parts.small_solid()
    found = faults((factor * solid.vertices, solid.triangles), unit=parts.small_unit())
    assert {"scale", "build volume"} == set(found)
    assert words in found["scale"].what
    alone = faults((factor * solid.vertices, solid.triangles))
    assert set(alone) == {"build volume"}
    assert "inches" in alone["build volume"].what


def test_a_unit_in_a_user_defined_body_has_its_size_and_inches_are_still_found():
    unit = parts.small_unit()
    body = envelope(cylinder(16.0, 20.0, 4.0, -1.0, 40.0), unit.dimensions)
    solid = build_solid(unit, body=body)
    surface, printer = (solid.vertices, solid.triangles), load_printer()
    assert check(*surface, printer, unit, stages=()).worst == "error", "not the box's size"
    scale = next(
        f for f in check(*surface, printer, unit, stages=(), in_body=True).findings if f.check == "scale"
    )
    assert scale.severity == "pass"
    inches = check(solid.vertices / 25.4, solid.triangles, printer, unit, stages=(), in_body=True)
    assert "mm for inches" in next(f.what for f in inches.findings if f.check == "scale")


def test_a_part_a_little_too_tall_is_not_taken_for_inches():
    (found,) = (
        f
        for f in check(*parts.arrays(shapes.box([0, 0, 0], [40, 40, 204])), load_printer()).findings
        if f.check == "build volume"
    )
    assert found.severity == "error"
    assert "inches" not in found.what


@pytest.mark.nightly("test_a_sound_unit_has_none_of_them")
@pytest.mark.parametrize("name", ["mu-0.75x", "mu-1.0x", "mu-1.5x"])
def test_the_presets_have_no_errors(name):
    from mu_addon.design.anchors import window
    from mu_addon.design.parameters import load_preset
    from mu_addon.design.solid import build_solid

    unit = load_preset(name)
    path = window(unit, "alpha4")
    solid = build_solid(unit, path)
    # Layers of the largest are as those of the others.
    stages = ("thickness", "chambers") if unit.scale > 1.0 else ("thickness", "chambers", "layers")
    found = check(solid.vertices, solid.triangles, load_printer(), unit, path, stages=stages)
    assert [f.what for f in found.findings if f.severity == "error"] == []
    by_name = {f.check: f for f in found.findings}
    assert by_name["drain"].value == pytest.approx(unit.dimensions.inlet_radius * 2, abs=0.05)
    assert by_name["chamber wall"].value == pytest.approx(unit.dimensions.wall, rel=0.03)


def build_volume(*size, printer=None):
    """The finding on a box of this size in mm on its supports."""
    body = printable(shapes.box([0.0, 0.0, 0.0], list(size)))
    found = check(*body, printer or load_printer(), stages=())
    return next(f for f in found.findings if f.check == "build volume")


def test_a_part_that_fits_only_turned_is_said_to():
    assert "turned" not in build_volume(150, 60, 40).what
    found = build_volume(60, 150, 40)
    assert found.severity == "pass"
    assert "only if it is turned by 90 degrees" in found.what
    assert "by 90 degrees about the build direction" in found.remedy
    assert build_volume(150, 150, 40).severity == "error"


def test_supports_need_some_of_the_height():
    """A part of 202.5 mm fits 210 mm on supports of 7 mm, one of 203.5 mm does not."""
    found = build_volume(20, 20, 202.5)
    assert found.severity == "pass"
    assert found.value == pytest.approx(202.5 / 203.0)
    assert "on 7 mm of supports and raft" in found.what
    assert found.assumed
    assert build_volume(20, 20, 203.5).severity == "error"


def test_a_printers_file_without_supports_is_refused(tmp_path):
    text = printer_text(load_printer())
    start = text.index("# height that supports")
    (tmp_path / "short.toml").write_text(text[:start] + text[text.index("# height of a layer") :])
    with pytest.raises(InputError, match="a limit is missing: support_mm") as refused:
        read_printer(tmp_path / "short.toml")
    assert "add [support_mm] with value and source" in refused.value.remedy


def without_a_strut():
    """The small unit with one strut cut through in its middle, and that place."""
    lattice = lattice_of(parts.small_unit().dimensions)
    middles = lattice.nodes[lattice.struts].mean(axis=1)
    # In the lattice's outermost corner, far from the membrane.
    place = middles[np.argmax(middles @ [0.1, 1.0, 0.01])]
    return printable(parts.small_body() - shapes.box(place - 1.6, place + 1.6)), place


def test_a_missing_strut_is_a_missing_tunnel():
    solid = parts.small_solid()
    nominal = solid.vertices, solid.triangles
    surface, _ = without_a_strut()
    found = {f.check: f for f in check(*surface, load_printer(), stages=(), nominal=nominal).findings}
    assert found["tunnels"].severity == "error"
    assert ": 1 less, as if struts were missing" in found["tunnels"].what
    assert found["volume"].severity == "pass"
