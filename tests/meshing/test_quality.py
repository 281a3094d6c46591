"""Volumes, angles and Jacobians of elements whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mu_addon.errors import MeshingError
from mu_addon.meshing import LATTICE, Mesh
from mu_addon.meshing.mesh import TET_EDGES, edges_of, oriented, second_order
from mu_addon.meshing.quality import (
    cavity_enclosed,
    check_positive,
    dihedral_angles,
    element_volumes,
    folded_corners,
    inverted,
)

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
REGULAR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])

# The four faces of a tetrahedron, pointing into it, as those of a cavity that it would fill.
INWARD = np.array([[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]])


def single(nodes: np.ndarray) -> Mesh:
    tets = np.arange(len(nodes))[None]
    faces = INWARD
    if len(nodes) == 10:
        middle = {frozenset(e): 4 + k for k, e in enumerate(TET_EDGES.tolist())}
        rows = [[*f, *(middle[frozenset((f[i], f[(i + 1) % 3]))] for i in range(3))] for f in INWARD.tolist()]
        faces = np.array(rows)
    return Mesh(nodes, tets, [LATTICE], faces, [], [])


def curved(corners: np.ndarray, bend: np.ndarray) -> np.ndarray:
    return np.vstack([corners, corners[TET_EDGES].mean(axis=1) + bend])


def test_known_angles_and_volume() -> None:
    assert dihedral_angles(single(REGULAR)) == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert np.sort(dihedral_angles(single(CORNERS))[0]) == pytest.approx(
        [np.degrees(np.arctan(np.sqrt(2)))] * 3 + [90] * 3
    )
    assert element_volumes(single(CORNERS)) == pytest.approx([1 / 6])


@settings(max_examples=50)
@given(arrays(float, (6, 3), elements=st.floats(-0.2, 0.2)))
def test_a_curved_volume_is_that_within_its_faces(bend: np.ndarray) -> None:
    mesh = single(curved(CORNERS, bend))
    assert element_volumes(mesh)[0] == pytest.approx(cavity_enclosed(mesh), rel=1e-10)


@settings(max_examples=50)
@given(arrays(float, (6, 3), elements=st.floats(-0.1, 0.1)), st.floats(0.1, 10), st.floats(0, 6))
def test_quality_does_not_depend_on_size_or_place(bend: np.ndarray, size: float, angle: float) -> None:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    nodes = curved(CORNERS, bend)
    moved = size * nodes @ turn.T + 3.0
    assert folded_corners(single(moved)) == pytest.approx(folded_corners(single(nodes)), abs=1e-9)
    assert dihedral_angles(single(moved)) == pytest.approx(dihedral_angles(single(nodes)), abs=1e-6)


def test_a_side_bent_flat_is_a_folded_corner() -> None:
    bend = np.zeros((6, 3))
    assert folded_corners(single(curved(CORNERS, bend)))[0] == pytest.approx(1.0)
    bend[0] = [0.0, 0.25, 0.0]
    bend[2] = [0.25, 0.0, 0.0]
    assert folded_corners(single(curved(CORNERS, bend)))[0] <= 1e-12


def test_an_inverted_element_is_found_and_named() -> None:
    check_positive(single(CORNERS))
    turned = single(CORNERS[[1, 0, 2, 3]])
    assert inverted(turned).tolist() == [0]
    with pytest.raises(MeshingError, match="1 of 1 elements are inverted") as refused:
        check_positive(turned)
    assert "lattice at x, y, z = 0.25, 0.25, 0.25 mm" in refused.value.where


def test_second_order_keeps_the_volume() -> None:
    nodes = np.vstack([REGULAR, [[3.0, 3.0, -3.0]]])
    tets = oriented(nodes, np.array([[0, 1, 2, 3], [0, 1, 2, 4]]))
    volume = np.abs(np.linalg.det(nodes[tets[:, 1:]] - nodes[tets[:, :1]])).sum() / 6
    edges, _ = edges_of(tets)
    quadratic, ten, _ = second_order(nodes, tets, np.empty((0, 3), int), nodes[edges].mean(axis=1))
    mesh = Mesh(quadratic, ten, [LATTICE] * 2, np.empty((0, 6)), [], [])
    assert element_volumes(mesh).sum() == pytest.approx(volume)
    assert folded_corners(mesh) == pytest.approx(1.0)
