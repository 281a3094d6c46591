import numpy as np
import pytest

from mu_addon.design import surface
from mu_addon.errors import InputError

CORNERS = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 3.0) for z in (0.0, 4.0)])
FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
)


def test_measures_of_a_box():
    assert surface.volume(CORNERS, FACES) == pytest.approx(24.0)
    assert surface.area(CORNERS, FACES) == pytest.approx(52.0)
    assert surface.genus(CORNERS, FACES) == 0
    assert surface.bad_edges(FACES) == 0


def test_a_missing_or_turned_face_is_seen():
    assert surface.bad_edges(FACES[1:]) == 3
    assert surface.bad_edges(np.concatenate([FACES[:1, ::-1], FACES[1:]])) == 3
    assert surface.bad_edges(np.concatenate([FACES, FACES[:1]])) == 3


def test_stl_survives_reading_back():
    content = surface.stl_bytes(CORNERS, FACES)
    assert len(content) == 84 + 50 * len(FACES)
    assert not content.startswith(b"solid")
    vertices, triangles = surface.stl_surface(content)
    assert surface.bad_edges(triangles) == 0
    assert surface.volume(vertices, triangles) == pytest.approx(24.0)
    normals = np.frombuffer(content, surface._STL, offset=84)["normal"]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    with pytest.raises(InputError, match="binary STL is truncated"):
        surface.stl_surface(content[:-1])


def test_weld_closes_what_single_precision_would_open():
    """Each triangle with corners of its own, off by less than a quantum, becomes one closed box again."""
    rng = np.random.default_rng(1)
    loose = CORNERS[FACES].reshape(-1, 3) + rng.uniform(-2e-6, 2e-6, (36, 3))
    faces = np.arange(36).reshape(-1, 3)
    assert surface.bad_edges(faces) == 36
    vertices, triangles = surface.weld(loose, faces, 1e-4)
    assert len(vertices) == 8
    assert surface.bad_edges(triangles) == 0
    assert surface.volume(vertices, triangles) == pytest.approx(24.0)


def test_weld_removes_what_collapses():
    """A fin thinner than the quantum folds flat: its two faces cancel and leave the box."""
    fin = np.array([[1.0, 3.0, 4.0 + 2e-6], [1.0, 3.0, 4.0]])
    extra = np.array([[3, 7, 8], [7, 3, 9]])
    vertices, triangles = surface.weld(
        np.concatenate([CORNERS, fin]), np.concatenate([FACES, extra, [[8, 8, 9]]]), 1e-4
    )
    assert surface.bad_edges(triangles) == 0
    assert len(triangles) == len(FACES)
    assert len(vertices) == 8


def test_weld_order_does_not_depend_on_the_input_order():
    rng = np.random.default_rng(2)
    shuffle, turn = rng.permutation(8), rng.permutation(12)
    renumbered = np.roll(np.argsort(shuffle)[FACES][turn], 1, axis=1)
    for one, other in zip(
        surface.weld(CORNERS, FACES, 1e-4), surface.weld(CORNERS[shuffle], renumbered, 1e-4), strict=True
    ):
        assert np.array_equal(one, other)


@pytest.mark.filterwarnings("error")
def test_a_signalling_nan_in_a_damaged_stl_is_read_without_a_warning():
    """Whoever reads the file refuses it in words of its own."""
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    content = bytearray(surface.stl_bytes(triangle, np.array([[0, 1, 2]])))
    content[84 + 12 : 84 + 16] = (0x7FA00000).to_bytes(4, "little")
    vertices, triangles = surface.stl_surface(bytes(content))
    assert np.isnan(vertices).sum() == 1
    assert triangles.shape == (1, 3)
