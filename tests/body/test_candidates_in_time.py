"""Printed waveguides where a state depends on those before it: instant by instant, each on its own mesh."""

import attrs
import numpy as np
import pytest

from mu_addon.body.candidates import PrintedWaveguides
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design import load_preset
from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.wall_material import Wall
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import BODY_OBSTACLE_NEWTON
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Plane
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings

SMALL = load_preset("mu-1.0x")
SMALL = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, count=3))
(ALONG_ALL,) = windows(3)
ANCHORS = anchor_points(SMALL)
SIDE = SMALL.printed.bounds[1][1]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SMALL, MeshSettings(refine=0.4), solid=True)


def candidates(mesh, unit=SMALL, beside=False):
    """The one waveguide of three chambers, with a wall along the lattice's side or without."""

    def model(own):
        found = Model(own, threads=1)
        if beside:
            plane = Plane((0.0, SIDE, 0.0), (0.0, -1.0, 0.0))
            found.obstacles = (Obstacle(own, plane, 0.1, 0.05, friction=0.3),)
        return found

    paths = (ANCHORS[list(ALONG_ALL.indices)],)
    settings = attrs.evolve(BODY_OBSTACLE_NEWTON, tolerance=1e-8)
    return PrintedWaveguides(unit, mesh, paths, ANCHORS, lambda own: materials_of(unit, own), model, settings)


@pytest.mark.nightly("test_a_wall_that_relaxes_lets_a_candidate_go_on")
def test_what_remembers_nothing_is_where_pressure_alone_takes_it(mesh):
    free = candidates(mesh)
    moved = free.simulated_in_time(0, np.array([0.0, 1.0]), np.array([0.0, -4.0]))
    assert np.abs(moved[0] - ANCHORS).max() == 0.0
    assert np.abs(moved[1] - free.alone(0, np.array([-0.004]))[0]).max() < 1e-6


@pytest.mark.nightly("test_a_wall_that_relaxes_lets_a_candidate_go_on")
def test_an_obstacle_holds_a_candidate_back(mesh):
    time, pressure = np.array([0.0, 1.0]), np.array([0.0, 10.0])
    free, held = (
        candidates(mesh, beside=beside).simulated_in_time(0, time, pressure)[1] for beside in (False, True)
    )
    assert free[-1, 1] - held[-1, 1] > 0.02


def test_a_wall_that_relaxes_lets_a_candidate_go_on(mesh):
    """A share of 0.3 of the shear modulus goes: the motion grows by 1 / 0.7 and some, after ten times tau."""
    slow = attrs.evolve(SMALL, wall=Wall(law="prony", prony_g1=0.3, prony_tau1_s=1.0))
    time, pressure = np.array([0.0, 1e-3, 10.0]), np.array([0.0, -1.0, -1.0])
    moved = candidates(mesh, slow).simulated_in_time(0, time, pressure) - ANCHORS
    at_once, later = np.linalg.norm(moved[1:, -1], axis=1)
    assert 1.3 < later / at_once < 1.6
