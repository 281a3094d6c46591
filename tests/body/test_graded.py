"""Graded struts as they are printed: swept octants of their own radii that still share their nodes."""

import attrs
import numpy as np
import pytest

from mu_addon.body.lattice import strut_volume_mm3, struts
from mu_addon.body.octants import graded_nodes
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.body.waveguide import bar_of, with_waveguide
from mu_addon.design.anchors import windows
from mu_addon.design.grading import Grading
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.meshing.mesh import LATTICE, boundary_faces
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.settings import MeshSettings
from tests.design.kinds import cross, custom

UNIT = load_preset("mu-1.0x")
SMALL = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))
STEEP = Grading(base=0.8, tip=1.3, minus_y=0.75, plus_y=1.2, beside_x=0.9, cells="0 1 2: 0.7; 1 0 1: 1.3")


def with_grading(grading):
    return attrs.evolve(SMALL, grading=grading)


def test_an_even_grading_is_other_diameters():
    thin = attrs.evolve(SMALL.lattice, junction_diameter_mm=1.2, midspan_diameter_mm=1.6)
    plain = struts(attrs.evolve(SMALL, lattice=thin).printed, 1, 5)
    graded = struts(with_grading(Grading(cells="* * *: 0.8")).printed, 1, 5)
    assert np.abs(graded.nodes - plain.nodes).max() < 1e-12 * UNIT.dimensions.cell
    assert (graded.tets == plain.tets).all()
    assert graded.filled == pytest.approx(plain.filled, abs=1e-9)


def test_octants_share_their_nodes_and_stay_in_their_planes():
    plain, graded = (struts(with_grading(g).printed, 1, 5, full=True) for g in (Grading(), STEEP))
    d = SMALL.printed
    # A lattice cut nowhere: the faces on planes between octants belong to two elements each, as before.
    for mesh in (plain, graded):
        faces, _ = boundary_faces(mesh.tets)
        points = mesh.nodes[faces]
        for axis, planes in enumerate(
            (d.cell * np.array([-1, -0.5, 0.0, 0.5, 1.0]), d.cell * np.array([1.0, 1.5, 2.0]))
        ):
            for plane in planes:
                # Only beside the actuator, where whole elements are left out, are such faces bare.
                bare = (points[..., axis] == plane).all(axis=1)
                bare &= np.hypot(points[..., 0], points[..., 1]).min(axis=1) > d.R + 2.0
                assert not bare.any()
    assert (element_volumes(graded) > 0).all()
    mirrored = graded.nodes * [-1, 1, 1]
    order = [np.lexsort(np.round(n, 7).T + 0.0) for n in (graded.nodes, mirrored)]
    assert graded.nodes[order[0]] == pytest.approx(mirrored[order[1]], abs=1e-9)


@pytest.mark.parametrize(
    "name",
    [
        "body-centred",
        pytest.param(
            "body-centred-straight",
            marks=pytest.mark.nightly("test_its_volume_is_that_of_the_drawn_struts"),
        ),
    ],
)
def test_its_volume_is_that_of_the_drawn_struts(name):
    unit = attrs.evolve(with_grading(STEEP), lattice=attrs.evolve(SMALL.lattice, kind=name))
    mesh = struts(unit.printed, 1, 5)
    found = 2.0 * float((element_volumes(mesh) * mesh.filled.mean(axis=1)).sum())
    assert found == pytest.approx(strut_volume_mm3(unit), rel=3e-3)


@pytest.mark.nightly("test_octants_share_their_nodes_and_stay_in_their_planes")
def test_a_printed_waveguide_stands_in_graded_struts():
    """Thickened struts and replaced ones: the same rules as without, on the graded mesh."""
    unit = with_grading(Grading(base=0.8, tip=1.2, plus_y=0.8))
    (path,) = windows(3)
    mesh = mesh_printed(unit, MeshSettings(refine=0.6))
    sensed = with_waveguide(mesh, bar_of(unit, path), unit)
    moved = (sensed.nodes[: len(mesh.nodes)] != mesh.nodes).any(axis=1)
    assert moved.any(), "struts of 1.2 mm are thickened to the bar's 1.5"
    inside = mesh.region == LATTICE
    assert moved[np.unique(mesh.tets[~inside])].sum() == 0
    assert (element_volumes(sensed) > 0).all()
    wide = with_grading(Grading(plus_y=1.3))
    mesh = mesh_printed(wide, MeshSettings(refine=0.6))
    sensed = with_waveguide(mesh, bar_of(wide, path), wide)
    assert (sensed.nodes[: len(mesh.nodes)] == mesh.nodes).all(), "struts wider than the bar stay"


def test_struts_of_another_kind_are_graded_about_their_axes(tmp_path):
    """As wide as drawn at each place: their volume grows by as much, and none leaves the box's faces."""
    factors = Grading(), Grading(base=0.9, tip=1.3, minus_y=0.9, plus_y=1.3, cells="1 0 1: 1.3")
    plain, graded = (with_grading(g).evolve(**custom(cross()), seats=False) for g in factors)
    before, after = (struts(unit.printed, 1, 5, cache=tmp_path) for unit in (plain, graded))
    volumes = [(element_volumes(mesh) * mesh.filled.mean(axis=1)).sum() for mesh in (before, after)]
    wanted = strut_volume_mm3(graded) / strut_volume_mm3(plain)
    assert abs(wanted - 1.0) > 0.02
    assert volumes[1] / volumes[0] == pytest.approx(wanted, rel=2e-3)
    assert (element_volumes(after) > 0).all()
    low, high = np.array(graded.printed.bounds).T
    assert after.nodes.min(axis=0) == pytest.approx([0.0, *low[1:]], abs=0.0)
    assert after.nodes.max(axis=0) == pytest.approx(high, abs=0.0)


def test_struts_that_fill_their_cell_are_refused():
    thick = attrs.evolve(with_grading(Grading(tip=1.9)).printed, midspan_diameter=3.0)
    with pytest.raises(InputError, match="fill their cell"):
        graded_nodes(thick, np.zeros((1, 3)))
    wide = attrs.evolve(with_grading(Grading(tip=1.9)).printed, kind=cross(), midspan_diameter=5.0)
    with pytest.raises(InputError, match="close the openings"):
        struts(wide, 1, 5)
