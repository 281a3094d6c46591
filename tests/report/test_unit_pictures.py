"""The unit's pictures: right parts, right place, right side of the cut."""

import io

import attrs
import numpy as np
import pytest
from PIL import Image

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.design.surface import volume
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, Mesh, mirror, second_order
from mu_addon.meshing.settings import MeshSettings
from mu_addon.report import unit_pictures as pictures
from mu_addon.report.render import Part
from mu_addon.report.unit_pictures import region_skin, skin


def cube(order, low=(0.0, -1.0, 0.0), high=(1.0, 1.0, 2.0)):
    """Five tetrahedra; the middle one is membrane."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    nodes = np.asarray(low) + corners * (np.asarray(high) - np.asarray(low))
    tets = np.array([[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 6, 3], [4, 0, 5, 6], [7, 3, 6, 5]])
    negative = np.linalg.det(nodes[tets[:, 1:]] - nodes[tets[:, :1]]) < 0
    tets[negative] = tets[negative][:, [1, 0, 2, 3]]
    triangles = np.zeros((0, 3), int)
    if order == 2:
        from mu_addon.meshing.mesh import edges_of

        middles = nodes[edges_of(tets)[0]].mean(axis=1)
        nodes, tets, triangles = second_order(nodes, tets, triangles, middles)
    region = np.array([MEMBRANE, LATTICE, LATTICE, LATTICE, LATTICE])
    return Mesh(nodes, tets, region, triangles, np.array([0]), np.array([1]), ("x",))


@pytest.mark.parametrize(("order", "faces"), [(1, 12), (2, 48)])
def test_skin_is_closed_and_outward(order, faces):
    mesh = cube(order)
    skin = pictures.skin(mesh.tets)
    assert skin.shape == (faces, 3)
    assert volume(mesh.nodes, skin) == pytest.approx(4.0)
    edges = np.sort(skin[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    inside = pictures.skin(mesh.tets[mesh.region == MEMBRANE])
    assert volume(mesh.nodes, inside) == pytest.approx(4.0 / 3.0)


def opened(picture):
    return np.asarray(Image.open(io.BytesIO(picture.png))).astype(int)


def test_half_and_whole_mesh_show_the_same_motion():
    half = cube(2)
    whole = mirror(half, "x")

    def states(mesh):
        bent = np.zeros_like(mesh.nodes)
        bent[:, 1] = 0.3 * mesh.nodes[:, 2] ** 2
        return [(np.zeros_like(bent), "at rest", "a"), (bent, "bent", "b")]

    shown = pictures.motion(half, states(half), width=120)
    again = pictures.motion(whole, states(whole), width=120)
    assert [p.caption for p in shown] == ["at rest", "bent"]
    for one, other in zip(shown, again, strict=True):
        close = np.abs(opened(one) - opened(other)).max(axis=2) < 24
        assert close.mean() > 0.97
    # +y is to the right, and the bent unit leans that way.
    rest, bent = (np.nonzero(opened(p)[..., 2] < 240) for p in shown)
    assert bent[1].max() > rest[1].max() + 15
    assert bent[1].min() == pytest.approx(rest[1].min(), abs=3)


def test_section_shows_membrane_and_lattice_in_their_colours():
    shown = pictures.motion(cube(1), [(np.zeros((8, 3)), "", "")], width=200)[0]
    colors = opened(shown)[..., :3].reshape(-1, 3)
    warm = (colors[:, 0] - colors[:, 2] > 40).mean()
    cool = (colors[:, 2] - colors[:, 0] > 15).mean()
    # Of the plane x = 0 the inner tetrahedron touches an edge only: the section is lattice.
    assert warm < 0.02
    assert cool > 0.3


def test_unit_is_parted_into_membrane_and_lattice():
    d = load_preset("mu-1.0x").dimensions
    far = 1.4 * d.R
    vertices = np.array(
        [[0, 0, 1], [d.r, 0, 1], [0, d.r, 1], [far, 0, 9], [far, 1, 9], [far, 0, 8], [1, 1, -3.0]]
    )
    faces = np.array([[0, 1, 2], [3, 4, 5], [0, 1, 6], [2, 3, 4]])
    membrane, lattice = pictures.unit_parts(d, vertices, faces)
    assert membrane.faces.tolist() == [[0, 1, 2], [0, 1, 6]]
    assert lattice.faces.tolist() == [[3, 4, 5], [2, 3, 4]]
    assert membrane.color != lattice.color


def test_side_view_is_to_scale_with_the_sensor_on_its_anchors():
    mesh = cube(1, low=(-15.0, -15.0, 0.0), high=(15.0, 30.0, 75.0))
    body = Part(mesh.nodes, pictures.skin(mesh.tets), pictures.LATTICE_COLOR)
    anchors = np.stack([np.zeros(6), np.full(6, 20.0), (np.arange(6) + 0.5) * 12.5], axis=1)
    view = pictures.side_view([body], anchors, anchors[3:6], 1.0, width=180)
    left, right, bottom, top = view.extent
    height, width = view.image.shape[:2]
    assert width / height == pytest.approx((right - left) / (top - bottom), rel=0.01)

    def pixel(y, z):
        return view.image[int((top - z) / (top - bottom) * height), int((y - left) / (right - left) * width)]

    for z in (50.0, 62.5):
        orange = pixel(20.0, z).astype(int)
        assert orange[0] > orange[1] + 60 > orange[2] + 60
    assert np.ptp(pixel(20.0, 25.0)[:3].astype(int)) < 60
    assert pixel(20.0, 6.25)[:3].max() < 80
    assert view.anchors.tolist() == anchors[:, 1:].tolist()


def test_portrait_is_opaque_white_around_the_unit():
    mesh = cube(1, low=(-15.0, -15.0, 0.0), high=(15.0, 30.0, 75.0))
    body = Part(mesh.nodes, pictures.skin(mesh.tets), pictures.LATTICE_COLOR)
    image = pictures.portrait([body], np.zeros((0, 3)), np.zeros((0, 3)), 1.0, width=120)
    assert image[0, 0].tolist() == [255, 255, 255, 255]
    assert (image[..., :3] < 230).any(axis=2).mean() > 0.5


def test_struts_of_a_printed_unit_are_drawn_up_to_their_wall():
    """No triangle of a strut lies within the wall by all its nodes, and none of those outside is missing."""
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))
    mesh = mesh_printed(unit, MeshSettings(refine=0.5))
    drawn = region_skin(mesh, LATTICE)
    every = skin(mesh.tets[mesh.region == LATTICE])
    within = np.isin(every, mesh.tied).all(axis=1)
    assert within.any()
    assert np.array_equal(drawn, every[~within])
    assert np.array_equal(region_skin(mesh, MEMBRANE), skin(mesh.tets[mesh.region == MEMBRANE]))
