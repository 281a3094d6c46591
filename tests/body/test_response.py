"""Bars between joints: their stiffness by closed forms, and what moves with them does not strain them."""

import attrs
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mu_addon.body.candidates import PrintedWaveguides
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.body.response import _frame, _natural, _stiffness, bar_response
from mu_addon.design import load_preset
from mu_addon.design.anchors import anchor_points
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import BODY_NEWTON
from mu_addon.fem.trajectory import simulate, whole_body
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.graph import lattice_graph
from mu_addon.placement.sensitivity_map import loaded


@pytest.mark.parametrize("r", [0.0, 0.1])
def test_a_beam_with_rigid_ends_is_stiffer_as_the_textbook_has_it(r):
    """With a share r of the length rigid at either end."""
    clear = 1.0 - 2.0 * r
    t = np.linspace(r, 1.0 - r, 401)
    found = _stiffness(t, np.full(401, 3.0), np.full(401, 5.0), np.full(401, 7.0), 2.0)
    assert np.diag(found)[:2] == pytest.approx([1.5 / clear, 2.5 / clear])
    for bending in (found[2:4, 2:4], found[4:, 4:]):
        # Ends that turn alike bend the middle in an S, with the force that moves the clear part aside.
        assert bending.sum() == pytest.approx(12.0 * 3.5 / clear**3, rel=1e-4)
        # Ends that turn against each other bend it evenly.
        assert np.trace(bending) - 2.0 * bending[0, 1] == pytest.approx(4.0 * 3.5 / clear, rel=1e-4)


def moved_bar(seed):
    rng = np.random.default_rng(seed)
    ends = rng.normal(size=(2, 3))
    return _frame(ends[1] - ends[0]), float(np.linalg.norm(ends[1] - ends[0])), ends, rng


def test_a_rigid_motion_strains_no_bar():
    frame, length, ends, _ = moved_bar(1)
    turn = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
    found, _ = _natural(frame, length, ends @ turn.T + [3.0, 1.0, -2.0], np.array([turn, turn]))
    assert np.abs(found).max() < 1e-12


def test_slopes_are_those_of_the_bar_s_deformation():
    """Of a bar moved and turned far, strained little, as a stiff one is."""
    frame, length, ends, rng = moved_bar(2)
    turn = Rotation.from_rotvec([0.7, -0.4, 1.1])
    place, turns = ends @ turn.as_matrix().T, np.array([turn.as_matrix()] * 2)
    _, slopes = _natural(frame, length, place, turns)
    step = 1e-6 * rng.normal(size=12)

    def at(sign):
        shift = sign * np.stack([step[:3], step[6:9]])
        spins = Rotation.from_rotvec(sign * np.stack([step[3:6], step[9:]])).as_matrix()
        return _natural(frame, length, place + shift, spins @ turns)[0]

    np.testing.assert_allclose((at(1) - at(-1)) / 2.0, slopes @ step, atol=1e-12)


@pytest.mark.nightly(
    "tests/placement/test_printed_influence.py::test_a_part_made_stiffer_moves_the_points_as_the_map_says"
)
def test_it_predicts_what_a_printed_waveguide_does():
    """A bent path off the mirror plane of three chambers at 1 kPa, against the full solution with it."""
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))
    anchors, graph = anchor_points(unit), lattice_graph(unit.printed)
    half = mesh_printed(unit, MeshSettings(refine=0.6))
    solver = Equilibrium(Model(half), materials_of(unit, half), BODY_NEWTON)
    mesh, trajectory = whole_body(half, simulate(solver, np.arange(2.0), np.array([0.0, 1.0])))
    chain = (2, 11, 24, 31)
    found = bar_response(
        Model(mesh), materials_of(unit, mesh), unit.printed, trajectory, probe(mesh, anchors), graph
    )
    (predicted,) = found.displacements([chain], np.array([0.001]))
    (state,) = loaded(trajectory)
    candidates = PrintedWaveguides(
        unit,
        mesh,
        (graph.nodes[list(chain)],),
        anchors,
        lambda m: materials_of(unit, m),
        Model,
        BODY_NEWTON,
    )
    solved = np.subtract(*candidates.points([*candidates.states(0, [state]), state]))
    assert np.linalg.norm(predicted[0] - solved) < 0.2 * np.linalg.norm(solved)
