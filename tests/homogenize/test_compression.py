"""Blocks between plates: closed forms, bounds, the periodic cell they approach, contact where it must be."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from mu_addon.design.lattice_kinds import kind
from mu_addon.design.strut_cell import StrutCell
from mu_addon.errors import ConvergenceError, InputError
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.materials import Materials
from mu_addon.homogenize.cell_mesh import CellMeshSettings, mesh_cell
from mu_addon.homogenize.compression import STRAINS, Plates, compress
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.homogenize.specimen import Specimen, block_specimen
from mu_addon.homogenize.stress_strain_curve import PROCEDURES, Curve, moduli, modulus
from mu_addon.meshing.mesh import AXES
from mu_addon.meshing.quality import element_volumes
from tests.fem import bodies

E, NU = 2.5, 0.45
U = 12.5


def piece(counts, size=(1.0, 1.0, 1.0), kept=lambda c: np.ones(len(c), bool), order=2):
    """Those elements of a box grid whose centres (m, 3) are kept."""
    nodes, tets = bodies._grid(counts, size)
    used, tets = np.unique(tets[kept(nodes[tets].mean(axis=1))], return_inverse=True)
    return bodies.make(nodes[used], tets.reshape(-1, 4), order)


def solid(counts=(1, 1, 2)):
    return piece(counts, (U / 2,) * 3)


def walls(cells=2):
    """Octant of a cell with closed walls a quarter of it thick: the cube at its middle is void."""
    return piece((cells,) * 3, (U / 2,) * 3, lambda c: (c < U / 4).any(axis=1))


def resin(mesh, poisson=NU):
    return bodies.uniform(mesh, E, poisson)


def block(octant, cells, poisson=NU):
    return block_specimen(octant, cells, resin(octant, poisson))


def initial(octant, cells, friction, **how):
    """Slope at rest in MPa."""
    return modulus(
        compress(block(octant, cells, **how), [5e-4, 1e-3], friction, stability=False).curve,
        "initial tangent",
    )


def by_hand(mesh, height, cells=1):
    """An eighth given as it is, its nodes at z = height on the plate."""
    mesh = attrs.evolve(mesh, tip=np.flatnonzero(mesh.nodes[:, 2] == height), symmetry=AXES)
    return Specimen(mesh, cells, 2 * height, resin(mesh))


def uniaxial(stretch, mu, kappa, lateral=None):
    """Lateral stretch, nominal stress along z and energy density of a neo-Hookean body, free at its sides."""

    def stress(across, own, other):
        J = across**2 * stretch
        I1 = 2 * across**2 + stretch**2
        return mu * J ** (-2 / 3) * (own - I1 / 3 / own) + kappa * (J - 1) * J / own

    if lateral is None:
        lateral = brentq(lambda a: stress(a, a, stretch), 0.5, 2.0, xtol=1e-15, rtol=1e-14)
    J, I1 = lateral**2 * stretch, 2 * lateral**2 + stretch**2
    energy = mu / 2 * (J ** (-2 / 3) * I1 - 3) + kappa / 2 * (J - 1) ** 2
    return lateral, stress(lateral, stretch, None), energy


@pytest.mark.parametrize("cells", [1, 2])
def test_a_solid_block_that_slides_follows_its_law(cells):
    curve = compress(block(solid(), cells), [0.1, 0.25, 0.4]).curve
    mu, kappa = NeoHooke.parameters(np.array([E]), np.array([NU]))[0]
    known = np.array([uniaxial(s, mu, kappa) for s in curve.stretch])
    np.testing.assert_allclose(curve.stress_MPa, known[:, 1], rtol=1e-8, atol=1e-8 * E)
    np.testing.assert_allclose(curve.lateral, known[:, [0, 0]], rtol=1e-8)


def test_plates_that_hold_a_block_stiffen_it_within_bounds():
    """Sliding, sticking and a uniform strain without bulging: each leaves energy less freedom."""
    strain, body = 0.3, block(solid((2, 2, 2)), 2)
    mu, kappa = NeoHooke.parameters(np.array([E]), np.array([NU]))[0]
    slide, stick = (compress(body, [0.1, 0.2, strain], f).states[-1] for f in ("slide", "stick"))
    volume = body.side_mm**3
    assert slide.energy_mJ == pytest.approx(volume * uniaxial(1 - strain, mu, kappa)[2], rel=1e-9)
    assert 1.02 * slide.energy_mJ < stick.energy_mJ < volume * uniaxial(1 - strain, mu, kappa, 1.0)[2]
    assert stick.force_N > 1.02 * slide.force_N
    # Without lateral strain there is nothing to hold; at finite strain this law has some even at nu = 0.
    slide, stick = (initial(solid((2, 2, 2)), 1, f, poisson=0.0) for f in ("slide", "stick"))
    assert stick == pytest.approx(slide, rel=1e-6)


@pytest.mark.parametrize("friction", ["slide", "stick"])
def test_the_plate_works_as_much_as_energy_is_stored(friction):
    h, middle = 2e-3, 0.2
    body = block(walls(), 2)
    states = compress(body, [0.1, *(middle + h * np.array([-2, -1, 0, 1, 2]))], friction).states[2:]
    a, b, here, c, d = states
    # The derivative by five points is exact to h^4.
    assert here.u[body.mesh.tip, 2] == pytest.approx(-middle * body.side_mm / 2)
    slope = (8 * (c.energy_mJ - b.energy_mJ) - (d.energy_mJ - a.energy_mJ)) / (12 * h * body.side_mm)
    assert slope == pytest.approx(here.force_N, rel=1e-8)
    # The octant is the same along all axes, and so is its mesh.
    curve = compress(body, [middle], friction).curve
    np.testing.assert_allclose(curve.lateral[:, 0], curve.lateral[:, 1], rtol=1e-9)


def test_large_blocks_approach_the_periodic_cell():
    """Cells at free sides lack neighbours: the modulus rises toward the periodic cell's, by 1 / N."""
    octant = walls()
    periodic = effective_tensor(octant, resin(octant)).E100
    found = np.array([initial(octant, n, "slide") for n in (1, 2, 3, 4)])
    lack = 1 - found / periodic
    assert (np.diff(lack) < 0).all()
    assert (lack > 0).all()
    # A layer of weak cells: what is missing times N is constant.
    assert 3 * lack[2] == pytest.approx(4 * lack[3], rel=0.1)
    limit = 4 * found[3] - 3 * found[2]
    assert limit == pytest.approx(periodic, rel=3e-3)
    sticking = np.array([initial(octant, n, "stick") for n in (1, 2, 3)])
    assert (sticking > found[:3]).all()


@pytest.mark.nightly("test_large_blocks_approach_the_periodic_cell")
def test_blocks_of_the_papers_lattice_approach_its_periodic_cell(tmp_path):
    """Its bending struts are far softer along an edge than in shear: plates that hold it count for more."""
    cell = StrutCell(kind("body-centred"), U, 0.75, 1.0)
    octant = mesh_cell(cell, CellMeshSettings(per_diameter=1.0), tmp_path)
    periodic = effective_tensor(octant, resin(octant)).E100
    one, two = (initial(octant, n, "slide") for n in (1, 2))
    assert one < two < periodic
    # As 1 / N, to what is not yet so at N = 1.
    assert 2 * two - one == pytest.approx(periodic, rel=0.03)
    first, second = (initial(octant, n, "stick") for n in (1, 2))
    assert first > second > 3 * periodic


@pytest.mark.parametrize("cells", [1, 2, 3])
def test_corners_of_cells_stand_on_the_plates_and_at_the_outer_faces(cells):
    """The octant's side at zero is a face of its cell, and a specimen ends at faces."""
    octant = piece((2, 2, 2), (U / 2,) * 3, lambda c: (c < U / 4).all(axis=1) | (c > U / 4).all(axis=1))
    body = block(octant, cells)
    half = cells * U / 2
    assert body.side_mm == 2 * half
    for axis in range(3):
        outer = body.mesh.nodes[:, axis] == half
        beside = [i for i in range(3) if i != axis]
        folded = np.mod(half - body.mesh.nodes[outer][:, beside], U)
        folded = np.unique(np.minimum(folded, U - folded), axis=0)
        np.testing.assert_array_equal(
            folded, np.unique(octant.nodes[octant.nodes[:, axis] == 0][:, beside], axis=0)
        )
    np.testing.assert_array_equal(body.mesh.tip, np.flatnonzero(body.mesh.nodes[:, 2] == half))
    volumes = element_volumes(body.mesh)
    assert (volumes > 0).all()
    assert volumes.sum() == pytest.approx(cells**3 * element_volumes(octant).sum(), rel=1e-12)


def test_materials_go_with_their_elements():
    octant = walls()
    moduli_MPa = np.linspace(1.0, 2.0, len(octant.tets))
    body = block_specimen(octant, 3, Materials.neo_hooke(moduli_MPa, np.full(len(moduli_MPa), NU)))
    young, _ = body.materials.small_strain(len(body.mesh.tets))
    # Every copy is of its own octant: the same place in the cell has the same modulus.
    place = np.mod(3 * U / 2 - body.mesh.nodes[body.mesh.corners].mean(axis=1), U)
    place = np.minimum(place, U - place)
    of_octant = octant.nodes[octant.corners].mean(axis=1)
    for k in range(0, len(of_octant), 7):
        same = np.abs(place - of_octant[k]).max(axis=1) < 1e-9
        assert same.sum() == 27
        np.testing.assert_allclose(young[same], moduli_MPa[k])


def meeting(*boxes):
    """A column at x > 1/2 of an eighth of side 1, and boxes (low, high) on its grid."""

    def kept(c):
        inside = c[:, 0] > 0.5
        for low, high in boxes:
            inside |= ((c > low) & (c < high)).all(axis=1)
        return inside

    return by_hand(piece((8, 8, 10), kept=kept, order=1), 1.0)


@pytest.mark.parametrize(
    ("boxes", "what"),
    [
        ([((0, 0, 0.1), (0.25, 0.25, 1))], "its mirror image"),
        ([((0, 0, 0), (0.25, 0.25, 0.9))], "a plate"),
        ([((0, 0, 0), (0.375, 0.375, 0.3)), ((0.125, 0.125, 0.4), (0.25, 0.25, 1))], "another"),
    ],
)
def test_bars_meet_when_the_gap_between_them_is_closed(boxes, what):
    """A bar that hangs from the plate or stands on the middle is free of load, and keeps its length."""
    found = compress(meeting(*boxes), [0.04, 0.08, 0.12, 0.16], "stick", stability=False)
    assert found.touch.strain == pytest.approx(0.1, abs=1e-4 if what == "another" else 1e-9)
    assert found.touch.what == what
    assert found.valid_to_strain == found.touch.strain
    assert found.valid.tolist() == [False, False, True, True, True]
    assert "at 10 %" in found.why
    assert what in found.why
    before = compress(meeting(*boxes), [0.05, 0.09], "stick", stability=False)
    assert before.touch is None
    assert before.valid.all()
    assert before.valid_to_strain == 0.09


def test_a_sticking_block_folds_onto_the_plates():
    found = compress(block(solid((3, 3, 3)), 1), [0.1, 0.2, 0.3, 0.4], "stick")
    assert found.touch.what == "a plate"
    assert 0.05 < found.touch.strain < 0.4


def test_a_column_that_buckles_ends_the_path_at_eulers_strain():
    """Posts beside the mirror planes, held above and guided at the middle: P = pi^2 E I / L^2."""
    side, length = 0.1, 1.0
    post = piece((1, 1, 10), (side, side, length))
    post = attrs.evolve(post, nodes=post.nodes + np.array([0.3, 0.3, 0.0]))
    found = compress(by_hand(post, length), [0.002, 0.004, 0.02, 0.05], "stick")
    # The slender limit; shear and the strain itself change it by some percent at this thickness.
    assert found.states[-1].strain == pytest.approx(np.pi**2 / 12 * (side / length) ** 2, rel=0.07)
    assert "unstable" in found.ended or "distant" in found.ended
    assert "% nominal strain" in found.why


def test_a_column_on_the_axis_buckles_out_of_its_mirror_planes():
    """The same strain, where the eighth itself sees nothing of it."""
    side, length = 0.05, 1.0
    post = piece((1, 1, 10), (side, side, length))
    strains = np.pi**2 / 12 * (2 * side / length) ** 2 * np.array([0.4, 0.7, 0.9, 1.1, 1.4])
    found = compress(by_hand(post, length), strains, "stick")
    assert found.states[-1].strain == strains[-1]
    assert strains[2] <= found.loss.before < found.loss.after <= strains[3]
    assert found.loss.before == pytest.approx(strains.mean() / 0.9, rel=0.06)
    assert found.loss.signs in ((True, False, False), (False, True, False))
    assert found.valid_to_strain == found.loss.before
    assert "not symmetric across" in found.why
    # A stout block is stable, whether plates hold it or let it drift.
    for friction in ("slide", "stick"):
        assert compress(block(walls(), 2), [0.05], friction).loss is None


def test_a_path_goes_on_from_its_states_to_the_same_ones():
    body = block(walls(), 1)
    strains = [0.05, 0.1, 0.2, 0.3]
    whole = compress(body, strains, stability=False)
    reached = []
    for strain in strains:
        # Each time another model, as in a run that was killed in between.
        reached.append(Plates(body, "slide").reached(strain, reached))
    for one, other in zip(whole.states[1:], reached, strict=True):
        np.testing.assert_array_equal(one.u, other.state.u)
        assert one.force_N == other.state.force_N


@given(st.floats(1.0, 100.0), st.floats(-1.0, 0.9))
def test_procedures_read_a_parabola(young, softening):
    """Of s = E (e - b e^2): the slope of the best line over 0 to r is E (1 - b r), and so is the secant's."""
    strain = np.linspace(0.4, 0.0, 41)
    stress = young * (strain - softening * strain**2)
    curve = Curve(1 - strain, -stress, np.ones((41, 2)))
    known = [young * (1 - softening * r) for r in (0.0, 0.1, 0.4, 0.4)]
    assert list(moduli(curve)) == list(PROCEDURES)
    np.testing.assert_allclose(list(moduli(curve).values()), known, rtol=1e-6)


def test_what_cannot_be_tested_is_named():
    octant = walls()
    for cells in (0, -1, 1.5):
        with pytest.raises(InputError, match="cells"):
            block(octant, cells)
    with pytest.raises(InputError, match="cubic"):
        block(piece((1, 1, 1), (1.0, 1.0, 2.0)), 1)
    body = block(octant, 1)
    for strains in ([], [0.0, 0.1], [-0.1], [0.2, 0.1], [0.5, 1.0], [float("nan")]):
        with pytest.raises(InputError, match="strains"):
            compress(body, strains)
    with pytest.raises(InputError, match="friction"):
        compress(body, [0.1], "glue")
    short = compress(body, [0.05]).curve
    with pytest.raises(InputError, match="ends at 5 %"):
        modulus(short)
    with pytest.raises(InputError, match="procedure"):
        modulus(short, "by eye")
    assert list(moduli(short)) == ["initial tangent"]
    assert max(STRAINS) == 0.4


def test_a_path_without_a_first_state_is_an_error():
    side = 0.02
    post = piece((1, 1, 10), (side, side, 1.0))
    post = attrs.evolve(post, nodes=post.nodes + np.array([0.3, 0.3, 0.0]))
    with pytest.raises(ConvergenceError, match="% nominal strain"):
        compress(by_hand(post, 1.0), [0.1], "stick")
