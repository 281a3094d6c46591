"""Any closed surface by pytetwild: sides, cache, and what is refused."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mu_addon.design.surface import winding_number
from mu_addon.errors import InputError, MeshingError
from mu_addon.meshing import LATTICE, mesh_surface, surface
from mu_addon.meshing.mesh import Mesh, boundary_faces, oriented
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.surface import _fullness


def sphere(radius: float, subdivisions: int = 2) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions, radius)


def test_a_ball() -> None:
    ball = sphere(10.0)
    mesh = mesh_surface(ball.vertices, ball.faces, 4.0)
    assert mesh.order == 1
    assert len(mesh.cavity) == 0
    assert set(mesh.region) == {LATTICE}
    assert element_volumes(mesh).min() > 0
    assert element_volumes(mesh).sum() == pytest.approx(ball.volume, rel=0.02)


def test_a_box_of_order_two_has_flat_sides() -> None:
    box = trimesh.creation.box((8.0, 6.0, 10.0))
    mesh = mesh_surface(box.vertices, box.faces, 3.0, order=2)
    faces, _ = boundary_faces(mesh.tets)
    assert np.all((np.abs(mesh.nodes[faces]) == [4.0, 3.0, 5.0]).all(axis=1).any(axis=1))
    assert mesh.order == 2
    assert element_volumes(mesh).min() > 0
    assert element_volumes(mesh).sum() == pytest.approx(480.0, rel=1e-9)


def test_a_mesh_with_a_flat_element_is_made_anew_and_the_good_one_kept(tmp_path, monkeypatch) -> None:
    corners = np.array([[x, y, z] for x in (0.0, 1) for y in (0, 1) for z in (0, 1)])
    five = [[0, 6, 5, 3], [4, 0, 6, 5], [2, 0, 6, 3], [1, 0, 5, 3], [7, 6, 5, 3]]
    flat = np.array([[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.2, 0.8, 0.5], [0.5, 0.5, 0.5 + 1e-6]])
    made = [(np.vstack([corners, flat]), np.array([*five, [8, 9, 10, 11]])), (corners, np.array(five))]
    monkeypatch.setattr(surface, "_tetrahedralize", lambda *_: made.pop(0))
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    for _ in range(2):
        mesh = mesh_surface(box.vertices + 0.5, box.faces, 1.0, cache=tmp_path)
        assert len(mesh.tets) == 5


def test_the_cache_makes_it_repeatable(tmp_path: Path) -> None:
    ball = sphere(5.0, 1)
    first = mesh_surface(ball.vertices, ball.faces, 3.0, cache=tmp_path)
    again = mesh_surface(ball.vertices, ball.faces, 3.0, cache=tmp_path)
    assert first.hash() == again.hash()
    (stored,) = tmp_path.iterdir()
    # A file torn by a full disk is made anew.
    stored.write_bytes(stored.read_bytes()[:100])
    assert len(mesh_surface(ball.vertices, ball.faces, 3.0, cache=tmp_path).tets)
    mesh_surface(ball.vertices, ball.faces, 6.0, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


FLAT = pytest.mark.nightly("test_a_flat_element_is_bad_luck_and_meshed_again")


@pytest.mark.parametrize("off", [pytest.param(0.0, marks=FLAT), 1e-6], ids=["flat", "flat but for rounding"])
def test_a_flat_element_is_bad_luck_and_meshed_again(tmp_path: Path, off: float) -> None:
    ball = sphere(10.0)
    mesh_surface(ball.vertices, ball.faces, 4.0, cache=tmp_path)
    (file,) = tmp_path.glob("tetwild-*.npz")
    stored = dict(np.load(file))
    bottom, left, right, top = stored["tets"][0]
    x = stored["nodes"]
    up = np.sign(np.linalg.det(x[[left, right, top]] - x[bottom])) * np.cross(
        x[left] - x[bottom], x[right] - x[bottom]
    )
    x[top] = x[[bottom, left, right]].mean(axis=0) + off * up
    np.savez(file, **stored)
    mesh = mesh_surface(ball.vertices, ball.faces, 4.0, cache=tmp_path)
    assert element_volumes(mesh).min() > 1e-3
    again = mesh_surface(ball.vertices, ball.faces, 4.0, cache=tmp_path)
    np.testing.assert_array_equal(again.nodes, mesh.nodes)


@pytest.mark.parametrize("edge", [0.5, 20.0])
def test_a_regular_element_is_full_at_any_size(edge: float) -> None:
    nodes = edge * np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]) / np.sqrt(8)
    none = np.zeros((0, 3))
    mesh = Mesh(nodes, oriented(nodes, np.array([[0, 1, 2, 3]])), [LATTICE], none, [], [])
    assert _fullness(mesh) == pytest.approx(1.0)


def test_nothing_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ball = sphere(5.0, 1)
    mesh_surface(ball.vertices, ball.faces, 3.0)
    assert os.getcwd() == str(tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert "pyvista" not in sys.modules


def test_an_open_surface_is_refused() -> None:
    ball = sphere(5.0)
    with pytest.raises(InputError, match="not closed"):
        mesh_surface(ball.vertices, ball.faces[1:], 2.0)
    with pytest.raises(InputError, match="not closed"):
        mesh_surface(ball.vertices, np.vstack([ball.faces[:1, ::-1], ball.faces[1:]]), 2.0)


def test_a_missing_pytetwild_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pytetwild", None)
    ball = sphere(5.0, 1)
    with pytest.raises(MeshingError, match="pytetwild cannot be loaded"):
        mesh_surface(ball.vertices, ball.faces, 2.0)


@settings(max_examples=30)
@given(arrays(float, (5, 3), elements=st.floats(-9, 9)))
def test_winding_number_counts_inside_once(points: np.ndarray) -> None:
    ball = sphere(5.0)
    radius = np.linalg.norm(points, axis=1)
    points = points[np.abs(radius - 5) > 0.3]
    expected = np.linalg.norm(points, axis=1) < 5
    assert np.allclose(winding_number(ball.vertices, ball.faces, points), expected, atol=1e-9)
