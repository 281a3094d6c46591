"""Printed bars in a body that deforms: their own wells, their legs, and where they give way."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.anchors import window
from mu_addon.design.parameters import load_preset
from mu_addon.design.waveguide import waveguide
from mu_addon.errors import InputError
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.graph import Limits, lattice_graph
from mu_addon.sensing.embedded_waveguide import Joints, WaveguideShape, embed_waveguide
from mu_addon.sensing.guide import Centreline
from mu_addon.sensing.light_law import straight_guide
from mu_addon.sensing.notched import well_angles, with_wells

from .bars import bent_to_a_circle, body, of_window

REST = np.eye(3)


@pytest.mark.parametrize("preset", ["mu-0.75x", "mu-1.0x", "mu-1.5x"])
def test_the_printed_bars_own_wells(preset: str) -> None:
    unit = load_preset(preset)
    bar = waveguide(unit, window(unit, "alpha6"))
    guide = of_window("alpha6", preset)
    z = [well.centre[2] for well in bar.wells]
    np.testing.assert_allclose(guide.shape.wells, z - bar.points[0, 2], atol=1e-9)
    assert len(guide.shape.junctions) == 4
    assert guide.s[-1] == pytest.approx(np.linalg.norm(bar.points[-1] - bar.points[0]))
    # What the law is fitted to has the same wells, from the first node on.
    d = unit.printed
    like = np.asarray(straight_guide(d, 3 * d.cell).wells) - d.waveguide_end
    np.testing.assert_allclose(like, np.asarray(guide.shape.wells) - guide.s[1], atol=1e-9)


def test_a_bent_path_keeps_its_bends_out_of_its_curvature() -> None:
    """A bar along a chain of struts: at rest its legs are straight; turned as a whole they stay so."""
    unit = load_preset("mu-1.0x")
    graph = lattice_graph(unit.printed)
    chain = next(c for k, c in enumerate(graph.chains(Limits())) if k == 1379)
    nodes = graph.nodes[list(chain)]
    bar = waveguide(unit, nodes)
    guide = embed_waveguide(bar, nodes, unit.printed)
    legs = guide.at_rest
    assert len(legs) == len(bar.points) - 1 > 1
    assert len(guide.shape.wells) == len(bar.wells)
    turn = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    for turned in (legs, guide.legs(nodes @ turn.T, np.tile(turn, (len(nodes), 1, 1)))):
        for leg in turned:
            np.testing.assert_allclose(leg.curvature, 0, atol=1e-9)
            np.testing.assert_allclose(leg.stretch, 1, rtol=1e-9)
    assert [leg.s[0] for leg in legs[1:]] == [leg.s[-1] for leg in legs[:-1]]


def test_nodes_on_a_circle_bend_the_bar_to_it() -> None:
    guide, curvature = of_window("alpha5"), 0.01
    mesh = body(load_preset("mu-1.0x"))
    u = bent_to_a_circle(mesh.nodes, curvature, y=25.0) - mesh.nodes
    (leg,) = guide.legs(*Joints.of(mesh, guide.nodes).moved(u))
    held_part = (leg.s > guide.s[1] + 0.5) & (leg.s < guide.s[-2] - 0.5)
    # The wells look toward +y, the inside of this bend.
    np.testing.assert_allclose(leg.curvature[held_part], -curvature, rtol=0.03)
    np.testing.assert_allclose(leg.stretch[held_part], 1, atol=2e-3)


def test_joints_turn_by_the_bodys_rotation_alone() -> None:
    mesh = body(load_preset("mu-1.0x"))
    a = np.radians(30)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    strain = np.array([[1.1, 0.05, 0], [0.05, 0.95, 0.1], [0, 0.1, 1.0]])
    joints = Joints.of(mesh, np.array([[0.0, 25, 43.75]]))
    position, rotation = joints.moved(mesh.nodes @ (turn @ strain).T - mesh.nodes)
    np.testing.assert_allclose(rotation[0], turn, atol=1e-9)
    np.testing.assert_allclose(position[0], turn @ strain @ [0, 25, 43.75], atol=1e-9)


def test_a_bar_gives_way_at_its_wells() -> None:
    """Ends that are pulled and do not turn, and ends that turn: the same on average, more in the wells."""
    shape = of_window("alpha4").shape
    s = np.linspace(0, 30, 1201)
    between = (s > 2.5) & (s < 27.5)
    along = np.where(between, 0.02, 0.0)
    pulled = Centreline(
        s, np.column_stack([0 * s, 0 * s, s + np.cumsum(along) * s[1]]), np.tile([0, 1.0, 0], (1201, 1))
    )
    assert (well_angles(shape, pulled) > 0.02).all()
    found = with_wells(shape, pulled)
    assert found.points[-1, 2] == pytest.approx(pulled.points[-1, 2], abs=0.02)
    np.testing.assert_allclose(found.normals[-1], [0, 1, 0], atol=0.01)
    bare = WaveguideShape(1.5, 1.5, (), 1.0, 0.65, shape.junctions)
    np.testing.assert_allclose(with_wells(bare, pulled).curvature, 0, atol=1e-9)


@pytest.mark.parametrize(("pull", "turn"), [(0.5, 0.0), (0.0, 0.2)])
def test_how_far_wells_open_against_plane_elasticity(pull: float, turn: float) -> None:
    """The bar between its end nodes in plane stress: wells open as beam theory says, and a little more.

    Beam theory leaves out that force lines crowd at a well's corners.
    """
    wells = of_window("alpha4").shape.wells
    exact = _openings(25.0, [w - 2.5 for w in wells], pull, turn)
    s = np.linspace(0, 30, 1201)
    steps = (1 + np.where((s > 2.5) & (s < 27.5), pull / 25, 0.0)) * s[1]
    angle = np.clip((s - 2.5) / 25, 0, 1) * -turn
    points = np.column_stack([0 * s, -np.cumsum(np.sin(angle) * steps), np.cumsum(np.cos(angle) * steps)])
    line = Centreline(s, points, np.column_stack([0 * s, np.cos(angle), np.sin(angle)]))
    shape = of_window("alpha4").shape
    found = with_wells(shape, line)
    opened = np.interp(wells, found.s, found.stretch - 1) + 0.75 * np.interp(wells, found.s, found.curvature)
    np.testing.assert_allclose(opened / exact, 0.84, atol=0.07)
    # Sections that stay as they are along the bar would open them by a third of that or less.
    smooth = np.interp(wells, line.s, line.stretch - 1) + 0.75 * np.interp(wells, line.s, line.curvature)
    assert (np.abs(smooth / exact) < 0.34).all()


def _openings(length: float, wells: list[float], pull: float, turn: float) -> np.ndarray:
    """How far wells (n,) open in mm, plane stress; the end faces stay plane, are pulled apart and turned."""
    h, poisson = 0.05, 0.45
    C = np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]]) / (1 - poisson**2)
    K = np.zeros((8, 8))
    for a in (-(3**-0.5), 3**-0.5):
        for b in (-(3**-0.5), 3**-0.5):
            slope = np.array([[b - 1, 1 - b, 1 + b, -1 - b], [a - 1, -1 - a, 1 + a, 1 - a]]) / (2 * h)
            B = np.zeros((3, 8))
            B[0, ::2] = B[2, 1::2] = slope[0]
            B[1, 1::2] = B[2, ::2] = slope[1]
            K += B.T @ C @ B * h * h / 4
    columns, rows = round(length / h), round(1.5 / h)
    y = (np.arange(rows) + 0.5) * h - 0.75
    there = np.ones((columns, rows), bool)
    edges = [(round((w - 0.5) / h), round((w + 0.5) / h)) for w in wells]
    for first, last in edges:
        there[first:last, y > 0.75 - 0.65] = False
    i, j = np.nonzero(there)
    corner = i * (rows + 1) + j
    element = np.stack([corner, corner + rows + 1, corner + rows + 2, corner + 1], axis=1)
    dof = np.stack([2 * element, 2 * element + 1], axis=2).reshape(len(i), 8)
    total = 2 * (columns + 1) * (rows + 1)
    entries = np.tile(K.ravel(), len(dof)), (np.repeat(dof, 8, axis=1).ravel(), np.tile(dof, (1, 8)).ravel())
    A = sp.coo_matrix(entries, (total, total)).tocsr()
    u, fixed = np.zeros(total), np.ones(total, bool)
    fixed[dof.ravel()] = False
    height = np.arange(rows + 1) * h - 0.75
    for column, way, angle in ((0, 0.0, turn / 2), (columns, pull, -turn / 2)):
        nodes = column * (rows + 1) + np.arange(rows + 1)
        u[2 * nodes] = way + angle * height
        fixed[2 * nodes] = True
        fixed[2 * nodes[rows // 2] + 1] = True
    free = ~fixed
    u[free] = spsolve(A[free][:, free].tocsc(), -A[free][:, fixed] @ u[fixed])
    top = u[2 * (np.arange(columns + 1) * (rows + 1) + rows)]
    return np.array([top[last] - top[first] for first, last in edges])


def test_a_printed_joint_turns_with_its_body() -> None:
    unit = load_preset("mu-1.0x").evolve(count=3)
    mesh = mesh_printed(unit, MeshSettings(refine=0.2))
    nodes = np.array([[0.0, 25.0, 18.75], [12.5, 25.0, 18.75], [-12.5, 25.0, 18.75]])
    turn = Rotation.from_euler("x", 20.0, degrees=True).as_matrix()
    at, turned = Joints.of(mesh, nodes).moved(mesh.nodes @ turn.T - mesh.nodes)
    np.testing.assert_allclose(at, nodes @ turn.T, atol=1e-9)
    np.testing.assert_allclose(turned, np.broadcast_to(turn, (3, 3, 3)), atol=1e-9)
    with pytest.raises(InputError, match="not a node"):
        Joints.of(mesh, nodes + 1.0)
