"""The analysis mesh of a unit: tags, curved faces, volumes, determinism, symmetry, the missing gmsh."""

from __future__ import annotations

import subprocess
import sys
import warnings

import attrs
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mu_addon.design.parameters import Printing, Unit, load_preset
from mu_addon.design.profile import cavity_radius, cavity_volume, membrane_volume, outer_radius
from mu_addon.errors import InputError, MeshingError
from mu_addon.meshing import (
    LATTICE,
    MEMBRANE,
    Mesh,
    MeshingWarning,
    MeshSettings,
    mesh_quality,
    mesh_unit,
    mirror,
)
from mu_addon.meshing.lattice_region import GmshUnavailable
from mu_addon.meshing.mesh import FLIPPED_TET, TET_EDGES, TET_FACES, TRIANGLE_EDGES, boundary_faces, edges_of
from mu_addon.meshing.quality import cavity_enclosed, check_positive, element_volumes

PRESETS = ("mu-0.75x", "mu-1.0x", "mu-1.5x")


def interface(mesh: Mesh) -> np.ndarray:
    """Corner triangles shared by membrane and lattice, found from the elements alone."""
    faces = mesh.corners[:, TET_FACES].reshape(-1, 3)
    region = np.repeat(mesh.region, 4)
    _, which = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    which = which.ravel()
    touches = [np.bincount(which[region == r], minlength=which.max() + 1) > 0 for r in (MEMBRANE, LATTICE)]
    return faces[(touches[0] & touches[1])[which]]


def middle_of(mesh: Mesh) -> dict[tuple[int, int], int]:
    edges, of_tet = edges_of(mesh.tets)
    middle = np.empty(len(edges), int)
    middle[of_tet.ravel()] = mesh.tets[:, 4:].ravel()
    return {tuple(e): m for e, m in zip(edges.tolist(), middle.tolist(), strict=True)}


def at_cavity_wall(unit: Unit, points: np.ndarray, tolerance: float) -> np.ndarray:
    """True where points (n, 3) lie on the offset curve or on the flat ends of the cavity."""
    d = unit.dimensions
    radius, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    ends = np.array([d.base_cap, d.height - d.tip_cap])
    on_end = (np.abs(z[:, None] - ends) < tolerance).any(axis=1) & (radius <= cavity_radius(d, z) + tolerance)
    between = (z > ends[0] - tolerance) & (z < ends[1] + tolerance)
    return on_end | (between & (np.abs(radius - cavity_radius(d, z)) < tolerance))


def test_default_mesh_is_small_and_sound(unit: Unit, half: Mesh) -> None:
    report = mesh_quality(half, unit)
    assert half.order == 2
    assert half.symmetry == ("x",)
    assert 10_000 <= report.nodes <= 25_000
    assert report.inverted == 0
    assert report.min_scaled_jacobian > 0.3
    assert report.min_corner_jacobian > 0.1
    assert report.min_dihedral_deg > 5
    assert report.membrane_tets + report.lattice_tets == report.tets
    check_positive(half)


VOLUMES = pytest.mark.nightly("test_volumes_match_the_design")


@pytest.mark.parametrize(
    "preset", [name if name == "mu-1.0x" else pytest.param(name, marks=VOLUMES) for name in PRESETS]
)
def test_volumes_match_the_design(preset: str) -> None:
    unit = load_preset(preset)
    report = mesh_quality(mesh_unit(unit), unit)
    assert abs(report.membrane_volume_error) < 2e-4
    assert abs(report.lattice_volume_error) < 1e-4
    assert abs(report.cavity_volume_error) < 1e-4


def test_refinement_converges_on_the_volumes(unit: Unit, half: Mesh) -> None:
    errors = []
    for mesh in (mesh_unit(unit, MeshSettings(refine=0.5)), half):
        report = mesh_quality(mesh, unit)
        errors.append([report.membrane_volume_error, report.cavity_volume_error])
    rough, fine = np.abs(errors)
    assert np.all(fine < rough / 4)


def test_regions_fill_the_envelope_exactly(unit: Unit, half: Mesh) -> None:
    (x0, x1), (y0, y1), (z0, z1) = unit.dimensions.bounds
    box = (x1 - x0) * (y1 - y0) * (z1 - z0)
    assert 2 * (element_volumes(half).sum() + cavity_enclosed(half)) == pytest.approx(box, rel=1e-12)


def test_every_node_is_used_and_every_number_valid(half: Mesh) -> None:
    assert np.array_equal(np.unique(half.tets), np.arange(len(half.nodes)))
    assert set(np.unique(half.region)) == {MEMBRANE, LATTICE}
    assert half.nodes.dtype == np.float64
    assert {a.dtype for a in (half.tets, half.cavity, half.base, half.tip)} == {np.dtype(np.int32)}


def test_mid_edge_nodes_follow_vtk_order(half: Mesh) -> None:
    middle = middle_of(half)
    for tet in half.tets[::97].tolist():
        assert tet[4:] == [middle[tuple(sorted((tet[i], tet[j])))] for i, j in TET_EDGES.tolist()]
    for face in half.cavity[::17].tolist():
        assert face[3:] == [middle[tuple(sorted((face[i], face[j])))] for i, j in TRIANGLE_EDGES.tolist()]


def test_cavity_is_the_inside_of_the_solid_and_closed_by_the_mirror(unit: Unit, half: Mesh) -> None:
    assert at_cavity_wall(unit, half.nodes[np.unique(half.cavity_corners)], 1e-6).all()
    # Its faces bound one element each, from which they point away.
    faces, _ = boundary_faces(half.tets)
    bounding = {tuple(f) for f in faces.tolist()}
    rotations = half.cavity_corners[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]]
    assert all(any(tuple(r) in bounding for r in three) for three in rotations.tolist())
    # Its border lies in the mirror plane, so that the mirrored cavity is closed.
    directed = half.cavity_corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends, count = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    assert np.all(half.nodes[ends[count == 1]][:, :, 0] == 0)
    assert 2 * cavity_enclosed(half) == pytest.approx(cavity_volume(unit.dimensions), rel=1e-4)


def test_second_order_nodes_lie_on_the_curved_surfaces(unit: Unit, half: Mesh) -> None:
    middle = middle_of(half)
    faces = interface(half)
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0)
    points = half.nodes[[middle[tuple(e)] for e in edges.tolist()]]
    off = np.hypot(points[:, 0], points[:, 1]) - outer_radius(unit.dimensions, points[:, 2])
    assert np.abs(off).max() < 1e-9
    assert at_cavity_wall(unit, half.nodes[np.unique(half.cavity)], 1e-6).all()
    # What a straight-sided mesh would be wrong by, beside a wall of 0.6 mm.
    chords = half.nodes[edges].mean(axis=1)
    sag = np.hypot(chords[:, 0], chords[:, 1]) - outer_radius(unit.dimensions, chords[:, 2])
    assert np.abs(sag).max() > 0.1


def test_wall_keeps_its_normal_thickness(unit: Unit, half: Mesh) -> None:
    d = unit.dimensions
    z = half.nodes[:, 2]
    membrane = np.unique(half.corners[half.region == MEMBRANE])
    shell = membrane[(z[membrane] > d.cell) & (z[membrane] < d.height - d.cell)]
    outer = shell[np.abs(np.hypot(*half.nodes[shell, :2].T) - outer_radius(d, z[shell])) < 1e-9]
    inner = np.setdiff1d(shell, outer)
    gap = np.linalg.norm(half.nodes[inner][:, None] - half.nodes[outer][None], axis=2).min(axis=1)
    assert gap == pytest.approx(d.wall, rel=1e-9)


PRINTED = pytest.mark.nightly("test_the_printed_unit_is_meshed")


@pytest.mark.parametrize(
    "offsets",
    [pytest.param((0.2, 0.2), marks=PRINTED), pytest.param((-0.15, -0.15), marks=PRINTED), (0.05, 0.3)],
)
def test_the_printed_unit_is_meshed(offsets: tuple[float, float]) -> None:
    """Walls of the smallest unit as they are printed, and no others."""
    unit = attrs.evolve(load_preset("mu-0.75x"), print=Printing(*offsets))
    mesh, p = mesh_unit(unit), unit.printed
    report = mesh_quality(mesh, unit)
    assert report.inverted == 0
    assert report.min_corner_jacobian > 0.05
    assert abs(report.membrane_volume_error) < 1e-3
    assert abs(report.cavity_volume_error) < 1e-3
    assert report.membrane_volume_mm3 != pytest.approx(membrane_volume(unit.dimensions), rel=0.1)
    on_profile = mesh.nodes[np.unique(interface(mesh))]
    assert np.hypot(*on_profile[:, :2].T) == pytest.approx(outer_radius(p, on_profile[:, 2]), abs=1e-9)
    assert outer_radius(p, p.cell / 2) == p.R == unit.dimensions.R + offsets[0]


@pytest.mark.parametrize("name", ["half", "coarse"])
def test_ends_are_all_nodes_on_their_planes(name: str, unit: Unit, request: pytest.FixtureRequest) -> None:
    mesh: Mesh = request.getfixturevalue(name)
    height = unit.dimensions.height
    faces, _ = boundary_faces(mesh.tets)
    for nodes, plane, sign in ((mesh.base, 0.0, -1), (mesh.tip, height, 1)):
        assert np.array_equal(nodes, np.flatnonzero(mesh.nodes[:, 2] == plane))
        flat = faces[np.isin(faces, nodes).all(axis=1)]
        a, b, c = np.moveaxis(mesh.nodes[flat], 1, 0)
        normal = np.cross(b - a, c - a)
        assert np.all(sign * normal[:, 2] > 0)
        (x0, x1), (y0, y1), _ = unit.dimensions.bounds
        assert np.abs(normal[:, 2]).sum() / 2 == pytest.approx((x1 - x0) / 2 * (y1 - y0), rel=1e-9)


def test_same_bytes_in_two_processes(unit: Unit, half: Mesh) -> None:
    code = (
        "from mu_addon.design.parameters import load_preset; from mu_addon.meshing import mesh_unit;"
        "print(mesh_unit(load_preset('mu-1.0x')).hash())"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == half.hash()


def test_scaled_units_get_the_same_mesh(half: Mesh, unit: Unit) -> None:
    other = mesh_unit(attrs.evolve(unit, scale=0.9))
    assert np.array_equal(other.tets, half.tets)
    assert np.allclose(other.nodes, 0.9 * half.nodes, rtol=0, atol=1e-6)


def test_mirrored_mesh_is_exactly_symmetric(half: Mesh, unit: Unit) -> None:
    full = mirror(half, "x")
    assert full.symmetry == ()
    reflected = full.nodes * [-1.0, 1.0, 1.0] + 0.0
    assert np.array_equal(np.unique(full.nodes + 0.0, axis=0), np.unique(reflected, axis=0))
    assert len(full.nodes) == 2 * len(half.nodes) - len(half.symmetry_nodes("x"))
    report, before = mesh_quality(full, unit), mesh_quality(half, unit)
    assert report.inverted == 0
    assert report.membrane_volume_mm3 == pytest.approx(before.membrane_volume_mm3, rel=1e-12)
    assert report.cavity_volume_mm3 == pytest.approx(before.cavity_volume_mm3, rel=1e-12)
    # No face is left unmatched on the plane, and the cavity is closed.
    faces, _ = boundary_faces(full.tets)
    assert not np.any(np.all(full.nodes[faces][:, :, 0] == 0, axis=1))
    directed = full.cavity_corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(np.vstack([directed, directed[:, ::-1]]), axis=0)) == len(directed)
    assert np.array_equal(full.base, np.flatnonzero(full.nodes[:, 2] == 0))


def test_full_is_the_mirrored_half(coarse: Mesh, unit: Unit) -> None:
    full = mesh_unit(unit, MeshSettings(refine=0.5, order=1, fraction="full"))
    assert full.hash() == mirror(coarse, "x").hash()


def test_a_mirror_must_exist(half: Mesh) -> None:
    with pytest.raises(MeshingError, match="no mirror plane y"):
        mirror(half, "y")


@pytest.mark.parametrize(
    ("field", "value"), [("order", 3), ("fraction", "quarter"), ("refine", 0.0), ("hoop_mm", -1.0)]
)
def test_settings_are_refused_in_words(field: str, value: object) -> None:
    with pytest.raises(InputError, match=field):
        MeshSettings(**{field: value})


def test_inverted_elements_are_counted_and_placed(half: Mesh) -> None:
    tets = half.tets.copy()
    tets[7] = tets[7, FLIPPED_TET]
    with pytest.raises(MeshingError, match="1 of") as caught:
        check_positive(attrs.evolve(half, tets=tets))
    assert "mm" in caught.value.where


def test_refine_raises_every_count(coarse: Mesh, half: Mesh) -> None:
    rough, fine = ([len(m.tets), len(m.cavity), (m.region == LATTICE).sum()] for m in (coarse, half))
    assert np.all(np.array(fine) > 2 * np.array(rough))


def test_progress_is_told(unit: Unit) -> None:
    reports: list[tuple[str, float]] = []
    mesh_unit(
        unit, MeshSettings(refine=0.5, order=1), progress=lambda stage, share: reports.append((stage, share))
    )
    shares = [share for _, share in reports]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


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
def test_any_printable_unit_is_meshed_without_inversion(values: dict[str, float]) -> None:
    try:
        unit = attrs.evolve(Unit(), chambers=attrs.evolve(Unit().chambers, **values))
    except InputError:
        return
    mesh = mesh_unit(unit)
    report = mesh_quality(mesh, unit)
    assert report.inverted == 0
    assert abs(report.membrane_volume_error) < 5e-3
    assert abs(report.cavity_volume_error) < 5e-3
    box = np.prod([high - low for low, high in unit.dimensions.bounds])
    filled = report.membrane_volume_mm3 + report.lattice_volume_mm3 + report.cavity_volume_mm3
    assert filled == pytest.approx(box, rel=1e-10)


class _Unloadable:
    """An import hook under which gmsh fails as it does where a system library is missing."""

    def find_spec(self, name: str, *_: object) -> None:
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file: No such file or directory")


@pytest.fixture
def no_glu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [_Unloadable(), *sys.meta_path])


@pytest.mark.usefixtures("no_glu")
def test_without_libglu_the_package_is_named(unit: Unit) -> None:
    with pytest.raises(GmshUnavailable, match=r"libGLU") as caught:
        mesh_unit(unit, mesher="gmsh")
    assert "libglu1-mesa" in caught.value.remedy


def test_without_gmsh_at_all(unit: Unit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(GmshUnavailable, match="not installed"):
        mesh_unit(unit, mesher="gmsh")


@pytest.mark.usefixtures("no_glu")
def test_without_gmsh_pytetwild_is_asked_and_the_user_told(
    unit: Unit, coarse: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(
        "mu_addon.meshing.homogenised_unit._from_surfaces", lambda d, *_: asked.append(d) or coarse
    )
    with pytest.warns(MeshingWarning, match="libglu1-mesa"):
        mesh_unit(unit)
    assert asked == [unit.dimensions]


@pytest.mark.nightly("tests/meshing/test_surface.py::test_nested_spheres_are_told_apart")
@pytest.mark.usefixtures("no_glu")
def test_pytetwild_meshes_a_unit_instead() -> None:
    small = attrs.evolve(Unit(), chambers=attrs.evolve(Unit().chambers, count=3, wall_mm=1.5))
    with pytest.warns(MeshingWarning):
        mesh = mesh_unit(small, MeshSettings(refine=0.5))
    report = mesh_quality(mesh, small)
    assert report.inverted == 0
    assert abs(report.membrane_volume_error) < 0.05
    assert abs(report.lattice_volume_error) < 0.01
    assert abs(report.cavity_volume_error) < 0.05
    assert mesh.symmetry == ("x",)
    assert len(mesh.base)
    assert len(mesh.tip)
    full = mirror(mesh, "x")
    faces, _ = boundary_faces(full.tets)
    assert not np.any(np.all(full.nodes[faces][:, :, 0] == 0, axis=1))


def test_an_unknown_mesher_is_refused(unit: Unit) -> None:
    with pytest.raises(InputError, match="tetgen"):
        mesh_unit(unit, mesher="tetgen")


def test_meshing_warns_of_nothing(unit: Unit) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh_unit(unit, MeshSettings(refine=0.5))
