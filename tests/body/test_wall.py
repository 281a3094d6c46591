"""The mesh of a unit's wall: on its curved faces, of its volumes, closed, mirrored."""

import sys

import attrs
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from mu_addon.body.printed_mesh import Sizes, wall_mesh
from mu_addon.design.parameters import Printing, Unit, load_preset
from mu_addon.design.profile import cavity_radius, cavity_volume, membrane_volume, outer_radius
from mu_addon.errors import InputError, MeshingError
from mu_addon.meshing import mirror
from mu_addon.meshing.gmsh_model import GmshUnavailable, load_gmsh
from mu_addon.meshing.mesh import FLIPPED_TET, TET_EDGES, TRIANGLE_EDGES, boundary_faces, edges_of
from mu_addon.meshing.quality import cavity_enclosed, check_positive, element_volumes

UNIT = load_preset("mu-1.0x")
D = UNIT.printed


@pytest.fixture(scope="module")
def half():
    return wall_mesh(D, Sizes())


def middle_of(mesh):
    edges, of_tet = edges_of(mesh.tets)
    middle = np.empty(len(edges), int)
    middle[of_tet.ravel()] = mesh.tets[:, 4:].ravel()
    return {tuple(e): m for e, m in zip(edges.tolist(), middle.tolist(), strict=True)}


def at_cavity_wall(d, points, tolerance):
    """True where points (n, 3) lie on the offset curve or on the flat ends of the cavity."""
    radius, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    ends = np.array([d.base_cap, d.height - d.tip_cap])
    on_end = (np.abs(z[:, None] - ends) < tolerance).any(axis=1) & (radius <= cavity_radius(d, z) + tolerance)
    between = (z > ends[0] - tolerance) & (z < ends[1] + tolerance)
    return on_end | (between & (np.abs(radius - cavity_radius(d, z)) < tolerance))


def volume_errors(d, mesh):
    """Relative errors of the wall's and the cavity's volume, the whole body's."""
    wall, cavity = 2 * element_volumes(mesh).sum(), 2 * cavity_enclosed(mesh)
    return np.abs([wall / membrane_volume(d) - 1, cavity / cavity_volume(d) - 1])


@pytest.mark.parametrize("preset", ["mu-0.75x", "mu-1.0x", "mu-1.5x"])
def test_volumes_match_the_design_and_converge(preset):
    d = load_preset(preset).printed
    rough, fine = (volume_errors(d, wall_mesh(d, Sizes().refined(by))) for by in (0.5, 1.0))
    assert (fine < [2e-4, 1e-4]).all()
    assert (fine < rough / 4).all()


def test_mid_edge_nodes_follow_vtk_order(half):
    middle = middle_of(half)
    for tet in half.tets[::97].tolist():
        assert tet[4:] == [middle[tuple(sorted((tet[i], tet[j])))] for i, j in TET_EDGES.tolist()]
    for face in half.cavity[::17].tolist():
        assert face[3:] == [middle[tuple(sorted((face[i], face[j])))] for i, j in TRIANGLE_EDGES.tolist()]


def test_cavity_is_the_inside_of_the_solid_and_closed_by_the_mirror(half):
    assert at_cavity_wall(D, half.nodes[np.unique(half.cavity)], 1e-6).all()
    # Its faces bound one element each, from which they point away.
    faces, _ = boundary_faces(half.tets)
    bounding = {tuple(f) for f in faces.tolist()}
    rotations = half.cavity_corners[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]]
    assert all(any(tuple(r) in bounding for r in three) for three in rotations.tolist())
    # Its border lies in the mirror plane, so that the mirrored cavity is closed.
    directed = half.cavity_corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends, count = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    assert np.all(half.nodes[ends[count == 1]][:, :, 0] == 0)


def test_the_wall_is_curved_and_keeps_its_normal_thickness(half):
    z = half.nodes[:, 2]
    shell = np.flatnonzero((z > D.cell) & (z < D.height - D.cell))
    off = np.abs(np.hypot(*half.nodes[shell, :2].T) - outer_radius(D, z[shell]))
    outer, corners = shell[off < 1e-9], np.unique(half.corners)
    inner = np.setdiff1d(np.intersect1d(shell, corners), outer)
    gap = cKDTree(half.nodes[np.intersect1d(outer, corners)]).query(half.nodes[inner])[0]
    assert gap == pytest.approx(D.wall, rel=1e-9)
    # Mid-edge nodes lie on the profile, beside the chords of a straight-sided mesh.
    outside = set(outer.tolist())
    edges = np.array([e for e, m in middle_of(half).items() if m in outside])
    chords = half.nodes[edges].mean(axis=1)
    assert np.abs(np.hypot(chords[:, 0], chords[:, 1]) - outer_radius(D, chords[:, 2])).max() > 0.05


def test_the_printed_wall_is_meshed_and_no_other():
    unit = attrs.evolve(load_preset("mu-0.75x"), print=Printing(0.05, 0.3))
    p, mesh = unit.printed, wall_mesh(unit.printed, Sizes())
    assert (volume_errors(p, mesh) < 1e-3).all()
    assert 2 * element_volumes(mesh).sum() != pytest.approx(membrane_volume(unit.dimensions), rel=0.1)
    assert outer_radius(p, p.cell / 2) == p.R == unit.dimensions.R + 0.05


def test_mirrored_mesh_is_exactly_symmetric(half):
    full = mirror(half, "x")
    assert full.symmetry == ()
    reflected = full.nodes * [-1.0, 1.0, 1.0] + 0.0
    assert np.array_equal(np.unique(full.nodes + 0.0, axis=0), np.unique(reflected, axis=0))
    assert len(full.nodes) == 2 * len(half.nodes) - len(half.symmetry_nodes("x"))
    check_positive(full)
    assert element_volumes(full).sum() == pytest.approx(2 * element_volumes(half).sum(), rel=1e-12)
    assert cavity_enclosed(full) == pytest.approx(2 * cavity_enclosed(half), rel=1e-12)
    # No face is left unmatched on the plane, and the cavity is closed.
    faces, _ = boundary_faces(full.tets)
    assert not np.any(np.all(full.nodes[faces][:, :, 0] == 0, axis=1))
    directed = full.cavity_corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(np.vstack([directed, directed[:, ::-1]]), axis=0)) == len(directed)
    for nodes, plane in ((full.base, 0.0), (full.tip, D.height)):
        assert np.array_equal(nodes, np.flatnonzero(full.nodes[:, 2] == plane))


def test_a_mirror_must_exist(half):
    with pytest.raises(MeshingError, match="no mirror plane y"):
        mirror(half, "y")


def test_inverted_elements_are_counted_and_placed(half):
    tets = half.tets.copy()
    tets[7] = tets[7, FLIPPED_TET]
    with pytest.raises(MeshingError, match="1 of") as caught:
        check_positive(attrs.evolve(half, tets=tets))
    assert "mm" in caught.value.where


# Dimensions that printable units may have; the design refuses those that do not fit together.
chambers = st.builds(
    dict,
    count=st.integers(3, 5),
    neck_diameter_mm=st.floats(8.0, 20.0),
    bladder_share=st.floats(0.3, 0.8),
    wall_mm=st.floats(0.3, 1.5),
    base_cap_mm=st.floats(0.5, 5.0),
    tip_cap_mm=st.floats(0.5, 5.0),
)


@settings(max_examples=6, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(chambers)
def test_any_printable_wall_is_meshed_without_inversion(values):
    try:
        d = attrs.evolve(Unit(), chambers=attrs.evolve(Unit().chambers, **values)).printed
    except InputError:
        return
    mesh = wall_mesh(d, Sizes())
    check_positive(mesh)
    assert (volume_errors(d, mesh) < 5e-3).all()


class _Unloadable:
    """An import hook under which gmsh fails as it does where a system library is missing."""

    def find_spec(self, name, *_):
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file: No such file or directory")


def test_without_libglu_the_package_is_named(monkeypatch):
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [_Unloadable(), *sys.meta_path])
    with pytest.raises(GmshUnavailable, match=r"libGLU") as caught:
        load_gmsh()
    assert "libglu1-mesa" in caught.value.remedy


def test_without_gmsh_at_all(monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(GmshUnavailable, match="not installed"):
        load_gmsh()
