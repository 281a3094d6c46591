"""Struts of lattices of any kind as beams: moduli of frames, and units against the same mesh of solids."""

import functools
import math

import attrs
import numpy as np
import pytest
from scipy.spatial import cKDTree

from mu_addon.body.beams import Layers, integrals
from mu_addon.body.frame import frame_tensor, frame_zones
from mu_addon.body.graph_beams import graph_layers_of, with_graph_beams
from mu_addon.body.joints import POISSON, Zones, zones_of
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.body.strut import strut_mesh
from mu_addon.body.waveguide import bar_of, with_waveguide
from mu_addon.design.anchors import anchor_points
from mu_addon.design.grading import Grading
from mu_addon.design.lattice import filled, lattice_of
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.carried_nodes import Carried
from mu_addon.fem.elements import reference_gradients, shape_functions, tet_quadrature
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.stress import of_sections, peak_stretch
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings
from mu_addon.meshing.tiling import tiled
from tests.design.kinds import BODY_CENTRED, cross, custom, octet

UPRIGHT = cross()
NONE = Zones(0.0, 0.0, ())


def tensor(kind, junction, midspan, zones=NONE):
    """Of a frame of struts of these diameters in cells."""
    one = filled(kind, np.zeros((1, 3), np.int64), 1.0, junction / 2, midspan / 2)
    each = np.arange(len(one.struts))
    return frame_tensor(kind, integrals(one, each, one.struts, 0 * each, 1, zones), POISSON)


def test_half_diagonals_have_the_moduli_of_their_closed_form():
    """C44 = K + (C11 - C12)/6, and the bulk's error that `zones_of` finds by another way."""
    d = load_preset("mu-1.0x").printed
    zones = attrs.evolve(zones_of(d), fewer=())
    sizes = BODY_CENTRED, d.junction_diameter / d.cell, d.midspan_diameter / d.cell
    C, soft = tensor(*sizes, zones), tensor(*sizes)
    bulk = (C[0, 0] + 2 * C[0, 1]) / 3
    assert C[3, 3] == pytest.approx(bulk + (C[0, 0] - C[0, 1]) / 6, rel=1e-9)
    assert (np.diag(C) > np.diag(soft)).all(), "rigid zones stiffen"
    solid = bulk / (1 + zones.bulk_error)
    assert 0.0145 < solid < 0.0152, "the solid cell's, see docs/engineering/method.md"


def test_a_slender_cross_is_the_frame_of_the_textbook():
    """Cubes of bars: E A along an edge, and both bars of a face bend in shear, G = 6 E I/a^4."""
    d = 0.02
    C = tensor(UPRIGHT, d, d)
    assert C[0, 0] == pytest.approx(math.pi * d**2 / 4, rel=1e-9)
    assert C[0, 1] == pytest.approx(0.0, abs=1e-12)
    assert C[3, 3] == pytest.approx(6 * math.pi * (d / 2) ** 4 / 4, rel=0.01)


def test_an_octet_frame_of_slender_bars_has_the_moduli_of_pinned_ones():
    """C11 = 2 C12 = 2 C44 = rho E/6 (Deshpande, Fleck and Ashby, J. Mech. Phys. Solids 49 (2001) 1747)."""
    d = 0.01
    C = tensor(octet(), d, d)
    rho = 6 * math.sqrt(2) * math.pi * (d / 2) ** 2 / (1 / math.sqrt(2)) ** 2
    for value, share in ((C[0, 0], 1 / 6), (C[0, 1], 1 / 12), (C[3, 3], 1 / 12)):
        assert value == pytest.approx(share * rho, rel=0.01)


@pytest.fixture(scope="module")
def unit():
    return load_preset("mu-1.0x").evolve(**custom(UPRIGHT), count=3, seats=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cells")


@pytest.fixture(scope="module")
def meshes(unit, folder):
    """The unit's mesh of one of these names, made when it is asked for."""

    @functools.cache
    def of(name):
        settings = MeshSettings("full" if name == "full" else "half", 0.5)
        return mesh_printed(unit, settings, cache=folder, solid=name == "solid")

    return of


@pytest.fixture(scope="module")
def sensed(unit, meshes):
    path = np.array([[0.0, 25.0, 12.5 * (k + 0.5)] for k in range(3)])
    return {name: with_waveguide(meshes(name), bar_of(unit, path), unit) for name in ("half", "solid")}


def bent(unit, mesh, kPa=5.0):
    solver = Equilibrium(Model(mesh, threads=1), materials_of(unit, mesh))
    state = solver.reach(kPa / 1000, [solver.at_zero_pressure()])
    return bending_angle_deg(mesh, state.u), len(solver.model.free)


def test_zones_give_beams_the_solid_cells_moduli(unit, folder):
    d = unit.printed
    zones = frame_zones(d, folder)
    assert zones.fewer == ()
    assert 0.0 <= zones.stretch < zones.bend < 1.0
    assert -0.3 < zones.bulk_error < 0.0


def plate_force(mesh, axis):
    """Force in N along an axis on the upper plate of a block, moved that way by 1e-4 of its height."""
    height = mesh.nodes[mesh.tip[0], 2]
    held = np.zeros(mesh.nodes.shape, bool)
    held[np.concatenate([mesh.base, mesh.tip])] = True
    moved = np.zeros_like(mesh.nodes)
    moved[:, axis] = 1e-4 * mesh.nodes[:, 2]
    moved[mesh.beams[:, 1::2]] = 0.0
    model = Model(attrs.evolve(mesh, base=mesh.base[:0], tip=mesh.tip[:0]), held, threads=1)
    m = model.parameters(Materials.neo_hooke(np.ones(len(mesh.tets)), np.full(len(mesh.tets), POISSON)))
    model.factor.factor(model.tangent(np.zeros_like(moved), 0.0, m))
    u = model.following(moved)
    for _ in range(3):
        u = model.moved(u, -model.factor.solve(model.residual(u, 0.0, m).ravel()[model.free]))
    return 2.0 * float(model.potential(u, 0.0, m)) / (1e-4 * height)


def test_a_block_between_plates_is_as_stiff_as_swept_ones():
    """Of half diagonals, whose mesh is swept, so that beams can be laid into it by layers, too."""
    d, cells = load_preset("mu-1.0x").printed, 2
    octant = strut_mesh(d, 1, 5)
    mesh = tiled(octant, (2 * cells,) * 3, (d.cell / 2,) * 3)
    side, count = cells * d.cell, len(mesh.tets)
    nodes = mesh.nodes.copy()
    nodes[np.abs(nodes - side) < 1e-7] = side
    ends = (np.flatnonzero(nodes[:, 2] == z) for z in (0.0, side))
    base, tip = ends
    solid = attrs.evolve(mesh, nodes=nodes, symmetry=(), base=base, tip=tip, filled=np.ones((count, 4)))
    at = 2 * np.stack(np.meshgrid(*(np.arange(cells),) * 3, indexing="ij"), -1).reshape(-1, 3)
    lattice = filled(BODY_CENTRED, at, d.cell, d.junction_diameter / 2, d.midspan_diameter / 2)
    clear = np.minimum(nodes[:, 2], side - nodes[:, 2])
    reach, zones = 0.3 * d.junction_diameter, zones_of(d)
    graph = with_graph_beams(solid, lattice, 5, clear, reach, zones)
    swept = Layers(solid, lattice, 5)
    layers = swept.replaced(solid, swept.whole(solid, clear, reach), zones)
    assert len(graph.beams) > 0.85 * len(layers.beams)
    for axis in (0, 2):
        assert plate_force(graph, axis) == pytest.approx(plate_force(layers, axis), rel=0.02)


@pytest.mark.nightly("test_a_block_between_plates_is_as_stiff_as_swept_ones")
def test_a_unit_bends_as_its_solid_struts_do_and_half_of_it_as_the_whole(unit, meshes, sensed):
    found = {name: bent(unit, meshes(name)) for name in ("half", "full", "solid")}
    (half, few), (full, _), (solid, many) = (found[name] for name in ("half", "full", "solid"))
    assert half == pytest.approx(full, rel=1e-3)
    assert half == pytest.approx(solid, rel=0.03)
    assert few < 0.4 * many
    # What the waveguide changes is the same.
    by_beams, by_solids = (bent(unit, sensed[name])[0] for name in ("half", "solid"))
    assert by_beams / half == pytest.approx(by_solids / solid, rel=5e-3)


@pytest.fixture(scope="module")
def graded(unit):
    factors = Grading(base=0.8, tip=1.3, minus_y=0.75, plus_y=1.2, beside_x=0.9)
    return attrs.evolve(unit, grading=factors)


def test_graded_struts_are_beams_of_their_own_sections(graded, folder):
    mesh = mesh_printed(graded, MeshSettings(refine=0.5), cache=folder)
    ends = mesh.nodes[mesh.beams[:, 0::2]]
    lattice = lattice_of(graded.printed)
    # Beams between joints, where no rigid zone takes a part.
    away = cKDTree(lattice.nodes).query(ends.reshape(-1, 3))[0].reshape(-1, 2).min(axis=1)
    inner = away > 1e-6
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    area = length[inner] / mesh.flexible[inner, 0]
    area /= np.where((ends[inner, :, 0] == 0.0).all(axis=1), 0.5, 1.0)
    wanted = math.pi * (0.5 * graded.printed.midspan_diameter) ** 2
    factor = np.sqrt(area / wanted)
    field = graded.printed.grading.at(ends[inner].mean(axis=1))
    assert np.ptp(field) > 0.4
    assert factor == pytest.approx(field, rel=0.05), "the field is sampled at joints"


@pytest.mark.nightly("test_graded_struts_are_beams_of_their_own_sections")
def test_a_graded_unit_bends_as_its_solid_struts_do(graded, folder):
    found = []
    for solid in (False, True):
        mesh = mesh_printed(graded, MeshSettings(refine=0.5), cache=folder, solid=solid)
        solver = Equilibrium(Model(mesh, threads=1), materials_of(graded, mesh))
        u = solver.reach(0.005, [solver.at_zero_pressure()]).u
        found.append((bending_angle_deg(mesh, u), peak_stretch(mesh, u, LATTICE)))
    (angle, stretch), (by_solids, of_solids) = found
    assert angle == pytest.approx(by_solids, rel=0.03)
    # Beams leave the joints' concentration of strain to `joint_stretch`.
    assert stretch.exceeded - 1.0 == pytest.approx(of_solids.exceeded - 1.0, rel=0.07)
    assert stretch.largest - 1.0 == pytest.approx(of_solids.largest - 1.0, rel=0.1)


def test_candidates_share_the_layers_of_their_mesh(unit, meshes, sensed):
    lattice = lattice_of(unit.printed)
    mesh = meshes("half")
    assert graph_layers_of(mesh, lattice) is graph_layers_of(mesh, lattice)
    path = np.array([[0.0, 25.0, 12.5 * (k + 0.5)] for k in range(3)])
    anew = with_waveguide(attrs.evolve(mesh), bar_of(unit, path), unit)
    assert anew.hash() == sensed["half"].hash()


def test_stretch_within_a_beam_is_that_of_the_motion_between_its_sections(meshes):
    """By differences of what carried nodes at neighbouring places do."""
    mesh, step = meshes("half"), 1e-5
    beam = mesh.beams[len(mesh.beams) // 2]
    first, second = mesh.nodes[beam[[0, 2]]]
    random = np.random.default_rng(0)
    u = np.zeros_like(mesh.nodes)
    u[beam] = 0.3 * random.standard_normal((4, 3))
    held = np.flatnonzero((mesh.in_beams > 0.5).any(axis=1) | (mesh.beam_of >= 0))
    F = of_sections(mesh, u, np.tile(np.eye(3), (len(held), 4, 1, 1)), held, np.zeros(len(held)))
    points = np.einsum("qn,mni->mqi", shape_functions(tet_quadrature(2)[0], 2), mesh.nodes[mesh.tets[held]])
    t = (points - first) @ (second - first) / ((second - first) @ (second - first))
    off = np.linalg.norm(points - first - t[..., None] * (second - first), axis=2)
    inside = (t > 0.01) & (t < 0.99) & (off < 1.0)
    own = np.argwhere(inside & (mesh.beam_of[held] >= 0)[:, None])
    assert len(own) > 20
    for row, point in own[:: len(own) // 10]:
        shifts = step * np.vstack([np.eye(3), -np.eye(3)])
        probes = attrs.evolve(
            mesh,
            nodes=np.vstack([mesh.nodes, points[row, point] + shifts]),
            carried=len(mesh.nodes) + np.arange(6),
            carriers=np.tile(beam, (6, 1)),
            shares=1.0 - t[row, point] - shifts @ (second - first) / ((second - first) @ (second - first)),
        )
        moved = Carried(probes).follow(np.vstack([u, np.zeros((6, 3))]))[-6:]
        wanted = np.eye(3) + (moved[:3] - moved[3:]).T / (2 * step)
        assert F[row, point] == pytest.approx(wanted, abs=1e-6)


def test_what_a_beam_takes_is_what_solids_no_longer_resist(unit, meshes):
    """Elements within a beam resist nothing; of one that reaches into a beam the part outside does."""
    mesh, solid = meshes("half"), meshes("solid")
    assert (mesh.tets == solid.tets).all()
    assert (mesh.filled == solid.filled).all(), "all weigh what they did"
    cut = (mesh.in_beams > 0.0).any(axis=1)
    assert cut.any()
    assert mesh.solid[cut].all()
    assert (mesh.region[cut] == LATTICE).all()
    assert (mesh.filled[cut] == 1.0).all(), "none that the wall cuts"
    # Beams have the volume that solids lose.
    volume = reference_gradients(mesh.nodes, mesh.tets).volumes
    lost = (volume * mesh.in_beams).sum() + volume[~mesh.solid].sum()
    ends = mesh.nodes[mesh.beams[:, 0::2]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    halved = (ends[..., 0] == 0.0).all(axis=1)
    area = np.pi * unit.printed.midspan_diameter**2 / 4
    drawn = (length * np.where(halved, 0.5, 1.0)).sum() * area
    assert 0.87 * drawn < lost < 0.97 * drawn, "six struts overlap at a joint, and are round"
    # Struts on the envelope's faces are half away, and those in the mirror plane a half of theirs.
    low, high = (np.array(unit.printed.bounds)[1, k] for k in (0, 1))
    assert not ((ends[..., 1] == low).all(axis=1) | (ends[..., 1] == high).all(axis=1)).any()
    assert halved.any()


def test_struts_that_a_waveguide_meets_are_solid_again(unit, meshes, sensed):
    """Where bar and struts are as wide the joint is whole again: nothing is missing, nothing doubled."""
    plain, found, by_solids = meshes("half"), sensed["half"], sensed["solid"]
    assert 0 < len(found.beams) < len(plain.beams)
    own = len(plain.tets)
    held = np.zeros(len(found.nodes), bool)
    held[found.carried] = True
    apart = found.solid[:own] & ~held[found.tets[:own]].any(axis=1)
    assert (found.resisting[:own][apart] == by_solids.filled[:own][apart]).all()
    assert (found.filled[:own] == by_solids.filled[:own]).all()
    assert not np.isin(found.tied, found.carried).any()
    # Sections without beams follow what lies around them: anchors are among them.
    unused = np.setdiff1d(plain.beams[:, 0::2], found.beams)
    assert cKDTree(found.nodes[unused]).query(anchor_points(unit))[0].max() < 1e-9
    moved = found.nodes @ np.random.default_rng(0).standard_normal((3, 3))
    wanted = moved[unused].copy()
    moved[unused] = 0.0
    np.testing.assert_allclose(found.following(moved)[unused], wanted, atol=1e-9)
