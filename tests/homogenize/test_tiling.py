"""Mirror images side by side: one body, of whole volume, whose only free faces are the pattern's own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import MeshingError
from mu_addon.meshing.mesh import TET_EDGES, boundary_faces, mirror
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.tiling import box_of, tiled
from tests.fem import bodies
from tests.homogenize.tiled_motion import tiled_displacement

COUNTS = st.tuples(*[st.integers(1, 4)] * 3)
SIZES = st.tuples(*[st.floats(0.1, 7.3)] * 3)


@settings(max_examples=25)
@given(COUNTS, SIZES, st.sampled_from([1, 2]))
def test_boxes_fill_a_box(counts: tuple[int, int, int], size: tuple[float, float, float], order: int) -> None:
    mesh = bodies.box((2, 1, 2), size, order, jiggle=0.1)
    whole = tiled(mesh, counts)
    volumes = element_volumes(whole)
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(np.prod(size) * np.prod(counts))
    # A crack would show as faces of one element inside, and a node too many.
    faces, _ = boundary_faces(whole.tets)
    low, high = np.zeros(3), np.array(size) * counts
    sides = (whole.nodes[faces] == low) | np.isclose(whole.nodes[faces], high, rtol=1e-14)
    assert sides.all(axis=1).any(axis=1).all()
    expected = np.prod([n * c * order + 1 for n, c in zip((2, 1, 2), counts, strict=True)])
    assert len(whole.nodes) == expected
    assert np.array_equal(np.unique(whole.tets), np.arange(expected))
    assert np.allclose(whole.nodes[whole.base, 2], 0)
    assert np.allclose(whole.nodes[whole.tip, 2], size[2] * counts[2])
    assert len(whole.tip) == len(whole.base) > 0


def test_middles_of_edges_stay_between_their_ends() -> None:
    whole = tiled(bodies.box((2, 2, 1), order=2, jiggle=0.2), (3, 2, 3))
    ends = whole.nodes[whole.corners][:, TET_EDGES]
    assert whole.nodes[whole.tets[:, 4:]] == pytest.approx(ends.mean(axis=2), abs=1e-14)


def test_a_body_beside_its_planes_stays_apart() -> None:
    # Half a box away from the far planes, twice mirrored: two pieces, each closed.
    mesh = bodies.box((1, 1, 1), (1.0, 1.0, 1.0), 1)
    whole = tiled(mesh, (4, 1, 1), box=(2.0, 1.0, 1.0))
    faces, _ = boundary_faces(whole.tets)
    x = whole.nodes[faces][:, :, 0]
    assert {float(v) for v in x[(x == x[:, :1]).all(axis=1)].ravel()} == {0.0, 1.0, 3.0, 5.0, 7.0, 8.0}
    assert element_volumes(whole).sum() == pytest.approx(4)


def test_elements_follow_in_their_own_order() -> None:
    mesh = bodies.box((2, 2, 2), order=1, jiggle=0.2)
    mesh.region[:] = np.arange(len(mesh.tets)) % 2 + 1
    whole = tiled(mesh, (2, 3, 2))
    assert np.array_equal(whole.region, np.tile(mesh.region, 12))
    volumes = element_volumes(whole).reshape(12, -1)
    assert volumes == pytest.approx(np.tile(element_volumes(mesh), (12, 1)))
    assert whole.tets[: len(mesh.tets)].tolist() == mesh.tets.tolist()


def test_planes_named_as_mirrors_are_kept() -> None:
    mesh = bodies.box((1, 1, 1), order=2)
    half = tiled(mesh, (2, 2, 2), symmetry=("x", "y"))
    whole = mirror(mirror(half, "x"), "y")
    assert whole.nodes.min(axis=0).tolist() == [-2, -2, 0]
    assert element_volumes(whole).sum() == pytest.approx(32)


def test_displacements_follow_their_copies() -> None:
    mesh = bodies.box((2, 2, 2), (1.0, 2.0, 1.5), 2)
    box, reach = np.array(box_of(mesh)), np.array([1.3, 1.7, 1.2])
    x = mesh.nodes / box
    # Any motion that keeps the sides in their planes.
    u = x * (reach - box) + 0.05 * np.sin(np.pi * x) * (1 + x[:, [1, 2, 0]])
    whole = tiled(mesh, (3, 2, 4))
    moved = whole.nodes + tiled_displacement(mesh, u, (3, 2, 4), box, reach)
    here = np.where(np.floor(whole.nodes / box) % 2 == 0, whole.nodes % box, box - whole.nodes % box)
    for a, b in zip(moved, here, strict=True):
        original = np.flatnonzero(np.isclose(mesh.nodes, b).all(axis=1))
        assert len(original) == 1
        folded = a % (2 * reach)
        folded = np.minimum(folded, 2 * reach - folded)
        expected = (mesh.nodes + u)[original[0]]
        # A point on a plane folds to either side of it.
        assert np.abs(folded - expected).max() < 1e-9


def test_what_does_not_fit_is_refused() -> None:
    mesh = bodies.box((1, 1, 1), order=1)
    with pytest.raises(MeshingError, match="leaves the box"):
        tiled(mesh, (2, 2, 2), box=(0.5, 1.0, 1.0))
    with pytest.raises(MeshingError, match="are no mesh"):
        tiled(mesh, (2, 0, 2))
