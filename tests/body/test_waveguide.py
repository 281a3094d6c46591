"""A printed waveguide in the printed mesh: its volume, its ties and what it does to a motion."""

import attrs
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mu_addon.body.bar import bar_mesh, outside_bar
from mu_addon.body.candidates import PrintedWaveguides
from mu_addon.body.octants import thickened_nodes
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.body.start import eased, started
from mu_addon.body.waveguide import bar_of, with_waveguide
from mu_addon.design import load_preset
from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.lattice import lattice_of
from mu_addon.design.solid import build_solid
from mu_addon.design.surface import volume
from mu_addon.errors import InputError
from mu_addon.fem.carried_nodes import following
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import BODY_NEWTON
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.state import State
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import mirror
from mu_addon.meshing.settings import MeshSettings

from .ties import require_linear_motions_kept


def short(name):
    unit = load_preset(name)
    return attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))


SMALL, THIN = short("mu-1.0x"), short("mu-0.75x")
(ALONG_ALL,) = windows(3)


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SMALL, MeshSettings(refine=0.6))


@pytest.fixture(scope="module")
def sensed(mesh):
    return with_waveguide(mesh, bar_of(SMALL, ALONG_ALL), SMALL)


@pytest.fixture(scope="module")
def thin():
    return mesh_printed(THIN, MeshSettings(refine=0.6))


@pytest.fixture(scope="module")
def bent(mesh):
    return with_waveguide(mirror(mesh, "x"), bar_of(SMALL, path_of(SMALL)), SMALL)


def path_of(unit):
    """A bent path of lattice nodes that has room for seats."""
    nodes = lattice_of(unit.printed).nodes
    wanted = (
        np.array([[-1.0, 1.0, 0.5], [-0.5, 1.5, 1.0], [0.0, 2.0, 1.5], [0.0, 2.0, 2.5]]) * unit.printed.cell
    )
    away = np.linalg.norm(nodes[None] - wanted[:, None], axis=2)
    assert away.min(axis=1).max() < 1e-9
    return nodes[away.argmin(axis=1)]


def added_mm3(unit, path):
    drawn = [build_solid(unit, p, "export") for p in (path, None)]
    return np.subtract(*(volume(s.vertices, s.triangles) for s in drawn))


def resin_mm3(mesh):
    return Model(mesh).volumes.sum() * 2 ** len(mesh.symmetry)


@pytest.mark.nightly("test_a_half_holds_half_of_what_the_whole_holds")
def test_it_adds_the_resin_that_the_drawn_waveguide_adds(mesh, sensed):
    added = resin_mm3(sensed) - resin_mm3(mesh)
    # 2.12 % more than drawn, at any fineness of struts: what seats and struts share at their edges.
    assert added == pytest.approx(added_mm3(SMALL, ALONG_ALL), rel=0.025)


@pytest.mark.nightly("test_only_the_struts_that_a_waveguide_meets_are_thickened")
def test_struts_that_it_thickens_are_as_thick_as_drawn(thin):
    sensed = with_waveguide(thin, bar_of(THIN, ALONG_ALL), THIN)
    count = len(thin.nodes)
    assert (sensed.nodes[:count] != thin.nodes).any(axis=1).sum() > 500
    assert resin_mm3(sensed) - resin_mm3(thin) == pytest.approx(added_mm3(THIN, ALONG_ALL), rel=0.02)
    require_linear_motions_kept(sensed)


@pytest.mark.nightly("test_a_bent_bar_is_meshed_as_drawn")
def test_a_bent_waveguide_off_the_mirror_plane_adds_what_is_drawn(mesh, bent):
    added = resin_mm3(bent) - resin_mm3(mesh)
    assert added == pytest.approx(added_mm3(SMALL, path_of(SMALL)), rel=0.02)


def test_a_bent_bar_is_meshed_as_drawn():
    bar = bar_of(SMALL, path_of(SMALL))
    found = bar_mesh(bar, False, [lambda points: np.ones(len(points))])
    drawn = attrs.evolve(bar, seats=())
    solid = drawn.solid()
    for cut in drawn.cut_solids():
        solid -= cut
    assert Model(found).volumes.sum() == pytest.approx(solid.volume(), rel=1e-9)
    assert outside_bar(bar, found.nodes).max() < 1e-9


def test_a_half_holds_half_of_what_the_whole_holds(mesh, sensed):
    whole = with_waveguide(mirror(mesh, "x"), bar_of(SMALL, ALONG_ALL), SMALL)
    assert resin_mm3(whole) == pytest.approx(resin_mm3(sensed), rel=1e-4)


def test_only_the_struts_that_a_waveguide_meets_are_thickened(thin):
    bar, d = bar_of(THIN, ALONG_ALL), THIN.printed
    nodes = thin.nodes[thin.nodes[:, 1] > d.cell]
    moved = thickened_nodes(d, bar, nodes) - nodes
    far = np.abs(nodes - [0.0, 2.0 * d.cell, nodes[:, 2].mean()])[:, :2].max(axis=1) > d.cell / 2.0 + 1e-9
    assert not moved[far].any()
    # At junctions by as much as their radius lacks of half the bar's, nowhere by more.
    lacking = bar.half - d.junction_diameter / 2.0
    assert 0.5 * lacking < np.linalg.norm(moved, axis=1).max() < 2.5 * lacking
    for axis in (0, 2):
        on_plane = np.abs(np.mod(nodes[:, axis], d.cell / 2.0)) < 1e-9
        assert np.abs(moved[on_plane, axis]).max() < 1e-9


def test_the_unit_s_own_mesh_comes_first_and_stays(mesh, sensed):
    count, elements = len(mesh.nodes), len(mesh.tets)
    assert np.array_equal(sensed.nodes[:count], mesh.nodes)
    assert np.array_equal(sensed.tets[:elements], mesh.tets)
    assert (sensed.filled[:elements] <= mesh.filled).all()
    far = np.linalg.norm(mesh.nodes[mesh.tets].mean(axis=1)[:, :2] - [0.0, 25.0], axis=1) > 5.0
    assert np.array_equal(sensed.filled[:elements][far], mesh.filled[far])


@pytest.mark.parametrize("which", ["sensed", "bent"])
def test_ties_neither_chain_nor_repeat_and_keep_straight_what_is_straight(which, request):
    found = request.getfixturevalue(which)
    assert not np.isin(found.tied_to, found.tied).any()
    assert len(np.unique(found.tied)) == len(found.tied)
    require_linear_motions_kept(found)


def test_a_turned_unit_turns_its_waveguide_with_it(thin):
    """What `started` makes of a rigid motion is that motion, bends, seats and thickened struts included."""
    unit = mirror(thin, "x")
    path = path_of(THIN)
    whole = with_waveguide(unit, bar_of(THIN, path), THIN)
    turn = Rotation.from_rotvec([0.3, -0.2, 0.4]).as_matrix()

    def move(nodes):
        return nodes @ (turn.T - np.eye(3)) + [1.0, -2.0, 0.5]

    u = move(unit.nodes)
    u[unit.beams[:, 1::2]] = [0.3, -0.2, 0.4]
    is_place = np.ones(len(whole.nodes), bool)
    is_place[unit.beams[:, 1::2]] = False
    found = started(unit, whole, path, u)
    assert np.abs(found - move(whole.nodes))[is_place].max() < 1e-9


def test_a_candidate_is_found_from_model_a_s_state_as_along_its_own_path(mesh):
    def materials(m):
        return materials_of(SMALL, m)

    still = Equilibrium(Model(mesh), materials(mesh), BODY_NEWTON)
    state = still.reach(-0.004, [still.at_zero_pressure()])
    anchors = anchor_points(SMALL)
    candidates = PrintedWaveguides(SMALL, mesh, (anchors,), anchors, materials, Model, BODY_NEWTON)
    moved = candidates.points(candidates.states(0, [state]))[0]
    alone = candidates.alone(0, np.array([-0.004]))[0]
    assert np.abs(moved - alone).max() < 1e-6
    without = candidates.points([state])[0]
    # A bar as stiff as the lattice beside it changes the way of its anchors by tenths of their motion.
    apart = np.linalg.norm(moved - without, axis=1).max()
    assert 0.02 < apart / np.linalg.norm(without - anchors, axis=1).max() < 0.5


def test_a_start_far_from_rest_inverts_nothing_once_its_struts_give_way(mesh, sensed):
    """The unit is pressed shorter by a tenth; a bar has to stay as long as it is."""
    u = np.zeros_like(mesh.nodes)
    u[:, 2] = -0.1 * (mesh.nodes[:, 2] - mesh.nodes[mesh.base[0], 2])
    u[mesh.beams[:, 1::2]] = 0.0
    following(mesh, u)
    equilibrium = Equilibrium(Model(sensed), materials_of(SMALL, sensed), BODY_NEWTON)
    least = equilibrium.model.smallest_jacobian
    start = started(mesh, sensed, anchor_points(SMALL), u)
    found = eased(equilibrium, start, u)
    assert least(start, equilibrium.parameters)[0] < 0.3
    assert least(found, equilibrium.parameters)[0] > 0.7
    assert np.abs((found - start)[len(u) :]).max() < 1e-6
    assert np.array_equal(eased(equilibrium, 0.0 * start, 0.0 * u), 0.0 * start)


def test_a_waveguide_does_not_touch_what_stands_on_it(mesh, sensed):
    contact = SelfContact(sensed, 0.1, 0.1)
    assert not contact.intersects(np.zeros_like(sensed.nodes))
    assert contact.count(np.zeros_like(sensed.nodes)) == 0
    # Its bar touches as the struts do: its nodes lie behind those of the unit.
    assert (contact.facets >= len(mesh.nodes)).any()


def test_the_unit_s_own_nodes_are_seen_where_they_would_be_without_thickening(thin):
    anchors = anchor_points(THIN)
    candidates = PrintedWaveguides(
        THIN, thin, (anchors,), anchors, lambda m: materials_of(THIN, m), Model, BODY_NEWTON
    )
    sensed = with_waveguide(thin, bar_of(THIN, anchors), THIN)
    gradient = np.array([[0.02, 0.0, 0.0], [0.0, -0.01, 0.03], [0.0, 0.02, 0.01]])
    seen = candidates.of_unit(0, State(0.001, sensed.nodes @ gradient.T))
    assert np.abs(seen - thin.nodes @ gradient.T).max() < 1e-9


def test_what_the_model_does_not_follow_is_refused(mesh):
    with pytest.raises(InputError, match="not its own image"):
        with_waveguide(mesh, bar_of(SMALL, path_of(SMALL)), SMALL)
    with pytest.raises(InputError, match="not a node of the lattice"):
        bar_of(SMALL, path_of(SMALL) + 0.1)
