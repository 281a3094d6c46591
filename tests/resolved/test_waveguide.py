"""A printed waveguide in the resolved mesh: its volume, its ties and what it does to a motion."""

import attrs
import numpy as np
import pytest

from mu_addon.design import load_preset
from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.solid import build_solid
from mu_addon.design.surface import volume
from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import RESOLVED_NEWTON
from mu_addon.fem.unit import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.resolved.candidates import PrintedWaveguides
from mu_addon.resolved.unit import mesh_printed
from mu_addon.resolved.waveguide import bar_of, with_waveguide

from .ties import require_linear_motions_kept

SMALL = load_preset("mu-1.0x")
SMALL = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, count=3))
(ALONG_ALL,) = windows(3)


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SMALL, MeshSettings(refine=0.6))


@pytest.fixture(scope="module")
def sensed(mesh):
    return with_waveguide(mesh, bar_of(SMALL, ALONG_ALL))


def test_it_adds_the_resin_that_the_drawn_waveguide_adds(mesh, sensed):
    drawn = [build_solid(SMALL, path, "export") for path in (ALONG_ALL, None)]
    added = np.subtract(*(volume(s.vertices, s.triangles) for s in drawn))
    assert 2 * (Model(sensed).volumes.sum() - Model(mesh).volumes.sum()) == pytest.approx(added, rel=0.03)


def test_the_unit_s_own_mesh_comes_first_and_stays(mesh, sensed):
    count, elements = len(mesh.nodes), len(mesh.tets)
    assert np.array_equal(sensed.nodes[:count], mesh.nodes)
    assert np.array_equal(sensed.tets[:elements], mesh.tets)
    assert (sensed.filled[:elements] <= mesh.filled).all()
    far = np.linalg.norm(mesh.nodes[mesh.tets].mean(axis=1)[:, :2] - [0.0, 25.0], axis=1) > 5.0
    assert np.array_equal(sensed.filled[:elements][far], mesh.filled[far])


def test_ties_neither_chain_nor_repeat_and_keep_straight_what_is_straight(sensed):
    assert not np.isin(sensed.tied_to, sensed.tied).any()
    assert len(np.unique(sensed.tied)) == len(sensed.tied)
    require_linear_motions_kept(sensed)


def test_a_candidate_is_found_from_model_a_s_state_as_along_its_own_path(mesh):
    def model(m):
        return Model(m)

    def materials(m):
        return materials_of(SMALL, m)

    still = Equilibrium(model(mesh), materials(mesh), RESOLVED_NEWTON, explains=False)
    state = still.reach(-0.004, [still.at_zero_pressure()])
    candidates = PrintedWaveguides(
        SMALL, mesh, (ALONG_ALL.name,), anchor_points(SMALL), materials, model, RESOLVED_NEWTON
    )
    moved = candidates.points(candidates.states(state))[0]
    alone = candidates.alone(0, np.array([-0.004]))[0]
    assert np.abs(moved - alone).max() < 1e-6
    without = candidates.points([state])[0]
    # A bar as stiff as the lattice beside it changes the way of its anchors by tenths of their motion.
    apart = np.linalg.norm(moved - without, axis=1).max()
    assert 0.02 < apart / np.linalg.norm(without - anchor_points(SMALL), axis=1).max() < 0.5


def test_what_the_model_does_not_follow_is_refused(mesh):
    small = load_preset("mu-0.75x")
    with pytest.raises(InputError, match="thickened where they meet"):
        bar_of(small, windows(small.dimensions.count)[0])
    bar = bar_of(SMALL, ALONG_ALL)
    bent = attrs.evolve(bar, points=bar.points + np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    with pytest.raises(InputError, match="straight waveguides along z"):
        with_waveguide(mesh, bent)
